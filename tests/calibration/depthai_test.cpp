// SPDX-License-Identifier: MIT
// A DepthAI device with numbers that say where everything must be.
#include <gmock/gmock.h>

#include <string>

#include "damaged_texts.h"
#include "error_of.h"
#include "replaced.h"
#include "temporary_folder.h"
#include "widestereo/calibration.h"

namespace widestereo {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;

std::string link(const std::string& socket, const std::string& rotation, const std::string& xyz) {
  return R"({"rotationMatrix": )" + rotation +
         R"(, "specTranslation": {"x": 9, "y": 9, "z": 9}, "toCameraSocket": )" + socket +
         R"(, "translation": )" + xyz + "}";
}

const std::string straight = "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
const std::string nowhere =
    R"({"rotationMatrix": [], "specTranslation": {"x": 0, "y": 0, "z": 0}, "toCameraSocket": -1,
        "translation": {"x": 0, "y": 0, "z": 0}})";

std::string camera(const std::string& type, const std::string& coefficients,
                   const std::string& width, const std::string& extrinsics) {
  return R"({"cameraType": )" + type + R"(, "distortionCoeff": [)" + coefficients +
         R"(], "extrinsics": )" + extrinsics + R"(, "height": 800,
  "intrinsicMatrix": [[570.5, 0.0, 640.25], [0.0, 571.5, 400.75], [0.0, 0.0, 1.0]],
  "lensPosition": 0, "specHfovDeg": 127, "width": )" +
         width + "}";
}

/// A colour camera between two fisheyes 7.5 cm apart, of which the right one is linked to the left
/// one, and the left one, turned half round the axis, to the colour camera; socket D is empty.
std::string device() {
  const std::string rational = "0.1, 0.2, 0.001, 0.002, 0.3, 0.4, 0.5, 0.6, 0, 0, 0, 0, 0, 0";
  const std::string fisheye = "0.01, 0.02, 0.03, 0.04, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0";
  return R"({"batchName": "", "boardName": "OAK-D W", "cameraData": [[0, )" +
         camera("0", rational, "1280", nowhere) + "],\n[1, " +
         camera("1", fisheye, "1280",
                link("0", "[[-1, 0, 0], [0, -1, 0], [0, 0, 1]]",
                     R"({"x": -3.75, "y": 0.5, "z": 0})")) +
         "],\n[2, " +
         camera("1", fisheye, "1280", link("1", straight, R"({"x": -7.5, "y": 0, "z": 0.25})")) +
         "],\n[3, " + camera("0", "", "0", nowhere) +
         "]],\n\"imuExtrinsics\": " + link("1", straight, R"({"x": 1, "y": 2, "z": 3})") +
         R"(, "version": 7})";
}

class DepthAi : public ::testing::Test {
 protected:
  std::string error(const std::string& text) {
    return test::error_of([&] { read_calibration(folder_.write("calib.json", text)); });
  }
  test::TemporaryFolder folder_;
};

TEST_F(DepthAi, ReadsAllCamerasOfADevice) {
  const Calibration calibration = read_calibration(folder_.write("calib.json", device()));
  EXPECT_EQ(calibration.format, CalibrationFormat::depthai);
  const Rig& rig = calibration.rig;
  ASSERT_EQ(rig.views.size(), 3u);
  EXPECT_EQ(rig.views[2].name, "CAM_C");
  const Camera& colour = rig.views[0].camera;
  EXPECT_EQ(colour.model, CameraModel::pinhole_rational);
  EXPECT_EQ(colour.p2, 0.002);
  EXPECT_EQ(colour.k3, 0.3);
  EXPECT_EQ(colour.k6, 0.6);
  const Camera& left = rig.views[1].camera;
  EXPECT_EQ(left.model, CameraModel::kannala_brandt);
  EXPECT_EQ(left.k4, 0.04);
  EXPECT_EQ(left.fx, 570.5);
  EXPECT_EQ(left.fy, 571.5);
  EXPECT_EQ(left.cx, 640.25);
  EXPECT_EQ(left.cy, 400.75);
  EXPECT_EQ(left.width, 1280);
  EXPECT_EQ(left.height, 800);
  // Metres; the turned camera's own x points to the left.
  const Eigen::Isometry3d& of_left = rig.views[1].world_from_camera;
  EXPECT_LT((of_left.translation() - Vector3d(-0.0375, 0.005, 0)).norm(), 1e-12);
  EXPECT_LT((of_left.linear().col(0) + Vector3d::UnitX()).norm(), 1e-12);
  const Eigen::Isometry3d& of_right = rig.views[2].world_from_camera;
  EXPECT_LT((of_right.translation() - Vector3d(0.0375, 0.005, 0.0025)).norm(), 1e-12);
  ASSERT_TRUE(rig.world_from_imu.has_value());
  EXPECT_LT((rig.world_from_imu->translation() - Vector3d(-0.0475, -0.015, 0.03)).norm(), 1e-12);
}

TEST_F(DepthAi, LinksAreFollowedBothWays) {
  // The first camera links to the second, which is the end.
  std::string text =
      R"({"cameraData": [[1, )" +
      camera("1", "0, 0, 0, 0", "1280", link("2", straight, R"({"x": -7.5, "y": 0, "z": 0})")) +
      "], [2, " + camera("1", "0, 0, 0, 0", "1280", nowhere) + "]]}";
  const Rig rig = read_calibration(folder_.write("calib.json", text)).rig;
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_LT((rig.views[1].world_from_camera.translation() - Vector3d(0.075, 0, 0)).norm(), 1e-12);
  EXPECT_FALSE(rig.world_from_imu.has_value());
}

TEST_F(DepthAi, LengthsMayHaveAUnit) {
  for (const auto& [unit, metres] : {std::pair("0", 1.0), {"1", 0.01}, {"2", 0.001}}) {
    const std::string text =
        R"({"cameraData": [[1, )" +
        camera("1", "0, 0, 0, 0", "1280",
               link("2", straight,
                    R"({"x": -7.5, "y": 0, "z": 0}, "lengthUnit": )" + std::string(unit))) +
        "], [2, " + camera("1", "0, 0, 0, 0", "1280", nowhere) + "]]}";
    const Rig rig = read_calibration(folder_.write("calib.json", text)).rig;
    EXPECT_NEAR(rig.views[1].world_from_camera.translation().x(), 7.5 * metres, 1e-12);
    EXPECT_THAT(error(test::replaced(text, "Unit\": " + std::string(unit), "Unit\": 5")),
                HasSubstr("The lengthUnit is 5"));
  }
}

TEST_F(DepthAi, WhatIsWrongIsOneSentence) {
  const std::string good = device();
  EXPECT_EQ(error(good), "");
  const auto replaced = [&good](const std::string& what, const std::string& with) {
    return std::string(good).replace(good.find(what), what.size(), with);
  };
  EXPECT_THAT(error(replaced("\"toCameraSocket\": 0", "\"toCameraSocket\": 7")),
              HasSubstr("CAM_B: No toCameraSocket links it to CAM_A"));
  EXPECT_THAT(error(replaced("\"toCameraSocket\": 0", "\"toCameraSocket\": 1e300")),
              HasSubstr("CAM_B: No toCameraSocket"));
  EXPECT_THAT(error(replaced("[[-1, 0, 0]", "[[-2, 0, 0]")), HasSubstr("CAM_B: extrinsics: rot"));
  EXPECT_THAT(error(replaced("\"cameraType\": 1", "\"cameraType\": 2")), HasSubstr("cameraType"));
  EXPECT_THAT(error(replaced("0, 0, 0, 0, 0, 0]", "0, 0, 0, 0, 0.1, 0]")),
              HasSubstr("CALIB_TILTED_MODEL"));
  EXPECT_THAT(error(replaced("0.03, 0.04, 0,", "0.03, 0.04, 0.5,")), HasSubstr("distortionCoeff"));
  EXPECT_THAT(error(replaced("[[570.5, 0.0, 640.25]", "[[570.5, 0.0]")), HasSubstr("3x3 matrix"));
  EXPECT_THAT(error(replaced("[[570.5, 0.0, 640.25], [0.0, 571.5, 400.75], [0.0, 0.0, 1.0]]",
                             "[[570.5, 0.0, 0.0], [0.0, 571.5, 0.0], [640.25, 400.75, 1.0]]")),
              HasSubstr("CAM_A: The intrinsicMatrix is transposed"));
  EXPECT_THAT(error(replaced("[1, {", "[0, {")), HasSubstr("the socket of CAM_A twice"));
  EXPECT_THAT(error(replaced("[1, {", "[99, {")), HasSubstr("pairs of a socket"));
  EXPECT_THAT(error(replaced("\"x\": -3.75", "\"u\": -3.75")), HasSubstr("The key x is missing"));
  EXPECT_THAT(error(replaced("\"extrinsics\"", "\"others\"")),
              HasSubstr("CAM_A: extrinsics: It must hold keys"));
  EXPECT_THAT(error(replaced("\"translation\": {\"x\": -3.75", "\"moved\": {\"x\": -3.75")),
              HasSubstr("CAM_B: extrinsics: translation: It must hold keys"));
  EXPECT_GT(test::times_refused(good, [this](const std::string& text) { return error(text); }),
            100);
}

}  // namespace
}  // namespace widestereo
