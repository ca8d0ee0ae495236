// SPDX-License-Identifier: MIT
#include "widestereo/view_selection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <set>

#include "error_of.h"
#include "geometry/angle.h"

namespace widestereo {
namespace {

using Groups = std::vector<std::vector<std::size_t>>;

/// 90 degrees across, at a place, turned about the vertical.
View view_at(double x, double degrees = 0) {
  View view;
  view.camera.width = view.camera.height = 101;
  view.camera.fx = view.camera.fy = 50.5;
  view.camera.cx = view.camera.cy = 50;
  view.world_from_camera =
      Eigen::Translation3d(x, 0, 0) *
      Eigen::AngleAxisd(degrees * radians_per_degree, Eigen::Vector3d::UnitY());
  return view;
}

TEST(AssumedPoints, LieInFrontOfTheViewsAllOverTheRange) {
  const std::vector<View> views = {view_at(0), view_at(0, 180), view_at(0.01)};
  const std::vector<ObservedPoint> points = assumed_points(views, 1, 16);
  ASSERT_EQ(points.size(), 3 * 64 * 4U);
  std::set<long> distances;
  std::size_t shared = 0;
  for (std::size_t i = 0; i < 64 * 4; ++i) {  // of the first view
    const Eigen::Vector3d& position = points[i].position;
    EXPECT_GT(position.z(), 0);
    distances.insert(std::lround(1000 * position.norm()));
    ASSERT_FALSE(points[i].observers.empty());
    EXPECT_EQ(points[i].observers.front(), 0U);
    shared += points[i].observers == std::vector<std::size_t>{0, 2};
  }
  for (std::size_t i = 64 * 4; i < 2 * 64 * 4; ++i) {  // of the second view, which looks back
    EXPECT_LT(points[i].position.z(), 0);
    EXPECT_EQ(points[i].observers, std::vector<std::size_t>{1});
  }
  EXPECT_EQ(shared, 64 * 4U) << "neither behind the camera nor beyond the other image";
  // The middles of four equal steps of the logarithm.
  EXPECT_EQ(distances, (std::set<long>{1414, 2828, 5657, 11314}));
}

TEST(AssumedPoints, LieInImagesOfAnyShape) {
  View view = view_at(0);
  view.camera.width = 301;
  view.camera.cx = 150;
  double highest = 0, farthest_left = 0;
  for (const ObservedPoint& point : assumed_points({view}, 1, 16)) {
    EXPECT_EQ(point.observers.size(), 1U);
    highest = std::min(highest, point.position.y() / point.position.z());
    farthest_left = std::min(farthest_left, point.position.x() / point.position.z());
  }
  // The middles of the outermost of eight rows and columns.
  EXPECT_NEAR(highest, -7 / 8.0, 1e-9);
  EXPECT_NEAR(farthest_left, -7 / 8.0 * 301 / 101, 1e-9);
}

TEST(AssumedPoints, AreNotSeenThroughMasks) {
  std::vector<View> views = {view_at(0), view_at(0.01)};
  views[1].mask = cv::Mat(101, 101, CV_8UC1, cv::Scalar(255));
  views[1].mask.colRange(0, 51) = 0;
  std::size_t shared = 0, of_second = 0;
  const std::vector<ObservedPoint> points = assumed_points(views, 1, 16);
  EXPECT_EQ(points.size(), (64 + 32) * 4U) << "masked pixels assume none";
  for (const ObservedPoint& point : points) {
    if (point.observers.size() == 2) ++shared;
    if (point.observers.back() == 1) ++of_second;
    if (point.observers.back() == 1) {
      EXPECT_GT(point.position.x(), 0);
    }
  }
  EXPECT_EQ(shared, of_second);  // the first view sees all that the second one does
  EXPECT_EQ(of_second, 2 * 32 * 4U);
}

/// Otherwise work would grow with the cube of the number of views.
TEST(AssumedPoints, AreListedForAFewViewsThatSuit) {
  std::vector<View> views;
  for (int i = 0; i < 150; ++i) views.push_back(view_at(0.02 * i));
  std::vector<std::size_t> listed(views.size());
  double last = 0;
  for (const ObservedPoint& point :
       assumed_points(views, 3.3, 3.5, [&last](double share) { last = share; })) {
    ASSERT_LE(point.observers.size(), 64U);
    EXPECT_TRUE(std::is_sorted(point.observers.begin(), point.observers.end()));
    for (const std::size_t observer : point.observers) {
      ++listed[observer];
      const View& view = views[observer];
      EXPECT_GT((view.world_from_camera.inverse() * point.position).z(), 0);
    }
  }
  EXPECT_EQ(last, 1);
  // By the points on their own rays, at least.
  EXPECT_GE(*std::min_element(listed.begin(), listed.end()), 4 * 4 * 4U);
}

TEST(AssumedPoints, AreListedForTheirOwnViewAndOthersOfManyBaselines) {
  std::vector<View> views;
  for (int i = 0; i < 200; ++i) views.push_back(view_at(0.01 * i));
  const std::vector<ObservedPoint> points = assumed_points(views, 3.3, 3.5);
  constexpr std::size_t of_view = 4 * 4 * 4;
  ASSERT_EQ(points.size(), views.size() * of_view);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_TRUE(std::ranges::binary_search(points[i].observers, i / of_view)) << i;
  }
  std::set<long> centimetres;
  constexpr long middle = 75;
  for (std::size_t i = 0; i < of_view; ++i) {
    for (const std::size_t observer : points[middle * of_view + i].observers) {
      const long away = std::abs(static_cast<long>(observer) - middle);
      if (away > 0) centimetres.insert(away);
    }
  }
  // The best 63 are less far away.
  EXPECT_GT(*centimetres.begin(), 20) << "whose angles tell little";
  EXPECT_GT(*centimetres.rbegin(), 75);
  EXPECT_LT(*centimetres.rbegin(), 100);
}

/// From behind, views see a point ahead under smaller angles than from before it.
TEST(AssumedPoints, AreSeenByMoreViewsFromBehindThanFromBefore) {
  std::vector<View> views;
  for (int i = 0; i < 200; ++i) {
    views.push_back(view_at(0));
    views.back().world_from_camera.translation().z() = 0.02 * i;
  }
  const std::vector<ObservedPoint> points = assumed_points(views, 3.3, 3.5);
  constexpr std::size_t of_view = 4 * 4 * 4;
  constexpr int middle = 100;
  std::set<int> places;  // along the way, from the middle one
  for (std::size_t i = 0; i < of_view; ++i) {
    for (const std::size_t observer : points[middle * of_view + i].observers) {
      if (observer != middle) places.insert(static_cast<int>(observer) - middle);
    }
  }
  const auto first_ahead = places.lower_bound(0);
  ASSERT_NE(first_ahead, places.begin());
  ASSERT_NE(first_ahead, places.end());
  EXPECT_LT(*first_ahead, -*std::prev(first_ahead));
  EXPECT_LT(*places.begin(), -75);
}

/// The nearest ones tell no distances.
TEST(ViewSelection, ViewsOfACameraThatStoodStillAreMatchedWithOthers) {
  std::vector<View> views;
  for (int i = 0; i < 100; ++i) views.push_back(view_at(1e-5 * i));
  for (int i = 1; i <= 40; ++i) views.push_back(view_at(0.02 * i));
  std::vector<Eigen::Vector3d> centres;
  for (const View& view : views) centres.push_back(view.world_from_camera.translation());
  const ViewSelection selection(centres, assumed_points(views, 3.3, 3.5));
  for (std::size_t i = 0; i < 100; ++i) {
    EXPECT_GT(centres[selection.sources(i, 1).at(0)].x(), 0.2);
  }
  for (const std::vector<std::size_t>& group : selection.groups(2)) {
    ASSERT_EQ(group.size(), 2U);
    EXPECT_GT(std::abs(centres[group[0]].x() - centres[group[1]].x()), 0.1);
  }
}

TEST(ViewSelection, NeverPairsViewsOfOnePlace) {
  const std::vector<View> views = {view_at(0), view_at(0, 10), view_at(0.5)};
  std::vector<Eigen::Vector3d> centres;
  for (const View& view : views) centres.push_back(view.world_from_camera.translation());
  const ViewSelection selection(centres, assumed_points(views, 2, 10));
  EXPECT_EQ(selection.sources(0, 5), (std::vector<std::size_t>{2}));
  EXPECT_EQ(selection.groups(3), (Groups{{0, 2}, {1, 2}}));
}

TEST(ViewSelection, PrefersBaselinesThatSuitTheScene) {
  std::vector<View> views;
  std::vector<Eigen::Vector3d> centres;
  for (int i = 0; i < 8; ++i) {
    views.push_back(view_at(0.1 * i));
    centres.push_back(views.back().world_from_camera.translation());
  }
  // 5 degrees at 3.4 m are 0.3 m in front of the cameras, and more to their sides.
  const ViewSelection near(centres, assumed_points(views, 3.3, 3.5));
  EXPECT_EQ(near.sources(0, 1), (std::vector<std::size_t>{4}));
  const ViewSelection far(centres, assumed_points(views, 7.9, 8.1));
  EXPECT_EQ(far.sources(0, 1), (std::vector<std::size_t>{7}));
}

TEST(ViewSelection, CountsObserversOnce) {
  const std::vector<Eigen::Vector3d> centres = {{0, 0, 0}, {0.9, 0, 0}, {-0.9, 0, 0}};
  const std::vector<ObservedPoint> points = {
      {{0, 0, 10}, {0, 1, 1, 1}}, {{0, 0, 10}, {2, 0}}, {{0, 0, 10}, {0, 2}}};
  EXPECT_EQ(ViewSelection(centres, points).sources(0, 2), (std::vector<std::size_t>{2, 1}));
}

/// So many points that two views share.
struct Shared {
  std::size_t first, second;
  int points;
};

/// Of views at the corners of a square, which see them under angles of about the same worth.
ViewSelection selection_of(const std::vector<Shared>& pairs) {
  std::vector<ObservedPoint> points;
  for (const Shared& pair : pairs) {
    points.insert(points.end(), static_cast<std::size_t>(pair.points),
                  {{0.5, 0.5, 10}, {pair.first, pair.second}});
  }
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, points};
}

TEST(ViewSelection, GroupsAreJoinedByWhatAllMembersShareWith) {
  // View 2 has most in common with view 0, but little with view 1.
  EXPECT_EQ(
      selection_of({{0, 1, 20}, {0, 2, 18}, {0, 3, 10}, {1, 2, 2}, {1, 3, 10}}).groups(3).front(),
      (std::vector<std::size_t>{0, 1, 3}));
}

TEST(ViewSelection, ViewsOfAGroupJoinAnotherOneWhereTheyShareTwiceAsMuch) {
  const auto with = [](int shared) {
    return selection_of({{0, 1, 100}, {2, 0, shared}, {2, 3, 20}}).groups(2);
  };
  EXPECT_EQ(with(30), (Groups{{0, 1}, {2, 3}}));
  EXPECT_EQ(with(50), (Groups{{0, 1}, {2, 0}, {3, 2}}));
}

TEST(ViewSelection, NumbersOfNoViewAreErrors) {
  const std::vector<Eigen::Vector3d> centres = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const std::string asked = test::error_of([&] { (void)ViewSelection(centres, {}).sources(3, 1); });
  EXPECT_NE(asked.find("no view number 3 among its 3"), std::string::npos) << asked;
  const std::string observed = test::error_of([&] {
    (void)ViewSelection(centres, {{{0, 0, 10}, {0, 7}}});
  });
  EXPECT_NE(observed.find("no view number 7 among its 3"), std::string::npos) << observed;
}

}  // namespace
}  // namespace widestereo
