// SPDX-License-Identifier: MIT
#include "widestereo/fusion.h"

#include <gtest/gtest.h>

#include <array>
#include <opencv2/core.hpp>
#include <utility>

#include "error_of.h"
#include "widestereo/synthesis.h"

namespace widestereo {
namespace {

constexpr int side = 64;
// {X : normal . X = offset}, metres.
const Eigen::Vector3d plane_normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
constexpr double plane_offset = 2;

double from_plane(const CloudPoint& point) {
  return plane_normal.dot(point.position.cast<double>()) - plane_offset;
}

/// Three fisheye views side by side with the true maps of a plane.
class Fusion : public ::testing::Test {
 protected:
  Fusion() {
    Rig rig = demo_rig(side);
    rig.views.push_back(rig.views[1]);
    rig.views[2].world_from_camera.translation() *= 2;
    const RenderedPair scene = render_plane(rig, plane_normal, plane_offset);
    for (std::size_t i = 0; i < 3; ++i) {
      views_.push_back(scene.rig.views[i]);
      const RenderedView& rendered = scene.views[i];
      maps_.push_back(
          {.distance = rendered.truth.distance.clone(),
           .normals = rendered.truth.normals.clone(),
           .image = rendered.image,
           .confidence = cv::Mat(side, side, CV_32FC1, cv::Scalar(std::array{0.6, 0.7, 0.5}[i]))});
    }
  }
  PointCloud fuse_all(const FusionOptions& options = {}) {
    return fuse(
        views_, {{1, 2}, {0, 2}, {0, 1}}, [this](std::size_t i) { return maps_[i]; }, options);
  }
  std::size_t pixels_with_distance() const {
    int count = 0;
    for (const ViewMaps& maps : maps_) count += cv::countNonZero(maps.distance > 0);
    return static_cast<std::size_t>(count);
  }

  std::vector<View> views_;
  std::vector<ViewMaps> maps_;
};

TEST_F(Fusion, ViewsOfOneSurfaceBecomeOneLayerOfPointsOnIt) {
  const PointCloud cloud = fuse_all();
  // Views see nearly the same: little more points than one of them has pixels.
  const int one = cv::countNonZero(maps_[0].distance > 0);
  EXPECT_GT(cloud.size(), 0.9 * one);
  EXPECT_LT(cloud.size(), 1.5 * one);
  double largest = 0;
  for (const CloudPoint& point : cloud) {
    // Near the rim planes are far and oblique; pixels differ by half of one there.
    const double distance = point.position.norm();
    if (distance > 5) continue;
    largest = std::max(largest, std::abs(from_plane(point)) / distance);
    EXPECT_NEAR(std::abs(point.normal.cast<double>().dot(plane_normal)), 1, 1e-5);
    EXPECT_GE(point.confidence, 0.6F);  // the surest of two views at least
  }
  EXPECT_LT(largest, 1e-5);
}

TEST_F(Fusion, WhatMasksExcludeIsNoPointOfTheirViews) {
  FusionOptions options;
  options.min_views = 1;
  const cv::Mat nothing = cv::Mat::zeros(side, side, CV_8UC1);
  views_[0].mask = views_[2].mask = nothing;
  EXPECT_EQ(fuse_all(options).size(),
            static_cast<std::size_t>(cv::countNonZero(maps_[1].distance > 0)));
  views_[1].mask = nothing;
  EXPECT_TRUE(fuse_all(options).empty());
}

TEST_F(Fusion, PointsOfOneViewAloneNeedToBeAskedFor) {
  maps_[1].distance = maps_[2].distance = cv::Mat::zeros(side, side, CV_32FC1);
  EXPECT_TRUE(fuse_all().empty());
  FusionOptions options;
  options.min_views = 1;
  EXPECT_EQ(fuse_all(options).size(), pixels_with_distance());
  options.min_views = 3;
  EXPECT_TRUE(fuse_all(options).empty());
}

TEST_F(Fusion, WhatAgreesWithNoOtherViewIsLeftOut) {
  const cv::Rect patch(24, 24, 16, 16);
  maps_[0].distance(patch) *= 0.9;
  for (const CloudPoint& point : fuse_all()) {
    if (point.position.norm() < 5) {
      EXPECT_LT(std::abs(from_plane(point)), 0.03);
    }
  }
  FusionOptions options;
  options.min_views = 1;
  const auto off = [](const PointCloud& cloud) {
    return std::count_if(cloud.begin(), cloud.end(), [](const CloudPoint& point) {
      return point.position.norm() < 5 && std::abs(from_plane(point)) > 0.1;
    });
  };
  EXPECT_EQ(off(fuse_all(options)), patch.area());
}

TEST_F(Fusion, WhatMoreViewsSeeThroughThanHaveIsLeftOut) {
  for (int i : {1, 2}) {
    views_.push_back(views_[i]);
    maps_.push_back(maps_[i]);
  }
  views_.push_back(views_[1]);
  maps_.push_back(maps_[1]);
  // Two views agree on something 10 % nearer than the plane.
  const cv::Rect patch(24, 24, 16, 16);
  for (int i : {0, 3}) {
    maps_[i].distance = maps_[i].distance.clone();
    maps_[i].distance(patch) *= 0.9;
  }
  views_[3].world_from_camera = views_[0].world_from_camera;
  maps_[3] = maps_[0];
  const auto wrong_of = [this](const std::vector<std::size_t>& others, int min_views) {
    std::vector<std::vector<std::size_t>> lists(views_.size());
    lists[0] = others;
    FusionOptions options;
    options.min_views = min_views;
    const PointCloud cloud = fuse(
        views_, lists, [this](std::size_t i) { return maps_[i]; }, options);
    return std::count_if(cloud.begin(), cloud.end(), [](const CloudPoint& point) {
      return point.position.norm() < 5 && std::abs(from_plane(point)) > 0.1;
    });
  };
  EXPECT_EQ(wrong_of({3}, 2), patch.area());
  EXPECT_EQ(wrong_of({3, 1, 2}, 2), patch.area());
  EXPECT_EQ(wrong_of({3, 1, 2, 4}, 2), 0);
  EXPECT_GE(wrong_of({3, 1, 2, 4}, 1), patch.area());
}

TEST_F(Fusion, AsManyOthersAreLookedAtAsMemoryAllows) {
  constexpr std::size_t count = 14;
  std::vector<std::vector<std::size_t>> others(count);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      if (j != i) others[i].push_back(j);
    }
  }
  const std::vector<View> same(count, views_[0]);
  const auto one = static_cast<std::size_t>(cv::countNonZero(maps_[0].distance > 0));
  const auto maps = [this](std::size_t) { return maps_[0]; };
  FusionOptions options;
  options.min_views = count;
  EXPECT_EQ(fuse(same, others, maps, options).size(), one);
  options.cache_bytes = 1;
  EXPECT_TRUE(fuse(same, others, maps, options).empty());
  options.min_views = 11;  // ten others
  EXPECT_EQ(fuse(same, others, maps, options).size(), one);
}

TEST_F(Fusion, ViewsThatAreNotComparedWithEachOtherShareTheirPoints) {
  const std::vector<View> same(6, views_[0]);
  const auto maps = [this](std::size_t) { return maps_[0]; };
  const std::vector<std::vector<std::size_t>> chain = {{1}, {0}, {1}, {0}, {1}, {0}};
  const auto one = static_cast<std::size_t>(cv::countNonZero(maps_[0].distance > 0));
  EXPECT_EQ(fuse(same, chain, maps).size(), one);
  // Views that make no point of their own hand points on.
  const std::vector<std::vector<std::size_t>> line = {{1}, {0}, {1}, {2}, {3}, {4}};
  EXPECT_EQ(fuse(same, line, maps).size(), one);
}

TEST_F(Fusion, PointsAreSharedAtEveryDistance) {
  const std::vector<View> same(6, views_[0]);
  const std::vector<std::vector<std::size_t>> chain = {{1}, {0}, {1}, {0}, {1}, {0}};
  const cv::Mat has_distance = maps_[0].distance > 0;
  const auto one = static_cast<std::size_t>(cv::countNonZero(has_distance));
  for (double metres = 0.5; metres < 2; metres *= 1.04) {
    maps_[0].distance.setTo(metres, has_distance);
    ASSERT_EQ(fuse(same, chain, [this](std::size_t) { return maps_[0]; }).size(), one) << metres;
  }
}

TEST_F(Fusion, AViewIsNoOtherOfItself) {
  const auto with_itself = [this](int min_views) {
    FusionOptions options;
    options.min_views = min_views;
    return fuse(
        {views_[0]}, {{0}}, [this](std::size_t) { return maps_[0]; }, options);
  };
  EXPECT_FALSE(with_itself(1).empty());
  EXPECT_TRUE(with_itself(2).empty());
}

TEST_F(Fusion, AViewListedTwiceIsOneView) {
  const auto fused = [this](std::vector<std::size_t> of_first, int min_views) {
    FusionOptions options;
    options.min_views = min_views;
    return fuse(
        {views_[0], views_[1]}, {std::move(of_first), {}},
        [this](std::size_t i) { return maps_[i]; }, options);
  };
  EXPECT_FALSE(fused({1}, 2).empty());
  EXPECT_TRUE(fused({1, 1}, 3).empty());
  const PointCloud once = fused({1}, 2), twice = fused({1, 0, 1}, 2);
  ASSERT_EQ(twice.size(), once.size());
  for (std::size_t i = 0; i < once.size(); ++i) {
    ASSERT_EQ(twice[i].position, once[i].position) << i;
  }
}

/// A wall that each view is little nearer to than the one it is compared with.
TEST_F(Fusion, CoarsePointsAreNotHandedOnToEverFinerPixels) {
  Rig rig = demo_rig(side);
  rig.views.resize(1, rig.views[0]);
  rig.views[0].world_from_camera.setIdentity();
  for (double distance = 2; distance > 1;) {
    distance *= 0.9;
    rig.views.push_back(rig.views[0]);
    rig.views.back().world_from_camera = Eigen::Translation3d(0, 0, 2 - distance);
  }
  const RenderedPair scene = render_plane(rig, Eigen::Vector3d::UnitZ(), 2);
  const auto points_ahead = [&](std::size_t first) {
    std::vector<View> views;
    std::vector<std::vector<std::size_t>> others;
    for (std::size_t i = first; i < scene.rig.views.size(); ++i) {
      others.push_back({views.empty() ? 1 : views.size() - 1});
      views.push_back(scene.rig.views[i]);
    }
    const PointCloud cloud = fuse(views, others, [&](std::size_t i) {
      return ViewMaps{.distance = scene.views[first + i].truth.distance,
                      .normals = {},
                      .image = {},
                      .confidence = {}};
    });
    return std::count_if(cloud.begin(), cloud.end(), [](const CloudPoint& point) {
      return point.position.head<2>().norm() < 0.5F;
    });
  };
  const auto fine = points_ahead(scene.rig.views.size() - 2);
  EXPECT_GT(10 * points_ahead(0), 7 * fine);
}

/// Two views of a wall 2 m ahead of the first one, which sees it half as finely as the other: from
/// twice the distance, or through a lens of half the focal length.
std::vector<Rig> coarse_and_fine() {
  Rig farther = demo_rig(side);
  farther.views[0].world_from_camera.setIdentity();
  farther.views[1].world_from_camera = farther.views[0].world_from_camera;
  Rig shorter = farther;
  farther.views[1].world_from_camera.translation().z() = 1;
  shorter.views[1].world_from_camera.translation().x() = 0.01;
  shorter.views[0] = resized(shorter.views[0], side / 2, side / 2);
  return {farther, shorter};
}

/// Points as fine as those of twice as far away are a quarter as many.
TEST_F(Fusion, CoarsePointsDoNotStandForFinePixels) {
  for (const Rig& rig : coarse_and_fine()) {
    const RenderedPair scene = render_plane(rig, Eigen::Vector3d::UnitZ(), 2);
    const auto maps = [&scene](std::size_t i) {
      return ViewMaps{
          .distance = scene.views[i].truth.distance, .normals = {}, .image = {}, .confidence = {}};
    };
    const auto points_ahead = [&](const std::vector<std::size_t>& order) {
      const std::vector<View> views = {scene.rig.views[order[0]], scene.rig.views[order[1]]};
      const PointCloud cloud =
          fuse(views, {{1}, {0}}, [&](std::size_t i) { return maps(order[i]); });
      return std::count_if(cloud.begin(), cloud.end(), [](const CloudPoint& point) {
        return point.position.head<2>().norm() < 0.5F;
      });
    };
    const auto fine = points_ahead({1, 0});
    const auto both = points_ahead({0, 1});
    // The coarse view's come first and take a quarter of the fine one's pixels.
    EXPECT_GT(10 * both, 8 * fine);
  }
}

/// What a view passes on of a wall is as fine as the finest point that its pixels are part of.
TEST_F(Fusion, PixelsOfACoarseAndAFinePointStandForTheFineOne) {
  Rig rig;
  for (const double distance : {2.0, 1.8, 1.55, 1.55}) {
    rig.views.push_back(views_[0]);
    rig.views.back().world_from_camera = Eigen::Translation3d(0, 0, 2 - distance);
  }
  const RenderedPair scene = render_plane(rig, Eigen::Vector3d::UnitZ(), 2);
  const auto points_ahead = [&scene](std::size_t count) {
    // The second view takes over the points of the first one, and joins finer ones of the third.
    std::vector<std::vector<std::size_t>> others = {{}, {0}, {1}, {1}};
    others.resize(count);
    FusionOptions options;
    options.min_views = 1;
    const PointCloud cloud = fuse(
        {scene.rig.views.begin(), scene.rig.views.begin() + static_cast<std::ptrdiff_t>(count)},
        others,
        [&scene](std::size_t i) {
          return ViewMaps{.distance = scene.views[i].truth.distance,
                          .normals = {},
                          .image = {},
                          .confidence = {}};
        },
        options);
    return std::count_if(cloud.begin(), cloud.end(), [](const CloudPoint& point) {
      return point.position.head<2>().norm() < 0.5F;
    });
  };
  EXPECT_EQ(points_ahead(2), points_ahead(1));
  EXPECT_GT(points_ahead(3), points_ahead(2));
  EXPECT_EQ(points_ahead(4), points_ahead(3)) << "which the fourth sees as finely";
}

TEST_F(Fusion, PointsHaveTheImagesColours) {
  maps_[0].image = cv::Mat(side, side, CV_8UC3, cv::Scalar(10, 20, 30));  // blue, green, red
  FusionOptions options;
  options.min_views = 1;
  const PointCloud cloud = fuse(
      {views_[0]}, {{}}, [this](std::size_t view) { return maps_[view]; }, options);
  ASSERT_FALSE(cloud.empty());
  EXPECT_EQ(cloud[0].red, 30);
  EXPECT_EQ(cloud[0].green, 20);
  EXPECT_EQ(cloud[0].blue, 10);
}

TEST_F(Fusion, NoiseIsAveraged) {
  cv::RNG random(3);
  for (ViewMaps& maps : maps_) {
    cv::Mat noise(side, side, CV_32FC1);
    random.fill(noise, cv::RNG::NORMAL, 1, 0.002);
    maps.distance = maps.distance.mul(noise);
  }
  const auto deviation = [](const PointCloud& cloud) {
    double sum = 0;
    int count = 0;
    for (const CloudPoint& point : cloud) {
      if (point.position.norm() > 3) continue;
      sum += from_plane(point) * from_plane(point);
      ++count;
    }
    return std::sqrt(sum / count);
  };
  FusionOptions alone, three;
  alone.min_views = 1;
  alone.max_relative = 0;
  three.min_views = 3;
  // Three independent measurements.
  EXPECT_NEAR(deviation(fuse_all(three)) / deviation(fuse_all(alone)), 1 / std::sqrt(3), 0.08);
}

TEST_F(Fusion, SurfacesSeenFromTheirTwoSidesStayApart) {
  for (int i : {1, 2}) maps_[i].normals *= -1;
  FusionOptions options;
  options.min_views = 3;
  EXPECT_TRUE(fuse_all(options).empty());
  options.max_normal_angle = 180;
  EXPECT_FALSE(fuse_all(options).empty());
}

/// A pixel and the one that it falls on in a view from the same place with pixels six times as
/// large, whose centre is 1.5 or 2.5 pixels away.
TEST_F(Fusion, PixelsFartherThanTheLargestDisplacementAreNotJoined) {
  View fine;
  fine.name = "fine";
  fine.camera.width = fine.camera.height = side;
  fine.camera.fx = fine.camera.fy = 120;
  fine.camera.cx = 31.5;
  fine.camera.cy = 32;
  View coarse = fine;
  coarse.name = "coarse";
  coarse.camera.width = coarse.camera.height = 11;
  coarse.camera.fx = coarse.camera.fy = 20;
  coarse.camera.cx = coarse.camera.cy = 5;
  const auto are_joined = [&](int column, double max_pixels) {
    cv::Mat distance = cv::Mat::zeros(side, side, CV_32FC1);
    distance.at<float>(32, column) = 2;
    const cv::Mat of_coarse(11, 11, CV_32FC1, cv::Scalar(2));
    FusionOptions options;
    options.max_pixels = max_pixels;
    const PointCloud cloud = fuse(
        {fine, coarse}, {{1}, {}},
        [&](std::size_t i) {
          return ViewMaps{.distance = i == 0 ? distance : of_coarse,
                          .normals = {},
                          .image = {},
                          .confidence = {}};
        },
        options);
    return cloud.size() == 1;
  };
  const double by_default = FusionOptions().max_pixels;
  for (const int side_of_centre : {-1, 1}) {
    const auto column = [&](double pixels) {
      return static_cast<int>(31.5 + side_of_centre * pixels);
    };
    EXPECT_TRUE(are_joined(column(1.5), by_default));
    EXPECT_FALSE(are_joined(column(2.5), by_default));
    EXPECT_FALSE(are_joined(column(1.5), 1.4));
    EXPECT_TRUE(are_joined(column(1.5), 1.6));
    EXPECT_FALSE(are_joined(column(2.5), 2.4));
    EXPECT_TRUE(are_joined(column(2.5), 2.6));
  }
}

/// A view that sees a wall twice as finely as another knows four times as much.
TEST_F(Fusion, FineViewsCountMore) {
  for (const Rig& rig : coarse_and_fine()) {
    const RenderedPair scene = render_plane(rig, Eigen::Vector3d::UnitZ(), 2);
    for (std::size_t i = 0; i < 2; ++i) {
      views_[i] = scene.rig.views[i];
      const cv::Mat& truth = scene.views[i].truth.distance;
      maps_[i] = {.distance = truth.clone(),
                  .normals = {},
                  .image = cv::Mat(truth.size(), CV_8UC3, cv::Scalar(0, 0, i == 0 ? 200 : 0)),
                  .confidence = {}};
    }
    const cv::Mat distance = 1.004 * maps_[0].distance;
    const cv::Rect middle(distance.cols / 2 - 1, distance.rows / 2 - 1, 2, 2);
    maps_[0].distance = cv::Mat::zeros(distance.size(), CV_32FC1);
    distance(middle).copyTo(maps_[0].distance(middle));
    const PointCloud cloud =
        fuse({views_[0], views_[1]}, {{1}, {}}, [this](std::size_t i) { return maps_[i]; });
    ASSERT_EQ(cloud.size(), static_cast<std::size_t>(middle.area()));
    for (const CloudPoint& point : cloud) {
      EXPECT_NEAR(point.red, 200 / 5.0, 2);
      EXPECT_NEAR(point.position.z(), 2 * (1 + 0.004 / 5), 2e-4);
    }
  }
}

TEST_F(Fusion, MemoryLimitsChangeTimeOnly) {
  int loads = 0;
  const auto counted = [&](std::size_t i) {
    ++loads;
    return maps_[i];
  };
  const std::vector<std::vector<std::size_t>> others = {{1, 2}, {0, 2}, {0, 1}};
  const PointCloud once = fuse(views_, others, counted);
  EXPECT_EQ(loads, 3);
  FusionOptions options;
  options.cache_bytes = 1;
  double done = 0;
  const PointCloud often =
      fuse(views_, others, counted, options, [&done](double share) { done = share; });
  EXPECT_GT(loads, 9);
  EXPECT_EQ(done, 1);
  ASSERT_EQ(often.size(), once.size());
  for (std::size_t i = 0; i < once.size(); ++i) EXPECT_EQ(often[i].position, once[i].position);
}

TEST_F(Fusion, IsAsPreciseInANationalGridFromALocalOrigin) {
  const auto near = static_cast<double>(fuse_all().size());
  const Eigen::Vector3d place(600'012.3, -5'700'099.6, 70.1);
  for (View& view : views_) view.world_from_camera.translation() += place;
  const Eigen::Vector3d origin = local_origin(views_.front());
  EXPECT_EQ(origin, Eigen::Vector3d(600'000, -5'700'000, 0));
  for (View& view : views_) view.world_from_camera.translation() -= origin;
  const PointCloud cloud = fuse_all();
  EXPECT_NEAR(static_cast<double>(cloud.size()), near, 0.01 * near);
  double largest = 0;
  for (CloudPoint point : cloud) {
    point.position = (point.position.cast<double>() + origin - place).cast<float>();
    if (point.position.norm() < 5) largest = std::max(largest, std::abs(from_plane(point)));
  }
  EXPECT_LT(largest, 1e-4);
}

/// Every pixel has a distance, but a lens of half the size has no ray for the corners.
TEST_F(Fusion, PixelsWithoutARayMakeNoPoints) {
  for (std::size_t i = 0; i < 3; ++i) {
    views_[i].camera.fx /= 2;
    views_[i].camera.fy /= 2;
    maps_[i].distance.setTo(2);
  }
  const cv::Mat rays = ray_image(views_[0].camera, {});
  ASSERT_EQ(rays.at<cv::Vec4f>(0, 0), cv::Vec4f(0, 0, 0, 0));
  FusionOptions options;
  options.min_views = 1;
  const PointCloud cloud = fuse_all(options);
  EXPECT_GT(cloud.size(), 1000U);
  for (const CloudPoint& point : cloud) {
    ASSERT_TRUE(point.position.allFinite());
    ASSERT_GT(point.position.norm(), 1);
  }
}

TEST_F(Fusion, WhatIsAsNearAsPositionsAreRoundedIsNoPoint) {
  for (std::size_t i = 0; i < 3; ++i) {
    views_[i].world_from_camera.translation() += Eigen::Vector3d(5, 5, 5);
  }
  FusionOptions options;
  options.min_views = 1;
  for (const double distance : {1e-9, 1e-7, 1e-5, 1e-3}) {
    for (ViewMaps& maps : maps_) maps.distance.setTo(distance, maps.distance > 0);
    const PointCloud cloud = fuse_all(options);
    EXPECT_EQ(cloud.empty(), distance < 5e-6) << distance;
    for (const CloudPoint& point : cloud) {
      ASSERT_TRUE(point.position.allFinite() && point.normal.allFinite()) << distance;
    }
  }
}

TEST_F(Fusion, RefusesLimitsAndViewsThatAreNone) {
  const auto error = [this](const FusionOptions& options) {
    return test::error_of([&] {
      fuse(
          views_, {{1}, {0}, {}}, [this](std::size_t i) { return maps_[i]; }, options);
    });
  };
  EXPECT_EQ(error({}), "");
  EXPECT_NE(error({.min_views = 0}).find("at least 0 views"), std::string::npos);
  EXPECT_NE(error({.max_relative = NAN}).find("difference of distance of fusion is nan"),
            std::string::npos);
  EXPECT_NE(error({.max_pixels = -1}).find("displacement of fusion is -1"), std::string::npos);
  EXPECT_NE(error({.max_normal_angle = NAN}).find("angle of normals"), std::string::npos);
  views_[2].world_from_camera.translation().y() = NAN;
  EXPECT_NE(error({}).find(views_[2].name + ": the pose is not a rigid motion"), std::string::npos);
}

TEST_F(Fusion, MapsThatDoNotFitAreNamed) {
  maps_[1].distance = cv::Mat::ones(4, 4, CV_32FC1);
  EXPECT_NE(test::error_of([this] { fuse_all(); }).find(views_[1].name), std::string::npos);
  const auto expect = [this](cv::Mat ViewMaps::*map, const cv::Mat& wrong,
                             const std::string& message) {
    const cv::Mat right = std::exchange(maps_[0].*map, wrong);
    EXPECT_NE(test::error_of([this] { fuse_all(); }).find(message + " of " + views_[0].name),
              std::string::npos)
        << message;
    maps_[0].*map = right;
  };
  maps_[1].distance = maps_[0].distance;
  expect(&ViewMaps::distance, {}, "The distance map");
  expect(&ViewMaps::distance, cv::Mat::ones(side, side, CV_64FC1), "The distance map");
  expect(&ViewMaps::normals, cv::Mat::ones(side, side, CV_64FC3), "The normal map");
  expect(&ViewMaps::normals, cv::Mat::ones(side, 4, CV_32FC3), "The normal map");
  expect(&ViewMaps::confidence, cv::Mat::ones(side, side, CV_8UC1), "The confidence map");
  expect(&ViewMaps::image, cv::Mat::ones(side, side, CV_32FC3), "The image");
  expect(&ViewMaps::image, cv::Mat::ones(side, 4, CV_8UC3), "The image");
  EXPECT_NE(test::error_of([this] {
              fuse(views_, {{}}, [this](std::size_t i) { return maps_[i]; });
            }).find("3 views"),
            std::string::npos);
  EXPECT_NE(test::error_of([this] {
              fuse(views_, {{1}, {3}, {}}, [this](std::size_t i) { return maps_[i]; });
            }).find("no view number 3 among its 3"),
            std::string::npos);
}

}  // namespace
}  // namespace widestereo
