// SPDX-License-Identifier: MIT
#include "widestereo/sharpness.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "calibration/match_rays.h"
#include "geometry/pixel_angle.h"
#include "geometry/validation.h"
#include "statistics/percentile.h"
#include "statistics/robust.h"
#include "text/number.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

// Standard deviations, pixels, of the scales compared. At the finer one noise hardly counts around
// features yet; the coarser one says how strong their edges are.
constexpr double fine_scale = 0.7;
constexpr double coarse_scale = 2;
constexpr int window = 9;
constexpr float weakest_edge = 1.0F / 255;  // per pixel, at the coarse scale
constexpr std::size_t fewest_matches = 30;
constexpr double largest_scale = 1.2;  // of a feature in one image to that in the other
constexpr double smallest_blur = 0.7;  // noise in one image looks like less
constexpr double largest_blur = 3;
constexpr double blur_of_a_pixel = 0.5;  // pixels: of a square as a camera integrates over it
constexpr int directions = 24;           // each way over an image
constexpr double bisection_end = 0.01;
constexpr double certain = 3;  // standard errors

/// Mean squared gradient (per pixel) of the surroundings of each pixel, at one scale.
cv::Mat edge_energy(const cv::Mat& intensity, double scale) {
  const cv::Mat smooth = blurred(intensity, scale);
  cv::Mat dx;
  cv::Mat dy;
  cv::Sobel(smooth, dx, CV_32F, 1, 0, 3, 1.0 / 8);
  cv::Sobel(smooth, dy, CV_32F, 0, 1, 3, 1.0 / 8);
  cv::Mat energy = dx.mul(dx) + dy.mul(dy);
  cv::blur(energy, energy, {window, window});
  return energy;
}

cv::Point pixel_of(const Eigen::Vector2d& point, const cv::Mat& image) {
  return {std::clamp(cvRound(point.x()), 0, image.cols - 1),
          std::clamp(cvRound(point.y()), 0, image.rows - 1)};
}

/// Whether a feature is about as large in both images: detail of another size would pass for blur.
class EqualScale {
 public:
  EqualScale(const View& first, const View& second)
      : rays_(first, second), motion_(source_from_reference(second, first)) {}

  bool operator()(const PixelMatch& match) const {
    Eigen::Vector3d ray_first;
    Eigen::Vector3d ray_second;
    if (!rays_.find(match, ray_first, ray_second)) return false;
    const auto angle_first = pixel_angle(rays_.first_camera(), match.first);
    const auto angle_second = pixel_angle(rays_.second_camera(), match.second);
    if (!angle_first || !angle_second) return false;
    // The law of sines gives the ratio of the distances.
    const Eigen::Vector3d baseline = motion_.translation();
    const double to_first = baseline.cross(motion_.linear() * ray_first).norm();
    const double to_second = baseline.cross(ray_second).norm();
    const double distance_ratio = baseline.isZero() ? 1 : to_second / to_first;
    const double scale = distance_ratio * *angle_first / *angle_second;
    return scale < largest_scale && scale > 1 / largest_scale;
  }

 private:
  MatchRays rays_;
  Eigen::Isometry3d motion_;
};

/// At each point the logarithm of the fine scale's share; NaN where there is no edge.
std::vector<double> detail_at(const cv::Mat& intensity, const std::vector<cv::Point>& points) {
  const cv::Mat fine = edge_energy(intensity, fine_scale);
  const cv::Mat coarse = edge_energy(intensity, coarse_scale);
  std::vector<double> detail;
  for (const cv::Point& point : points) {
    const float edge = coarse.at<float>(point);
    detail.push_back(edge < weakest_edge * weakest_edge
                         ? std::nan("")
                         : std::log(static_cast<double>(fine.at<float>(point) / edge)));
  }
  return detail;
}

struct Estimate {
  double value = 0;
  double error = 0;  ///< standard deviation
};

/// By how much `a` exceeds `b` where both are known, by the median; none from too few.
std::optional<Estimate> excess(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> differences;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (std::isfinite(a[i] - b[i])) differences.push_back(a[i] - b[i]);
  }
  if (differences.size() < fewest_matches) return std::nullopt;
  Estimate estimate{.value = percentile(differences, 0.5)};
  for (double& difference : differences) difference = std::abs(difference - estimate.value);
  // A median's deviation, from the median absolute one of what it is taken of.
  estimate.error = 1.253 * deviations_per_median * percentile(differences, 0.5) /
                   std::sqrt(static_cast<double>(differences.size()));
  return estimate;
}

}  // namespace

std::optional<SharpnessDifference> compare_sharpness(const View& first, const View& second,
                                                     const cv::Mat& first_image,
                                                     const cv::Mat& second_image,
                                                     const std::vector<PixelMatch>& matches) {
  cv::Mat sharp = to_intensity(first_image, "The first image");
  cv::Mat blunt = to_intensity(second_image, "The second image");
  sharp *= contrast_gain(sharp, usual_max_gain);
  blunt *= contrast_gain(blunt, usual_max_gain);
  const EqualScale equal_scale(first, second);
  std::vector<cv::Point> in_sharp;
  std::vector<cv::Point> in_blunt;
  for (const PixelMatch& match : matches) {
    if (!equal_scale(match)) continue;
    in_sharp.push_back(pixel_of(match.first, sharp));
    in_blunt.push_back(pixel_of(match.second, blunt));
  }
  std::vector<double> detail = detail_at(sharp, in_sharp);
  std::vector<double> target = detail_at(blunt, in_blunt);
  const auto found = excess(detail, target);
  if (!found || std::abs(found->value) < certain * found->error) return std::nullopt;
  SharpnessDifference difference;
  if (found->value < 0) {
    difference.sharper = 1;
    std::swap(sharp, blunt);
    std::swap(in_sharp, in_blunt);
    std::swap(detail, target);
  }
  double low = 0;
  double high = largest_blur;
  while (high - low > bisection_end) {
    difference.blur = (low + high) / 2;
    const auto left = excess(detail_at(blurred(sharp, difference.blur), in_sharp), target);
    (left && left->value > 0 ? low : high) = difference.blur;
  }
  if (difference.blur < smallest_blur) return std::nullopt;
  return difference;
}

double blur_of_finer_pixels(const View& view, const View& other) {
  validate(view.camera, "The view's camera");
  validate(other.camera, "The other view's camera");
  const MatchRays rays(view, other);
  const Eigen::Matrix3d rotation = source_from_reference(other, view).linear();
  std::vector<double> scales;  // pixels of the view for one of the other's
  for_each_of_grid(view.camera, directions, [&](const Eigen::Vector2d& pixel) {
    PixelMatch match{.first = pixel, .second = {}};
    Eigen::Vector3d ray;
    Eigen::Vector3d ray_of_other;
    if (!rays.first_camera().unproject(match.first, ray) ||
        !rays.second_camera().project_into_image(rotation * ray, match.second) ||
        !rays.find(match, ray, ray_of_other)) {
      return;
    }
    const auto angle = pixel_angle(rays.first_camera(), match.first);
    const auto other_angle = pixel_angle(rays.second_camera(), match.second);
    if (angle && other_angle) scales.push_back(*other_angle / *angle);
  });
  if (scales.empty()) return 0;
  const double scale = percentile(scales, 0.5);
  return scale < largest_scale ? 0 : blur_of_a_pixel * std::sqrt(scale * scale - 1);
}

cv::Mat blurred(const cv::Mat& image, double blur) {
  if (!(blur >= 0 && blur <= most_blur)) {
    throw Error("A blur of " + text_of(blur) + " pixels is not possible; give 0 to " +
                text_of(most_blur) + ".");
  }
  require_pixels(image, "The image to blur");
  if (image.depth() != CV_8U && image.depth() != CV_16U && image.depth() != CV_32F) {
    throw Error("The image to blur is " + cv::typeToString(image.type()) +
                "; give one of 8 or 16 bits, or of floats.");
  }
  if (blur == 0) return image;
  cv::Mat result;
  // Not from what lies beside a part of a larger image.
  cv::GaussianBlur(image, result, {}, blur, blur, cv::BORDER_REPLICATE | cv::BORDER_ISOLATED);
  return result;
}

}  // namespace widestereo
