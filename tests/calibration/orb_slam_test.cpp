// SPDX-License-Identifier: MIT
// Settings of ORB-SLAM3: a rig with numbers that say where everything must be.
#include <gmock/gmock.h>

#include <string>

#include "damaged_texts.h"
#include "error_of.h"
#include "temporary_folder.h"
#include "widestereo/calibration.h"

namespace widestereo {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

std::string camera(const std::string& name, const std::string& fx) {
  return name + ".fx: " + fx + "\n" + name + ".fy: 285.25\n" + name + ".cx: 420.5\n" + name +
         ".cy: 400.75\n\n" + name + ".k1: -0.005\n" + name + ".k2: 0.04\n";
}

std::string fisheye(const std::string& name, const std::string& fx) {
  return camera(name, fx) + name + ".k3: -0.03\n" + name + ".k4: 0.006\n";
}

std::string matrix(const std::string& name, const std::string& rows, const std::string& data) {
  return name + ": !!opencv-matrix\n  rows: " + rows + "\n  cols: 4\n  dt: f\n  data: [" + data +
         "]\n";
}

const std::string size = "Camera.width: 848\nCamera.height: 800\nCamera.fps: 30\n";
/// The left camera looks along the body's x, the right one 6.4 cm beside it is turned half round.
const std::string imu =
    matrix("IMU.T_b_c1", "4", "0, 0, 1, 0.1,\n  -1, 0, 0, 0.2,\n  0, -1, 0, 0.3,\n  0, 0, 0, 1");
const std::string stereo = matrix("Stereo.T_c1_c2", "4",
                                  "-1, 0, 0, 0.064,\n  0, -1, 0, 0.002,\n  0, 0, 1, 0,\n"
                                  "  0.0, 0.0, 0.0, 1.0");
/// Without a space, as in some of the project's files.
const std::string viewer = "Viewer.PointSize:2\nViewer.ViewpointF: 500.0\n";

std::string settings(const std::string& type, const std::string& cameras) {
  return "%YAML:1.0\n\n#-----\n# Camera Parameters. Adjust them!\n#-----\nFile.version: \"1.0\"\n"
         "Camera.type: \"" +
         type + "\"\n" + cameras + size + viewer;
}

class OrbSlam : public ::testing::Test {
 protected:
  Rig read(const std::string& text) {
    const Calibration calibration = read_calibration(folder_.write("settings.yaml", text));
    EXPECT_EQ(calibration.format, CalibrationFormat::orb_slam);
    return calibration.rig;
  }
  std::string error(const std::string& text) {
    return test::error_of([&] { read_calibration(folder_.write("settings.yaml", text)); });
  }

  test::TemporaryFolder folder_;
};

TEST_F(OrbSlam, ReadsFisheyeRigs) {
  const std::string good =
      settings("KannalaBrandt8", fisheye("Camera1", "284.5") + fisheye("Camera2", "286.5") +
                                     stereo + "Camera1.overlappingBegin: 0\n" + imu);
  const Rig rig = read(good);
  ASSERT_EQ(rig.views.size(), 2u);
  const Camera& right = rig.views[1].camera;
  EXPECT_EQ(right.model, CameraModel::kannala_brandt);
  EXPECT_EQ(right.width, 848);
  EXPECT_EQ(right.height, 800);
  EXPECT_EQ(right.fx, 286.5);
  EXPECT_EQ(right.fy, 285.25);
  EXPECT_EQ(right.cx, 420.5);
  EXPECT_EQ(right.cy, 400.75);
  EXPECT_EQ(right.k1, -0.005);
  EXPECT_EQ(right.k2, 0.04);
  EXPECT_EQ(right.k3, -0.03);
  EXPECT_EQ(right.k4, 0.006);
  EXPECT_EQ(rig.views[0].camera.fx, 284.5);
  const Eigen::Isometry3d& pose = rig.views[1].world_from_camera;
  EXPECT_LT((pose.translation() - Vector3d(0.064, 0.002, 0)).norm(), 1e-12);
  EXPECT_LT((pose.linear().col(0) + Vector3d::UnitX()).norm(), 1e-12);
  ASSERT_TRUE(rig.world_from_imu.has_value());
  EXPECT_LT((rig.world_from_imu->translation() - Vector3d(0.2, 0.3, -0.1)).norm(), 1e-12);

  const auto replaced = [&good](const std::string& what, const std::string& with) {
    return std::string(good).replace(good.find(what), what.size(), with);
  };
  EXPECT_THAT(error(replaced("KannalaBrandt8", "Fisheye")), HasSubstr("Camera.type \"Fisheye\""));
  EXPECT_THAT(error(replaced("Camera2.k4", "Camera2.k5")), HasSubstr("Camera2.k4 is missing"));
  EXPECT_THAT(error(replaced("Stereo.T_c1_c2", "Stereo.T")), HasSubstr("Stereo.T_c1_c2"));
  EXPECT_THAT(error(replaced("Camera.width", "Camera.w")), HasSubstr("Camera.width"));
  EXPECT_THAT(error(replaced("[-1, 0, 0, 0.064", "[-2, 0, 0, 0.064")), HasSubstr("rigid motion"));
  EXPECT_THAT(error(good + "LEFT.K: 1\n"), HasSubstr("LEFT.K"));
  EXPECT_GT(test::times_refused(good, [this](const std::string& text) { return error(text); }),
            100);
}

TEST_F(OrbSlam, ReadsItsFirstVersion) {
  const Rig rig =
      read(settings("KannalaBrandt8",
                    fisheye("Camera", "284.5") + fisheye("Camera2", "286.5") +
                        matrix("Tlr", "3", "1, 0, 0, 0.064, 0, 1, 0, 0, 0, 0, 1, 0") +
                        matrix("Tbc", "4", "1, 0, 0, 0.5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1")));
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_EQ(rig.views[0].camera.fx, 284.5);
  EXPECT_NEAR(rig.views[1].world_from_camera.translation().x(), 0.064, 1e-12);
  ASSERT_TRUE(rig.world_from_imu.has_value());
  EXPECT_NEAR(rig.world_from_imu->translation().x(), -0.5, 1e-12);
}

TEST_F(OrbSlam, ReadsPinholes) {
  const Rig one = read(settings("PinHole", camera("Camera1", "458.5") + "Camera1.p1: 0.001\n"));
  ASSERT_EQ(one.views.size(), 1u);
  EXPECT_FALSE(one.world_from_imu.has_value());
  EXPECT_EQ(one.views[0].camera.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(one.views[0].camera.k2, 0.04);
  EXPECT_EQ(one.views[0].camera.p1, 0.001);
  EXPECT_EQ(one.views[0].camera.p2, 0);
  const Rig two = read(settings("Rectified", camera("Camera1", "458.5") + "Stereo.b: 0.11\n"));
  ASSERT_EQ(two.views.size(), 2u);
  EXPECT_EQ(two.views[1].camera.model, CameraModel::pinhole);
  EXPECT_EQ(two.views[1].camera.k1, 0);
  EXPECT_EQ(two.views[1].world_from_camera.translation(), Vector3d(0.11, 0, 0));
}

}  // namespace
}  // namespace widestereo
