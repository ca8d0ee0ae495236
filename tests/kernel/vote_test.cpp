// SPDX-License-Identifier: MIT
// The vote of the surroundings on maps with two known surfaces.
#include <gtest/gtest.h>

#include <tuple>

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
    cv::Vec4f& prior = fixture_.view(0).priors(y, x);
    prior = cv::Vec4f::all(0);
    kernel::cpu::vote_pixel(fixture_.context(), ivec2(x, y));
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
  hold(edge - 2, edge, far_plane);
  for (int x = edge - 8; x < edge; ++x) EXPECT_EQ(elected(x), near_plane) << "column " << x;
}

/// On one intensity, a pixel of the nearer surface beside the edge, of more near planes than far
/// ones.
TEST_F(Vote, GoesForTheFartherSurfaceWhereTheNearerOneMatches) {
  constexpr float slightly_nearer = far_plane + 0.15f;  // half a pixel
  for (const auto& [nearer, cost, expected] : {std::tuple(near_plane, 0.1f, far_plane),
                                               {near_plane, 1.0f, near_plane},
                                               {slightly_nearer, 0.1f, slightly_nearer}}) {
    fill(0, size, dark, far_plane);
    hold(0, edge, nearer);
    for (cv::Vec4f& held : fixture_.view(0).hypotheses) held[3] = cost;
    EXPECT_EQ(elected(edge - 1), expected) << nearer << " at cost " << cost;
    EXPECT_EQ(elected(edge + 8), far_plane) << nearer << " at cost " << cost;
    EXPECT_EQ(elected(edge - 8), nearer) << nearer << " at cost " << cost;
  }
}

TEST_F(Vote, LeavesThinThingsThatLookDifferent) {
  fill(70, 73, bright, near_plane);
  for (int x = 70; x < 73; ++x) EXPECT_EQ(elected(x), near_plane) << "column " << x;
}

TEST_F(Vote, LeavesWhatEveryoneAgreesWith) {
  EXPECT_EQ(elected(edge / 2), near_plane);
  EXPECT_EQ(elected(70), far_plane);
}

TEST_F(Vote, LeavesWhatDiffersByFewHundredthsOfAPixel) {
  // A point at 2 m moves by about three pixels per unit of inverse distance.
  constexpr float slightly = far_plane + 0.01f;
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

TEST_F(Vote, NearPlanesCountForMoreThanMoreOfThemFarAway) {
  for (int view = 0; view < 2; ++view) fixture_.view(view).image().setTo(bright);
  fixture_.interpolate();
  hold(0, size, near_plane);
  constexpr int radius = 5;  // 121 of 289 pixels
  const cv::Rect around(70 - radius, size / 2 - radius, 2 * radius + 1, 2 * radius + 1);
  fixture_.view(0).hypotheses(around).setTo(cv::Scalar(0, 0, far_plane, 0.2));
  fixture_.view(0).hypotheses(size / 2, 70) = cv::Vec4f(0, 0, 1, 0.2f);
  EXPECT_EQ(elected(70), far_plane);
}

TEST_F(Vote, WhatIsNotSeenIsAsUnlikeAsCanBe) {
  bool whole = false;
  const auto likeness = [&](float plane, kernel::vec2 exposure) {
    return kernel::cpu::likeness_of_middle(fixture_.context(), 1, {48, 48}, {0, 0, plane}, exposure,
                                           whole);
  };
  for (const auto& [reference, source, exposure] : {std::tuple(0.4f, 0.38f, kernel::vec2(1, 0)),
                                                    {0.8f, 0.38f, kernel::vec2(2, 0)},
                                                    {0.8f, 0.38f, kernel::vec2(1, 0.4f)}}) {
    fixture_.view(0).image().setTo(reference);
    fixture_.view(1).image().setTo(source);
    fixture_.interpolate();
    EXPECT_NEAR(likeness(far_plane, exposure), 0.5, 0.005) << "of differences in the darker image";
  }
  fixture_.view(1).image().setTo(0);
  fixture_.interpolate();
  const float least = likeness(far_plane, {1, 0});
  EXPECT_TRUE(whole);
  fixture_.view(1).image().setTo(MASKED_INTENSITY);
  fixture_.interpolate();
  EXPECT_FLOAT_EQ(likeness(far_plane, {1, 0}), least);
  EXPECT_FALSE(whole);
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

/// Share of the pixels that elect a textured wall's plane where most planes around are twice as
/// near, by up to `spread` of that more or less. The source is `exposure` times as bright, which it
/// `shows` pixels that passed the checks; an eighth of the grid around a pixel sees a lamp.
double share_that_elects_the_wall(float exposure, bool shows, float spread = 0) {
  KernelFixture fixture(fisheye_rig(size), wide_range("fast"));
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, 1).normalized();
  fixture.show(render_plane(fixture.rig(), normal, 2), exposure);
  fixture.set_reference(0);
  fixture.pass().radius = 10;
  const auto wall = (normal / 2).cast<float>().eval();
  const auto holds_wall = [](int x) { return x % 7 < 2; };
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float nearness = 2 * (1 + spread * (static_cast<float>((5 * x + 3 * y) % 11) / 5 - 1));
      const Eigen::Vector3f m = holds_wall(x) ? wall : nearness * wall;
      fixture.view(0).hypotheses(y, x) = cv::Vec4f(m.x(), m.y(), m.z(), 0.2f);
      const float intensity = fixture.view(0).image().at<float>(y, x);
      const bool lamp = (x / 10 + 3 * (y / 10)) % 8 == 0;
      const float shown = intensity < 0 ? MASKED_INTENSITY : lamp ? 1 : exposure * intensity;
      const float reasons = shows ? 0 : REASON_INCONSISTENT;
      fixture.view(0).checks(y, x) = cv::Vec4f(1, 0, shown, reasons);
    }
  }
  int pixels = 0;
  int elected = 0;
  for (int y = 20; y < size - 20; ++y) {
    for (int x = 20; x < size - 20; ++x) {
      if (holds_wall(x)) continue;
      kernel::cpu::vote_pixel(fixture.context(), ivec2(x, y));
      ++pixels;
      if (fixture.view(0).priors(y, x)[2] == wall.z()) ++elected;
    }
  }
  return static_cast<double>(elected) / pixels;
}

TEST(VoteOnATexturedWall, TheSourceOutweighsTheMajority) {
  EXPECT_GT(share_that_elects_the_wall(1, false), 0.8);
  EXPECT_GT(share_that_elects_the_wall(1, false, 0.05f), 0.8) << "which hardly differs: one rival";
}

TEST(VoteOnATexturedWall, TheMajorityDecidesWhereExposuresDifferAndNothingTellsIt) {
  EXPECT_LT(share_that_elects_the_wall(0.6f, false), 0.05);
}

TEST(VoteOnATexturedWall, WhatPassedTheChecksTellsHowExposuresDiffer) {
  for (const float exposure : {0.6f, 1.0f, 1.2f}) {
    EXPECT_GT(share_that_elects_the_wall(exposure, true), 0.75) << exposure;
  }
}

/// The wall, which the search had found, was outvoted everywhere by a plane twice as near.
class VoteAfterARegression : public ::testing::Test {
 protected:
  VoteAfterARegression() : fixture_(fisheye_rig(size), wide_range("fast")) {
    const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, 1).normalized();
    fixture_.show(render_plane(fixture_.rig(), normal, 2), 1);
    fixture_.set_reference(0);
    fixture_.pass().radius = 10;
    wall_ = (normal / 2).cast<float>();
    fixture_.view(0).hypotheses.setTo(cv::Scalar(2 * wall_.x(), 2 * wall_.y(), 2 * wall_.z(), 0.2));
  }

  /// Of the pixels in the middle, which held this multiple of the wall's plane before, the share
  /// that elects that.
  double share_that_goes_back(float multiple) {
    const Eigen::Vector3f before = multiple * wall_;
    int elected = 0;
    for (int y = first; y < last; ++y) {
      for (int x = first; x < last; ++x) {
        cv::Vec4f& prior = fixture_.view(0).priors(y, x);
        prior = cv::Vec4f(before.x(), before.y(), before.z(), 0);
        kernel::cpu::vote_pixel(fixture_.context(), ivec2(x, y));
        elected += prior[2] == before.z() ? 1 : 0;
      }
    }
    return static_cast<double>(elected) / ((last - first) * (last - first));
  }

  static constexpr int first = 20;
  static constexpr int last = size - first;
  KernelFixture fixture_;
  Eigen::Vector3f wall_;
};

TEST_F(VoteAfterARegression, GoesBackWhereTheSourceShowsIt) {
  EXPECT_GT(share_that_goes_back(1), 0.5);
  EXPECT_LT(share_that_goes_back(3), 0.05) << "which the source does not show";
}

/// Those around are no votes for a plane that one pixel alone holds, as a thin surface's.
TEST_F(VoteAfterARegression, GoesBackFromAPlaneThatNoPixelAroundHolds) {
  const Eigen::Vector3f around = 6 * wall_;
  const Eigen::Vector3f own = 2 * wall_;
  int elected = 0;
  for (int x = first; x < last; ++x) {
    fixture_.view(0).hypotheses.setTo(cv::Scalar(around.x(), around.y(), around.z(), 0.2));
    fixture_.view(0).hypotheses(size / 2, x) = cv::Vec4f(own.x(), own.y(), own.z(), 0.2f);
    fixture_.view(0).priors(size / 2, x) = cv::Vec4f(wall_.x(), wall_.y(), wall_.z(), 0);
    kernel::cpu::vote_pixel(fixture_.context(), ivec2(x, size / 2));
    elected += fixture_.view(0).priors(size / 2, x)[2] == wall_.z() ? 1 : 0;
  }
  EXPECT_GT(elected, 0.5 * (last - first));
}

/// As at the rim of its image, farther inside of which anything may look more alike.
TEST_F(VoteAfterARegression, StaysWhereTheSourceDoesNotSeeAllOfTheNewPlane) {
  const ivec2 pixel(48, 48);
  const Eigen::Vector3f near = 8 * wall_;  // ten pixels away in the source
  fixture_.view(0).hypotheses.setTo(cv::Scalar(near.x(), near.y(), near.z(), 0.2));
  const auto goes_back = [&] {
    fixture_.view(0).priors(pixel.y, pixel.x) = cv::Vec4f(wall_.x(), wall_.y(), wall_.z(), 0);
    kernel::cpu::vote_pixel(fixture_.context(), pixel);
    return fixture_.view(0).priors(pixel.y, pixel.x)[2] == wall_.z();
  };
  EXPECT_TRUE(goes_back());
  const kernel::vec3 ray = to_kernel(fixture_.view(0).rays(pixel.y, pixel.x));
  kernel::vec2 place;
  ASSERT_TRUE(kernel::cpu::position_in_source(
      fixture_.context(), 1, ray, ray.x * near.x() + ray.y * near.y() + ray.z * near.z(), place));
  // What lies above: the pixel in which the point lands stays seen.
  const cv::Rect above(static_cast<int>(place.x) - 1, static_cast<int>(place.y) - 1, 4, 2);
  fixture_.view(1).image()(above).setTo(MASKED_INTENSITY);
  fixture_.interpolate();
  EXPECT_FALSE(goes_back());
}

/// A veil of light, a black level or a tone curve of one camera adds to what it shows.
TEST(VoteBetweenExposures, ContrastTellsGainAndOffset) {
  KernelFixture fixture(fisheye_rig(96), wide_range("fast"));
  fixture.set_reference(0);
  for (const auto& [gain, offset] :
       {std::pair(1.0f, 0.0f), {0.6f, 0.0f}, {1.6f, -0.3f}, {0.5f, 0.3f}, {0.15f, 0.5f}}) {
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 96; ++x) {
        const float shown = 0.3f + 0.05f * static_cast<float>((3 * x / 10 + 5 * y / 10) % 7);
        const bool other_point = (x / 10 + 3 * (y / 10)) % 10 == 0;
        fixture.view(0).image()(y, x) = gain * shown + offset;
        fixture.view(0).checks(y, x) = cv::Vec4f(1, 0, other_point ? 1 - shown : shown, 0);
      }
    }
    const kernel::vec2 exposure = kernel::cpu::exposure_around(fixture.context(), 1, {48, 48});
    for (const float shown : {0.3f, 0.6f}) {
      EXPECT_NEAR(exposure.x * shown + exposure.y, gain * shown + offset, 0.01)
          << gain << " and " << offset;
    }
  }
}

TEST(VoteInOneOfTwoSources, AsksTheSourceOfTheCheck) {
  KernelFixture fixture(rig_of_baselines(96, {0.5, 1}), wide_range("fast"));
  fixture.set_reference(0);
  fixture.view(0).image().setTo(0.5);
  // Sources of different exposure by turns.
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      fixture.view(0).checks(y, x) =
          x / 10 % 2 == 0 ? cv::Vec4f(1, 0, 0.25f, 0) : cv::Vec4f(2, 0, 0.5f, 0);
    }
  }
  for (const auto& [source, gain] : {std::pair(1, 2.0f), {2, 1.0f}}) {
    const kernel::vec2 exposure = kernel::cpu::exposure_around(fixture.context(), source, {48, 48});
    EXPECT_NEAR(exposure.x, gain, 0.01) << "source " << source;
    EXPECT_NEAR(exposure.y, 0, 0.01) << "source " << source;
  }
  const auto asked = [&] {
    kernel::vec2 velocity;
    const kernel::vec3 ray = to_kernel(fixture.view(0).rays(48, 48));
    return kernel::cpu::checked_source(fixture.context(), {48, 48}, ray, 0.5f, velocity);
  };
  EXPECT_EQ(asked(), 1);
  fixture.view(0).checks(48, 48)[3] = REASON_INCONSISTENT | REASON_FILLED;
  EXPECT_EQ(asked(), 2) << "the check was of the plane that was rejected";
}

}  // namespace
}  // namespace widestereo::test
