// SPDX-License-Identifier: MIT
// The average over views whose planes are known.
#include <gtest/gtest.h>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;

constexpr ivec2 pixel(48, 40);
const Eigen::Vector3d wall(0.05, 0.1, 0.5);

class Merging : public ::testing::Test {
 protected:
  explicit Merging(const Rig& rig = fisheye_rig(96)) : fixture_(rig, wide_range("fast")) {
    fixture_.set_reference(0);
    fixture_.hold_in_all_views(to_kernel(wall));
  }

  /// Lets a view hold the wall where it puts the pixel's point this much (1 / m) nearer.
  void hold_nearer(int view, double inverse_distance) {
    const double own = wall.dot(ray());
    const kernel::vec3 m =
        fixture_.plane_in(view, to_kernel(((own + inverse_distance) / own) * wall));
    fixture_.view(view).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, 0.1));
  }

  Eigen::Vector3d ray() { return fixture_.ray(0, pixel); }

  /// Pixels that the point moves in a view per unit of inverse distance.
  double speed(int view) {
    return pixels_per_inverse_distance(fixture_.rig().views[static_cast<std::size_t>(view)],
                                       fixture_.rig().views[0], ray(), wall.dot(ray()));
  }

  cv::Vec4f merged() {
    kernel::cpu::merge_pixel(fixture_.context(), pixel);
    return fixture_.view(0).priors(pixel.y, pixel.x);
  }
  /// How much nearer than the wall the merged plane is, 1 / m.
  double moved() {
    const cv::Vec4f plane = merged();
    EXPECT_EQ(plane[3], 1);
    return to_eigen(to_kernel(plane)).dot(ray()) - wall.dot(ray());
  }

  KernelFixture fixture_;
};

class MergingOfThree : public Merging {
 protected:
  MergingOfThree() : Merging(rig_of_baselines(96, {1, -1})) {}
};

TEST_F(Merging, TakesTheMeanOfBothViewsDistancesAndKeepsTheNormal) {
  const double tenth_of_a_pixel = 0.1 / speed(1);
  hold_nearer(1, tenth_of_a_pixel);
  // 0.04 of the squared limit away, another plane weighs 0.96^2.
  constexpr double share = 0.9216 / 1.9216;
  EXPECT_NEAR(moved(), share * tenth_of_a_pixel, 0.01 * tenth_of_a_pixel);
  const Eigen::Vector3d normal = to_eigen(to_kernel(merged())).normalized();
  EXPECT_LT((normal - wall.normalized()).norm(), 1e-6);
  hold_nearer(0, tenth_of_a_pixel);
  hold_nearer(1, 0);
  EXPECT_NEAR(moved(), (1 - share) * tenth_of_a_pixel, 0.01 * tenth_of_a_pixel);
}

TEST_F(Merging, LeavesWhatTheViewsDoNotAgreeOn) {
  for (const double pixels : {0.6, -0.6, 5.0}) {
    hold_nearer(1, pixels / speed(1));
    EXPECT_NEAR(moved(), 0, 1e-6) << pixels;
  }
  fixture_.view(1).hypotheses.setTo(cv::Scalar(0, 0, 0, INVALID_COST));
  EXPECT_NEAR(moved(), 0, 1e-6) << "no plane there";
}

TEST_F(Merging, NeedsAPlaneOfThePixelsOwn) {
  fixture_.view(0).hypotheses(pixel.y, pixel.x)[3] = INVALID_COST;
  EXPECT_EQ(merged(), cv::Vec4f::all(0));
}

TEST_F(MergingOfThree, TakesTheMeanOfThoseThatAgree) {
  const double near = 0.01 / speed(1);
  hold_nearer(1, 3 * near);
  EXPECT_NEAR(moved(), near, 0.02 * near) << "of three";
  hold_nearer(2, 2 / speed(2));
  EXPECT_NEAR(moved(), 1.5 * near, 0.02 * near) << "of two";
}

}  // namespace
}  // namespace widestereo::test
