// SPDX-License-Identifier: MIT
#include "widestereo/calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "bytes_of.h"
#include "comma_locale.h"
#include "damaged_texts.h"
#include "data_folder.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "geometry/named_cameras.h"
#include "replaced.h"
#include "temporary_folder.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

using test::bytes_of;
using test::replaced;
using test::TemporaryFolder;
using ::testing::HasSubstr;

const char* const kalibr_text = R"(cam0:
  camera_model: pinhole
  intrinsics: [190.97, 190.96, 254.93, 256.89]
  distortion_model: equidistant
  distortion_coeffs: [0.0034, 0.0007, -0.002, 0.0002]
  resolution: [512, 512]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999994457734953, -0.0008233639921576076, -0.0006561436136444361, -0.10106110275180535]
  - [0.0007916877528168117, 0.9988994619156757, -0.04689603624058988, -0.0019764575873431013]
  - [0.0006940340102242531, 0.04689549078870055, 0.9988995601463054, -0.0011756424802046581]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: ds
  intrinsics: [-0.17, 0.59, 157.9, 157.8, 252.5, 255.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [512, 480]
  max_theta_deg: 97.5
)";

const char* const basalt_text = R"({"value0": {
  "T_imu_cam": [
    {"px": 0.0, "py": 0.0, "pz": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0},
    {"px": 0.1, "py": 0.01, "pz": -0.02, "qx": 0.0, "qy": 0.0998334166, "qz": 0.0, "qw": 0.9950041653}],
  "intrinsics": [
    {"camera_type": "ucm", "intrinsics": {"fx": 120.0, "fy": 121.0, "cx": 255.0, "cy": 256.0, "alpha": 0.6}},
    {"camera_type": "kb4", "intrinsics": {"fx": 190.0, "fy": 191.0, "cx": 255.0, "cy": 256.0,
     "k1": 0.003, "k2": 0.0007, "k3": -0.002, "k4": 0.0002}}],
  "resolution": [[512, 510], [512, 510]],
  "vignette": []}})";

const char* const opencv_text = R"(%YAML:1.0
---
K1: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 392.2, 0.39, 631.6, 0., 393.2, 493.2, 0., 0., 1. ]
D1: !!opencv-matrix
   rows: 4
   cols: 1
   dt: d
   data: [ -0.028, 0.0001, -0.0076, 0.0024 ]
K2: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 391.8, 0., 620.6, 0., 392.6, 489.2, 0., 0., 1. ]
D2: !!opencv-matrix
   rows: 1
   cols: 4
   dt: d
   data: [ -0.031, 0.003, -0.008, 0.002 ]
R: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 1., 0., 0., 0., 1., 0., 0., 0., 1. ]
T: !!opencv-matrix
   rows: 3
   cols: 1
   dt: d
   data: [ -0.125, 0., 0. ]
image_width: 1280
image_height: 960
)";

/// X y z are z x y in the camera, which the IMU is beside.
const char* const beside_imu = R"(:
  - [0.0, 0.0, 1.0, 0.05]
  - [1.0, 0.0, 0.0, -0.04]
  - [0.0, 1.0, 0.0, -0.07]
  - [0.0, 0.0, 0.0, 1.0]
)";

Eigen::Isometry3d camera_beside_imu() {
  Eigen::Isometry3d camera_from_imu = Eigen::Isometry3d::Identity();
  camera_from_imu.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  camera_from_imu.translation() << 0.05, -0.04, -0.07;
  return camera_from_imu;
}

/// kalibr_text with a transform of one camera.
std::string with_imu(const std::string& camera, const std::string& key,
                     const std::string& text = kalibr_text) {
  return replaced(text, camera + ":\n", camera + ":\n  " + key + beside_imu);
}

void expect_imu(const Rig& rig, const Eigen::Isometry3d& world_from_imu) {
  ASSERT_TRUE(rig.world_from_imu.has_value());
  EXPECT_LT((rig.world_from_imu->matrix() - world_from_imu.matrix()).norm(), 1e-9);
}

std::string error_of(const std::filesystem::path& path) {
  return test::error_of([&] { read_calibration(path); });
}

TEST(Kalibr, ReadsModelsPosesAndTheFieldOfView) {
  const TemporaryFolder folder;
  const Calibration c = read_calibration(folder.write("chain.yaml", kalibr_text));
  EXPECT_EQ(c.format, CalibrationFormat::kalibr);
  ASSERT_EQ(c.rig.views.size(), 2u);
  const Camera& kb = c.rig.views[0].camera;
  EXPECT_EQ(kb.model, CameraModel::kannala_brandt);
  EXPECT_EQ(kb.fx, 190.97);
  EXPECT_EQ(kb.cy, 256.89);
  EXPECT_EQ(kb.k3, -0.002);
  const Camera& ds = c.rig.views[1].camera;
  EXPECT_EQ(ds.model, CameraModel::double_sphere);
  EXPECT_EQ(ds.xi, -0.17);
  EXPECT_EQ(ds.alpha, 0.59);
  EXPECT_EQ(ds.height, 480);
  EXPECT_NEAR(ds.max_theta, 97.5 * radians_per_degree, 1e-15);
  // T_cn_cnm1 takes points of camera 0 to camera 1.
  const Eigen::Vector3d moved =
      source_from_reference(c.rig.views[1], c.rig.views[0]) * Eigen::Vector3d(0, 0, 1);
  EXPECT_NEAR(moved.x(), -0.10106110275180535 - 0.0006561436136444361, 1e-9);
  EXPECT_NEAR(moved.y(), -0.0019764575873431013 - 0.04689603624058988, 1e-9);
}

TEST(Kalibr, ReadsEveryCombination) {
  const TemporaryFolder folder;
  const auto read = [&](const char* model, const char* intrinsics, const char* distortion,
                        const char* coefficients) {
    const std::string text =
        std::string("cam0:\n  camera_model: ") + model + "\n  intrinsics: " + intrinsics +
        "\n  distortion_model: " + distortion + "\n  distortion_coeffs: " + coefficients +
        "\n  resolution: [640, 480]\n";
    return read_calibration(folder.write("one.yaml", text)).rig.views[0].camera;
  };
  const char* four = "[0.1, 0.02, 0.003, 0.0004]";
  EXPECT_EQ(read("pinhole", "[4e2, 401, 320, 240]", "none", "[]").model, CameraModel::pinhole);
  Camera c = read("pinhole", "[400, 401, 320, 240]", "radtan", four);
  EXPECT_EQ(c.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(c.p1, 0.003);
  c = read("pinhole", "[400, 401, 320, 240]", "fov", "[0.93]");
  EXPECT_EQ(c.model, CameraModel::field_of_view);
  EXPECT_EQ(c.omega, 0.93);
  c = read("omni", "[0.9, 400, 401, 320, 240]", "none", "[0, 0, 0, 0]");
  EXPECT_EQ(c.model, CameraModel::unified);
  EXPECT_EQ(c.xi, 0.9);
  EXPECT_EQ(c.fy, 401);
  c = read("omni", "[1.2, 400, 401, 320, 240]", "radtan", four);
  EXPECT_EQ(c.model, CameraModel::mei);
  EXPECT_EQ(c.p2, 0.0004);
  c = read("eucm", "[0.6, 1.1, 400, 401, 320, 240]", "none", "[]");
  EXPECT_EQ(c.model, CameraModel::extended_unified);
  EXPECT_EQ(c.beta, 1.1);
  c = read("equirectangular", "[100, 101, 320, 240]", "none", "[]");
  EXPECT_EQ(c.model, CameraModel::equirectangular);
  EXPECT_EQ(c.fy, 101);
  const std::string panorama = "cam0:\n  camera_model: equirectangular\n  resolution: [640, 320]\n";
  EXPECT_EQ(read_calibration(folder.write("sphere.yaml", panorama)).rig.views[0].camera,
            whole_sphere(640, 320));
}

TEST(Kalibr, ReadsFilesWithOpenCvsHeader) {
  const TemporaryFolder folder;
  const std::string text =
      std::string("%YAML:1.0 # need to specify the file type at the top!\n\n") + kalibr_text;
  EXPECT_EQ(read_calibration(folder.write("openvins.yaml", text)).rig.views.size(), 2u);
}

TEST(Kalibr, CommentsMayNameOtherFormats) {
  const TemporaryFolder folder;
  for (const char* words :
       {"ocam_model", "Camera.type", "inv_poly:", "cam0_calib", "(opencv-matrix)",
        "\"radial_poly\"", "model_type: KANNALA_BRANDT projection_parameters"}) {
    for (const std::string& comment :
         {"# as in " + std::string(words) + "\n", "x: 1 # as in " + std::string(words) + "\n"}) {
      const Calibration read =
          read_calibration(folder.write("chain.yaml", comment + std::string(kalibr_text)));
      EXPECT_EQ(read.format, CalibrationFormat::kalibr) << comment;
      EXPECT_EQ(read.rig.views.size(), 2u) << comment;
    }
  }
}

TEST(Kalibr, ReadsTheTimesOfTheImu) {
  const TemporaryFolder folder;
  std::string text = replaced(kalibr_text, "cam1:\n", "cam1:\n  timeshift_cam_imu: -0.0302\n");
  const Rig of_one = read_calibration(folder.write("chain.yaml", text)).rig;
  for (const View& view : of_one.views) EXPECT_EQ(view.imu_time_offset, -0.0302) << view.name;
  write_basalt(folder / "one.json", of_one);
  text = replaced(text, "cam0:\n", "cam0:\n  timeshift_cam_imu: 0\n");
  Rig rig = read_calibration(folder.write("chain.yaml", text)).rig;
  for (const char* file : {"again.yaml", "and_again.yaml"}) {
    EXPECT_EQ(rig.views[0].imu_time_offset, 0);
    EXPECT_EQ(rig.views[1].imu_time_offset, -0.0302);
    write_kalibr(folder / file, rig);
    rig = read_calibration(folder / file).rig;
  }
  EXPECT_NE(test::error_of([&] {
              write_basalt(folder / "one.json", rig);
            }).find("cam0 and cam1 by times that differ by more than a millisecond"),
            std::string::npos);
  for (const auto& [wrong, named] :
       {std::pair("4000", "ahead by 4000"), {".nan", "cam1"}, {"soon", "cam1"}}) {
    text = replaced(kalibr_text, "cam1:\n",
                    std::string("cam1:\n  timeshift_cam_imu: ") + wrong + "\n");
    EXPECT_NE(
        test::error_of([&] { read_calibration(folder.write("chain.yaml", text)); }).find(named),
        std::string::npos)
        << wrong;
  }
}

TEST(Kalibr, ReadsWhereTheImuIs) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& text) {
    return read_calibration(folder.write("chain.yaml", text)).rig;
  };
  EXPECT_FALSE(read(kalibr_text).world_from_imu.has_value());
  expect_imu(read(with_imu("cam0", "T_cam_imu")), camera_beside_imu());
  expect_imu(read(with_imu("cam0", "T_imu_cam")), camera_beside_imu().inverse());
  const Rig second = read(with_imu("cam1", "T_cam_imu"));
  expect_imu(second, second.views[1].world_from_camera * camera_beside_imu());
}

/// As OpenVINS's files of EuRoC and TUM VI.
TEST(Kalibr, ReadsPosesThatOnlyTheImuGives) {
  const TemporaryFolder folder;
  const Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  Rig to_imu = rig;
  to_imu.world_from_imu = camera_beside_imu();
  write_kalibr(folder / "both.yaml", to_imu);
  const std::string text = replaced(bytes_of(folder / "both.yaml"), "T_cn_cnm1", "unused");
  const Rig again = read_calibration(folder.write("imu.yaml", text)).rig;
  EXPECT_LT(
      (again.views[1].world_from_camera.matrix() - rig.views[1].world_from_camera.matrix()).norm(),
      1e-9);
}

/// As YAML's parsers read JSON, and write it where asked for one line.
TEST(Kalibr, MayBeWrittenAsJson) {
  const TemporaryFolder folder;
  const std::string camera =
      R"("camera_model": "ds", "intrinsics": [-0.17, 0.59, 157, 158, 254, 256], "distortion_model": )"
      R"("none", "distortion_coeffs": [], "resolution": [512, 512])";
  const std::string flow =
      "{cam0: {camera_model: ds, intrinsics: [-0.17, 0.59, 157, 158, 254, 256], "
      "distortion_model: none, distortion_coeffs: [], resolution: [512, 512]}}\n";
  for (const std::string& text : {"{\"cam0\": {" + camera + "}}", flow}) {
    const Calibration c = read_calibration(folder.write("chain.json", text));
    EXPECT_EQ(c.format, CalibrationFormat::kalibr);
    EXPECT_EQ(c.rig.views.at(0).camera.model, CameraModel::double_sphere);
    EXPECT_EQ(c.rig.views.at(0).camera.alpha, 0.59);
  }
}

TEST(Basalt, MayBeginWithAByteOrderMark) {
  const TemporaryFolder folder;
  const auto path = folder.write("calib.json", "\xef\xbb\xbf" + std::string(basalt_text));
  EXPECT_EQ(read_calibration(path).format, CalibrationFormat::basalt);
}

TEST(Basalt, HasEachKeyOnce) {
  const TemporaryFolder folder;
  const std::string twice = replaced(basalt_text, "\"fx\":", "\"fx\": 90, \"fx\":");
  EXPECT_NE(
      error_of(folder.write("calib.json", twice)).find("The key fx is there twice; leave one"),
      std::string::npos);
}

TEST(Basalt, ReadsWhereTheImuIs) {
  const TemporaryFolder folder;
  EXPECT_FALSE(
      read_calibration(folder.write("calib.json", basalt_text)).rig.world_from_imu.has_value())
      << "the identity is no IMU";
  const std::string text = replaced(
      basalt_text, R"("px": 0.0, "py": 0.0, "pz": 0.0, "qx": 0.0, "qy": 0.0, "qz": 0.0, "qw": 1.0)",
      R"("px": 0.05, "py": -0.04, "pz": -0.07, "qx": 0.5, "qy": 0.5, "qz": 0.5, "qw": 0.5)");
  expect_imu(read_calibration(folder.write("calib.json", text)).rig, camera_beside_imu().inverse());
  const Rig close_by =
      read_calibration(folder.write("calib.json", replaced(basalt_text, R"("px": 0.0, "py": 0.0)",
                                                           R"("px": 0.005, "py": 0.0)")))
          .rig;
  ASSERT_TRUE(close_by.world_from_imu.has_value());
  EXPECT_NEAR(close_by.world_from_imu->translation().x(), -0.005, 1e-12);
}

TEST(Basalt, ConvertsAlphaFormAndPoses) {
  const TemporaryFolder folder;
  const Calibration c = read_calibration(folder.write("calib.json", basalt_text));
  EXPECT_EQ(c.format, CalibrationFormat::basalt);
  const Camera& ucm = c.rig.views[0].camera;
  EXPECT_EQ(ucm.model, CameraModel::unified);
  EXPECT_NEAR(ucm.xi, 1.5, 1e-12);
  // The alpha form itself, written out.
  const Eigen::Vector3d point(0.7, -0.4, 0.2);
  const double denominator = 0.6 * point.norm() + 0.4 * point.z();
  Eigen::Vector2d pixel;
  ASSERT_TRUE(project(ucm, point, pixel));
  EXPECT_NEAR(pixel.x(), 120 * point.x() / denominator + 255, 1e-9);
  EXPECT_NEAR(pixel.y(), 121 * point.y() / denominator + 256, 1e-9);
  // T_imu_cam is camera to rig.
  EXPECT_NEAR(c.rig.views[1].world_from_camera.translation().x(), 0.1, 1e-12);
  EXPECT_NEAR(Eigen::AngleAxisd(c.rig.views[1].world_from_camera.linear()).angle(), 0.2, 1e-8);
}

TEST(OpenCv, ReadsFisheyeStereo) {
  const TemporaryFolder folder;
  const Calibration c = read_calibration(folder.write("stereo.yml", opencv_text));
  EXPECT_EQ(c.format, CalibrationFormat::opencv);
  ASSERT_EQ(c.rig.views.size(), 2u);
  const Camera& left = c.rig.views[0].camera;
  EXPECT_EQ(left.model, CameraModel::kannala_brandt);
  EXPECT_EQ(left.skew, 0.39);
  EXPECT_EQ(left.k4, 0.0024);
  EXPECT_EQ(left.width, 1280);
  // X_right = R X_left + T with T.x negative: the right camera is to the right.
  EXPECT_NEAR(c.rig.views[1].world_from_camera.translation().x(), 0.125, 1e-12);
}

/// OpenCV's own sample of stereo calibration writes two files.
TEST(OpenCv, OfWhichAPartIsMissingIsNamed) {
  const TemporaryFolder folder;
  const std::string text = opencv_text;
  const std::size_t rotation = text.find("R:");
  ASSERT_NE(rotation, std::string::npos);
  const auto expect = [&](const std::string& part, const char* message) {
    const std::string error = error_of(folder.write("part.yml", part));
    EXPECT_NE(error.find(message), std::string::npos) << error;
  };
  expect(text.substr(0, rotation) + "image_width: 1280\nimage_height: 960\n",
         "two cameras without the rotation (R)");
  expect("%YAML:1.0\n---\n" + text.substr(rotation), "no camera matrix (K1 or M1");
}

/// OpenCV's parsers crash on such files, or never return.
TEST(OpenCv, WhatItsParsersDoNotSurviveIsRefused) {
  const TemporaryFolder folder;
  const auto expect = [&folder](const std::string& name, const std::string& text,
                                const std::string& finding) {
    const std::string message = error_of(folder.write(name, text));
    EXPECT_NE(message.find(finding), std::string::npos) << message;
  };
  const std::string xml =
      "<?xml version=\"1.0\"?>\n<opencv_storage>\n<K1 type_id=\"opencv-matrix\"><rows>1</rows>"
      "<cols>1</cols><dt>d</dt><data>1.</data></K1>\n</opencv_storage>\n";
  const std::size_t inside = xml.find("type_id=") + 8;
  expect("cut.xml", xml.substr(0, inside), "It does not end with </opencv_storage>");
  expect("nul.xml", std::string(xml).insert(inside, 1, '\0'), "It has a byte that is 0");
  const std::string yaml = opencv_text;
  expect("dots.yml", replaced(yaml, "K1:", "...-\nK1:"), "It goes on in the line of the");
  expect("binary.yml", replaced(yaml, "K1: !!opencv-matrix", "K1: !!binary |"),
         "It has numbers packed as base64");
}

/// OpenCV's sample of calibration says what a camera is.
TEST(OpenCv, AreFisheyesWhereTheFileSaysSo) {
  const TemporaryFolder folder;
  const auto file = [&](int fisheye, const std::string& coefficients,
                        const char* matrix = "camera_matrix",
                        const char* distortion = "distortion_coefficients") {
    return folder.write("camera.yml",
                        "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\nfisheye_model: " +
                            std::to_string(fisheye) + "\n" + matrix +
                            ": !!opencv-matrix { rows: 3, cols: 3, dt: d, data: [ 300, 0, 320, 0, "
                            "300, 240, 0, 0, 1 ] }\n" +
                            distortion + ": [ " + coefficients + " ]\n");
  };
  const auto model = [&](const std::filesystem::path& path) {
    return read_calibration(path).rig.views[0].camera.model;
  };
  EXPECT_EQ(model(file(1, "0.01, 0.02, 0, 0")), CameraModel::kannala_brandt);
  EXPECT_EQ(model(file(0, "0.01, 0.02, 0, 0")), CameraModel::pinhole_radtan);
  EXPECT_EQ(model(file(0, "0.01, 0.02, 0, 0, 0")), CameraModel::pinhole_radtan);
  EXPECT_NE(error_of(file(1, "0.01, 0.02, 0, 0, 0")).find("fisheye_model asks for the four"),
            std::string::npos);
  for (const auto& [matrix, distortion] : {std::pair("Camera_Matrix", "Distortion_Coefficients"),
                                           std::pair("cameraMatrix", "distCoeffs")}) {
    EXPECT_EQ(model(file(1, "0.01, 0.02, 0, 0", matrix, distortion)), CameraModel::kannala_brandt);
  }
}

TEST(OpenCv, TakesTheSizeFromTheImages) {
  const TemporaryFolder folder;
  const std::string text =
      replaced(replaced(opencv_text, "image_width: 1280\n", ""), "image_height: 960\n", "");
  const auto path = folder.write("stereo.yml", text);
  EXPECT_NE(error_of(path).find("image size"), std::string::npos);
  EXPECT_EQ(read_calibration(path, {1280, 960}).rig.views[1].camera.height, 960);
  EXPECT_THROW(read_calibration(folder.write("with.yml", opencv_text), {640, 480}), Error);
  const auto error_for = [&](int width, int height) {
    return test::error_of([&] { read_calibration(path, {width, height}); });
  };
  // By its centres, which lie within 3 % of the middle, for 1279x959.
  for (const double scale : {0.5, 2 / 3., 0.8, 1.25, 1.5, 2.0}) {
    EXPECT_THAT(error_for(cvRound(1280 * scale), cvRound(960 * scale)),
                ::testing::MatchesRegex(".*likely made for images of about 12[78].x9[56]. pixels, "
                                        "while the given ones have .*--scale.*"))
        << scale;
  }
  for (const double scale : {0.95, 1.05}) {
    EXPECT_EQ(error_for(cvRound(1280 * scale), cvRound(960 * scale)), "") << scale;
  }
  // Sides of other proportions tell no size.
  EXPECT_THAT(error_for(1280, 720), HasSubstr("not near the middle of the given images"));
  EXPECT_THAT(error_for(1600, 960), HasSubstr("not near the middle of the given images"));
  const std::string of_one = text.substr(0, text.find("K2:"));
  EXPECT_THAT(test::error_of([&] {
                read_calibration(folder.write("mono.yml", of_one), {640, 480});
              }),
              HasSubstr("likely made for images of about 12"));
}

TEST(OpenCv, MayCountCamerasFromZero) {
  const TemporaryFolder folder;
  std::string text = opencv_text;
  for (const char* letter : {"K", "D"}) {
    text = replaced(text, std::string(letter) + "1:", std::string(letter) + "0:");
    text = replaced(text, std::string(letter) + "2:", std::string(letter) + "1:");
  }
  const Rig rig = read_calibration(folder.write("from_zero.yml", text)).rig;
  const Rig expected = read_calibration(folder.write("stereo.yml", opencv_text)).rig;
  ASSERT_EQ(rig.views.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(rig.views[i].camera, expected.views[i].camera);
  // A third one would be dropped without a word.
  const std::string matrix = "\nK2: [300., 0., 640., 0., 300., 480., 0., 0., 1.]\n";
  const std::string three = "It has three cameras, but R and T are those of two";
  EXPECT_NE(error_of(folder.write("three.yml", text + matrix)).find(three), std::string::npos);
  EXPECT_NE(
      error_of(folder.write("three.yml", opencv_text + replaced(matrix, "K2", "K3"))).find(three),
      std::string::npos);
}

/// As programs in Python write its matrices by json and yaml.
TEST(OpenCv, ReadsListsOfRows) {
  const TemporaryFolder folder;
  const std::string rows = "[[300, 0, 320], [0, 301, 240], [0, 0, 1]]";
  const std::string json =
      R"({"image_size": [640, 480], "K1": )" + rows + R"(, "D1": [[0.01], [0.02], [0], [1e-05]],)" +
      R"("K2": )" + rows +
      R"(, "D2": [0.01, 0.02, 0, 0], "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], )" +
      R"("T": [[-0.1], [0], [0]]})";
  const std::string flow =
      "image_size: [640, 480]\nK1: " + rows +
      "\nD1: [[0.01], [0.02], [0.0], [1.0e-05]]\nK2: " + rows +
      "\nD2: [0.01, 0.02, 0, 0]\nR: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nT: [-0.1, 0, 0]\n";
  const std::string block =
      "D:\n- - 0.01\n- - 0.02\n- - 0.0\n- - 1.0e-05\nK:\n- - 300.0\n  - 0.0\n  - 320.0\n- - 0.0\n"
      "  - 301.0\n  - 240.0\n- - 0.0\n  - 0.0\n  - 1.0\nimage_size:\n- 640\n- 480\n";
  for (const auto& [name, text] :
       {std::pair("rig.json", json), std::pair("rig.yaml", flow), std::pair("one.yaml", block)}) {
    SCOPED_TRACE(name);
    const Calibration c = read_calibration(folder.write(name, text));
    EXPECT_EQ(c.format, CalibrationFormat::opencv);
    const Camera& camera = c.rig.views.at(0).camera;
    EXPECT_EQ(camera.model, CameraModel::kannala_brandt);
    EXPECT_EQ(camera.fy, 301);
    EXPECT_EQ(camera.cx, 320);
    EXPECT_EQ(camera.k4, 1e-5);
    EXPECT_EQ(camera.width, 640);
    ASSERT_EQ(c.rig.views.size(), text == block ? 1u : 2u);
    if (text == block) continue;
    EXPECT_NEAR(c.rig.views[1].world_from_camera.translation().x(), 0.1, 1e-12);
  }
  const std::string ragged = replaced(json, "[0, 301, 240]", "[0, 301]");
  EXPECT_NE(error_of(folder.write("ragged.json", ragged)).find("camera matrix"), std::string::npos);
}

TEST(OpenCv, RefusesSizesThatAreNotWhole) {
  const TemporaryFolder folder;
  const std::string list =
      replaced(replaced(opencv_text, "image_width: 1280", "image_size: [ 1280, 960.5 ]"),
               "image_height", "x");
  for (const std::string& text :
       {replaced(opencv_text, "image_width: 1280", "image_width: 1280.7"),
        replaced(opencv_text, "image_width: 1280", "imageSize: [ 1280, 960, 3 ]"),
        replaced(opencv_text, "image_height: 960", "image_height: -960"), list}) {
    const std::string error = error_of(folder.write("stereo.yml", text));
    EXPECT_NE(error.find("whole numbers of pixels"), std::string::npos) << error;
  }
}

TEST(OpenCv, RefusesAWidthWithoutAHeight) {
  const TemporaryFolder folder;
  for (const std::string side : {"width", "height"}) {
    const auto path = folder.write("stereo.yml", replaced(opencv_text, "image_" + side, "x"));
    const std::string error = test::error_of([&] { read_calibration(path, {640, 480}); });
    EXPECT_NE(error.find("add image_" + side + "."), std::string::npos) << error;
  }
}

TEST(OpenCv, RefusesWhatIsNoCameraMatrix) {
  const TemporaryFolder folder;
  const std::string matrix = "[ 391.8, 0., 620.6, 0., 392.6, 489.2, 0., 0., 1. ]";
  const auto error_with = [&](const std::string& text) {
    return error_of(folder.write("stereo.yml", text));
  };
  const auto expect = [&](const std::string& other, const char* part) {
    const std::string error = error_with(replaced(opencv_text, matrix, other));
    EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  expect("[ 391.8, 0., 0., 0., 392.6, 0., 620.6, 489.2, 1. ]",
         "cam1: The camera matrix (K2) is transposed, as MATLAB has it; write its rows as fx");
  expect("[ 391.8, 0., 620.6, 0.1, 392.6, 489.2, 0., 0., 1. ]", "(K2) is no camera matrix");
  expect("[ 391.8, 0., 620.6, 0., 392.6, 489.2, 0., 0., 2. ]", "(K2) is no camera matrix");
  const std::string wide =
      replaced(replaced(opencv_text, "cols: 3", "cols: 4"), "631.6, 0., 393.2, 493.2, 0., 0., 1.",
               "631.6, 0., 0., 393.2, 493.2, 0., 0., 0., 1., 0.");
  EXPECT_NE(error_with(wide).find("(K1) is 3x4 instead of 3x3"), std::string::npos)
      << error_with(wide);
}

TEST(OpenCv, RefusesATranslationOfMoreThanThreeNumbers) {
  const TemporaryFolder folder;
  const std::string text = replaced(
      opencv_text, "   rows: 3\n   cols: 1\n   dt: d\n   data: [ -0.125, 0., 0. ]",
      "   rows: 3\n   cols: 3\n   dt: d\n   data: [ 0., 0.1, 0., -0.1, 0., 0., 0., 0., 0. ]");
  const std::string error = error_of(folder.write("stereo.yml", text));
  EXPECT_NE(error.find("The translation (T) has 9 numbers instead of three"), std::string::npos)
      << error;
}

/// As OpenCV writes a cv::Size or a cv::Mat.
TEST(OpenCv, SizesMayBeListsAndMatricesByEveryName) {
  const TemporaryFolder folder;
  const cv::FileStorage stereo(opencv_text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
  for (const char* key : {"image_size", "imageSize", "img_size"}) {
    for (const char* name : {"stereo.yml", "stereo.xml", "stereo.json"}) {
      for (const bool is_list : {true, false}) {
        const auto path = folder / name;
        {
          cv::FileStorage file(path.string(), cv::FileStorage::WRITE);
          for (const char* matrix : {"K1", "D1", "K2", "D2", "R", "T"}) {
            file << matrix << stereo[matrix].mat();
          }
          const cv::Size size(1280, 960);
          if (is_list) {
            file << key << size;
          } else {
            file << key << cv::Mat(cv::Vec2i(size.width, size.height));
          }
        }
        EXPECT_EQ(read_calibration(path).rig.views[1].camera.height, 960) << key << " " << name;
        const std::string error = test::error_of([&] { read_calibration(path, {640, 480}); });
        EXPECT_NE(error.find("for images of 1280x960"), std::string::npos) << error;
      }
    }
  }
}

TEST(OpenCv, ReadsOmnidir) {
  const TemporaryFolder folder;
  const auto path = folder / "omni.xml";
  {
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE);
    file << "K" << cv::Mat(cv::Matx33d(600, 0.5, 320, 0, 601, 240, 0, 0, 1));
    file << "xi" << 1.3;
    file << "D" << cv::Mat(cv::Matx14d(-0.2, 0.05, 0.001, -0.002));
    file << "image_width" << 640 << "image_height" << 480;
  }
  const Camera c = read_calibration(path).rig.views[0].camera;
  EXPECT_EQ(c.model, CameraModel::mei);
  EXPECT_EQ(c.xi, 1.3);
  EXPECT_EQ(c.skew, 0.5);
  EXPECT_EQ(c.p2, -0.002);
}

/// With the keys of its samples omni_stereo_calibration and omni_calibration, which keep no size.
class OmnidirSamples : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::function<void(cv::FileStorage&)>& cameras) const {
    const auto path = folder_ / "out_camera_params.xml";
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE);
    file << "nFrames" << 12 << "flags" << 0;
    cameras(file);
    file << "rms" << 0.3;
    return path;
  }
  static void write_camera(cv::FileStorage& file, const std::string& suffix, double xi) {
    file << "camera_matrix" + suffix << cv::Mat(cv::Matx33d(600, 0.5, 320, 0, 601, 240, 0, 0, 1));
    file << "distortion_coefficients" + suffix << cv::Mat(cv::Matx14d(-0.2, 0.05, 0.001, -0.002));
    file << "xi" + suffix << xi;
  }
  static void expect_camera(const Camera& camera, double xi) {
    EXPECT_EQ(camera.model, CameraModel::mei);
    EXPECT_EQ(camera.xi, xi);
    EXPECT_EQ(camera.k2, 0.05);
    EXPECT_EQ(camera.skew, 0.5);
    EXPECT_EQ(camera.width, 640);
  }
  const cv::Size size_{640, 480};
  const TemporaryFolder folder_;
};

TEST_F(OmnidirSamples, OfPairsAreRead) {
  const std::vector<std::function<void(cv::FileStorage&)>> motions = {
      [](cv::FileStorage& file) {
        file << "extrinsic_parameters" << cv::Mat(cv::Matx<double, 1, 6>(0, 0.1, 0, -0.2, 0, 0));
      },
      [](cv::FileStorage& file) {
        file << "rvec" << cv::Vec3d(0, 0.1, 0) << "tvec" << cv::Vec3d(-0.2, 0, 0);
      }};
  for (const auto& motion : motions) {
    const Rig rig = read_calibration(write([&](cv::FileStorage& file) {
                                       write_camera(file, "_1", 1.3);
                                       write_camera(file, "_2", 1.4);
                                       motion(file);
                                       file << "extrinsic_parameters_1"
                                            << cv::Mat::eye(12, 6, CV_64F);
                                     }),
                                     size_)
                        .rig;
    ASSERT_EQ(rig.views.size(), 2u);
    expect_camera(rig.views[0].camera, 1.3);
    expect_camera(rig.views[1].camera, 1.4);
    // X_2 = R X_1 + T, as stereoCalibrate() composes them.
    Eigen::Isometry3d second_from_first = Eigen::Isometry3d::Identity();
    second_from_first.linear() =
        Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix();
    second_from_first.translation() << -0.2, 0, 0;
    EXPECT_LT(
        (rig.views[1].world_from_camera.inverse().matrix() - second_from_first.matrix()).norm(),
        1e-12);
  }
}

TEST_F(OmnidirSamples, OfOneCameraAreRead) {
  const Rig rig = read_calibration(write([](cv::FileStorage& file) {
                                     write_camera(file, "", 1.3);
                                     file << "extrinsic_parameters" << cv::Mat::eye(100, 6, CV_64F);
                                   }),
                                   size_)
                      .rig;
  ASSERT_EQ(rig.views.size(), 1u);
  expect_camera(rig.views[0].camera, 1.3);
}

/// The text below its header, as a map of the top level.
std::string within_map(const std::string& name, const std::string& text) {
  const std::string header = "%YAML:1.0\n---\n";
  std::string within = header + name + ":\n   ";
  for (const char c : text.substr(text.find("---\n") + 4)) {
    within += c;
    if (c == '\n') within += "   ";
  }
  return within + "\n";
}

TEST(OpenCv, ReadsMatricesWithinOneMap) {
  const TemporaryFolder folder;
  const Rig expected = read_calibration(folder.write("top.yml", opencv_text)).rig;
  const std::string within = within_map("camera_params", opencv_text);
  const Rig rig = read_calibration(folder.write("within.yml", within)).rig;
  ASSERT_EQ(rig.views.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(rig.views[i].camera, expected.views[i].camera);
    EXPECT_TRUE(rig.views[i].world_from_camera.isApprox(expected.views[i].world_from_camera, 0));
  }
  // Nobody could tell which of two is meant.
  const std::string twice = within + within_map("others", opencv_text).substr(14);
  EXPECT_NE(error_of(folder.write("twice.yml", twice)).find("no camera matrix (K1"),
            std::string::npos);
  EXPECT_NE(error_of(folder.write("xi.yml", within + "   xi_l: 1.2\n")).find("correct xi_l"),
            std::string::npos);
}

TEST_F(OmnidirSamples, NumberedFromZeroAreRead) {
  const Rig rig = read_calibration(write([](cv::FileStorage& file) {
                                     write_camera(file, "_0", 1.3);
                                     write_camera(file, "_1", 1.4);
                                     file << "R" << cv::Mat::eye(3, 3, CV_64F) << "T"
                                          << cv::Vec3d(-0.2, 0, 0);
                                   }),
                                   size_)
                      .rig;
  ASSERT_EQ(rig.views.size(), 2u);
  expect_camera(rig.views[0].camera, 1.3);
  expect_camera(rig.views[1].camera, 1.4);
}

/// The camera would be taken for one of cv::fisheye.
TEST_F(OmnidirSamples, NoXiIsOverlooked) {
  const auto error_with = [&](const std::string& line) {
    return error_of(folder_.write("stereo.yml", opencv_text + line + "\n"));
  };
  for (const char* line : {"xi_l: 1.2", "Xi1: 1.2", "xi_1: high", "xi: [ 1.2, 1.3 ]"}) {
    const std::string key = std::string(line).substr(0, std::string(line).find(':'));
    const std::string error = error_with(line);
    EXPECT_NE(error.find("by the name xi, xi1 or xi2; correct " + key), std::string::npos) << error;
  }
  const std::string second = error_of(
      folder_.write("stereo.yml", replaced(opencv_text, "K2:", "A2:") + "xi1: 1.2\nxi_2: 1.3\n"));
  EXPECT_NE(second.find("xi without its matrix"), std::string::npos) << second;
}

Camera camera_with_opencv_coefficients(const std::vector<double>& d) {
  const TemporaryFolder folder;
  const auto path = folder / "mono.yml";
  const cv::Matx33d k(600, 0, 320, 0, 601, 240, 0, 0, 1);
  {
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE);
    file << "K" << cv::Mat(k) << "D" << cv::Mat(d, true);
    file << "image_width" << 640 << "image_height" << 480;
  }
  const Camera c = read_calibration(path).rig.views[0].camera;
  std::vector<cv::Point2d> expected;
  cv::projectPoints(std::vector<cv::Point3d>{{0.3, -0.2, 1}}, cv::Vec3d(), cv::Vec3d(), k, d,
                    expected);
  Eigen::Vector2d pixel;
  EXPECT_TRUE(project(c, {0.3, -0.2, 1}, pixel));
  EXPECT_NEAR(pixel.x(), expected[0].x, 1e-9);
  EXPECT_NEAR(pixel.y(), expected[0].y, 1e-9);
  return c;
}

TEST(OpenCv, ReadsRationalAndPrismCoefficientsInItsOrder) {
  const Camera c = camera_with_opencv_coefficients(
      {0.51, -0.61, 0.0006, -0.0002, 0.52, 0.39, -0.43, 0.45, 0.001, -0.002, 0.003, -0.004});
  EXPECT_EQ(c.model, CameraModel::pinhole_rational);
}

TEST(OpenCv, EachRationalAndPrismCoefficientCounts) {
  for (std::size_t i = 5; i < 12; ++i) {
    SCOPED_TRACE(i);
    std::vector<double> d(12);
    d[0] = 0.1;
    d[i] = 0.02;
    EXPECT_EQ(camera_with_opencv_coefficients(d).model, CameraModel::pinhole_rational);
  }
}

/// What would be dropped must not be there.
TEST(OpenCv, RefusesCoefficientsThatNoModelHas) {
  const TemporaryFolder folder;
  const auto path = folder / "stereo.yml";
  const auto write = [&](const std::vector<double>& coefficients, bool omnidir) {
    cv::FileStorage file(path.string(), cv::FileStorage::WRITE);
    file << "K" << cv::Mat(cv::Matx33d(600, 0, 320, 0, 601, 240, 0, 0, 1));
    file << "D" << cv::Mat(coefficients, true);
    if (omnidir) file << "xi" << 1.3;
    file << "image_width" << 640 << "image_height" << 480;
  };
  for (const std::size_t count : {5u, 8u, 12u, 14u}) {
    std::vector<double> coefficients(count);
    coefficients[4] = 0.3;
    write(coefficients, false);
    EXPECT_EQ(read_calibration(path).rig.views[0].camera.k3, 0.3) << count;
    if (count < 14) continue;
    coefficients.back() = 0.01;
    write(coefficients, false);
    EXPECT_NE(error_of(path).find("CALIB_"), std::string::npos) << error_of(path);
    EXPECT_NE(error_of(path).find("cam0"), std::string::npos) << error_of(path);
  }
  write({-0.2, 0.05, 0.001, -0.002, 0}, true);
  EXPECT_EQ(read_calibration(path).rig.views[0].camera.p2, -0.002);
  write({-0.2, 0.05, 0.001, -0.002, 0.1}, true);
  EXPECT_NE(error_of(path).find("cv::omnidir"), std::string::npos) << error_of(path);
}

/// Readers make a rotation of what was rounded.
TEST(Rotations, MayBeWrittenWithFourDigits) {
  const TemporaryFolder folder;
  const Eigen::Matrix3d exact =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  const Eigen::Matrix3d rounded = (exact * 1e4).array().round() / 1e4;
  EXPECT_GT((rounded.transpose() * rounded - Eigen::Matrix3d::Identity()).norm(), 1e-4);
  std::ostringstream rows, list;
  for (int i = 0; i < 3; ++i) {
    rows << "  - [" << rounded(i, 0) << ", " << rounded(i, 1) << ", " << rounded(i, 2)
         << ", 0.1]\n";
    for (int j = 0; j < 3; ++j) list << (i + j > 0 ? ", " : "") << rounded(i, j);
  }
  const std::string kalibr = kalibr_text;
  const std::size_t first = kalibr.find("  - [0.99999"), last = kalibr.find("  - [0.0, 0.0, 0.0");
  const std::string kalibr_rounded = kalibr.substr(0, first) + rows.str() + kalibr.substr(last);
  const std::string opencv_rounded =
      replaced(opencv_text, "1., 0., 0., 0., 1., 0., 0., 0., 1.", list.str());
  for (const std::string& text : {kalibr_rounded, opencv_rounded}) {
    const auto path = folder.write("rounded.yaml", text);
    ASSERT_EQ(error_of(path), "");
    const Rig rig = read_calibration(path).rig;
    const Eigen::Matrix3d read = source_from_reference(rig.views[1], rig.views[0]).linear();
    EXPECT_LT((read - exact).norm(), 2e-4);
    EXPECT_LT((read.transpose() * read - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  }
}

TEST(Locales, DoNotChangeNumbers) {
  const TemporaryFolder folder;
  const Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  const auto expect_same = [&](const std::filesystem::path& path) {
    ASSERT_EQ(error_of(path), "");
    const Rig again = read_calibration(path).rig;
    EXPECT_EQ(again.views[0].camera, rig.views[0].camera) << path;
    EXPECT_NEAR(baseline(again.views[0], again.views[1]), baseline(rig.views[0], rig.views[1]),
                1e-12)
        << path;
  };
  const auto round_trip = [&] {
    expect_same(folder / "chain.yaml");
    write_kalibr(folder / "again.yaml", rig);
    expect_same(folder / "again.yaml");
    write_basalt(folder / "again.json", rig);
    expect_same(folder / "again.json");
    EXPECT_EQ(error_of(folder.write("stereo.yml", opencv_text)), "");
    EXPECT_EQ(read_calibration(folder / "stereo.yml").rig.views[0].camera.fx, 392.2);
  };
  {
    const test::CommaStreams streams;
    round_trip();
  }
  const test::CommaNumbers numbers;
  if (!numbers.installed()) GTEST_SKIP() << "no locale with a decimal comma is installed";
  round_trip();
}

void expect_same_camera(const Camera& found, const Camera& expected) {
  EXPECT_EQ(found.model, expected.model);
  EXPECT_EQ(found.width, expected.width);
  EXPECT_EQ(found.height, expected.height);
  EXPECT_NEAR(found.max_theta, expected.max_theta, 1e-14);  // degrees in files
  // Basalt's ucm has another parameter than ours and other focal lengths.
  const double rounding = expected.model == CameraModel::unified ? 4e-15 : 0;
  for (const auto& [name, member] : intrinsics()) {
    EXPECT_NEAR(found.*member, expected.*member, rounding * std::abs(expected.*member)) << name;
  }
}

TEST(Writing, RoundTripsExactly) {
  const TemporaryFolder folder;
  Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  const auto same = [&](const Rig& again) {
    ASSERT_EQ(again.views.size(), rig.views.size());
    ASSERT_EQ(again.world_from_imu.has_value(), rig.world_from_imu.has_value());
    if (rig.world_from_imu) expect_imu(again, *rig.world_from_imu);
    for (std::size_t i = 0; i < rig.views.size(); ++i) {
      expect_same_camera(again.views[i].camera, rig.views[i].camera);
      EXPECT_LT(
          (rig.views[i].world_from_camera.matrix() - again.views[i].world_from_camera.matrix())
              .norm(),
          1e-9);
      EXPECT_DOUBLE_EQ(again.views[i].imu_time_offset, rig.views[i].imu_time_offset);
    }
  };
  for (const bool with_imu : {false, true}) {
    if (with_imu) {
      rig.world_from_imu = camera_beside_imu();
      for (View& view : rig.views) view.imu_time_offset = -0.016604847;
    }
    write_kalibr(folder / "again.yaml", rig);
    same(read_calibration(folder / "again.yaml").rig);
    write_basalt(folder / "again.json", rig);
    const Calibration json = read_calibration(folder / "again.json");
    EXPECT_EQ(json.format, CalibrationFormat::basalt);
    same(json.rig);
  }
}

/// Kalibr's format and Basalt's hold a camera as it is, or name what they cannot hold.
class WritingCameras : public ::testing::TestWithParam<test::NamedCamera> {
 protected:
  using Write = void (*)(const std::filesystem::path&, const Rig&);

  void expect_held(bool is_held, Write write) {
    const Camera& camera = GetParam().camera;
    Rig rig;
    rig.views.resize(2);
    for (int i = 0; i < 2; ++i) {
      rig.views[i].name = "cam" + std::to_string(i);
      rig.views[i].camera = camera;
    }
    rig.views[1].camera.max_theta = 1.1;
    rig.views[1].world_from_camera = camera_beside_imu();
    const std::filesystem::path path = folder_ / "rig";
    if (!is_held) {
      EXPECT_NE(test::error_of([&] { write(path, rig); }).find("cam0"), std::string::npos);
      EXPECT_FALSE(std::filesystem::exists(path));
      return;
    }
    write(path, rig);
    const Rig again = read_calibration(path).rig;
    ASSERT_EQ(again.views.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
      expect_same_camera(again.views[i].camera, rig.views[i].camera);
      EXPECT_LT(
          (again.views[i].world_from_camera.matrix() - rig.views[i].world_from_camera.matrix())
              .norm(),
          1e-14);
    }
  }

  TemporaryFolder folder_;
};

TEST_P(WritingCameras, AsKalibrDoes) {
  const Camera& c = GetParam().camera;
  const std::set<CameraModel> has_no_form = {
      CameraModel::pinhole_rational, CameraModel::thin_prism_fisheye,
      CameraModel::rad_tan_thin_prism_fisheye, CameraModel::polynomial_fisheye};
  const bool is_radtan = c.model == CameraModel::pinhole_radtan || c.model == CameraModel::mei;
  expect_held(!has_no_form.contains(c.model) && c.skew == 0 && !(is_radtan && c.k3 != 0),
              write_kalibr);
}

/// Kalibr reads camchains by PyYAML, for which -5e-04 is a word: numbers are as the YAML 1.1
/// specification has them (int and float types).
TEST(Writing, NumbersOfCamchainsAreNumbersInYaml11) {
  const TemporaryFolder folder;
  Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  Camera& camera = rig.views[0].camera;
  camera = test::make_camera(CameraModel::kannala_brandt, 640, 480, 1e5, 300, 320.5, 240);
  camera.k1 = -0.0005;
  camera.k2 = 1e-30;
  camera.k3 = 1.25e-7;
  rig.views[1].world_from_camera.translation().y() = 2e-05;
  rig.views[1].imu_time_offset = -3e-06;
  write_kalibr(folder / "again.yaml", rig);
  const std::string text = bytes_of(folder / "again.yaml");
  for (const char* number : {"-5.0e-04", "1.0e-30", "1.25e-07", "1.0e+05"}) {
    EXPECT_NE(text.find(number), std::string::npos) << number << "\n" << text;
  }
  const std::regex number("[-+]?([0-9]+|[0-9]+\\.[0-9]*([eE][-+][0-9]+)?)");
  std::istringstream words(std::regex_replace(text, std::regex("[,\\[\\]]"), " "));
  int count = 0;
  for (std::string word; words >> word;) {
    if (word == "-" || std::string("-+.0123456789").find(word.front()) == std::string::npos) {
      continue;
    }
    EXPECT_TRUE(std::regex_match(word, number)) << word;
    ++count;
  }
  EXPECT_GT(count, 30);
}

TEST(Writing, NamesAModelThatKalibrLacksBeforeItsSkew) {
  const TemporaryFolder folder;
  Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  rig.views[0].camera.model = CameraModel::thin_prism_fisheye;
  rig.views[0].camera.skew = 0.1;
  const std::string error = test::error_of([&] { write_kalibr(folder / "again.yaml", rig); });
  EXPECT_NE(error.find("cam0 (thin_prism_fisheye) has no form"), std::string::npos) << error;
}

TEST_P(WritingCameras, AsBasaltDoes) {
  const Camera& c = GetParam().camera;
  const std::set<CameraModel> has_no_form = {
      CameraModel::mei, CameraModel::equirectangular, CameraModel::thin_prism_fisheye,
      CameraModel::rad_tan_thin_prism_fisheye, CameraModel::polynomial_fisheye};
  expect_held(!has_no_form.contains(c.model) && c.skew == 0 && c.s1 == 0, write_basalt);
}

TEST_P(WritingCameras, AsOpenCvDoes) {
  const CameraModel model = GetParam().camera.model;
  // They come back as Mei cameras and with a distortion of zero.
  if (model == CameraModel::unified || model == CameraModel::pinhole) return;
  const std::set<CameraModel> has_form = {CameraModel::pinhole_radtan,
                                          CameraModel::pinhole_rational,
                                          CameraModel::kannala_brandt, CameraModel::mei};
  expect_held(has_form.contains(model), write_opencv);
}

/// OpenCV itself reads it.
TEST(Writing, OpenCvFilesAreThoseOfItsCalibrations) {
  const TemporaryFolder folder;
  const Rig rig = read_calibration(folder.write("stereo.yml", opencv_text)).rig;
  for (const char* name : {"again.yml", "again.xml", "again.json"}) {
    write_opencv(folder / name, rig);
    const cv::FileStorage before(opencv_text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    const cv::FileStorage file((folder / name).string(), cv::FileStorage::READ);
    for (const char* key : {"K1", "K2", "R", "T", "D1", "D2"}) {
      const cv::Mat expected = before[key].mat().reshape(1, 1);
      const cv::Mat found = file[key].mat().reshape(1, 1);
      ASSERT_EQ(found.size(), expected.size()) << name << " " << key;
      EXPECT_LT(cv::norm(found, expected, cv::NORM_INF), 1e-15) << name << " " << key;
    }
    EXPECT_EQ(static_cast<int>(file["image_width"]), 1280);
  }
  for (const auto& [name, begin] : {std::pair("AGAIN.XML", "<?xml"), {"AGAIN.JSON", "{"}}) {
    write_opencv(folder / name, rig);
    EXPECT_THAT(bytes_of(folder / name), ::testing::StartsWith(begin));
  }
  Rig one = rig;
  one.views.pop_back();
  write_opencv(folder / "one.yml", one);
  EXPECT_EQ(read_calibration(folder / "one.yml").rig.views.size(), 1u);
  Rig unified = one;
  unified.views[0].camera = Camera{};
  unified.views[0].camera.model = CameraModel::unified;
  unified.views[0].camera.xi = 0.9;
  unified.views[0].camera.fx = unified.views[0].camera.fy = 300;
  unified.views[0].camera.width = unified.views[0].camera.height = 400;
  unified.views[0].camera.cx = unified.views[0].camera.cy = 200;
  write_opencv(folder / "unified.yml", unified);
  EXPECT_EQ(read_calibration(folder / "unified.yml").rig.views[0].camera.xi, 0.9);

  const auto expect = [&](const Rig& bad, const char* part) {
    const std::string error = test::error_of([&] { write_opencv(folder / "bad.yml", bad); });
    EXPECT_NE(error.find(part), std::string::npos) << error;
    EXPECT_FALSE(std::filesystem::exists(folder / "bad.yml"));
  };
  Rig bad = rig;
  bad.views.push_back(bad.views.back());
  bad.views.back().world_from_camera.translation().x() += 1;
  expect(bad, "two cameras at most, but the rig has 3");
  bad = rig;
  bad.world_from_imu = camera_beside_imu();
  expect(bad, "cannot say where the IMU is");
  bad = rig;
  bad.views[1].imu_time_offset = 0.05;
  expect(bad, "cannot say how the IMU's clock differs");
  bad = rig;
  bad.views[1].camera.width = 640;
  expect(bad, "cameras of one image size");
  bad = rig;
  bad.views[1].camera.model = CameraModel::mei;
  bad.views[1].camera.k3 = bad.views[1].camera.k4 = 0;
  expect(bad, "cam0 is kannala_brandt and cam1 is mei");
  bad.views[1].camera.model = CameraModel::pinhole_radtan;
  bad.views[1].camera.skew = 0;
  expect(bad, "cam0 is kannala_brandt and cam1 is pinhole_radtan");
}

INSTANTIATE_TEST_SUITE_P(Models, WritingCameras, ::testing::ValuesIn(test::cameras()),
                         [](const auto& test) { return std::string(test.param.name); });

/// Of names that it looks for, Basalt refuses a file that lacks one.
TEST(Writing, BasaltFindsWhatItAsksFor) {
  const TemporaryFolder folder;
  write_basalt(folder / "a.json", read_calibration(folder.write("c.yaml", kalibr_text)).rig);
  std::ifstream stream(folder / "a.json");
  const auto value = nlohmann::json::parse(stream).at("value0");
  const std::map<std::string, std::size_t> lists = {
      {"T_imu_cam", 2},       {"intrinsics", 2},       {"resolution", 2},
      {"vignette", 0},        {"calib_accel_bias", 9}, {"calib_gyro_bias", 12},
      {"accel_noise_std", 3}, {"gyro_noise_std", 3},   {"accel_bias_std", 3},
      {"gyro_bias_std", 3}};
  for (const auto& [key, size] : lists) {
    ASSERT_TRUE(value.contains(key)) << key;
    EXPECT_TRUE(value[key].is_array()) << key;
    EXPECT_EQ(value[key].size(), size) << key;
  }
  for (const char* key : {"accel_noise_std", "gyro_noise_std", "accel_bias_std", "gyro_bias_std"}) {
    for (const auto& deviation : value[key])
      EXPECT_GT(deviation, 0) << key << ", by which it divides";
  }
  EXPECT_TRUE(value.value("cam_time_offset_ns", nlohmann::json()).is_number_integer());
  EXPECT_GT(value.value("imu_update_rate", 0.0), 0);
}

TEST(Writing, PanoramasGoToKalibrAlone) {
  const TemporaryFolder folder;
  Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  for (View& view : rig.views) view.camera = whole_sphere(640, 320);
  write_kalibr(folder / "spheres.yaml", rig);
  for (const View& view : read_calibration(folder / "spheres.yaml").rig.views) {
    EXPECT_EQ(view.camera, whole_sphere(640, 320));
  }
  EXPECT_NE(test::error_of([&] { write_basalt(folder / "a.json", rig); }).find("equirectangular"),
            std::string::npos);
}

TEST(Writing, NamesTheOtherFormatWhereThatHoldsTheCamera) {
  const TemporaryFolder folder;
  Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  Camera& camera = rig.views[0].camera;
  const Camera whole = camera;
  const auto expect = [&](CameraModel model, double skew, const char* kalibr, const char* basalt) {
    camera = whole;
    camera.model = model;
    camera.k3 = 0;
    camera.skew = skew;
    const auto expect_end = [&](const char* end,
                                void (*write)(const std::filesystem::path&, const Rig&)) {
      const std::string error = test::error_of([&] { write(folder / "again", rig); });
      EXPECT_TRUE(error.ends_with(end)) << error;
    };
    expect_end(kalibr, write_kalibr);
    expect_end(basalt, write_basalt);
  };
  expect(CameraModel::pinhole_rational, 0,
         "(pinhole_rational) has no form in Kalibr's format; choose Basalt's or OpenCV's.", "");
  expect(CameraModel::mei, 0, "",
         "(mei) has no form in Basalt's format; choose Kalibr's or OpenCV's.");
  expect(CameraModel::kannala_brandt, 0.1,
         "with a skew) has no form in Kalibr's format; choose OpenCV's.",
         "with skew) has no form in Basalt's format; choose OpenCV's.");
  // cv::projectPoints() would ignore it.
  expect(CameraModel::pinhole_rational, 0.1,
         "in Kalibr's format; no other that is written has one, so keep the file that it is from.",
         "in Basalt's format; no other that is written has one, so keep the file that it is from.");
  expect(CameraModel::double_sphere, 0.1,
         "in Kalibr's format; no other that is written has one, so keep the file that it is from.",
         "in Basalt's format; no other that is written has one, so keep the file that it is from.");
}

// As calibrations of Windows Mixed Reality's headsets.
TEST(Basalt, HoldsRationalPinholesUpToTheirLargestRadius) {
  const TemporaryFolder folder;
  Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  Camera& c = rig.views[0].camera;
  c = Camera();
  c.model = CameraModel::pinhole_rational;
  c.width = 640;
  c.height = 480;
  c.fx = c.fy = 269;
  c.cx = 320;
  c.cy = 240;
  c.k1 = 0.64;
  c.k2 = 0.057;
  c.k3 = 0.0013;
  c.k4 = 0.99;
  c.k5 = 0.18;
  c.k6 = 0.0075;
  c.p1 = 0.0001;
  c.p2 = -0.00005;
  c.max_theta = std::atan(2.75);
  rig.views[1].camera.model = CameraModel::pinhole_radtan;
  rig.views[1].camera.p1 = 0.001;
  write_basalt(folder / "a.json", rig);
  const Rig again = read_calibration(folder / "a.json").rig;
  EXPECT_EQ(again.views[1].camera.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(again.views[1].camera.p1, 0.001);
  EXPECT_NEAR(again.views[0].camera.max_theta, c.max_theta, 1e-12);
  Camera unlimited = again.views[0].camera;
  unlimited.max_theta = c.max_theta;
  EXPECT_EQ(unlimited, c);

  EXPECT_NE(test::error_of([&] { write_kalibr(folder / "a.yaml", rig); }).find("pinhole_rational"),
            std::string::npos);
  c.s2 = 0.001;
  EXPECT_NE(test::error_of([&] { write_basalt(folder / "b.json", rig); }).find("pinhole_rational"),
            std::string::npos);
}

TEST(Writing, RefusesARigWithoutCameras) {
  const TemporaryFolder folder;
  for (const auto& write : {write_basalt, write_kalibr}) {
    const std::string error = test::error_of([&] { write(folder / "a.txt", {}); });
    EXPECT_NE(error.find("a.txt: the rig has no cameras"), std::string::npos) << error;
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  }
}

TEST(Writing, RefusesWhatCouldNotBeReadAgain) {
  const TemporaryFolder folder;
  const Rig rig = read_calibration(folder.write("chain.yaml", kalibr_text)).rig;
  Rig no_focal_length = rig, no_position = rig;
  no_focal_length.views[1].camera.fx = std::nan("");
  no_position.views[1].world_from_camera.translation().y() = std::nan("");
  for (const auto& write : {write_basalt, write_kalibr}) {
    const auto error = [&](const Rig& wrong) {
      return test::error_of([&] { write(folder / "a.txt", wrong); });
    };
    EXPECT_NE(error(no_focal_length).find("a.txt: the rig: cam1: fx is nan"), std::string::npos);
    EXPECT_NE(error(no_position).find("a.txt: the rig: cam1: the pose is not"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / "a.txt"));
  }
}

TEST(Writing, RefusesWhatAFormatCannotHold) {
  const TemporaryFolder folder;
  const Rig rig = read_calibration(folder.write("stereo.yml", opencv_text)).rig;  // has skew
  EXPECT_THROW(write_kalibr(folder / "a.yaml", rig), Error);
  EXPECT_THROW(write_basalt(folder / "a.json", rig), Error);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.yaml"));
  EXPECT_THROW(write_kalibr(folder / "no/such/folder.yaml",
                            read_calibration(folder.write("c.yaml", kalibr_text)).rig),
               Error);
}

TEST(BadCalibration, EveryMistakeIsNamed) {
  const TemporaryFolder folder;
  const auto path = folder / "bad";
  const auto message = [&](const std::string& text) { return error_of(folder.write("bad", text)); };
  const auto expect = [&](const std::string& text, const char* part) {
    const std::string error = message(text);
    EXPECT_NE(error.find(part), std::string::npos) << error;
    EXPECT_NE(error.find(path.string()), std::string::npos) << error;
  };
  EXPECT_NE(error_of(folder / "missing.yaml").find("no calibration file"), std::string::npos);
  EXPECT_NE(error_of(folder.path()).find("not a file"), std::string::npos);
  expect("", "empty");
  expect("hello world\n", "no calibration");
  expect(std::string("\x89PNG\r\n\x1a\n\0\0\0", 11), "no calibration");
  expect("\xff\xd8\xff\xe0", "no calibration");
  expect(std::string("\xff\xfe"
                     "c\0a\0m\0"
                     "0\0",
                     10),
         "is text in UTF-16; save it as UTF-8.");
  expect(std::string("\xfe\xff\0c\0a\0m\0"
                     "0",
                     10),
         "is text in UTF-16; save it as UTF-8.");
  expect("cam0: 5\n", "camera_model");
  expect("cam0: [1\n", "YAML");
  expect("camera_model: pinhole\n", "no cameras");
  expect(replaced(kalibr_text, "pinhole", "catadioptric"), "catadioptric");
  expect(replaced(kalibr_text, "equidistant", "thin_prism"), "thin_prism");
  expect(replaced(kalibr_text, "distortion_model: none", "distortion_model: radtan"), "radtan");
  expect(replaced(kalibr_text, "[190.97, 190.96, 254.93, 256.89]", "[190.97, 190.96, 254.93]"),
         "intrinsics");
  expect(replaced(kalibr_text, "190.97", ".nan"), "finite");
  expect(replaced(kalibr_text, "190.97", "wide"), "finite");
  expect(replaced(kalibr_text, "190.97", "-190.97"), "fx");
  expect(replaced(kalibr_text, "-0.17, 0.59", "-0.17, 1.59"), "alpha");
  expect(replaced(kalibr_text, "  resolution: [512, 512]\n", ""), "resolution");
  expect(replaced(kalibr_text, "resolution: [512, 512]", "resolution: [512.5, 512]"), "resolution");
  expect(replaced(kalibr_text, "T_cn_cnm1", "T_cam_imu"), "T_cn_cnm1");
  expect(replaced(kalibr_text, "0.9999994457734953", "1.2"), "rigid");
  for (const char* last : {"[0.1, 0.0, 0.0, 1.0]", "[0.0, 0.0, 0.0, 2.0]"}) {
    expect(replaced(with_imu("cam0", "T_cam_imu"), "[0.0, 0.0, 0.0, 1.0]", last),
           "cam0: T_cam_imu must end with the row 0 0 0 1; it may be transposed");
  }
  expect(replaced(with_imu("cam0", "T_cam_imu"), "[1.0, 0.0, 0.0, -0.04]", "[1.1, 0.0, 0.0, 0.0]"),
         "cam0: T_cam_imu: the pose is not a rigid motion");
  expect(replaced(with_imu("cam1", "T_imu_cam"), "-0.04", ".nan"), "cam1: The key T_imu_cam");
  expect(replaced(kalibr_text, "max_theta_deg: 97.5", "max_theta_deg: 400"), "max_theta");
  expect(replaced(kalibr_text, "256.89]", "256.89, 7]"),
         "cam0: The key intrinsics lists 5 numbers, but with these models it has 4");
  expect(replaced(kalibr_text, "-0.002, 0.0002]", "-0.002, 0.0002, 0, 0.5]"),
         "cam0: The key distortion_coeffs lists 6 numbers");
  expect(replaced(kalibr_text, "distortion_coeffs: []", "distortion_coeffs: [0.1]"),
         "cam1: The key distortion_coeffs lists 1 numbers");
  EXPECT_EQ(message(replaced(kalibr_text, "-0.002, 0.0002]", "-0.002, 0.0002, 0, 0.0]")), "");
  EXPECT_EQ(message(replaced(kalibr_text, "distortion_coeffs: []", "distortion_coeffs:")), "");
  expect(replaced(kalibr_text, "cam1:", "cam2:"), "It has cam2 but no cam1");
  expect(replaced(kalibr_text, "cam0:", "cam2:"), "It has cam2 but no cam0");
  expect(replaced(kalibr_text, "cam1:", "cam0:"), "The key cam0 is there twice");
  expect(replaced(kalibr_text, "cam1:", "---\ncam1:"), "2 YAML documents are in it");
  expect(std::string(kalibr_text) + "\n...\nmore\n", "2 YAML documents are in it");
  expect(replaced(kalibr_text, "  rostopic:", "  resolution:"),
         "cam0: The key resolution is there twice");
  expect(replaced(replaced(replaced(kalibr_text, "-0.10106110275180535", "0"),
                           "-0.0019764575873431013", "0"),
                  "-0.0011756424802046581", "0"),
         "baseline");
  expect("{\"value1\": 3}", "value0");
  expect("{\"value0\": {}}", "intrinsics");
  expect("{\"value0\": [", "JSON");
  expect(replaced(basalt_text, "\"ucm\"", "\"ocam\""), "ocam");
  expect(replaced(basalt_text, "\"alpha\": 0.6", "\"alpha\": 1.0"), "alpha");
  expect(replaced(basalt_text, "\"fx\": 120.0", "\"fx\": \"120\""),
         "cam0: The number \"fx\" is missing; add it.");
  expect(replaced(basalt_text, "\"qw\": 1.0", "\"qw\": 2.0"),
         "T_imu_cam has a quaternion of length 2 instead of 1; scale qx, qy, qz and qw alike.");
  expect(replaced(basalt_text, "[512, 510], ", ""), "length");
  expect(replaced(opencv_text, "K1:", "A1:"), "K1");
  expect(replaced(opencv_text, "   dt: d", "   : d"), "OpenCV cannot read it (");
  expect(replaced(kalibr_text, "resolution: [512,", "resolution: [-512,"),
         "The key resolution has -512; give whole numbers of pixels");
  expect(replaced(opencv_text, "T: !!", "U: !!"), "translation");
  expect(replaced(opencv_text, "[ 1., 0., 0., 0., 1.", "[ 1., 0., 0., 0., 2."), "rigid");
  expect(replaced(opencv_text, "[ -0.125, 0., 0. ]", "[ 0., 0., 0. ]"), "baseline");
  expect(replaced(opencv_text, "-0.028", ".Nan"), "");
  expect(std::string(opencv_text) + "xi1: 1.2\n", "It has a xi of one camera alone");
  expect(std::string(opencv_text) + "xi2: 1.2\n", "It has a xi of one camera alone");
  expect(replaced(opencv_text, "rows: 3", "rows: 1900000000"), "rows");
}

/// Parsers that call themselves for what is nested would fill the stack.
TEST(BadCalibration, DeepNestingIsRefused) {
  const TemporaryFolder folder;
  const auto repeated = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  const std::string yaml = std::string(opencv_text) + "x: ";
  const std::string json = "{\"x\": \"opencv-matrix\", \"a\": ";
  const std::string xml = "<?xml version=\"1.0\"?>\n<opencv_storage><!-- opencv-matrix <a <a -->";
  constexpr int deep = 200'000;
  // Also where OpenCV's parsers see other comments, strings and lines than one would think.
  for (const std::string& text :
       {yaml + repeated("[", deep), yaml + "[ //, " + repeated("[", deep),
        yaml + "[ y', " + repeated("[", deep), yaml + "[ a#b, " + repeated("[", deep),
        yaml + repeated("{a}: ", deep), yaml + repeated("a: ", deep), yaml + repeated("-", deep),
        yaml + "\n   " + repeated("- ", deep), json + repeated("[", deep),
        json + repeated("[\"]\", /*]*/ ", deep), json + repeated("[/*/]*/", deep),
        json + repeated("[\"\\\"]\", // ]\n", deep), json + repeated("[ \r]\n", deep),
        xml + repeated("<a>", deep) + repeated("</a>", deep) + "</opencv_storage>",
        xml + repeated("<a><!--></a>-->", deep) + "</opencv_storage>"}) {
    const std::string error = error_of(folder.write("deep", text));
    EXPECT_NE(error.find("more than 5000 brackets"), std::string::npos) << error;
  }
  for (const std::string& text :
       {"cam0: " + repeated("[", deep), "cam0:\n   " + repeated("- ", deep),
        "cam0: " + repeated("{a: ", deep), "{\"value0\": " + repeated("[", deep),
        "{\"value0\": " + repeated("[", deep) + repeated("]", deep) + "}"}) {
    EXPECT_NE(error_of(folder.write("deep", text)), "");
  }
  // What is not too deep for OpenCV.
  for (const std::string& text :
       {std::string(opencv_text) + repeated("many: [ {} ] # [\n", 1000), yaml + repeated("[", 4900),
        xml + repeated("<a><b/>'\"</a>", 1000) + "</opencv_storage>",
        xml + repeated("<a>", 4900) + repeated("</a>", 4900) + "</opencv_storage>"}) {
    EXPECT_EQ(error_of(folder.write("wide", text)).find("brackets"), std::string::npos);
  }
}

TEST(BadCalibration, UnreadableFoldersAreNamed) {
  if (geteuid() == 0) GTEST_SKIP() << "permissions do not hold for root";
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "closed");
  folder.write("closed/calib.yaml", kalibr_text);
  std::filesystem::permissions(folder / "closed", std::filesystem::perms::none);
  const std::string error = error_of(folder / "closed/calib.yaml");
  std::filesystem::permissions(folder / "closed", std::filesystem::perms::owner_all);
  EXPECT_NE(error.find("calib.yaml (Permission denied)"), std::string::npos) << error;
  folder.write("secret.yaml", kalibr_text);
  for (const char* name : {"closed", "secret.yaml"}) {
    std::filesystem::permissions(folder / name, std::filesystem::perms::none);
    const std::string of_entry = error_of(folder / name);
    std::filesystem::permissions(folder / name, std::filesystem::perms::owner_all);
    EXPECT_NE(of_entry.find(std::string(name) + ": Permission denied; check"), std::string::npos)
        << of_entry;
  }
}

TEST(BadCalibration, FilesThatCannotBeReadOnAreNoShorterOnes) {
  EXPECT_NE(error_of("/proc/self/mem").find("Cannot read /proc/self/mem: Input/output error"),
            std::string::npos);
}

TEST(BadCalibration, LargeFilesAreRefusedBeforeTheyAreParsed) {
  const TemporaryFolder folder;
  for (const char* name : {"a.yaml", "transforms.json"}) {
    folder.write(name, "{");
    std::filesystem::resize_file(folder / name, (4 << 20) + 1);
    const std::string error = error_of(folder / name);
    EXPECT_NE(error.find("too large for a calibration file (4 MiB)"), std::string::npos) << error;
  }
}

TEST(BadCalibration, WhatAColmapModelLacksIsNamed) {
  const TemporaryFolder folder;
  folder.write("cameras.txt", "");
  const std::string error = error_of(folder.path());
  EXPECT_NE(error.find("images.bin or images.txt is missing"), std::string::npos) << error;
}

TEST(BadCalibration, ModelsInAFolderAreNamed) {
  const TemporaryFolder folder;
  EXPECT_THAT(error_of(folder.path()), HasSubstr("holds cameras.bin or .txt."));
  std::filesystem::create_directories(folder / "sparse/0");
  for (const char* name : {"cameras.txt", "images.txt"}) {
    folder.write("sparse/0/" + std::string(name), "");
  }
  const std::string named = "; this one holds " + (folder / "sparse/0").string() + ".";
  EXPECT_THAT(error_of(folder.path()), HasSubstr(named));
  EXPECT_THAT(error_of(folder / "sparse"), HasSubstr(named));
  const auto file = folder.write("transforms.json", R"({"frames": []})");
  EXPECT_THAT(error_of(folder.path()), HasSubstr("; this one holds " + file.string() + "."));
}

/// Whatever bytes come, the reader answers with a rig or an Error.
TEST(BadCalibration, DamagedFilesNeverCrash) {
  const TemporaryFolder folder;
  for (const char* text : {kalibr_text, basalt_text, opencv_text}) {
    EXPECT_GT(
        test::times_refused(
            text, [&](const std::string& left) { return error_of(folder.write("left", left)); }),
        100);
  }
}

TEST(RealCalibrations, AreReadOrRefusedClearly) {
  SKIP_WITHOUT_STEREO_SETS();
  int read = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(test::data_folder())) {
    const std::string extension = entry.path().extension().string();
    if (extension != ".yaml" && extension != ".yml" && extension != ".json") continue;
    try {
      const Calibration c = read_calibration(entry.path(), {1280, 960});
      EXPECT_FALSE(c.rig.views.empty());
      ++read;
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find(entry.path().string()), std::string::npos);
    }
  }
  EXPECT_GT(read, 30);
  const auto real = test::data_folder() / "real";
  EXPECT_EQ(read_calibration(real / "calibrations/lafida_ocam/MultiCamSys_Calibration.yaml")
                .rig.views.size(),
            3u);
  const Rig tumvi = read_calibration(real / "tumvi_single_frame/calib.yaml").rig;
  EXPECT_NEAR(baseline(tumvi.views[0], tumvi.views[1]), 0.1010, 2e-4);
  const Rig basalt = read_calibration(real / "calibrations/basalt/tumvi_512_ds_calib.json").rig;
  EXPECT_NEAR(baseline(basalt.views[0], basalt.views[1]), 0.1010, 2e-4);
  const Rig converted =
      read_calibration(real / "calibrations/basalt_tumvi_512_ds_calib.camchain.yaml").rig;
  EXPECT_LT(
      (basalt.views[1].world_from_camera.matrix() - converted.views[1].world_from_camera.matrix())
          .norm(),
      1e-6);
}

/// Calibrations of one rig by several tools agree on where its IMU is.
TEST(RealCalibrations, AgreeOnTheImu) {
  SKIP_WITHOUT_STEREO_SETS();
  const auto folder = test::data_folder() / "real/calibrations";
  const auto expect_agreement = [&](const char* a, const char* b) {
    const Rig first = read_calibration(folder / a).rig;
    const Rig second = read_calibration(folder / b).rig;
    ASSERT_TRUE(first.world_from_imu && second.world_from_imu) << a << " " << b;
    const Eigen::Isometry3d between = first.world_from_imu->inverse() * *second.world_from_imu;
    EXPECT_LT(between.translation().norm(), 0.01) << a << " " << b;
    EXPECT_LT(Eigen::AngleAxisd(between.linear()).angle(), 0.02) << a << " " << b;
    EXPECT_NEAR(baseline(first.views[0], first.views[1]),
                baseline(second.views[0], second.views[1]), 1e-3);
  };
  expect_agreement("tumvi_official_kalibr/camchain-imucam-imucalib.yaml",
                   "basalt/tumvi_512_ds_calib.json");
  expect_agreement("open_vins/tum_vi_kalibr_imucam_chain.yaml", "basalt/tumvi_512_eucm_calib.json");
  expect_agreement("open_vins/euroc_mav_kalibr_imucam_chain.yaml", "basalt/euroc_ds_calib.json");
}

}  // namespace
}  // namespace widestereo
