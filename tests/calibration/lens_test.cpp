// SPDX-License-Identifier: MIT
#include "widestereo/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "data_folder.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

constexpr double degree = radians_per_degree;

Camera fisheye() {
  Camera camera;
  camera.model = CameraModel::double_sphere;
  camera.width = camera.height = 320;
  camera.fx = camera.fy = 92;
  camera.cx = 161;
  camera.cy = 158;
  camera.xi = -0.17;
  camera.alpha = 0.59;
  return camera;
}

/// A scene of random intensities times the light (in [0, 1]) that the lens lets through at an angle
/// (degrees) off the axis, over black of `offset` grey levels with noise.
cv::Mat photograph(const Camera& camera, const std::function<double(double)>& light,
                   double offset = 6, unsigned seed = 1) {
  cv::RNG random(seed);
  cv::Mat image(camera.height, camera.width, CV_8UC1);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      Eigen::Vector3d ray;
      double level = offset + random.gaussian(1);
      if (unproject(camera, {x, y}, ray)) {
        const double theta = std::atan2(ray.head<2>().norm(), ray.z()) / degree;
        level += light(theta) * random.uniform(40., 200.);
      }
      image.at<uchar>(y, x) = cv::saturate_cast<uchar>(level);
    }
  }
  return image;
}

double up_to(double theta, double end) { return theta < end ? 1 : 0; }

TEST(LensRim, IsWhereASharpCircleEnds) {
  for (const double end : {75.0, 90.0, 97.5}) {
    const auto rim =
        find_lens_rim(fisheye(), {photograph(fisheye(), [&](double t) { return up_to(t, end); })});
    ASSERT_TRUE(rim) << end;
    EXPECT_NEAR(rim->dark / degree, end, 0.6);
    EXPECT_NEAR(rim->usable / degree, end, 0.6);
  }
}

TEST(LensRim, IsFoundInSmallImages) {
  for (const int size : {96, 128, 160}) {
    Camera camera = fisheye();
    const double scale = size / static_cast<double>(camera.width);
    camera.width = camera.height = size;
    for (double* scaled : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *scaled *= scale;
    const auto rim =
        find_lens_rim(camera, {photograph(camera, [](double t) { return up_to(t, 97.5); })});
    ASSERT_TRUE(rim) << size;
    EXPECT_NEAR(rim->usable / degree, 97.5, 1.1) << size;
  }
}

TEST(LensRim, IsFoundWhereTheCameraHasFewerBitsThanItsFiles) {
  const cv::Mat image = photograph(fisheye(), [](double t) { return up_to(t, 90); });
  cv::Mat of_10_bits;
  image.convertTo(of_10_bits, CV_16U, 4);
  const auto rim = find_lens_rim(fisheye(), {of_10_bits});
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->dark / degree, 90, 0.6);
}

TEST(LensRim, IsNotFoundInAFewPixels) {
  Camera camera = fisheye();
  camera.width = camera.height = 12;
  for (double* scaled : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) *scaled *= 12. / 320;
  EXPECT_FALSE(find_lens_rim(camera, {cv::Mat(12, 12, CV_8UC1, cv::Scalar(90))}));
}

TEST(LensRim, LeavesReflectionsOut) {
  // Light falls from 88 to 94 degrees; half a lens's rim glows up to 97.
  cv::Mat image =
      photograph(fisheye(), [](double theta) { return std::clamp((94 - theta) / 6, 0.0, 1.0); });
  const cv::Mat glowing = photograph(fisheye(), [](double theta) { return up_to(theta, 97); });
  glowing.colRange(0, 100).copyTo(image.colRange(0, 100));
  const auto rim = find_lens_rim(fisheye(), {image});
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->dark / degree, 97, 0.6);
  EXPECT_NEAR(rim->usable / degree, 91, 1);
}

TEST(LensRim, IsNotLookedForFarInside) {
  // Half the light is gone at 60 degrees already: the lens may simply be so.
  const cv::Mat image =
      photograph(fisheye(), [](double theta) { return theta < 60 ? 1.0 : 0.2 * up_to(theta, 95); });
  const auto rim = find_lens_rim(fisheye(), {image});
  ASSERT_TRUE(rim);
  EXPECT_GT(rim->usable / degree, 0.91 * 95);
}

TEST(LensRim, IsNotLookedForInImagesThatEndBefore) {
  EXPECT_TRUE(may_show_rim(fisheye()));
  Camera pinhole;
  pinhole.width = pinhole.height = 320;
  pinhole.cx = pinhole.cy = 159.5;
  for (const auto& [corner, may] : {std::pair(59.0, false), {61.0, true}}) {
    pinhole.fx = pinhole.fy = 159.5 * std::sqrt(2) / std::tan(corner * degree);
    EXPECT_EQ(may_show_rim(pinhole), may);
  }
}

TEST(LensRim, IsNoneWhereNothingShowsIt) {
  const Camera camera = fisheye();
  EXPECT_FALSE(find_lens_rim(camera, {photograph(camera, [](double) { return 1; })}));
  EXPECT_FALSE(find_lens_rim(camera, {photograph(camera, [](double) { return 0; })}));
  EXPECT_FALSE(find_lens_rim(camera, {}));
  // Darkness around a light is the scene's.
  EXPECT_FALSE(find_lens_rim(camera, {photograph(camera, [](double t) { return up_to(t, 40); })}));
  // A calibrated field of view holds.
  Camera limited = camera;
  limited.max_theta = 90 * degree;
  EXPECT_FALSE(find_lens_rim(limited, {photograph(camera, [](double t) { return up_to(t, 95); })}));
}

TEST(LensRim, IsShownByTheBrightestOfManyImages) {
  cv::Mat night = photograph(fisheye(), [](double theta) { return up_to(theta, 70); });
  cv::Mat day = photograph(
      fisheye(), [](double theta) { return up_to(theta, 95); }, 6, 2);
  cv::Mat deep;
  day.convertTo(deep, CV_16U, 257);
  cv::Mat colour;
  cv::cvtColor(deep, colour, cv::COLOR_GRAY2BGR);
  const auto rim = find_lens_rim(fisheye(), {night, colour});
  ASSERT_TRUE(rim);
  EXPECT_NEAR(rim->usable / degree, 95, 0.6);
}

TEST(LensRim, NeedsImagesOfTheCalibratedSize) {
  const std::string message =
      test::error_of([] { find_lens_rim(fisheye(), {cv::Mat(320, 300, CV_8UC1)}); });
  EXPECT_NE(message.find("320x320"), std::string::npos) << message;
  EXPECT_NE(message.find("300x320"), std::string::npos) << message;
}

TEST(LensRim, OfARealLens) {
  SKIP_WITHOUT_STEREO_SETS();
  const auto set = test::data_folder() / "real/calicam_shun74";
  const Rig rig = read_calibration(set / "calib.yaml").rig;
  for (std::size_t i = 0; i < 2; ++i) {
    const auto image = set / ("cam" + std::to_string(i)) / "test-1.png";
    const auto rim = find_lens_rim(rig.views[i].camera, {read_image(image)});
    ASSERT_TRUE(rim) << image;
    // As seen: white-blue reflections from 94 degrees on, black from 98 on.
    EXPECT_NEAR(rim->usable / degree, 93.5, 1.5);
    EXPECT_NEAR(rim->dark / degree, 98.5, 1.5);
  }
}

}  // namespace
}  // namespace widestereo
