// SPDX-License-Identifier: MIT
#include "widestereo/epipolar.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>

#include "data_folder.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

Rig rig_with_rotation_error(double degrees) {
  Rig rig;
  rig.views.resize(2);
  for (int i = 0; i < 2; ++i) {
    Camera& c = rig.views[i].camera;
    rig.views[i].name = "cam" + std::to_string(i);
    c.model = CameraModel::double_sphere;
    c.width = c.height = 512;
    c.fx = c.fy = 158;
    c.cx = c.cy = 255;
    c.xi = -0.17;
    c.alpha = 0.59;
  }
  rig.views[1].world_from_camera =
      Eigen::Translation3d(0.1, 0, 0) *
      Eigen::AngleAxisd(degrees * radians_per_degree, Eigen::Vector3d::UnitX());
  return rig;
}

/// Of as many of the points that `next_point` gives, in the first camera's frame, as both see.
template <typename NextPoint>
std::vector<PixelMatch> matches_of_points(const Rig& rig, std::size_t count,
                                          const NextPoint& next_point) {
  std::vector<PixelMatch> matches;
  while (matches.size() < count) {
    const Eigen::Vector3d point = next_point();
    PixelMatch match;
    if (project(rig.views[0].camera, point, match.first) &&
        project(rig.views[1].camera, rig.views[1].world_from_camera.inverse() * point,
                match.second)) {
      matches.push_back(match);
    }
  }
  return matches;
}

std::vector<PixelMatch> exact_matches(const Rig& rig) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> unit(-1, 1);
  return matches_of_points(rig, 400, [&] {
    return Eigen::Vector3d(2 * unit(random), 2 * unit(random), 1.6 + 0.5 * unit(random));
  });
}

TEST(Epipolar, ExactMatchesHaveNoErrorAndTheirDistances) {
  const Rig rig = rig_with_rotation_error(0);
  const EpipolarReport report = check_epipolar(rig.views[0], rig.views[1], exact_matches(rig));
  EXPECT_EQ(report.matches, 400);
  EXPECT_LT(report.median_pixels, 1e-6);
  EXPECT_EQ(report.below_1_pixel, 1);
  EXPECT_EQ(report.below_5_pixels, 1);
  EXPECT_EQ(report.behind, 0);
  EXPECT_GT(report.nearest, 1.1);
  EXPECT_LT(report.farthest, 3.6);
  EXPECT_GT(report.typical, report.nearest);
}

TEST(Epipolar, MeasuresAKnownRotationError) {
  // One degree about the baseline moves every epipolar plane by up to one degree.
  const std::vector<PixelMatch> matches = exact_matches(rig_with_rotation_error(0));
  const Rig wrong = rig_with_rotation_error(1);
  const EpipolarReport report = check_epipolar(wrong.views[0], wrong.views[1], matches);
  EXPECT_GT(report.median_degrees, 0.4);
  EXPECT_LT(report.median_degrees, 1.01);
  EXPECT_GT(report.median_pixels, 1);
  EXPECT_LT(report.median_pixels, 4);
}

TEST(Epipolar, TellsHowManyMatchesAreOffAndHowManyLieBehind) {
  const Rig rig = rig_with_rotation_error(0);
  std::vector<PixelMatch> matches = exact_matches(rig);
  // Across epipolar lines, which are horizontal near the middle: a quarter by 3 pixels, a quarter
  // by 7.
  std::erase_if(matches, [](const PixelMatch& match) {
    return (match.second - Eigen::Vector2d(255, 255)).norm() > 60;
  });
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (i % 4 < 2) matches[i].second.y() += i % 4 == 0 ? 3 : 7;
  }
  const double one = 1.0 / static_cast<double>(matches.size());
  const EpipolarReport report = check_epipolar(rig.views[0], rig.views[1], matches);
  EXPECT_NEAR(report.below_1_pixel, 0.5, one);
  EXPECT_NEAR(report.below_5_pixels, 0.75, one);
  EXPECT_EQ(report.behind, 0);

  matches = exact_matches(rig);
  for (std::size_t i = 0; i < matches.size(); i += 4) {
    std::swap(matches[i].first, matches[i].second);
  }
  EXPECT_EQ(check_epipolar(rig.views[0], rig.views[1], matches).behind, 0.25);
  EXPECT_FALSE(lie_behind({.behind = 0.45}));
  EXPECT_TRUE(lie_behind({.behind = 0.55}));
}

TEST(Epipolar, DistancesAreFromTheFirstCameraHoweverTheSecondIsTurned) {
  const Rig rig = rig_with_rotation_error(25);
  const std::vector<PixelMatch> matches = exact_matches(rig);
  std::vector<double> distances;
  for (const PixelMatch& match : matches) {
    Eigen::Vector3d first, second;
    ASSERT_TRUE(unproject(rig.views[0].camera, match.first, first));
    ASSERT_TRUE(unproject(rig.views[1].camera, match.second, second));
    // first * distance = centre + second * its distance, by least squares
    Eigen::Matrix<double, 3, 2> rays;
    rays << first, -(rig.views[1].world_from_camera.linear() * second);
    distances.push_back(
        (rays.transpose() * rays).ldlt().solve(rays.transpose() * Eigen::Vector3d(0.1, 0, 0)).x());
  }
  std::sort(distances.begin(), distances.end());
  const EpipolarReport report = check_epipolar(rig.views[0], rig.views[1], matches);
  EXPECT_LT(report.median_pixels, 1e-6);
  EXPECT_EQ(report.behind, 0);
  // Ranks of the percentiles may be counted in different ways.
  EXPECT_NEAR(report.nearest, distances[20], distances[22] - distances[18]);
  EXPECT_NEAR(report.typical, distances[200], distances[202] - distances[198]);
  EXPECT_NEAR(report.farthest, distances[380], distances[382] - distances[378]);
}

/// At infinity noise alone makes half of all points lie behind.
TEST(Epipolar, FarMatchesTellNoDistance) {
  const Rig rig = rig_with_rotation_error(25);
  std::vector<PixelMatch> matches = exact_matches(rig);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    Eigen::Vector3d ray;
    ASSERT_TRUE(unproject(rig.views[0].camera, matches[i].first, ray));
    const Eigen::Vector3d turned = rig.views[1].world_from_camera.linear().transpose() * ray;
    ASSERT_TRUE(project(rig.views[1].camera, turned, matches[i].second));
    matches[i].second.x() += i % 2 == 0 ? 0.2 : -0.2;
  }
  const EpipolarReport report = check_epipolar(rig.views[0], rig.views[1], matches);
  EXPECT_EQ(report.matches, 400);
  EXPECT_EQ(report.behind, 0);
  EXPECT_EQ(report.nearest, 0);
  EXPECT_EQ(report.farthest, 0);
}

/// As of swapped cameras: some pixels are much where a lens is long, however small the angle.
TEST(Epipolar, SmallAnglesOfLongLensesTellWhatLiesBehind) {
  Rig rig = rig_with_rotation_error(0);
  for (View& view : rig.views) {
    view.camera.model = CameraModel::pinhole;
    view.camera.fx = view.camera.fy = 2000;
    view.camera.xi = view.camera.alpha = 0;
  }
  for (const double shift : {1.5, 3.0}) {  // 0.04 and 0.09 degrees
    std::vector<PixelMatch> matches;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector2d first(20 + 20 * (i % 20), 20 + 20 * (i / 20));
      matches.push_back({first, first + Eigen::Vector2d(shift, 0)});
    }
    const EpipolarReport report = check_epipolar(rig.views[0], rig.views[1], matches);
    EXPECT_EQ(report.matches, 400);
    EXPECT_EQ(report.behind, shift > 2 ? 1 : 0);
    EXPECT_EQ(lie_behind(report), shift > 2);
    EXPECT_EQ(check_range(rig.views[0], rig.views[1], matches, 1, 200).farther, 0);
  }
}

TEST(Epipolar, FalseMatchesTellNoDistance) {
  const Rig rig = rig_with_rotation_error(0);
  const std::vector<PixelMatch> right = exact_matches(rig);
  std::vector<PixelMatch> matches = right;
  std::erase_if(matches, [](const PixelMatch& match) {
    return (match.second - Eigen::Vector2d(255, 255)).norm() > 60;
  });
  for (PixelMatch& match : matches) match.second += Eigen::Vector2d(-60, 12);  // as if near
  matches.insert(matches.end(), right.begin(), right.end());
  const EpipolarReport expected = check_epipolar(rig.views[0], rig.views[1], right);
  const EpipolarReport report = check_epipolar(rig.views[0], rig.views[1], matches);
  EXPECT_GT(report.matches, 410);
  EXPECT_EQ(report.nearest, expected.nearest);
  EXPECT_EQ(report.typical, expected.typical);
}

TEST(Epipolar, LeavesOutWhatIsMasked) {
  Rig rig = rig_with_rotation_error(0);
  const std::vector<PixelMatch> matches = exact_matches(rig);
  View& second = rig.views[1];
  second.mask = cv::Mat(512, 512, CV_8UC1, cv::Scalar(255));
  second.mask.colRange(0, 256).setTo(0);
  const auto seen = std::count_if(matches.begin(), matches.end(), [](const PixelMatch& match) {
    return std::round(match.second.x()) >= 256;
  });
  EXPECT_EQ(check_epipolar(rig.views[0], second, matches).matches, seen);
}

/// Of two things that look alike only one can be what the other view sees.
TEST(Epipolar, AFeatureIsMatchedOnce) {
  const auto pattern = [](int seed) {
    cv::Mat noise(160, 160, CV_8UC1);
    cv::RNG(seed).fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(noise, noise, {}, 2);
    return noise;
  };
  cv::Mat twice;
  cv::hconcat(std::vector<cv::Mat>{pattern(1), pattern(2), pattern(1)}, twice);
  cv::Mat once;
  cv::hconcat(std::vector<cv::Mat>{pattern(1), pattern(2), pattern(3)}, once);
  const std::vector<PixelMatch> matches = match_features(twice, once);
  EXPECT_GT(matches.size(), 50U);
  for (const PixelMatch& match : matches) {
    const auto is_rival = [&](const PixelMatch& other) {
      return other.second == match.second && (other.first - match.first).norm() > 10;
    };
    EXPECT_TRUE(std::none_of(matches.begin(), matches.end(), is_rival)) << match.first.transpose();
  }
}

/// Of night, or of cameras with fewer bits than their files.
TEST(Epipolar, FeaturesAreFoundInDarkImages) {
  cv::Mat image(160, 200, CV_32FC1);
  cv::RNG(6).fill(image, cv::RNG::UNIFORM, 0, 1);
  cv::GaussianBlur(image, image, {}, 2);
  cv::normalize(image, image, 0, 1, cv::NORM_MINMAX);
  const auto matches = [&image](int type, double brightest) {
    cv::Mat dark;
    image.convertTo(dark, type, brightest);
    return static_cast<double>(match_features(dark, dark).size());
  };
  const double usual = matches(CV_8U, 255);
  ASSERT_GT(usual, 200);
  EXPECT_GT(matches(CV_16U, 4095), 0.9 * usual);
  EXPECT_GT(matches(CV_16U, 1023), 0.9 * usual);
  EXPECT_GT(matches(CV_8U, 21), 0.8 * usual);
}

/// What is found at x must be found at the same place from the other end once the image is turned
/// upside down.
TEST(Epipolar, FeaturesLieWherePixelsDo) {
  cv::Mat noise(256, 320, CV_8UC1);
  cv::RNG(4).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {}, 2);
  cv::Mat turned;
  cv::rotate(noise, turned, cv::ROTATE_180);
  const std::vector<PixelMatch> matches = match_features(noise, turned);
  ASSERT_GT(matches.size(), 100U);
  std::vector<double> x, y;
  for (const PixelMatch& match : matches) {
    x.push_back(match.first.x() + match.second.x());
    y.push_back(match.first.y() + match.second.y());
  }
  const auto median = [](std::vector<double>& values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  EXPECT_NEAR(median(x), 319, 0.03);
  EXPECT_NEAR(median(y), 255, 0.03);
}

TEST(Epipolar, NeedsMatches) {
  const Rig rig = rig_with_rotation_error(0);
  EXPECT_THROW(check_epipolar(rig.views[0], rig.views[1], {}), Error);
  const cv::Mat flat(128, 128, CV_8UC1, cv::Scalar(90));
  EXPECT_TRUE(match_features(flat, flat).empty());
}

TEST(Epipolar, NeedsABaseline) {
  const std::vector<PixelMatch> matches = exact_matches(rig_with_rotation_error(0));
  Rig rig = rig_with_rotation_error(1);
  rig.views[1].world_from_camera.translation().setZero();
  EXPECT_NE(test::error_of([&] {
              check_epipolar(rig.views[0], rig.views[1], matches);
            }).find("cam0 and cam1 have the same centre"),
            std::string::npos);
}

/// Where any ray lies in an epipolar plane.
TEST(Epipolar, LeavesOutMatchesAtTheEpipole) {
  const Rig rig = rig_with_rotation_error(0);
  std::vector<PixelMatch> matches = exact_matches(rig);
  PixelMatch epipole;
  ASSERT_TRUE(project(rig.views[0].camera, {1, 0, 0}, epipole.first));
  epipole.second = epipole.first - Eigen::Vector2d(0, 30);
  matches.push_back(epipole);
  EXPECT_EQ(check_epipolar(rig.views[0], rig.views[1], matches).matches, 400);
}

/// Matches of points up to 45 degrees off the first camera's axis at a distance from it.
std::vector<PixelMatch> matches_at(const Rig& rig, double distance, std::size_t count) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  return matches_of_points(rig, count, [&]() -> Eigen::Vector3d {
    return distance * Eigen::Vector3d(unit(random), unit(random), 1.5).normalized();
  });
}

TEST(Range, OfDistancesIsCheckedByFeatures) {
  for (const double turned : {0, 25}) {
    const Rig rig = rig_with_rotation_error(turned);
    std::vector<PixelMatch> matches;
    const auto add = [&](double distance, std::size_t count) {
      const std::vector<PixelMatch> more = matches_at(rig, distance, count);
      matches.insert(matches.end(), more.begin(), more.end());
    };
    add(0.6, 40);
    add(2, 300);
    add(4.1, 80);  // less than a pixel beyond 4
    add(50, 60);
    add(1e6, 20);
    const auto report = [&](double min, double max) {
      return check_range(rig.views[0], rig.views[1], matches, min, max);
    };
    const RangeReport all = report(0.5, 100);
    EXPECT_EQ(all.matches, 500);
    EXPECT_EQ(all.nearer, 0);
    EXPECT_EQ(all.farther, 0) << "what lies at infinity is hardly displaced";
    EXPECT_NEAR(all.nearest, 0.6, 1e-6);
    EXPECT_NEAR(all.farthest, 4.1, 1e-6) << "farther ones have too little parallax";
    const RangeReport part = report(1, 4);
    EXPECT_EQ(part.matches, 500);
    EXPECT_EQ(part.nearer, 40);
    EXPECT_EQ(part.farther, 80);
    EXPECT_EQ(report(5, 100).nearer, 40 + 300);
    EXPECT_EQ(report(0.1, 0.3).farther, 500);
    EXPECT_EQ(report(0.1, 0.3).nearer, 0);
  }
}

TEST(Range, EndsWithoutAPercentOfOutliers) {
  const Rig rig = rig_with_rotation_error(0);
  std::vector<PixelMatch> matches = matches_at(rig, 2, 300);
  for (const double distance : {0.6, 8.0}) {
    const std::vector<PixelMatch> outliers = matches_at(rig, distance, 2);
    matches.insert(matches.end(), outliers.begin(), outliers.end());
  }
  const RangeReport report = check_range(rig.views[0], rig.views[1], matches, 0.1, 100);
  EXPECT_NEAR(report.nearest, 2, 1e-6);
  EXPECT_NEAR(report.farthest, 2, 1e-6);
}

TEST(Range, IsNotToldByWhatDoesNotFitTheCalibration) {
  const Rig rig = rig_with_rotation_error(0);
  std::vector<PixelMatch> matches = matches_at(rig, 2, 100);
  for (std::size_t i = 0; i < 30; ++i) {
    // Rays that diverge; and a match of something else, off its epipolar curve.
    if (i % 2 == 0) std::swap(matches[i].first, matches[i].second);
    if (i % 2 == 1) matches[i].second += Eigen::Vector2d(-40, 20);
  }
  const RangeReport report = check_range(rig.views[0], rig.views[1], matches, 1, 4);
  EXPECT_EQ(report.matches, 85);
  EXPECT_EQ(report.nearer, 0);
  EXPECT_EQ(report.farther, 0);
  EXPECT_NEAR(report.nearest, 2, 1e-6);
  EXPECT_NEAR(report.farthest, 2, 1e-6);
  EXPECT_EQ(check_range(rig.views[0], rig.views[1], {}, 1, 4).matches, 0);
  for (const auto& [min, max] : {std::pair(0.0, 4.0), {4.0, 4.0}, {1.0, std::nan("")}}) {
    EXPECT_THROW(check_range(rig.views[0], rig.views[1], matches, min, max), Error);
  }
}

TEST(Epipolar, RealPairsAreAsGoodAsTheirCalibration) {
  SKIP_WITHOUT_STEREO_SETS();
  const auto set = test::data_folder() / "real/vfs_t265_fs";
  const Rig rig = read_calibration(set / "calib.yaml").rig;
  const EpipolarReport report =
      check_epipolar(rig.views[0], rig.views[1],
                     match_features(read_image(set / "cam0.png"), read_image(set / "cam1.png")));
  EXPECT_GT(report.matches, 500);
  EXPECT_LT(report.median_pixels, 0.4);
  EXPECT_NEAR(report.typical, 1.3, 0.4);
}

}  // namespace
}  // namespace widestereo
