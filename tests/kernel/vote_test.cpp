// SPDX-License-Identifier: MIT
// The vote of the surroundings on maps with two known surfaces.
#include <gtest/gtest.h>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;

constexpr int size = 96;
constexpr float bright = 0.8f;
constexpr float dark = 0.2f;
constexpr float far_plane = 0.5f;  // the planes' m: their inverse distance on the optical axis
constexpr float near_plane = 2;
/// The nearer, bright surface ends here.
constexpr int edge = 44;

class Vote : public ::testing::Test {
 protected:
  Vote() : fixture_(fisheye_rig(size), wide_range("fast")) {
    fixture_.set_reference(0);
    fixture_.pass().radius = 8;
    fill(0, size, dark, far_plane);
    fill(0, edge, bright, near_plane);
  }

  /// Columns first to last - 1.
  void fill(int first, int last, float intensity, float plane) {
    fixture_.view(0).image().colRange(first, last).setTo(intensity);
    hold(first, last, plane);
  }
  void hold(int first, int last, float plane) {
    cv::Mat(fixture_.view(0).hypotheses.colRange(first, last)).setTo(cv::Scalar(0, 0, plane, 0.2));
  }

  /// m.z of the plane elected at a column of the middle row; 0 where there is none.
  float elected(int x, int y = size / 2) {
    kernel::cpu::vote_pixel(fixture_.context(), ivec2(x, y));
    const cv::Vec4f prior = fixture_.view(0).priors(y, x);
    return prior[3] == 1 ? prior[2] : 0;
  }

  KernelFixture fixture_;
};

TEST_F(Vote, TakesBackWhatTheNearerSurfaceSpreadOver) {
  constexpr int spread = edge + 3;
  hold(edge, spread, near_plane);
  for (int x = edge - 8; x < edge; ++x) EXPECT_EQ(elected(x), near_plane) << "column " << x;
  for (int x = edge; x < edge + 8; ++x) EXPECT_EQ(elected(x), far_plane) << "column " << x;
}

TEST_F(Vote, GoesByIntensityWhereTheFartherSurfaceHasSpread) {
  hold(edge - 3, edge, far_plane);
  for (int x = edge - 8; x < edge; ++x) EXPECT_EQ(elected(x), near_plane) << "column " << x;
}

TEST_F(Vote, LeavesThinThingsThatLookDifferent) {
  fill(70, 73, bright, near_plane);
  for (int x = 70; x < 73; ++x) EXPECT_EQ(elected(x), near_plane) << "column " << x;
}

TEST_F(Vote, LeavesWhatEveryoneAgreesWith) {
  EXPECT_EQ(elected(edge / 2), near_plane);
  EXPECT_EQ(elected(70), far_plane);
}

TEST_F(Vote, LeavesWhatDiffersByLessThanATenthOfAPixel) {
  // A point at 2 m moves by about three pixels per unit of inverse distance.
  constexpr float slightly = far_plane + 0.02f;
  constexpr float clearly = far_plane + 0.2f;
  hold(70, 71, slightly);
  EXPECT_EQ(elected(70), slightly);
  hold(70, 71, clearly);
  EXPECT_EQ(elected(70), far_plane);
}

TEST_F(Vote, PixelsWithoutAPlaneNeitherVoteNorStand) {
  hold(edge, edge + 3, near_plane);
  cv::Mat(fixture_.view(0).hypotheses.colRange(edge + 3, size))
      .setTo(cv::Scalar(0, 0, far_plane, INVALID_COST));
  EXPECT_EQ(elected(edge + 1), near_plane);
  EXPECT_EQ(elected(edge + 5), 0) << "has none itself";
}

TEST_F(Vote, ElectsNoPlaneThatIsOutOfRange) {
  fixture_.schedule().parameters.range.z = 1;  // 1 m at most
  hold(edge, edge + 2, near_plane);
  EXPECT_EQ(elected(edge + 1), near_plane);
}

TEST_F(Vote, WorksAtTheImagesEdge) {
  EXPECT_EQ(elected(edge, 0), far_plane);
  EXPECT_EQ(elected(edge, size - 1), far_plane);
}

}  // namespace
}  // namespace widestereo::test
