// SPDX-License-Identifier: MIT
// sensor.yaml of a rig whose geometry is simple enough to say where everything must be.
#include <gmock/gmock.h>

#include <filesystem>
#include <string>

#include "damaged_texts.h"
#include "error_of.h"
#include "temporary_folder.h"
#include "widestereo/calibration.h"

namespace widestereo {
namespace {

using test::TemporaryFolder;
using ::testing::HasSubstr;

/// A camera that looks along the body's x, with the body's z up, at (0.1, y, 0.3) of the body.
std::string sensor(const std::string& y, const std::string& lens) {
  return "# General sensor definitions.\n"
         "sensor_type: camera\n"
         "comment: VI-Sensor cam0 (MT9M034)\n\n"
         "# Sensor extrinsics wrt. the body-frame.\n"
         "T_BS:\n"
         "  cols: 4\n"
         "  rows: 4\n"
         "  data: [0.0, 0.0, 1.0, 0.1,\n"
         "        -1.0, 0.0, 0.0, " +
         y +
         ",\n"
         "         0.0, -1.0, 0.0, 0.3,\n"
         "         0.0, 0.0, 0.0, 1.0]\n\n"
         "rate_hz: 20\n"
         "resolution: [752, 480]\n"
         "camera_model: pinhole\n"
         "intrinsics: [458.5, 457.25, 367.0, 248.0] #fu, fv, cu, cv\n" +
         lens;
}
const std::string radial_tangential =
    "distortion_model: radial-tangential\n"
    "distortion_coefficients: [-0.28, 0.07, 0.0002, 0.00002]\n";
const std::string equidistant =
    "distortion_model: equidistant\n"
    "distortion_coefficients: [0.0034, 0.0007, -0.002, 0.0002]\n";

/// The data set's folder, with cameras cam<first> and the next.
void write_set(const TemporaryFolder& folder, const std::string& base, int first = 0) {
  for (int i = 0; i < 2; ++i) {
    const std::string camera = base + "cam" + std::to_string(first + i);
    std::filesystem::create_directories(folder / camera);
    folder.write(camera + "/sensor.yaml", sensor(i == 0 ? "0.2" : "0.09", equidistant));
  }
}

void expect_set(const Calibration& calibration) {
  EXPECT_EQ(calibration.format, CalibrationFormat::euroc);
  const Rig& rig = calibration.rig;
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_EQ(rig.views[1].name, "cam1");
  for (const View& view : rig.views) {
    EXPECT_EQ(view.camera.model, CameraModel::kannala_brandt);
    EXPECT_EQ(view.camera.width, 752);
    EXPECT_EQ(view.camera.height, 480);
    EXPECT_EQ(view.camera.fy, 457.25);
    EXPECT_EQ(view.camera.cx, 367);
    EXPECT_EQ(view.camera.k3, -0.002);
    EXPECT_LT((view.world_from_camera.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  }
  EXPECT_LT(rig.views[0].world_from_camera.translation().norm(), 1e-12);
  const Eigen::Vector3d right(0.11, 0, 0);
  EXPECT_LT((rig.views[1].world_from_camera.translation() - right).norm(), 1e-12);
  ASSERT_TRUE(rig.world_from_imu.has_value());
  // The body's origin lies 0.2 to the right of camera 0, 0.3 below it and 0.1 behind it.
  EXPECT_LT((rig.world_from_imu->translation() - Eigen::Vector3d(0.2, 0.3, -0.1)).norm(), 1e-12);
}

TEST(EuRoC, ReadsTheCamerasOfADataSet) {
  const TemporaryFolder folder;
  write_set(folder, "set/mav0/");
  expect_set(read_calibration(folder / "set"));
  expect_set(read_calibration(folder / "set/mav0"));
}

TEST(EuRoC, ReadsOneCamera) {
  const TemporaryFolder folder;
  const Calibration one =
      read_calibration(folder.write("sensor.yaml", sensor("0", radial_tangential)));
  EXPECT_EQ(one.format, CalibrationFormat::euroc);
  ASSERT_EQ(one.rig.views.size(), 1u);
  const Camera& camera = one.rig.views[0].camera;
  EXPECT_EQ(camera.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(camera.k1, -0.28);
  EXPECT_EQ(camera.p2, 0.00002);
}

TEST(EuRoC, WhatIsWrongIsOneSentence) {
  const TemporaryFolder folder;
  const auto error = [&](const std::filesystem::path& path) {
    return test::error_of([&] { read_calibration(path); });
  };
  const auto error_of_text = [&](const std::string& text) {
    return error(folder.write("one/cam0/sensor.yaml", text).parent_path().parent_path());
  };
  std::filesystem::create_directories(folder / "one/cam0");
  const std::string good = sensor("0", radial_tangential);
  EXPECT_EQ(error_of_text(good), "");
  const auto without = [&](const std::string& key) {
    std::string text = good;
    text.at(text.find(key)) = 'x';
    return text;
  };
  EXPECT_THAT(error_of_text(without("T_BS")), HasSubstr("cam0/sensor.yaml: cam0: The key T_BS"));
  EXPECT_THAT(error_of_text(without("data: [")), HasSubstr("The key T_BS"));
  EXPECT_THAT(error_of_text(without("camera_model")), HasSubstr("The key camera_model is missing"));
  EXPECT_THAT(error_of_text(without("resolution")), HasSubstr("The key resolution"));
  EXPECT_THAT(error_of_text(without("distortion_coefficients")),
              HasSubstr("The key distortion_coeff"));
  EXPECT_THAT(error_of_text(good.substr(0, good.find("0.0, 0.0, 0.0, 1.0"))),
              HasSubstr("not valid YAML"));
  EXPECT_THAT(error_of_text(""), HasSubstr("cam0/sensor.yaml"));

  EXPECT_GT(test::times_refused(good, error_of_text), 100);

  write_set(folder, "late/", 1);
  EXPECT_THAT(error(folder / "late"), HasSubstr("number the cameras from cam0"));
  std::filesystem::create_directories(folder / "none/cam0");
  EXPECT_THAT(error(folder / "none"), HasSubstr("a folder with cam0/sensor.yaml"));
  EXPECT_THAT(error(folder / "none"), HasSubstr("a COLMAP model, the folder that holds cameras"));
}

}  // namespace
}  // namespace widestereo
