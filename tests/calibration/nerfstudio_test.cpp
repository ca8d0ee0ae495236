// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <string>

#include "damaged_texts.h"
#include "error_of.h"
#include "temporary_folder.h"
#include "widestereo/image_io.h"
#include "widestereo/sfm_model.h"

namespace widestereo {
namespace {

// At (1, 2, 3), looking along +x, with z up; in OpenGL's axes: right, up, backwards.
constexpr const char* pose = "[[0, 0, -1, 1], [-1, 0, 0, 2], [0, 1, 0, 3], [0, 0, 0, 1]]";
constexpr const char* fisheye = R"("camera_model": "OPENCV_FISHEYE", "w": 96, "h": 80, "fl_x": 30,
  "fl_y": 31, "cx": 48, "cy": 40.5, "k1": 0.01, "k2": -0.002, "k3": 0.0003, "k4": -0.0001)";

std::string frame(const std::string& name, const std::string& more = "") {
  return R"({"file_path": ")" + name + R"(", "transform_matrix": )" + pose + more + "}";
}
std::string file(const std::string& cameras, const std::string& frames) {
  return "{" + cameras + (cameras.empty() ? "" : ", ") + R"("frames": [)" + frames + "]}";
}

class Nerfstudio : public ::testing::Test {
 protected:
  SfmModel model(const std::string& text) {
    return SfmModel(folder_.write("transforms.json", text));
  }
  View view(const std::string& text, std::size_t image = 0) { return model(text).view(image); }
  std::string error(const std::string& text) {
    return test::error_of([&] { model(text).view(0); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(Nerfstudio, CamerasArePinholesAndFisheyes) {
  const View seen = view(file(fisheye, frame("images/a.png")));
  EXPECT_EQ(seen.name, "images/a.png");
  EXPECT_EQ(seen.camera.model, CameraModel::kannala_brandt);
  EXPECT_EQ(seen.camera.width, 96);
  EXPECT_EQ(seen.camera.height, 80);
  EXPECT_EQ(seen.camera.fx, 30);
  EXPECT_EQ(seen.camera.fy, 31);
  // The first pixel's centre is at a half there.
  EXPECT_EQ(seen.camera.cx, 47.5);
  EXPECT_EQ(seen.camera.cy, 40);
  EXPECT_EQ(seen.camera.k1, 0.01);
  EXPECT_EQ(seen.camera.k4, -0.0001);

  const View radial = view(file(R"("w": 96, "h": 80, "fl_x": 60, "k1": 0.1, "k3": 0.02, "p2": 0.003,
                                  "k4": 0)",
                                frame("a.png")));
  EXPECT_EQ(radial.camera.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(radial.camera.fy, 60);
  EXPECT_EQ(radial.camera.cx, 47.5);
  EXPECT_EQ(radial.camera.k1, 0.1);
  EXPECT_EQ(radial.camera.k3, 0.02);
  EXPECT_EQ(radial.camera.p2, 0.003);
}

TEST_F(Nerfstudio, InstantNgpsWordsAreKnown) {
  const View seen = view(file(R"("camera_angle_x": 1.5707963267948966, "w": 100, "h": 80,
                                "is_fisheye": true, "k1": 0.01)",
                              frame("./images/r_0")));
  EXPECT_EQ(seen.name, "images/r_0.png");
  EXPECT_EQ(seen.camera.model, CameraModel::kannala_brandt);
  EXPECT_NEAR(seen.camera.fx, 50, 1e-9);
  EXPECT_NEAR(seen.camera.fy, 50, 1e-9);
  const Camera both = view(file(R"("camera_angle_x": 1.5707963267948966, "w": 100, "h": 80,
                                  "camera_angle_y": 1.5707963267948966)",
                                frame("a.png")))
                          .camera;
  EXPECT_NEAR(both.fx, 50, 1e-9);
  EXPECT_NEAR(both.fy, 40, 1e-9);
  // Its other lenses have such an angle in their files, too.
  const std::string pinhole = R"("camera_angle_x": 1.5, "w": 100, "h": 80, )";
  for (const char* lens : {R"("ftheta_p1": 0.001)", R"("latlong": true)"}) {
    EXPECT_NE(error(file(pinhole + lens, frame("a.png"))).find("is not supported; give a camera_"),
              std::string::npos)
        << lens;
  }
  EXPECT_EQ(error(file(pinhole + R"("latlong": false)", frame("a.png"))), "");
}

/// Its data sets have neither width nor height.
TEST_F(Nerfstudio, NerfsSizesAreThoseOfTheImages) {
  const std::string angle = R"("camera_angle_x": 1.5707963267948966)";
  const std::string text = file(angle, frame("./train/r_0") + ", " + frame("./train/r_1"));
  const std::string missing = error(text);
  EXPECT_NE(missing.find("Frame 0: \"w\" and \"h\", the width and height of the images in pixels, "
                         "are missing"),
            std::string::npos)
      << missing;
  EXPECT_NE(missing.find("train/r_0.png"), std::string::npos) << missing;
  std::filesystem::create_directory(folder_ / "train");
  write_image(folder_ / "train/r_0.png", cv::Mat(80, 100, CV_8UC1, cv::Scalar(7)));
  const View seen = view(text, 1);
  EXPECT_EQ(seen.camera.width, 100);
  EXPECT_EQ(seen.camera.height, 80);
  EXPECT_NEAR(seen.camera.fx, 50, 1e-9);
  EXPECT_EQ(seen.camera.cx, 49.5);
  EXPECT_NE(error(file(angle + R"(, "w": 100)", frame("./train/r_0"))).find("\"h\" is missing"),
            std::string::npos);
}

TEST_F(Nerfstudio, FilesMayEndInCapitals) {
  const std::string text = file(fisheye, frame("a.png"));
  EXPECT_TRUE(is_sfm_model(folder_.write("T.JSON", text)));
  EXPECT_FALSE(is_sfm_model(folder_.write("t.yaml", text)));
}

TEST_F(Nerfstudio, WhatIsNoNumberIsNotMissing) {
  const std::string message =
      error(file(R"("camera_angle_x": 1.5, "w": 100, "h": "80")", frame("a.png")));
  EXPECT_NE(message.find("Frame 0: \"h\" is no number; write it without quotes"), std::string::npos)
      << message;
}

TEST_F(Nerfstudio, WhatCannotBeMeantIsRefused) {
  const auto expect = [this](const std::string& cameras, const std::string& finding) {
    const std::string message = error(file(cameras, frame("a.png")));
    EXPECT_NE(message.find(finding), std::string::npos) << message;
  };
  expect(R"("camera_angle_x": 90, "w": 100, "h": 80)",
         "\"camera_angle_x\" is 90; give radians, less than pi");
  expect(R"("w": 96, "h": 80, "fl_x": 3000, "fl_x": 30)", "The key fl_x is there twice");
  folder_.write("transforms.json", "{\"frames\": [], \"fl_x\": 1e400}");
  const std::string message =
      test::error_of([&] { SfmModel model(folder_.path() / "transforms.json"); });
  EXPECT_NE(message.find("transforms.json"), std::string::npos) << message;
  EXPECT_NE(message.find("number overflow"), std::string::npos) << message;
}

// As exported from Project Aria's recordings.
TEST_F(Nerfstudio, CoefficientsMayBeListed) {
  const std::string aria = R"("camera_model": "FISHEYE624", "w": 96, "h": 80)";
  const std::string intrinsics = R"(, "fl_x": 30, "fl_y": 31, "cx": 48, "cy": 40.5)";
  const Camera c =
      view(file(aria, frame("a.png", intrinsics + R"(, "distortion_params": [0.01, 0.02, 0.03, 0.04,
                              0.05, 0.06, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006])")))
          .camera;
  EXPECT_EQ(c.model, CameraModel::rad_tan_thin_prism_fisheye);
  EXPECT_EQ(c.fx, 30);
  EXPECT_EQ(c.k6, 0.06);
  EXPECT_EQ(c.p2, 0.001);
  EXPECT_EQ(c.p1, 0.002);
  EXPECT_EQ(c.s4, 0.006);

  const std::string list = R"(, "distortion_params": [0.01, 0.02, 0.03, 0.04, 0, 0])";
  const std::string plain = R"("camera_model": "OPENCV_FISHEYE", "w": 96, "h": 80)" + intrinsics;
  const Camera listed = view(file(plain + list, frame("a.png"))).camera;
  EXPECT_EQ(listed.model, CameraModel::kannala_brandt);
  EXPECT_EQ(listed.k4, 0.04);

  EXPECT_NE(error(file(aria + intrinsics + list, frame("a.png"))).find("12 numbers"),
            std::string::npos);
  EXPECT_NE(error(file(plain + list, frame("a.png", R"(, "k1": 0.1)"))).find("both"),
            std::string::npos);
}

TEST_F(Nerfstudio, PanoramasAreWholeSpheres) {
  const char* panorama = R"("camera_model": "EQUIRECTANGULAR", "w": 96, "h": 48, "fl_x": 48,
                            "fl_y": 48, "cx": 48, "cy": 24)";
  EXPECT_EQ(view(file(panorama, frame("a.png"))).camera, whole_sphere(96, 48));
}

TEST_F(Nerfstudio, PosesAreTurnedIntoOurAxes) {
  const Eigen::Isometry3d world_from_camera = view(file(fisheye, frame("a.png"))).world_from_camera;
  EXPECT_LT((world_from_camera.translation() - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
  const Eigen::Matrix3d axes = world_from_camera.linear();
  EXPECT_LT((axes.col(2) - Eigen::Vector3d(1, 0, 0)).norm(), 1e-12);   // ahead
  EXPECT_LT((axes.col(1) - Eigen::Vector3d(0, 0, -1)).norm(), 1e-12);  // down
  EXPECT_LT((axes.col(0) - Eigen::Vector3d(0, -1, 0)).norm(), 1e-12);  // right
}

TEST_F(Nerfstudio, FramesMayHaveTheirOwnCamerasAndMasks) {
  write_image(folder_ / "mask.png", cv::Mat(80, 96, CV_8UC1, cv::Scalar(0)));
  const std::string text = file(
      fisheye, frame("b.png", R"(, "fl_x": 40, "mask_path": "mask.png")") + ", " + frame("a.png"));
  const SfmModel model = this->model(text);
  EXPECT_EQ(model.names(), (std::vector<std::string>{"a.png", "b.png"}));
  EXPECT_FALSE(model.has_points());
  const View a = model.view(0);
  EXPECT_EQ(a.camera.fx, 30);
  EXPECT_TRUE(a.mask.empty());
  const View b = model.view(1);
  EXPECT_EQ(b.camera.fx, 40);
  EXPECT_EQ(b.camera.k1, 0.01);
  EXPECT_EQ(b.mask.size(), cv::Size(96, 80));
  EXPECT_EQ(cv::countNonZero(b.mask), 0);
  EXPECT_FALSE(model.calibrated({0}).in_metres);
}

TEST_F(Nerfstudio, NullMeansThatSomethingIsNotThere) {
  const View seen =
      view(file(R"("camera_model": null, "w": 96, "h": 80, "fl_x": 60, "fl_y": null, "cx": 47)",
                frame("a.png", R"(, "mask_path": null, "fl_x": null, "k1": null)")));
  EXPECT_EQ(seen.camera.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(seen.camera.fx, 60);
  EXPECT_EQ(seen.camera.fy, 60);
  EXPECT_TRUE(seen.mask.empty());
  EXPECT_NE(error(file(fisheye, R"({"file_path": null, "transform_matrix": [[1]]})"))
                .find("\"file_path\" is missing"),
            std::string::npos);
}

/// Names are those of folders of results, too.
TEST_F(Nerfstudio, ImagesMayLieOutsideOfTheFolder) {
  const SfmModel model =
      this->model(file(fisheye, frame("../images/1.png") + ", " + frame("/data/2.png") + ", " +
                                    frame("a/../3.png")));
  EXPECT_EQ(model.names(), (std::vector<std::string>{"3.png", "data/2.png", "images/1.png"}));
  EXPECT_EQ(model.file_of(0, "folder"), "folder/3.png");
  EXPECT_EQ(model.file_of(1, "folder"), "/data/2.png");
  EXPECT_EQ(model.file_of(2, "folder"), "folder/../images/1.png");
  EXPECT_THROW(model.file_of(3, "folder"), Error);
  EXPECT_EQ(model.image_of("/data/2.png"), 1u);
  EXPECT_EQ(model.image_of("elsewhere/images/1.png"), 2u);
  EXPECT_EQ(model.calibrated({2}).rig.views[0].name, "images/1.png");
}

TEST_F(Nerfstudio, NoTwoImagesHaveOneName) {
  const auto error_with = [this](const std::string& first, const std::string& second) {
    return error(file(fisheye, frame(first) + ", " + frame(second)));
  };
  const auto expect = [](const std::string& error, const std::string& paths) {
    EXPECT_NE(error.find("transforms.json has two images whose name is " + paths),
              std::string::npos)
        << error;
  };
  expect(error_with("images/1.png", "../images/1.png"),
         "images/1.png: images/1.png and ../images/1.png;");
  expect(error_with("/a/1.png", "a/1.png"), "a/1.png: /a/1.png and a/1.png;");
  expect(error_with("1.png", "1.png"), "1.png: 1.png and 1.png;");
}

TEST_F(Nerfstudio, WhatIsMissingIsNamed) {
  const auto expect = [this](const std::string& text, const std::string& what) {
    const std::string message = error(text);
    EXPECT_NE(message.find("transforms.json"), std::string::npos) << message;
    EXPECT_NE(message.find(what), std::string::npos) << message;
  };
  expect(file(fisheye, ""), "empty");
  expect(file(fisheye, "3"), "Frame 0");
  expect(file(fisheye, R"({"transform_matrix": []})"), "file_path");
  expect(file(fisheye, R"({"file_path": "a.png"})"), "transform_matrix");
  expect(file(fisheye, R"({"file_path": "a.png", "transform_matrix": [[1, 0], [0, 1], [0, 0]]})"),
         "transform_matrix");
  expect(file(fisheye, R"({"file_path": "a.png", "transform_matrix":
                [[2, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]})"),
         "rigid");
  expect(file(fisheye, R"({"file_path": "a.png", "transform_matrix":
                [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1]]})"),
         "The transform_matrix of frame 0 must end with the row 0 0 0 1");
  expect(file(R"("w": 9, "h": 9)", frame("a.png")), "fl_x");
  expect(file(R"("fl_x": 9, "h": 9)", frame("a.png")), "\"w\"");
  expect(file(R"("fl_x": 900, "w": 1919.9, "h": 1080)", frame("a.png")), "1919.9x1080");
  expect(file(R"("fl_x": 900, "w": -1e300, "h": 1080)", frame("a.png")), "whole numbers of pixels");
  for (const char* name : {"ORTHOPHOTO", "EUCM"}) {
    expect(
        file(R"("camera_model": ")" + std::string(name) + R"(", "w": 9, "h": 9)", frame("a.png")),
        name);
  }
  expect(file(std::string(fisheye) + R"(, "p1": 0.1)", frame("a.png")), "coefficients");
  for (const char* key : {"k4", "k5", "sx1"}) {
    expect(file(R"("w": 9, "h": 9, "fl_x": 9, ")" + std::string(key) + R"(": 0.1)", frame("a.png")),
           "coefficients");
  }
  EXPECT_NE(error(file(fisheye, frame("a.png", R"(, "mask_path": "none.png")"))).find("none.png"),
            std::string::npos);
}

/// Whatever bytes come, there is a model or an Error.
TEST_F(Nerfstudio, DamagedFilesNeverCrash) {
  const std::string text = file(fisheye, frame("a.png") + ", " + frame("b.png"));
  EXPECT_GT(test::times_refused(text, [&](const std::string& left) { return error(left); }), 200);
}

}  // namespace
}  // namespace widestereo
