// SPDX-License-Identifier: MIT
// The vote on normals where two known walls meet, and on one with noise.
#include <gtest/gtest.h>

#include <limits>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;

constexpr int size = 96;
constexpr int middle = size / 2;
/// The walls meet at the column before this one.
constexpr int crease = middle;
/// Movement in the source, pixels per unit of inverse distance.
constexpr float speed = 3;
constexpr float bright = 0.8f;
constexpr float dark = 0.2f;

/// m of the walls: 2 m away where they meet.
const Eigen::Vector3d left_wall(-0.2, 0, 0.5);
const Eigen::Vector3d right_wall(0.2, 0, 0.5);
const Eigen::Vector3d blend(0, 0, 0.5);

/// From a plane that was elected.
double degrees_off(const Eigen::Vector3d& elected, const Eigen::Vector3d& expected) {
  if (elected.norm() == 0) return std::numeric_limits<double>::infinity();
  return degrees_between(elected, expected);
}

class NormalVote : public ::testing::Test {
 protected:
  NormalVote() : fixture_(fisheye_rig(size), wide_range("fast")) {
    fixture_.set_reference(0);
    fixture_.view(0).checks.setTo(cv::Scalar(0.01, speed, 0, bright));
    hold(0, crease, left_wall, bright);
    hold(crease, size, right_wall, dark);
  }

  cv::Mat_<cv::Vec4f>& planes() { return fixture_.view(0).hypotheses; }

  Eigen::Vector3d ray(ivec2 pixel) { return fixture_.ray(0, pixel); }

  void hold(ivec2 pixel, const Eigen::Vector3d& m) {
    planes()(pixel.y, pixel.x) = cv::Vec4f(static_cast<float>(m.x()), static_cast<float>(m.y()),
                                           static_cast<float>(m.z()), 0.1f);
  }
  /// Columns first to last - 1.
  void hold(int first, int last, const Eigen::Vector3d& m, float intensity) {
    for (int y = 0; y < size; ++y) {
      for (int x = first; x < last; ++x) {
        hold(ivec2(x, y), m);
        fixture_.view(0).image()(y, x) = intensity;
        fixture_.view(0).checks(y, x)[3] = intensity;
      }
    }
  }
  /// The normals of columns first to last - 1 lie between the walls', distances stay.
  void blend_normals(int first, int last) {
    for (int y = 0; y < size; ++y) {
      for (int x = first; x < last; ++x) {
        const Eigen::Vector3d r = ray({x, y});
        const Eigen::Vector3d& wall = x < crease ? left_wall : right_wall;
        hold(ivec2(x, y), wall.dot(r) / blend.dot(r) * blend);
      }
    }
  }

  /// m of the elected plane; zero where there is none.
  Eigen::Vector3d elected(int x, int y = middle) {
    kernel::cpu::vote_normal_pixel(fixture_.context(), ivec2(x, y));
    const cv::Vec4f prior = fixture_.view(0).priors(y, x);
    if (prior[3] == 0) return Eigen::Vector3d::Zero();
    return {prior[0], prior[1], prior[2]};
  }

  KernelFixture fixture_;
};

TEST_F(NormalVote, PartsWallsThatTheRegressionHasRounded) {
  blend_normals(crease - 1, crease + 1);
  for (int x = crease - 8; x < crease + 8; ++x) {
    const Eigen::Vector3d& wall = x < crease ? left_wall : right_wall;
    EXPECT_LT(degrees_off(elected(x), wall), 0.1) << "column " << x;
  }
}

TEST_F(NormalVote, DoesNotElectWhatLiesBetween) {
  blend_normals(crease - 1, crease + 1);
  hold(0, crease - 1, left_wall, bright);
  hold(crease + 1, size, right_wall, bright);
  for (const int x : {crease - 1, crease}) {
    fixture_.view(0).image().col(x).setTo(bright);
    fixture_.view(0).checks(middle, x)[3] = bright;
    EXPECT_LT(std::min(degrees_off(elected(x), left_wall), degrees_off(elected(x), right_wall)),
              0.1)
        << "column " << x;
  }
}

TEST_F(NormalVote, LeavesDistances) {
  blend_normals(crease - 1, crease + 1);
  for (int x = crease - 1; x < crease + 1; ++x) {
    const Eigen::Vector3d r = ray({x, middle});
    const Eigen::Vector3d& wall = x < crease ? left_wall : right_wall;
    EXPECT_NEAR(elected(x).dot(r), wall.dot(r), 1e-6) << "column " << x;
  }
}

TEST_F(NormalVote, GoesByIntensity) {
  blend_normals(crease - 1, crease + 1);
  hold(0, crease - 1, left_wall, dark);
  hold(crease + 1, size, right_wall, bright);
  EXPECT_LT(degrees_off(elected(crease - 1), right_wall), 0.1);
  EXPECT_LT(degrees_off(elected(crease), left_wall), 0.1);
}

TEST_F(NormalVote, LeavesWhatLiesAtAnotherDistance) {
  for (const double nearer : {0.8, 1.05}) {  // by 0.45 px, by 0.08 px
    hold(0, size, left_wall, bright);
    const Eigen::Vector3d r = ray({middle, middle});
    const Eigen::Vector3d own = left_wall.dot(r) * nearer / right_wall.dot(r) * right_wall;
    hold(middle, middle + 1, own, bright);
    const bool same_surface = degrees_off(elected(middle), own) > 20;
    EXPECT_EQ(same_surface, nearer == 1.05) << nearer << " times as near";
  }
}

TEST_F(NormalVote, SmoothsAWall) {
  cv::RNG random(7);
  hold(0, size, blend, bright);
  const cv::Mat_<cv::Vec4f> smooth = planes().clone();
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const Eigen::Vector3d r = ray({x, y});
      const Eigen::Vector3d turned =
          blend + 0.05 * Eigen::Vector3d(random.gaussian(1), random.gaussian(1), 0);
      hold(ivec2(x, y), blend.dot(r) / turned.dot(r) * turned);
    }
  }
  double before = 0;
  double after = 0;
  for (int y = 30; y < 66; y += 3) {
    for (int x = 30; x < 66; x += 3) {
      const cv::Vec4f held = planes()(y, x);
      before += degrees_off(Eigen::Vector3d(held[0], held[1], held[2]), blend);
      after += degrees_off(elected(x, y), blend);
    }
  }
  EXPECT_LT(after, 0.6 * before);
}

TEST_F(NormalVote, LeavesWhatFindsNoMajority) {
  // All turned by 20 degrees and more from each other.
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      hold(ivec2(x, y), Eigen::Vector3d(0.2 * (x % 3 - 1), 0.2 * (y % 3 - 1), 0.5));
    }
  }
  fixture_.view(0).checks.setTo(cv::Scalar(0.01, 0.1, 0, bright));  // distances do not matter
  fixture_.view(0).image().setTo(bright);
  const cv::Vec4f own = planes()(middle, middle);
  EXPECT_LT(degrees_off(elected(middle), Eigen::Vector3d(own[0], own[1], own[2])), 0.1);
}

TEST_F(NormalVote, PixelsWithoutAPlaneOrAMeasureGetNone) {
  planes()(middle, middle)[3] = INVALID_COST;
  EXPECT_EQ(elected(middle).norm(), 0);
  fixture_.view(0).checks(middle, middle + 1)[0] = UNMEASURED_VARIANCE;
  EXPECT_EQ(elected(middle + 1).norm(), 0);
}

TEST_F(NormalVote, PixelsWithoutAPlaneDoNotVote) {
  hold(0, size, left_wall, bright);
  for (int y = 0; y < size; ++y) {  // all that the grid has
    for (int x = middle % 2; x < size; x += 2) planes()(y, x)[3] = INVALID_COST;
  }
  hold(ivec2(middle, middle), blend);
  EXPECT_LT(degrees_off(elected(middle), blend), 0.1);
}

TEST_F(NormalVote, PixelsWithoutAPlaneDoNotStand) {
  hold(0, size, left_wall, bright);
  for (const int dy : {-3, 0, 3}) {
    for (const int dx : {-3, 0, 3}) planes()(middle + dy, middle + dx)[3] = INVALID_COST;
  }
  hold(ivec2(middle, middle), blend);
  EXPECT_LT(degrees_off(elected(middle), blend), 0.1);
}

TEST_F(NormalVote, PlanesBehindThePixelDoNotStand) {
  const Eigen::Vector3d far_away(0, 0, 0.02);
  const Eigen::Vector3d beside(0.3, 0, -0.02);  // in front of pixels from two columns on
  hold(0, size, beside, bright);
  hold(middle, middle + 1, far_away, bright);
  ASSERT_LT(beside.dot(ray({middle, middle})), 0);
  EXPECT_LT(degrees_off(elected(middle), far_away), 0.1);
}

TEST_F(NormalVote, ElectsNoPlaneThatMayNotBe) {
  blend_normals(crease - 1, crease + 1);
  fixture_.schedule().parameters.patch_limits.z =
      0.95f;  // walls are seen at an angle of 22 degrees
  EXPECT_EQ(elected(crease).norm(), 0);
}

TEST_F(NormalVote, WorksAtTheImagesEdge) {
  fixture_.schedule().parameters.patch_limits.z = 0;
  for (const int y : {0, size - 1}) {
    if (ray({crease + 4, y}).norm() == 0) continue;
    EXPECT_LT(degrees_off(elected(crease + 4, y), right_wall), 0.1);
  }
}

}  // namespace
}  // namespace widestereo::test
