// SPDX-License-Identifier: MIT
// Cameras of OCam and WoodScape against their authors' formulas, pixel by pixel, and rigs of such
// cameras whose geometry is simple enough to say where everything must be.
#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "damaged_texts.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "replaced.h"
#include "temporary_folder.h"
#include "widestereo/calibration.h"

namespace widestereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::replaced;
using test::TemporaryFolder;
using ::testing::HasSubstr;

constexpr double degree = radians_per_degree;

/// Of OmniMVS's lens of 220 degrees, with a pixel's row before its column as in all of OCamCalib.
constexpr std::array<double, 5> polynomial = {-392.22, 0, 1.2707685e-3, -1.7456027e-6,
                                              2.2576557e-9};
constexpr double row = 756.215, column = 811.661, c = 1.00028, d = -0.032979, e = 0.0327437;
constexpr int width = 1600, height = 1532;

/// The toolbox's cam2world(): its x along rows, y along columns, and z away from the scene.
Vector3d cam2world(double at_row, double at_column) {
  const double determinant = c - d * e;
  const double x = ((at_row - row) - d * (at_column - column)) / determinant;
  const double y = (-e * (at_row - row) + c * (at_column - column)) / determinant;
  const double r = std::hypot(x, y);
  double z = 0;
  for (int i = 4; i >= 0; --i) z = z * r + polynomial[static_cast<std::size_t>(i)];
  return Vector3d(x, y, z).normalized();
}

/// In our frame: x right, y down, z forward.
Vector3d ray_of(double u, double v) {
  const Vector3d toolbox = cam2world(v, u);
  return {toolbox.y(), toolbox.x(), -toolbox.z()};
}

/// How many pixels of a grid within `max_theta` have rays that the camera projects to them.
int expect_agreement(const Camera& camera, double max_theta) {
  int compared = 0;
  for (double v = 0; v < height; v += 31) {
    for (double u = 0; u < width; u += 31) {
      const Vector3d ray = ray_of(u, v);
      const double theta = std::atan2(ray.head<2>().norm(), ray.z());
      Vector2d pixel;
      const bool seen = project(camera, ray, pixel);
      if (std::abs(theta - max_theta) > 1e-3) {
        EXPECT_EQ(seen, theta < max_theta) << theta / degree;
      }
      if (!seen) continue;
      EXPECT_LT((pixel - Vector2d(u, v)).norm(), 0.02) << pixel.transpose();
      ++compared;
    }
  }
  return compared;
}

const std::string ocamcalib =
    "#polynomial coefficients for the DIRECT mapping function (ocam_model.ss in MATLAB). These are "
    "used by cam2world\n\n"
    "5 -392.22 0.000000e+00 1.2707685e-03 -1.7456027e-06 2.2576557e-09 \n\n"
    "#polynomial coefficients for the inverse mapping function (ocam_model.invpol in MATLAB). "
    "These are used by world2cam\n\n"
    "4 611.433 386.965 -15.0504 -65.1466 \n\n"
    "#center: \"row\" and \"column\", starting from 0 (C convention)\n\n756.215 811.661\n\n"
    "#affine parameters \"c\", \"d\", \"e\"\n\n1.00028 -0.032979 0.0327437\n\n"
    "#image size: \"height\" and \"width\"\n\n1532 1600\n\n";

class OCam : public ::testing::Test {
 protected:
  Calibration read(const std::string& text, CalibrationFormat format) {
    const Calibration calibration = read_calibration(folder_.write("calibration", text));
    EXPECT_EQ(calibration.format, format);
    return calibration;
  }
  Camera camera_of(const std::string& text, CalibrationFormat format) {
    const Rig rig = read(text, format).rig;
    EXPECT_EQ(rig.views.size(), 1u);
    EXPECT_FALSE(rig.world_from_imu.has_value());
    const Camera& camera = rig.views[0].camera;
    EXPECT_EQ(camera.model, CameraModel::polynomial_fisheye);
    return camera;
  }
  std::string error(const std::string& text) {
    return test::error_of([&] { read_calibration(folder_.write("calibration", text)); });
  }

  TemporaryFolder folder_;
};

TEST_F(OCam, ReadsTheToolboxsFile) {
  const Camera camera = camera_of(ocamcalib, CalibrationFormat::ocam);
  EXPECT_EQ(camera.width, width);
  EXPECT_EQ(camera.height, height);
  EXPECT_EQ(camera.max_theta, std::numbers::pi);
  EXPECT_GT(expect_agreement(camera, std::numbers::pi), 2500);
}

TEST_F(OCam, EndsWhereTheAngleNoLongerGrows) {
  // z of this lens is least at a radius of 612.5 px and grows again; its angle falls from 732 px
  // on.
  const Camera camera = camera_of(
      replaced(ocamcalib, "1.2707685e-03 -1.7456027e-06 2.2576557e-09", "9.8e-04 0 -1.306122e-09"),
      CalibrationFormat::ocam);
  const auto z = [](double r) { return 392.22 - 9.8e-4 * r * r + 1.306122e-9 * std::pow(r, 4); };
  double largest = 0;
  for (double r = 0; r < 1100; r += 0.1) largest = std::max(largest, std::atan2(r, z(r)));
  EXPECT_LT(camera.max_theta, largest + 1e-9);
  EXPECT_GT(camera.max_theta, largest - 5 * degree);
}

TEST_F(OCam, WhatIsWrongWithAFileIsOneSentence) {
  EXPECT_EQ(error(ocamcalib), "");
  EXPECT_THAT(error(replaced(ocamcalib, "1532 1600", "1532")), HasSubstr("five lines of numbers"));
  EXPECT_THAT(error(replaced(ocamcalib, "1532 1600", "1532.5 1600")), HasSubstr("image size"));
  EXPECT_THAT(error(replaced(ocamcalib, "5 -392", "6 -392")), HasSubstr("as many coefficients"));
  EXPECT_THAT(error(replaced(ocamcalib, "756.215", "nan")), HasSubstr("\"nan\" is not a finite"));
  EXPECT_THAT(error(replaced(ocamcalib, "756.215", std::string("7\0\x1b", 3))),
              HasSubstr("\"7  \" is not a finite number; correct it."));
  EXPECT_THAT(error(replaced(ocamcalib, "-392.22", "0")), HasSubstr("other than 0"));
  EXPECT_THAT(error(replaced(ocamcalib, "1.00028 -0.03", "-1 -0.03")), HasSubstr("affine"));
  EXPECT_THAT(error(replaced(ocamcalib, "1.2707685e-03", "-1e9")), HasSubstr("no lens"));
  EXPECT_GT(test::times_refused(ocamcalib, [this](const std::string& text) { return error(text); }),
            100);
}

/// Four cameras on a square of 1.2 m that look outwards, as OmniMVS's synthetic rigs, with one
/// lens.
std::string omnimvs() {
  std::string text =
      "# config.yaml\nconfig:\n  omnimvs_sweep_min_depth: 1.65 # minimum depth\n"
      "dataset:\n  img_fmt: \"cam%d/%04d.png\"\n  start: 1\n\ncameras:\n";
  const char* poses[] = {"0, 0, 0, 0, 0, 0.6", "0, 1.570796326794897, 0, 0.6, 0, 0",
                         "0, 3.141592653589793, 0, 0, 0, -0.6",
                         "0, -1.570796326794897, 0, -0.6, 0, 0"};
  for (int i = 0; i < 4; ++i) {
    text += "  - cam_id: " + std::to_string(i + 1) +
            "\n    model: \"ocam\"\n"
            "    poly:\n      [\n        5,\n        -392.22,\n        0.0, 1.2707685e-03,\n"
            "        -1.7456027e-06, 2.2576557e-09,\n      ]\n      # used by cam2world\n"
            "    inv_poly: [4, 611.433, 386.965, -15.0504, -65.1466]\n"
            "    center: [756.215, 811.661]\n    affine: [1.00028, -0.032979, 0.0327437]\n"
            "    image_size: [1532, 1600]\n    invalid_mask: \"mask1.png\"\n    pose: [" +
            std::string(poses[i]) + "]\n    max_fov: 220.0 # degree\n\n";
  }
  return text;
}

TEST_F(OCam, ReadsRigsOfOmniMvs) {
  const Rig rig = read(omnimvs(), CalibrationFormat::omnimvs).rig;
  ASSERT_EQ(rig.views.size(), 4u);
  EXPECT_FALSE(rig.world_from_imu.has_value());
  EXPECT_EQ(rig.views[3].name, "cam3");
  EXPECT_NEAR(rig.views[0].camera.max_theta, 110 * degree, 1e-12);
  EXPECT_GT(expect_agreement(rig.views[2].camera, 110 * degree), 1000);
  // Seen from the first one the second is to the right and behind, and looks to the right.
  const Eigen::Isometry3d& second = rig.views[1].world_from_camera;
  EXPECT_LT((second.translation() - Vector3d(0.6, 0, -0.6)).norm(), 1e-12);
  EXPECT_LT((second.linear().col(2) - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((second.linear().col(1) - Vector3d::UnitY()).norm(), 1e-12);
  const std::string good = omnimvs();
  std::string without_inverse = good;
  const std::string inverse = "    inv_poly: [4, 611.433, 386.965, -15.0504, -65.1466]\n";
  for (std::size_t at = 0; (at = without_inverse.find(inverse)) != std::string::npos;) {
    without_inverse.erase(at, inverse.size());
  }
  EXPECT_EQ(read(without_inverse, CalibrationFormat::omnimvs).rig.views.size(), 4u);
  EXPECT_THAT(error(replaced(good, "\"ocam\"", "\"omni\"")), HasSubstr("cam0: The model \"omni\""));
  EXPECT_THAT(error(replaced(good, "5,\n", "6,\n")), HasSubstr("cam0: The key poly"));
  EXPECT_THAT(error(replaced(good, "pose:", "poses:")), HasSubstr("cam0: The key pose"));
  EXPECT_THAT(error(replaced(good, "cameras:", "cams:")), HasSubstr("list cameras is missing"));
  EXPECT_GT(test::times_refused(good, [this](const std::string& text) { return error(text); }),
            100);
}

/// MultiCol-SLAM counts columns first, some of its files have no space before numbers.
std::string multicol_camera() {
  return "%YAML:1.0\n\n# camera back\nCamera.Iw: 1600\nCamera.Ih: 1532\n\nCamera.nrpol: 5\n"
         "Camera.nrinvpol: 12\nCamera.a0:-392.22\nCamera.a1: 0.0 \nCamera.a2: 1.2707685e-03\n"
         "Camera.a3: -1.7456027e-06\nCamera.a4: 2.2576557e-09\nCamera.pol0: 611.433\n"
         "Camera.c: 0.99972008\nCamera.d: 0.03273453\nCamera.e: -0.03296977\n"
         "Camera.u0: 811.661\nCamera.v0: 756.215\nCamera.mirrorMask: 1\n";
}

TEST_F(OCam, ReadsRigsOfMultiColSlam) {
  // With columns first the matrix is [c d; e 1] of (column, row), here divided by the toolbox's c.
  const Camera camera =
      camera_of(replaced(multicol_camera(), "Camera.a0:-392.22", "Camera.a0:-392.11021"),
                CalibrationFormat::multicol);
  Vector3d ray;
  ASSERT_TRUE(unproject(camera, {column, row}, ray));
  EXPECT_LT((ray - Vector3d::UnitZ()).norm(), 1e-12);
  const double f = 392.11021;
  Eigen::Matrix<double, 2, 3> jacobian;
  Vector2d pixel;
  ASSERT_TRUE(project(camera, Vector3d::UnitZ(), pixel, jacobian));
  Eigen::Matrix2d expected;
  expected << 0.99972008, 0.03273453, -0.03296977, 1;
  EXPECT_LT((jacobian.leftCols<2>() - f * expected).norm(), 2) << jacobian;

  for (int i = 0; i < 2; ++i) {
    folder_.write("InteriorOrientationFisheye" + std::to_string(i) + ".yaml", multicol_camera());
  }
  // The first is turned by 90 degrees about y, whose Cayley parameter is tan(45 degrees).
  const std::string good =
      "%YAML:1.0\n\nCameraSystem.nrCams: 2                    \n"
      "CameraSystem.cam1_1: 0\nCameraSystem.cam1_2: 1   #r2\nCameraSystem.cam1_3: 0\n"
      "CameraSystem.cam1_4: 0.1\nCameraSystem.cam1_5: 0.2\nCameraSystem.cam1_6: 0.3\n"
      "CameraSystem.cam2_1: 0\nCameraSystem.cam2_2: 0\nCameraSystem.cam2_3: 0\n"
      "CameraSystem.cam2_4: 0.6\nCameraSystem.cam2_5: 0.2\nCameraSystem.cam2_6: 0.3\n";
  const Rig rig = read(good, CalibrationFormat::multicol).rig;
  ASSERT_EQ(rig.views.size(), 2u);
  const Eigen::Isometry3d& second = rig.views[1].world_from_camera;
  EXPECT_LT((second.translation() - Vector3d(0, 0, 0.5)).norm(), 1e-12);
  EXPECT_LT((second.linear().col(2) + Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_THAT(error(replaced(good, "nrCams: 2", "nrCams: 3")),
              HasSubstr("InteriorOrientationFisheye2.yaml"));
  EXPECT_THAT(error(replaced(good, "nrCams: 2", "nrCams: 1e9")), HasSubstr("CameraSystem.nrCams"));
  EXPECT_THAT(error(replaced(good, "cam2_6", "cam2_7")), HasSubstr("CameraSystem.cam2_6"));
  EXPECT_GT(test::times_refused(good, [this](const std::string& text) { return error(text); }), 80);
}

TEST_F(OCam, ReadsCamerasOfWoodScape) {
  const std::string good =
      R"({"extrinsic": {"quaternion": [0.594, -0.588, 0.387, -0.389], "translation": [3.7, 0, 0.66]},
          "intrinsic": {"aspect_ratio": 0.99, "cx_offset": 3.942, "cy_offset": -3.093,
                        "height": 966.0, "k1": 339.749, "k2": -31.988, "k3": 48.275, "k4": -7.201,
                        "model": "radial_poly", "poly_order": 4, "width": 1280.0},
          "name": "FV"})";
  const Camera camera = camera_of(good, CalibrationFormat::woodscape);
  for (double t = 0.1; t < 1.7; t += 0.2) {
    const double azimuth = 5 * t;
    const double r = 339.749 * t - 31.988 * t * t + 48.275 * t * t * t - 7.201 * t * t * t * t;
    const Vector2d expected(r * std::cos(azimuth) + 639.5 + 3.942,
                            0.99 * r * std::sin(azimuth) + 482.5 - 3.093);
    Vector2d pixel;
    ASSERT_TRUE(project(
        camera, {std::sin(t) * std::cos(azimuth), std::sin(t) * std::sin(azimuth), std::cos(t)},
        pixel));
    EXPECT_LT((pixel - expected).norm(), 1e-9);
  }
  EXPECT_THAT(error(replaced(good, "\"k3\"", "\"k5\"")), HasSubstr("The key k3 is missing"));
  EXPECT_THAT(error(replaced(good, "339.749", "0")), HasSubstr("k1 must be positive"));
  EXPECT_THAT(error(replaced(good, "\"poly_order\": 4", "\"poly_order\": 5")),
              HasSubstr("poly_order"));
  EXPECT_THAT(error(replaced(good, "\"intrinsic\"", "\"intrinsics\"")), HasSubstr("intrinsic"));
  EXPECT_GT(test::times_refused(good, [this](const std::string& text) { return error(text); }), 80);
}

}  // namespace
}  // namespace widestereo
