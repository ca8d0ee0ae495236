// SPDX-License-Identifier: MIT
// Between the levels of the image pyramid: intensities, cameras and planes.
#include <gtest/gtest.h>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;

constexpr int size = 64;

/// View 1 is view 0 at half the size, beside it.
class Pyramid : public ::testing::Test {
 protected:
  Pyramid() : fixture_(two_sizes(), wide_range("fast")) {}

  static Rig two_sizes() {
    Rig rig = fisheye_rig(size);
    rig.views[1].camera = resized(rig.views[0].camera, size / 2, size / 2);
    return rig;
  }
  void set_level(int reference, int other) {
    fixture_.set_reference(reference);
    fixture_.pass().other = other;
  }

  KernelFixture fixture_;
};

TEST_F(Pyramid, IntensitiesAreMeansOfWhatACoarserPixelCovers) {
  set_level(1, 0);
  cv::Mat fine = fixture_.view(0).image();
  const auto at = [](double x, double y) { return 0.1 + 0.007 * x + 0.004 * y; };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) fine.at<float>(y, x) = static_cast<float>(at(x, y));
  }
  const auto coarse = [&](int x, int y) {
    kernel::cpu::downsample_pixel(fixture_.context(), {x, y});
    return static_cast<double>(fixture_.view(1).image().at<float>(y, x));
  };
  EXPECT_NEAR(coarse(10, 13), at(20.5, 26.5), 1e-6);
  fine.at<float>(26, 20) = MASKED_INTENSITY;
  EXPECT_NEAR(coarse(10, 13), (at(21, 26) + at(20, 27) + at(21, 27)) / 3, 1e-6);
  fine.at<float>(27, 21) = MASKED_INTENSITY;
  EXPECT_LT(coarse(10, 13), 0) << "masked with half of what it covers";
}

TEST_F(Pyramid, CoarserPixelsLookThroughTheMiddleOfThoseTheyCover) {
  Rig rig = fisheye_rig(size);
  Camera& slanted = rig.views[1].camera;
  slanted.model = CameraModel::polynomial_fisheye;
  slanted.skew = 3;
  slanted.shear = -2;
  const Schedule schedule = make_schedule(rig, wide_range("fast"));
  for (std::size_t view = 0; view < 4; ++view) {
    for (const auto& [x, y] : {std::pair(5, 16), {18, 9}, {20, 24}}) {
      Eigen::Vector3d coarse;
      Eigen::Vector3d fine;
      ASSERT_TRUE(unproject(schedule.views.at(view + 2).camera, {0.5 * x, 0.5 * y}, coarse));
      ASSERT_TRUE(unproject(schedule.views.at(view).camera, {x + 0.5, y + 0.5}, fine));
      EXPECT_LT((coarse - fine).norm(), 1e-9) << view << ": " << x << ", " << y;
    }
  }
}

TEST_F(Pyramid, SweepsTheMiddlesOfEqualParts) {
  set_level(0, 0);
  const ivec2 pixel(size / 2, size / 2);
  const cv::Vec4f r = fixture_.view(0).rays(pixel.y, pixel.x);
  const kernel::vec4 range = fixture_.schedule().parameters.range;
  for (const int steps : {1, 2}) {
    fixture_.pass().steps = steps;
    kernel::cpu::sweep_pixel(fixture_.context(), pixel);
    const cv::Vec4f held = fixture_.view(0).hypotheses(pixel.y, pixel.x);
    const float w = held[0] * r[0] + held[1] * r[1] + held[2] * r[2];
    const float part = static_cast<float>(steps) * (w - range.z) / (range.w - range.z);
    EXPECT_NEAR(part - std::floor(part), 0.5, 1e-4) << steps;
  }
}

TEST_F(Pyramid, PlanesGoToTheFinerPixelsAround) {
  set_level(0, 1);
  fixture_.pass().places = 4;
  const cv::Vec4f plane(0.05f, 0.1f, 0.5f, 0.1f);
  const cv::Point coarse(15, 17);
  fixture_.view(1).hypotheses.setTo(cv::Scalar(0, 0, 0, INVALID_COST));
  fixture_.view(1).hypotheses(coarse) = plane;
  int without_plane = 0;
  for (int y = 2 * coarse.y - 4; y <= 2 * coarse.y + 5; ++y) {
    for (int x = 2 * coarse.x - 4; x <= 2 * coarse.x + 5; ++x) {
      kernel::cpu::upsample_pixel(fixture_.context(), {x, y});
      const cv::Vec4f held = fixture_.view(0).hypotheses(y, x);
      const bool near = x >= 2 * coarse.x - 1 && x <= 2 * coarse.x + 2 && y >= 2 * coarse.y - 1 &&
                        y <= 2 * coarse.y + 2;
      EXPECT_EQ(held[2] == plane[2], near) << x << ", " << y;
      without_plane += held[3] >= INVALID_COST;
    }
  }
  EXPECT_LT(without_plane, 10) << "of 100: most get a random one";
}

TEST_F(Pyramid, FewerPlanesAreTheOneThatHoldsThePixelAndThenTheOneAcrossTheCorner) {
  set_level(0, 1);
  const auto held_from = [&](cv::Point coarse, int places) {
    const cv::Vec4f plane(0.05f, 0.1f, 0.5f, 0.1f);
    fixture_.pass().places = places;
    fixture_.view(1).hypotheses.setTo(cv::Scalar(0, 0, 0, INVALID_COST));
    fixture_.view(1).hypotheses(coarse) = plane;
    const ivec2 pixel(30, 35);  // the nearest corner of (15, 17) is the one towards (14, 18)
    kernel::cpu::upsample_pixel(fixture_.context(), pixel);
    return fixture_.view(0).hypotheses(pixel.y, pixel.x)[2] == plane[2];
  };
  const cv::Point own(15, 17);
  const cv::Point across(14, 18);
  for (const cv::Point beside : {cv::Point(14, 17), {15, 18}}) {
    EXPECT_TRUE(held_from(beside, 4));
    EXPECT_FALSE(held_from(beside, 2));
  }
  EXPECT_TRUE(held_from(across, 2));
  EXPECT_FALSE(held_from(across, 1));
  EXPECT_TRUE(held_from(own, 1));
}

}  // namespace
}  // namespace widestereo::test
