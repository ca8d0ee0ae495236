// SPDX-License-Identifier: MIT
#include "widestereo/rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <opencv2/core.hpp>

#include "error_of.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

Rig two_views() {
  Rig rig;
  rig.views.resize(2);
  for (View& view : rig.views) {
    view.name = "cam" + std::to_string(&view - rig.views.data());
    view.camera.width = 64;
    view.camera.height = 48;
    view.camera.fx = view.camera.fy = 40;
  }
  rig.views[1].world_from_camera =
      Eigen::Translation3d(0.2, 0, 0) * Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitY());
  return rig;
}

std::string message_of(const Rig& rig) {
  return test::error_of([&] { validate(rig, "rig.yaml"); });
}

TEST(RigValidation, AcceptsARig) { EXPECT_EQ(message_of(two_views()), ""); }

TEST(RigValidation, NamesWhatIsWrong) {
  Rig rig = two_views();
  rig.views[1].world_from_camera.setIdentity();
  EXPECT_NE(message_of(rig).find("baseline"), std::string::npos);

  rig = two_views();
  rig.views[1].world_from_camera.linear() *= 1.01;
  EXPECT_NE(message_of(rig).find("cam1"), std::string::npos);
  EXPECT_NE(message_of(rig).find("rigid"), std::string::npos);

  rig = two_views();
  rig.views[1].world_from_camera.linear().col(0) *= -1;  // a mirror
  EXPECT_NE(message_of(rig).find("rigid"), std::string::npos);

  rig = two_views();
  rig.views[0].world_from_camera.translation().x() = std::nan("");
  EXPECT_NE(message_of(rig).find("rigid"), std::string::npos);

  rig = two_views();
  rig.world_from_imu = rig.views[1].world_from_camera;
  EXPECT_EQ(message_of(rig), "");
  rig.world_from_imu->linear() *= 1.01;
  EXPECT_NE(message_of(rig).find("IMU: the pose is not a rigid motion; its rotation is 1.01 times "
                                 "one; divide these nine by that."),
            std::string::npos);
  rig.world_from_imu->linear() = -rig.views[1].world_from_camera.linear();
  EXPECT_NE(message_of(rig).find("it mirrors"), std::string::npos);

  rig = two_views();
  rig.views[0].mask = cv::Mat(48, 63, CV_8UC1, cv::Scalar(1));
  EXPECT_NE(message_of(rig).find("mask"), std::string::npos);
  rig.views[0].mask = cv::Mat(48, 64, CV_32FC1, cv::Scalar(1));
  EXPECT_NE(message_of(rig).find("the mask is CV_32FC1 instead of CV_8UC1"), std::string::npos);

  EXPECT_NE(message_of(Rig{}).find("no cameras"), std::string::npos);
}

TEST(ResizedViews, ExcludePixelsThatCoverExcludedOnes) {
  View view = two_views().views[1];
  EXPECT_TRUE(resized(view, 32, 24).mask.empty());
  view.mask = cv::Mat(48, 64, CV_8UC1, cv::Scalar(1));
  view.mask.at<uchar>(20, 31) = 0;
  const View half = resized(view, 32, 24);
  EXPECT_TRUE(half.camera == resized(view.camera, 32, 24));
  EXPECT_TRUE(half.world_from_camera.isApprox(view.world_from_camera));
  ASSERT_EQ(half.mask.size(), cv::Size(32, 24));
  EXPECT_EQ(cv::countNonZero(half.mask == 0), 1);
  EXPECT_EQ(half.mask.at<uchar>(10, 15), 0);
  EXPECT_EQ(cv::countNonZero(resized(view, 20, 15).mask == 0), 1);
  EXPECT_THROW(resized(view, 0, 15), Error);
  view.mask = cv::Mat(48, 63, CV_8UC1, cv::Scalar(1));
  EXPECT_THROW(resized(view, 32, 24), Error);
}

TEST(ResizedViews, ExcludePixelsHoweverManyTheyCover) {
  View view = two_views().views[1];
  view.camera.width = view.camera.height = 4096;
  view.mask = cv::Mat(4096, 4096, CV_8UC1, cv::Scalar(255));
  view.mask.at<uchar>(2016, 1017) = 0;
  for (const int side : {2048, 128, 2}) {
    const cv::Mat mask = resized(view, side, side).mask;
    EXPECT_EQ(cv::countNonZero(mask == 0), 1) << side;
    EXPECT_EQ(mask.at<uchar>(2016 * side / 4096, 1017 * side / 4096), 0) << side;
    EXPECT_EQ(mask.at<uchar>(side - 1, side - 1), 255) << side;
  }
}

TEST(Maps, WithoutPixelsAreNotOfAnotherSize) {
  const View view = two_views().views[1];
  const auto error = [&view](const cv::Mat& map) {
    return test::error_of([&] { require_calibrated_size(map, view, "The image of cam1"); });
  };
  EXPECT_EQ(error({}), "The image of cam1 is empty; give one that has pixels.");
  const std::array<int, 3> sizes = {48, 64, 3};
  EXPECT_NE(error(cv::Mat(3, sizes.data(), CV_8UC1)).find("3 dimensions"), std::string::npos);
}

TEST(Maps, HaveTheCalibratedSize) {
  const View view = two_views().views[1];  // of 64x48 pixels
  const auto error = [&view](int width, int height) {
    return test::error_of(
        [&] { require_calibrated_size(cv::Mat(height, width, CV_8UC1), view, "map.tiff"); });
  };
  EXPECT_EQ(error(64, 48), "");
  const auto expect = [&](int width, int height, const std::string& remedy) {
    EXPECT_EQ(error(width, height),
              "map.tiff is " + std::to_string(width) + "x" + std::to_string(height) +
                  " pixels, but the calibration of cam1 is for 64x48; both must have the same "
                  "size" +
                  remedy + ".");
  };
  expect(48, 64, "; where images are turned by 90 degrees, turn them back");
  const std::string cropped =
      "; where images are cropped, subtract what is missing on their left and top from cx and cy, "
      "and set the calibration's size to theirs";
  expect(63, 48, cropped);
  expect(64, 36, cropped);
  expect(40, 40, cropped);
  expect(64, 49, "; where those calibrated were cropped, crop these likewise");
  expect(63, 49, "");
  const std::string reduced =
      "; `calibration convert --scale` makes a calibration for reduced images, but not of a COLMAP "
      "model, which needs the original ones (and --max-image-size)";
  expect(32, 24, reduced);
  expect(53, 40, reduced);
  const std::string enlarged =
      "; reduce images to that calibrated, or make a calibration for larger ones by `calibration "
      "convert --scale";
  expect(128, 96, enlarged + " 2`");
  expect(96, 72, enlarged + " 1.5`");
}

TEST(Masks, ExcludeTheNearestPixelAndWhatIsOutside) {
  View view;
  EXPECT_FALSE(is_masked(view, {-5, 1})) << "no mask";
  view.mask = cv::Mat(3, 4, CV_8UC1, cv::Scalar(255));
  view.mask.at<uchar>(1, 2) = 0;
  for (const Eigen::Vector2d& masked :
       {Eigen::Vector2d(2, 1), {1.6, 0.6}, {2.4, 1.4}, {-0.6, 1}, {3.6, 1}, {1, -0.6}, {1, 2.6}}) {
    EXPECT_TRUE(is_masked(view, masked)) << masked.transpose();
  }
  for (const Eigen::Vector2d& kept :
       {Eigen::Vector2d(1.4, 1), {2.6, 1}, {2, 0.4}, {2, 1.6}, {-0.4, 1}, {3.4, 2.4}}) {
    EXPECT_FALSE(is_masked(view, kept)) << kept.transpose();
  }
}

TEST(RigGeometry, LocalOriginsAreWholeKilometresFarFromTheWorlds) {
  View view;
  const auto origin_at = [&view](double x, double y, double z) {
    view.world_from_camera.translation() = Eigen::Vector3d(x, y, z);
    return local_origin(view);
  };
  EXPECT_EQ(origin_at(9999, -9999, 0), Eigen::Vector3d::Zero());
  EXPECT_EQ(origin_at(10'001, -10'999, 9999), Eigen::Vector3d(10'000, -11'000, 0));
  EXPECT_EQ(origin_at(600'499, -5'700'501, 70), Eigen::Vector3d(600'000, -5'701'000, 0));
}

/// Poses to the camera, as COLMAP has them, of one place far from the origin.
TEST(RigGeometry, RoundedCentresAreNoBaseline) {
  const Eigen::Vector3d place(4'075'539.8, 931'735.3, 4'801'629.5);
  const auto centre = [&place](double angle, const Eigen::Vector3d& axis) -> Eigen::Vector3d {
    const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, axis.normalized()).matrix();
    const Eigen::Vector3d translation = -(rotation * place);
    return -(rotation.transpose() * translation);
  };
  double farthest = 0;
  for (int i = 1; i < 1000; ++i) {
    const Eigen::Vector3d turned = centre(0.1 * i, {1.0, 0.01 * i, 2.0 - i});
    farthest = std::max(farthest, (turned - place).norm());
    EXPECT_FALSE(has_baseline(turned, place));
  }
  EXPECT_GT(farthest, 1e-9);
  EXPECT_TRUE(has_baseline(place, place + Eigen::Vector3d(1e-6, 0, 0)));
  EXPECT_TRUE(has_baseline({0, 0, 0}, {2e-9, 0, 0}));
}

TEST(RigGeometry, RelativePoseMovesPoints) {
  const Rig rig = two_views();
  const Eigen::Vector3d world(0.5, -0.3, 2);
  const Eigen::Vector3d in_first = rig.views[0].world_from_camera.inverse() * world;
  const Eigen::Vector3d in_second = rig.views[1].world_from_camera.inverse() * world;
  EXPECT_LT((source_from_reference(rig.views[1], rig.views[0]) * in_first - in_second).norm(),
            1e-12);
  EXPECT_NEAR(baseline(rig.views[0], rig.views[1]), 0.2, 1e-12);
}

}  // namespace
}  // namespace widestereo
