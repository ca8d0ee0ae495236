// SPDX-License-Identifier: MIT
// Cameras of CamOdoCal against its models' formulas, and a VINS-Fusion rig whose geometry is simple
// enough to say where everything must be.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
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

std::string with_lens(const std::string& model, const std::string& lens) {
  return "%YAML:1.0\n---\nmodel_type: " + model +
         "\ncamera_name: image_02\nimage_width: 1400\nimage_height: 1380\n" + lens;
}

/// As KITTI-360 has them for its fisheyes.
const std::string mei = with_lens("MEI",
                                  "mirror_parameters:\n"
                                  "   xi: 2.2\n"
                                  "distortion_parameters:\n"
                                  "   k1: 1.6e-02\n   k2: 1.65\n   p1: 4.2e-04\n   p2: -3e-04\n"
                                  "projection_parameters:\n"
                                  "   gamma1: 1336.25\n   gamma2: 1335.5\n"
                                  "   u0: 716.5\n   v0: 705.75\n");
const std::string kannala_brandt = with_lens("KANNALA_BRANDT",
                                             "projection_parameters:\n"
                                             "   k2: -0.011\n   k3: 0.024\n"
                                             "   k4: -0.016\n   k5: 0.003\n"
                                             "   mu: 461.5\n   mv: 460.25\n"
                                             "   u0: 362.5\n   v0: 246.75\n");
const std::string pinhole_full = with_lens("PINHOLE_FULL",
                                           "distortion_parameters:\n"
                                           "   k1: 0.1\n   k2: 0.02\n   k3: 0.003\n   k4: 0.2\n"
                                           "   k5: 0.01\n   k6: 0.001\n   p1: 1e-4\n   p2: 2e-4\n"
                                           "projection_parameters:\n"
                                           "   fx: 700\n   fy: 701\n   cx: 699\n   cy: 689\n");
const std::string pinhole = with_lens("PINHOLE",
                                      "distortion_parameters:\n"
                                      "   k1: -0.28\n   k2: 0.07\n   p1: 1e-4\n   p2: 2e-4\n"
                                      "projection_parameters:\n"
                                      "   fx: 458.5\n   fy: 457.25\n   cx: 367\n   cy: 248\n");

const std::string ocam_lens =
    "poly_parameters:\n   p0: -400\n   p1: 0\n   p2: 1e-03\n   p3: 0\n   p4: 2e-09\n"
    "inv_poly_parameters:\n   p0: 600\n   p1: 400\n"
    "affine_parameters:\n   ac: 0.999\n   ad: 0.01\n   ae: -0.02\n   cx: 716.5\n   cy: 705.75\n";

/// The camera of a file with this text.
Camera camera_of(const std::string& text) {
  const TemporaryFolder folder;
  const Calibration calibration = read_calibration(folder.write("image_02.yaml", text));
  EXPECT_EQ(calibration.format, CalibrationFormat::camodocal);
  EXPECT_EQ(calibration.rig.views.size(), 1u);
  EXPECT_FALSE(calibration.rig.world_from_imu.has_value());
  const Camera& camera = calibration.rig.views[0].camera;
  EXPECT_EQ(camera.width, 1400);
  EXPECT_EQ(camera.height, 1380);
  return camera;
}

void expect_projection(const Camera& camera, const Eigen::Vector3d& point,
                       const Eigen::Vector2d& expected, double tolerance = 1e-9) {
  Eigen::Vector2d pixel;
  ASSERT_TRUE(project(camera, point, pixel)) << point.transpose();
  EXPECT_LT((pixel - expected).norm(), tolerance)
      << pixel.transpose() << ", not " << expected.transpose();
}

TEST(CamOdoCal, ReadsMei) {
  const Camera camera = camera_of(mei);
  EXPECT_EQ(camera.model, CameraModel::mei);
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.4, -0.7, 1), Eigen::Vector3d(-3, 1, 2)}) {
    const Eigen::Vector2d p = point.head<2>() / (point.z() + 2.2 * point.norm());
    const double r2 = p.squaredNorm();
    const double radial = 1 + 1.6e-2 * r2 + 1.65 * r2 * r2;
    const double x = p.x() * radial + 2 * 4.2e-4 * p.x() * p.y() - 3e-4 * (r2 + 2 * p.x() * p.x());
    const double y = p.y() * radial + 4.2e-4 * (r2 + 2 * p.y() * p.y()) - 2 * 3e-4 * p.x() * p.y();
    expect_projection(camera, point, {1336.25 * x + 716.5, 1335.5 * y + 705.75});
  }
}

TEST(CamOdoCal, ReadsKannalaBrandt) {
  const Camera camera = camera_of(kannala_brandt);
  EXPECT_EQ(camera.model, CameraModel::kannala_brandt);
  for (const Eigen::Vector3d& point : {Eigen::Vector3d(0.5, 0.2, 1), Eigen::Vector3d(-2, 1, 0.5)}) {
    const double radius = point.head<2>().norm();
    const double t = std::atan2(radius, point.z());
    const double r = t - 0.011 * std::pow(t, 3) + 0.024 * std::pow(t, 5) - 0.016 * std::pow(t, 7) +
                     0.003 * std::pow(t, 9);
    expect_projection(
        camera, point,
        {461.5 * r * point.x() / radius + 362.5, 460.25 * r * point.y() / radius + 246.75});
  }
}

TEST(CamOdoCal, ReadsPinholes) {
  const Camera simple = camera_of(pinhole);
  EXPECT_EQ(simple.model, CameraModel::pinhole_radtan);
  EXPECT_EQ(simple.k2, 0.07);
  EXPECT_EQ(simple.p2, 2e-4);
  const Camera full = camera_of(pinhole_full);
  EXPECT_EQ(full.model, CameraModel::pinhole_rational);
  const double x = 0.3;
  const double y = -0.4;
  const double q = x * x + y * y;
  const double radial = (1 + 0.1 * q + 0.02 * q * q + 0.003 * q * q * q) /
                        (1 + 0.2 * q + 0.01 * q * q + 0.001 * q * q * q);
  expect_projection(full, {x, y, 1},
                    {700 * (x * radial + 2e-4 * x * y + 2e-4 * (q + 2 * x * x)) + 699,
                     701 * (y * radial + 1e-4 * (q + 2 * y * y) + 4e-4 * x * y) + 689});
}

TEST(CamOdoCal, ReadsOCamsLenses) {
  const Camera camera = camera_of(with_lens("scaramuzza", ocam_lens));
  EXPECT_EQ(camera.model, CameraModel::polynomial_fisheye);
  // Its matrix is of the column and the row; p0's sign tells on which side z lies.
  for (const double radius : {1.0, 100.0, 350.0, 600.0}) {
    const Eigen::Vector2d p(0.6 * radius, -0.8 * radius);
    const double z = 400 - 1e-3 * radius * radius - 2e-9 * std::pow(radius, 4);
    expect_projection(camera, {p.x(), p.y(), z},
                      {0.999 * p.x() + 0.01 * p.y() + 716.5, -0.02 * p.x() + p.y() + 705.75}, 0.06);
  }
}

TEST(CamOdoCal, MayBePartOfAConfiguration) {
  // VINS-Mono's.
  const Camera camera = camera_of(pinhole +
                                  "extrinsicRotation: !!opencv-matrix\n   rows: 3\n   cols: 3\n"
                                  "   dt: d\n   data: [0, -1, 0, 1, 0, 0, 0, 0, 1]\n");
  EXPECT_EQ(camera.k1, -0.28);
}

/// Cameras 11 cm apart that look along the body's x, with the body's z up.
std::string vins(const std::string& more = "imu: 1\nnum_of_cam: 2\n") {
  const auto pose = [](const std::string& name, const std::string& y) {
    return name + ": !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: [0, 0, 1, 0.1,\n" +
           "          -1, 0, 0, " + y + ",\n          0, -1, 0, 0.3,\n          0, 0, 0, 1]\n";
  };
  return "%YAML:1.0\n\n#common parameters\n" + more +
         "imu_topic: \"/imu0\"\nimage_width: 1400\nimage_height: 1380\n" +
         pose("body_T_cam0", "0.2") + pose("body_T_cam1", "0.09") +
         "cam0_calib: \"cam0_mei.yaml\"\ncam1_calib: \"lenses/cam1.yaml\"\n" +
         "max_cnt: 150            # max feature number in feature tracking\n";
}

class Vins : public ::testing::Test {
 protected:
  Vins() {
    std::filesystem::create_directories(folder_ / "lenses");
    folder_.write("cam0_mei.yaml", mei);
    folder_.write("lenses/cam1.yaml", kannala_brandt);
  }
  Calibration read(const std::string& text) {
    return read_calibration(folder_.write("config.yaml", text));
  }
  std::string error(const std::string& text) {
    return test::error_of([&] { read(text); });
  }

  TemporaryFolder folder_;
};

TEST_F(Vins, ReadsTheRig) {
  const Calibration calibration = read(vins());
  EXPECT_EQ(calibration.format, CalibrationFormat::vins);
  const Rig& rig = calibration.rig;
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_EQ(rig.views[0].name, "cam0");
  EXPECT_EQ(rig.views[0].camera.model, CameraModel::mei);
  EXPECT_EQ(rig.views[1].name, "cam1");
  EXPECT_EQ(rig.views[1].camera.model, CameraModel::kannala_brandt);
  EXPECT_LT(rig.views[0].world_from_camera.translation().norm(), 1e-12);
  const Eigen::Isometry3d& right = rig.views[1].world_from_camera;
  EXPECT_LT((right.translation() - Eigen::Vector3d(0.11, 0, 0)).norm(), 1e-12);
  EXPECT_LT((right.linear() - Eigen::Matrix3d::Identity()).norm(), 1e-12);
  ASSERT_TRUE(rig.world_from_imu.has_value());
  EXPECT_LT((rig.world_from_imu->translation() - Eigen::Vector3d(0.2, 0.3, -0.1)).norm(), 1e-12);
  EXPECT_FALSE(read(vins("imu: 0\n")).rig.world_from_imu.has_value());
  EXPECT_EQ(rig.views[1].imu_time_offset, 0);
  EXPECT_EQ(read(vins("td: 0.0125\n")).rig.views[1].imu_time_offset, 0.0125);
  EXPECT_EQ(read(vins("imu: 0\ntd: 0.0125\n")).rig.views[1].imu_time_offset, 0);
  const std::vector<std::filesystem::path> files = {
      folder_ / "config.yaml", folder_ / "cam0_mei.yaml", folder_ / "lenses/cam1.yaml"};
  EXPECT_EQ(calibration.files, files);
}

TEST_F(Vins, WhatIsWrongIsOneSentence) {
  const std::string good = vins();
  EXPECT_EQ(error(good), "");
  EXPECT_THAT(error(vins("num_of_cam: 1\n")), HasSubstr("config.yaml: The key num_of_cam says 1"));
  EXPECT_THAT(error(replaced(good, "body_T_cam1", "T_cam1")), HasSubstr("The key body_T_cam1"));
  EXPECT_THAT(error(replaced(good, "cam0_mei.yaml", "cam2.yaml")),
              HasSubstr("There is no calibration file"));
  EXPECT_THAT(error(replaced(good, "[0, 0, 1, 0.1", "[0, 0, 2, 0.1")), HasSubstr("rigid motion"));
  EXPECT_GT(test::times_refused(good, [this](const std::string& text) { return error(text); }),
            100);

  const auto camera = [&](const std::string& text) {
    folder_.write("lenses/cam1.yaml", text);
    return error(good);
  };
  EXPECT_THAT(camera(replaced(mei, "xi:", "x:")),
              HasSubstr("cam1.yaml: cam1: mirror_parameters: The key xi is missing"));
  EXPECT_THAT(camera(replaced(mei, "projection_parameters", "projections")),
              HasSubstr("The key projection_parameters is missing"));
  EXPECT_THAT(camera(replaced(mei, "MEI", "FOV")), HasSubstr("model_type \"FOV\""));
  EXPECT_THAT(camera(replaced(mei, "1400", "1400.5")), HasSubstr("image_width"));
  EXPECT_THAT(camera(replaced(mei, "1336.25", "nan")), HasSubstr("gamma1"));
  EXPECT_THAT(camera(with_lens("SCARAMUZZA", replaced(ocam_lens, "ae:", "a:"))),
              HasSubstr("affine_parameters: The key ae is missing"));
  EXPECT_THAT(camera(""), HasSubstr("cam1.yaml"));
  EXPECT_GT(test::times_refused(kannala_brandt, camera), 100);
}

}  // namespace
}  // namespace widestereo
