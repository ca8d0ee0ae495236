// SPDX-License-Identifier: MIT
#include "widestereo/epipolar.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <string>

#include "calibration/match_rays.h"
#include "geometry/angle.h"
#include "geometry/validation.h"
#include "io/intensity_range.h"
#include "statistics/percentile.h"
#include "text/number.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

constexpr double ratio = 0.8;
constexpr std::size_t fewest_matches = 8;
constexpr double at_epipole = 1e-6;     // radians
constexpr double least_parallax = 0.3;  // degrees, to tell a distance
constexpr double out_of_range = 2;      // pixels beyond an end of a range, or beyond infinity
/// SIFT looks for features in an image of twice the size, and takes pixel 2 x of it for pixel x,
/// whose middle lies a quarter of a pixel farther.
constexpr float sift_offset = 0.25f;

struct Features {
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
};

/// SIFT on a contrast-equalised image, descriptors in Hellinger form (square roots of shares).
Features detect(const cv::Mat& image, const std::string& name) {
  // Before it is rounded, so that dark and hazy images, and those of cameras with fewer bits than
  // their files, have as many.
  constexpr double outliers = 0.005;
  constexpr double least_contrast = 0.01;
  const cv::Mat intensity = to_intensity(image, name);
  const auto [darkest, brightest] = intensity_range(intensity, outliers);
  const double scale = 255 / std::max(brightest - darkest, least_contrast);
  cv::Mat grey;
  intensity.convertTo(grey, CV_8U, scale, -scale * darkest);
  cv::createCLAHE(3, {8, 8})->apply(grey, grey);
  Features features;
  cv::SIFT::create(6000)->detectAndCompute(grey, {}, features.points, features.descriptors);
  for (cv::KeyPoint& point : features.points) {
    point.pt -= cv::Point2f(sift_offset, sift_offset);
  }
  for (int i = 0; i < features.descriptors.rows; ++i) {
    cv::Mat row = features.descriptors.row(i);
    row /= cv::norm(row, cv::NORM_L1) + 1e-9;
    cv::sqrt(row, row);
  }
  return features;
}

/// For every descriptor of `a` its match in `b` or -1, by the ratio test.
std::vector<int> best_matches(const cv::Mat& a, const cv::Mat& b) {
  std::vector<std::vector<cv::DMatch>> found;
  cv::BFMatcher(cv::NORM_L2).knnMatch(a, b, found, 2);
  std::vector<int> best(static_cast<std::size_t>(a.rows), -1);
  for (const auto& pair : found) {
    if (pair.size() == 2 &&
        static_cast<double>(pair[0].distance) < ratio * static_cast<double>(pair[1].distance)) {
      best[static_cast<std::size_t>(pair[0].queryIdx)] = pair[0].trainIdx;
    }
  }
  return best;
}

/// SIFT finds a point once for each of its orientations, which may be matched to different things.
/// Leaves out those whose point at one end (`end`) has another point at the other (`other`).
void remove_contradictions(std::vector<PixelMatch>& matches, Eigen::Vector2d PixelMatch::*end,
                           Eigen::Vector2d PixelMatch::*other) {
  constexpr double same_point = 2;  // pixels
  const auto place = [end](const PixelMatch& match) {
    return std::pair((match.*end).x(), (match.*end).y());
  };
  std::map<std::pair<double, double>, std::vector<Eigen::Vector2d>> others;
  for (const PixelMatch& match : matches) others[place(match)].push_back(match.*other);
  std::erase_if(matches, [&](const PixelMatch& match) {
    const std::vector<Eigen::Vector2d>& found = others[place(match)];
    return std::any_of(found.begin(), found.end(), [&](const Eigen::Vector2d& point) {
      return (point - match.*other).norm() > same_point;
    });
  });
}

/// What a pair of views says of a match.
struct TriangulatedMatch {
  double pixels = 0;               ///< in the second image, to the epipolar curve
  double degrees = 0;              ///< of the second ray to the epipolar plane
  double parallax = 0;             ///< degrees
  std::optional<double> distance;  ///< from the first camera; of enough parallax to tell
  bool is_behind = false;          ///< the first camera, as rays diverge by more than noise
  Eigen::Vector3d first_ray;
};

class EpipolarGeometry {
 public:
  /// `what`: begins the message where both views share a centre.
  EpipolarGeometry(const View& first, const View& second, const std::string& what)
      : rays_(first, second), motion_(source_from_reference(second, first)) {
    require_baseline(first, second, what);
  }

  /// Nothing where it is masked, or lies where a camera has no ray, or at the epipole.
  std::optional<TriangulatedMatch> find(const PixelMatch& match) const {
    Eigen::Vector3d ray_first;
    Eigen::Vector3d ray_second;
    if (!rays_.find(match, ray_first, ray_second)) return std::nullopt;
    const Eigen::Vector3d epipole = motion_.translation();
    const Eigen::Vector3d rotated = motion_.linear() * ray_first;
    const Eigen::Vector3d normal = epipole.cross(rotated);
    // A ray to the epipole lies in every epipolar plane.
    if (!(normal.norm() > at_epipole * epipole.norm())) return std::nullopt;
    const Eigen::Vector3d plane = normal.normalized();
    const double offset = plane.dot(ray_second);
    Eigen::Vector2d foot;
    if (!rays_.second_camera().project(ray_second - offset * plane, foot)) return std::nullopt;
    TriangulatedMatch found{
        .pixels = (foot - match.second).norm(),
        .degrees = std::abs(std::asin(std::clamp(offset, -1.0, 1.0))) * degrees_per_radian,
        .parallax = degrees_between(rotated, ray_second),
        .distance = std::nullopt,
        .is_behind = false,
        .first_ray = ray_first};
    const Eigen::Vector3d other = motion_.linear().transpose() * ray_second;
    const double distance =
        triangulated_distance(ray_first, other, motion_.inverse().translation());
    if (found.parallax >= least_parallax) found.distance = distance;
    Eigen::Vector2d infinite;
    found.is_behind =
        distance < 0 && (found.distance || (rays_.second_camera().project(rotated, infinite) &&
                                            (infinite - foot).norm() > out_of_range));
    return found;
  }

  /// Of the points of a ray at a distance.
  double parallax(const Eigen::Vector3d& first_ray, double distance) const {
    return degrees_between(motion_.linear() * first_ray, motion_ * (distance * first_ray));
  }

  /// Where the second image has the point of a ray of the first camera; false where it does not.
  bool project(const Eigen::Vector3d& first_ray, double distance, Eigen::Vector2d& pixel) const {
    return rays_.second_camera().project(motion_ * (distance * first_ray), pixel);
  }

 private:
  MatchRays rays_;
  Eigen::Isometry3d motion_;  // from the first camera to the second
};

}  // namespace

std::vector<PixelMatch> match_features(const cv::Mat& first, const cv::Mat& second) {
  const Features a = detect(first, "The first image");
  const Features b = detect(second, "The second image");
  std::vector<PixelMatch> matches;
  if (a.descriptors.rows < 2 || b.descriptors.rows < 2) return matches;
  const std::vector<int> forward = best_matches(a.descriptors, b.descriptors);
  const std::vector<int> backward = best_matches(b.descriptors, a.descriptors);
  for (std::size_t i = 0; i < forward.size(); ++i) {
    const int j = forward[i];
    if (j < 0 || backward[static_cast<std::size_t>(j)] != static_cast<int>(i)) continue;
    const cv::Point2d u = a.points[i].pt;
    const cv::Point2d v = b.points[static_cast<std::size_t>(j)].pt;
    matches.push_back({{u.x, u.y}, {v.x, v.y}});
  }
  remove_contradictions(matches, &PixelMatch::first, &PixelMatch::second);
  remove_contradictions(matches, &PixelMatch::second, &PixelMatch::first);
  return matches;
}

bool lie_behind(const EpipolarReport& report) { return report.behind > 0.5; }

EpipolarReport check_epipolar(const View& first, const View& second,
                              const std::vector<PixelMatch>& matches) {
  const EpipolarGeometry geometry(first, second, "The epipolar check");
  std::vector<double> pixels;
  std::vector<double> angles;
  std::vector<double> distances;
  int behind = 0;
  for (const PixelMatch& match : matches) {
    const auto found = geometry.find(match);
    if (!found) continue;
    pixels.push_back(found->pixels);
    angles.push_back(found->degrees);
    behind += found->is_behind;
    if (!found->distance) continue;
    if (*found->distance > 0 && found->pixels < 5) distances.push_back(*found->distance);
  }
  if (pixels.size() < fewest_matches) {
    throw Error("Only " + std::to_string(pixels.size()) + " features match between " + first.name +
                " and " + second.name +
                "; the images need overlap, texture and the calibrated size to be checked.");
  }
  const auto share_below = [&](double limit) {
    return static_cast<double>(std::count_if(pixels.begin(), pixels.end(),
                                             [limit](double p) { return p < limit; })) /
           static_cast<double>(pixels.size());
  };
  EpipolarReport report;
  report.matches = static_cast<int>(pixels.size());
  report.median_pixels = percentile(pixels, 0.5);
  report.median_degrees = percentile(angles, 0.5);
  report.below_1_pixel = share_below(1);
  report.below_5_pixels = share_below(5);
  report.behind = static_cast<double>(behind) / report.matches;
  report.nearest = percentile(distances, 0.05);
  report.typical = percentile(distances, 0.5);
  report.farthest = percentile(distances, 0.95);
  return report;
}

RangeReport check_range(const View& first, const View& second,
                        const std::vector<PixelMatch>& matches, double min_distance,
                        double max_distance) {
  if (!(min_distance > 0 && min_distance < max_distance)) {
    throw Error("A range of distances from " + text_of(min_distance) + " to " +
                text_of(max_distance) + " holds none; give 0 < min < max.");
  }
  constexpr double on_curve = 1;  // pixels
  const EpipolarGeometry geometry(first, second, "The check of the range");
  RangeReport report;
  std::vector<double> distances;
  for (const PixelMatch& match : matches) {
    const auto found = geometry.find(match);
    if (!found || found->pixels > on_curve) continue;
    ++report.matches;
    if (found->is_behind) continue;
    if (found->distance) distances.push_back(*found->distance);
    const auto displaced_from = [&](double distance) {
      Eigen::Vector2d pixel;
      return geometry.project(found->first_ray, distance, pixel) &&
             (pixel - match.second).norm() > out_of_range;
    };
    if (found->parallax < geometry.parallax(found->first_ray, max_distance)) {
      report.farther += displaced_from(max_distance);
    } else if (found->parallax > geometry.parallax(found->first_ray, min_distance)) {
      report.nearer += displaced_from(min_distance);
    }
  }
  report.nearest = percentile(distances, 0.01);
  report.farthest = percentile(distances, 0.99);
  return report;
}

}  // namespace widestereo
