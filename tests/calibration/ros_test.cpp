// SPDX-License-Identifier: MIT
// camera_info of a pair that OpenCV rectified, as ROS's calibration does: it must come out as it
// went in.
#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <string>

#include "damaged_texts.h"
#include "error_of.h"
#include "replaced.h"
#include "temporary_folder.h"
#include "widestereo/calibration.h"

namespace widestereo {
namespace {

using test::replaced;
using test::TemporaryFolder;
using ::testing::HasSubstr;

const cv::Matx33d left_matrix(285.5, 0, 420, 0, 286.25, 398, 0, 0, 1);
const cv::Matx33d right_matrix(284, 0, 424, 0, 284.5, 402, 0, 0, 1);
const cv::Matx41d lens(-0.005, 0.04, -0.03, 0.006);
const cv::Vec3d turned(0.02, -0.03, 0.01);
const cv::Vec3d right_from_left(-0.064, 0.001, 0.0005);

template <int rows, int columns>
std::string numbers(const cv::Matx<double, rows, columns>& matrix) {
  std::string text;
  for (int i = 0; i < rows * columns; ++i) {
    text += (i > 0 ? ", " : "") + cv::format("%.17g", matrix.val[i]);
  }
  return "[" + text + "]";
}

template <int rows, int columns>
std::string matrix(const std::string& key, const cv::Matx<double, rows, columns>& values) {
  return key + ":\n  rows: " + std::to_string(rows) + "\n  cols: " + std::to_string(columns) +
         "\n  data: " + numbers(values) + "\n";
}

struct Rectified {
  cv::Matx33d rotation[2];
  cv::Matx34d projection[2];
};

Rectified rectified() {
  cv::Matx33d rotation;
  cv::Rodrigues(turned, rotation);
  Rectified result;
  cv::Matx44d unused;
  cv::fisheye::stereoRectify(left_matrix, lens, right_matrix, lens, cv::Size(848, 800), rotation,
                             right_from_left, result.rotation[0], result.rotation[1],
                             result.projection[0], result.projection[1], unused, 0);
  return result;
}

/// As camera_calibration writes it.
std::string file_of(int side) {
  const Rectified r = rectified();
  return "image_width: 848\nimage_height: 800\ncamera_name: t265/fisheye\n" +
         matrix("camera_matrix", side == 0 ? left_matrix : right_matrix) +
         "distortion_model: equidistant\n" + matrix("distortion_coefficients", lens.t()) +
         matrix("rectification_matrix", r.rotation[side]) +
         matrix("projection_matrix", r.projection[side]);
}

/// As rostopic and ros2 print the message; the former in capitals.
std::string message_of(int side, bool capitals,
                       const std::string& coefficients = numbers(lens.t())) {
  const Rectified r = rectified();
  const auto key = [&](char letter) {
    return std::string(1, capitals ? static_cast<char>(letter - 'a' + 'A') : letter) + ": ";
  };
  return "header:\n  stamp:\n    sec: 1\n    nanosec: 2\n  frame_id: fisheye\nheight: 800\n"
         "width: 848\ndistortion_model: equidistant\n" +
         key('d') + coefficients + "\n" + key('k') +
         numbers(side == 0 ? left_matrix : right_matrix) + "\n" + key('r') +
         numbers(r.rotation[side]) + "\n" + key('p') + numbers(r.projection[side]) +
         "\nbinning_x: 0\nbinning_y: 0\nroi:\n  x_offset: 0\n  y_offset: 0\n  height: 0\n"
         "  width: 0\n  do_rectify: false\n---\n";
}

void expect_pair(const std::filesystem::path& folder) {
  const Calibration calibration = read_calibration(folder);
  EXPECT_EQ(calibration.format, CalibrationFormat::ros);
  EXPECT_EQ(calibration.files.size(), 2u);
  const Rig& rig = calibration.rig;
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_EQ(rig.views[0].name, "cam0");
  const Camera& left = rig.views[0].camera;
  EXPECT_EQ(left.model, CameraModel::kannala_brandt);
  EXPECT_EQ(left.fx, 285.5);
  EXPECT_EQ(left.fy, 286.25);
  EXPECT_EQ(left.k3, -0.03);
  EXPECT_EQ(left.width, 848);
  EXPECT_EQ(left.height, 800);
  EXPECT_EQ(rig.views[1].camera.cx, 424);
  EXPECT_TRUE(rig.views[0].world_from_camera.isApprox(Eigen::Isometry3d::Identity(), 1e-12));
  cv::Matx33d rotation;
  cv::Rodrigues(turned, rotation);
  Eigen::Matrix3d expected;
  cv::cv2eigen(rotation, expected);
  const Eigen::Isometry3d to_right = rig.views[1].world_from_camera.inverse();
  EXPECT_LT((to_right.linear() - expected).norm(), 1e-9);
  EXPECT_LT((to_right.translation() - Eigen::Vector3d(-0.064, 0.001, 0.0005)).norm(), 1e-9);
}

TEST(Ros, ReadsBothCamerasOfAFolder) {
  const TemporaryFolder folder;
  folder.write("right.yaml", file_of(1));
  folder.write("left.yaml", file_of(0));
  folder.write("node.yaml", "rate: 30\n");
  folder.write("readme.txt", "projection_matrix distortion_model");
  expect_pair(folder.path());
}

TEST(Ros, ReadsMessages) {
  for (const bool capitals : {true, false}) {
    const TemporaryFolder folder;
    for (int side = 0; side < 2; ++side) {
      folder.write("cam" + std::to_string(side) + ".yml", message_of(side, capitals));
    }
    expect_pair(folder.path());
  }
}

TEST(Ros, CamerasMayStandAboveEachOther) {
  const TemporaryFolder folder;
  for (int i = 0; i < 2; ++i) {
    const cv::Matx34d projection(280, 0, 420, 0, 0, 280, 398, -28 * i, 0, 0, 1, 0);
    folder.write("cam" + std::to_string(i) + ".yaml",
                 "image_width: 848\nimage_height: 800\ndistortion_model: equidistant\n" +
                     matrix("camera_matrix", left_matrix) +
                     matrix("distortion_coefficients", lens.t()) +
                     matrix("rectification_matrix", cv::Matx33d::eye()) +
                     matrix("projection_matrix", projection));
  }
  const Rig rig = read_calibration(folder.path()).rig;
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_LT((rig.views[1].world_from_camera.translation() - Eigen::Vector3d(0, 0.1, 0)).norm(),
            1e-12);
}

TEST(Ros, ReadsOneCameraOfEachModel) {
  const TemporaryFolder folder;
  const auto camera = [&](const std::string& model, const std::string& coefficients) {
    const std::string text =
        replaced(message_of(0, true, "[" + coefficients + "]"), "equidistant", model);
    return read_calibration(folder.write("one.yaml", text)).rig.views.at(0).camera;
  };
  EXPECT_EQ(camera("plumb_bob", "-0.1, 0.2, 0, 0, 0.3").k3, 0.3);
  EXPECT_EQ(camera("rational_polynomial", "-0.1, 0.2, 0, 0, 0.3, 1, 2, 3").k6, 3);
  EXPECT_EQ(camera("plumb_bob", "").model, CameraModel::pinhole_radtan);
  // As RealSense's driver fills up five.
  EXPECT_EQ(camera("equidistant", "-0.1, 0.2, 0, 0.4, 0").k4, 0.4);
}

TEST(Ros, WhatIsWrongIsOneSentence) {
  const TemporaryFolder folder;
  const auto error_of_text = [&](const std::string& text) {
    folder.write("right.yaml", text);
    return test::error_of([&] { read_calibration(folder.path()); });
  };
  folder.write("left.yaml", file_of(0));
  EXPECT_EQ(error_of_text(file_of(1)), "");
  EXPECT_THAT(error_of_text(file_of(0)),
              HasSubstr("right.yaml: It has no baseline to cam0 in its projection matrix"));
  EXPECT_THAT(error_of_text(replaced(file_of(1), "equidistant", "fov")),
              HasSubstr("The distortion_model \"fov\" is unknown"));
  EXPECT_THAT(error_of_text(replaced(file_of(1), "camera_matrix", "x")),
              HasSubstr("right.yaml: cam1: The key camera_matrix must list 9 numbers"));
  EXPECT_THAT(error_of_text(replaced(file_of(1),
                                     "rectification_matrix:\n  rows: 3\n  cols: 3\n"
                                     "  data: [",
                                     "rectification_matrix:\n  data: [2")),
              HasSubstr("not a rigid motion"));
  EXPECT_THAT(error_of_text(replaced(message_of(1, true), "binning_x: 0", "binning_x: 2")),
              HasSubstr("Its images are binned (binning_x)"));
  EXPECT_THAT(error_of_text(replaced(message_of(1, true), "binning_y: 0", "binning_y: 2")),
              HasSubstr("Its images are binned (binning_y)"));
  EXPECT_THAT(error_of_text(replaced(message_of(1, false), "y_offset: 0", "y_offset: 16")),
              HasSubstr("a part of what was calibrated (roi: y_offset)"));
  const auto with_size = [](const char* height) {
    return replaced(message_of(1, false), "height: 0\n  width: 0",
                    std::string("height: ") + height + "\n  width: 848");
  };
  EXPECT_EQ(error_of_text(with_size("800")), "") << "all of the image";
  EXPECT_THAT(error_of_text(with_size("400")), HasSubstr("was calibrated (roi: height)"));
  EXPECT_GT(test::times_refused(file_of(1), error_of_text), 30);

  const TemporaryFolder other;
  std::filesystem::create_directories(other / "empty");
  EXPECT_THAT(test::error_of([&] { read_calibration(other / "empty"); }),
              HasSubstr("ROS's camera_info files"));
}

}  // namespace
}  // namespace widestereo
