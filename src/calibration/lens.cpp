// SPDX-License-Identifier: MIT
#include "widestereo/lens.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <string>

#include "geometry/angle.h"
#include "geometry/validation.h"
#include "statistics/percentile.h"
#include "text/size_text.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

constexpr double ring_width = 0.5 * radians_per_degree;
constexpr std::size_t fewest_pixels = 10;                    // of a ring of a small image
constexpr std::size_t fewest_pixels_of_large = 50;           // of one from 200x200 pixels on
constexpr double fewest_share = 1 / 800.0;                   // of an image in between
constexpr std::size_t fewest_dark_rings = 3;                 // fewer may be noise
constexpr std::size_t plateau_begin = 40, plateau_end = 10;  // rings inside of the dark
constexpr float most_noise = 4.0F / 255;                     // of black pixels, as files have it
constexpr float noise_by_spread = 3;  // of those that surely are black: their median's to 95 %
constexpr double smallest_rim = 60 * radians_per_degree;
/// Reflections inside lenses reach no farther in.
constexpr double widest_reflections = 0.08;  // of the angle

/// Intensities by angle off the axis, from ring to ring.
std::vector<std::vector<float>> rings_of(const Camera& camera, const cv::Mat& brightest) {
  const cv::Mat rays = ray_image(camera, {});
  // One more for angles that round up.
  std::vector<std::vector<float>> rings(static_cast<std::size_t>(std::numbers::pi / ring_width) +
                                        2);
  for (int y = 0; y < rays.rows; ++y) {
    for (int x = 0; x < rays.cols; ++x) {
      const auto& ray = rays.at<cv::Vec4f>(y, x);
      if (ray[3] == 0) continue;
      const float theta = std::atan2(std::hypot(ray[0], ray[1]), ray[2]);
      rings[static_cast<std::size_t>(theta / static_cast<float>(ring_width))].push_back(
          brightest.at<float>(y, x));
    }
  }
  // A corner of few pixels says little.
  const auto share = static_cast<std::size_t>(fewest_share * static_cast<double>(rays.total()));
  const std::size_t fewest = std::clamp(share, fewest_pixels, fewest_pixels_of_large);
  while (!rings.empty() && rings.back().size() < fewest) rings.pop_back();
  return rings;
}

cv::Mat brightest_of(const Camera& camera, const std::vector<cv::Mat>& images) {
  cv::Mat brightest(camera.height, camera.width, CV_32FC1, cv::Scalar(0));
  for (const cv::Mat& image : images) {
    if (image.size() != brightest.size()) {
      throw Error("The rim of a lens needs images of the calibrated size, " +
                  size_text(camera.width, camera.height) + " pixels, not " +
                  size_text(image.cols, image.rows) + ".");
    }
    cv::max(brightest, to_intensity(image, "An image"), brightest);
  }
  return brightest;
}

}  // namespace

bool may_show_rim(const Camera& camera) {
  const PreparedCamera prepared(camera);
  const double right = camera.width - 1, bottom = camera.height - 1;
  const Eigen::Vector2d corners[] = {{0, 0}, {right, 0}, {0, bottom}, {right, bottom}};
  return std::any_of(std::begin(corners), std::end(corners), [&](const Eigen::Vector2d& corner) {
    Eigen::Vector3d ray;
    return !prepared.unproject(corner, ray) ||
           std::atan2(ray.head<2>().norm(), ray.z()) >= smallest_rim;
  });
}

std::optional<LensRim> find_lens_rim(const Camera& camera, const std::vector<cv::Mat>& images) {
  validate(camera, "The camera of a rim");
  const cv::Mat brightest = brightest_of(camera, images);
  std::vector<std::vector<float>> rings = rings_of(camera, brightest);
  if (rings.size() < fewest_dark_rings) return std::nullopt;
  std::vector<float> dark_pixels;
  for (auto ring = rings.end() - fewest_dark_rings; ring != rings.end(); ++ring) {
    dark_pixels.insert(dark_pixels.end(), ring->begin(), ring->end());
  }
  const float black = percentile(dark_pixels, 0.5);
  // Cameras with fewer bits than their files have as much less noise.
  const auto gain = static_cast<float>(contrast_gain(brightest, usual_max_gain));
  const float noise = std::clamp(noise_by_spread * (percentile(dark_pixels, 0.95) - black),
                                 most_noise / gain, most_noise);
  const auto outermost = [&](std::size_t count, double share, float level) {
    while (count > 0 && percentile(rings[count - 1], share) - black <= level) --count;
    return count;
  };
  // Rings of which next to nothing is brighter than black.
  const std::size_t lit = outermost(rings.size(), 0.95, noise);
  if (rings.size() - lit < fewest_dark_rings) return std::nullopt;
  std::vector<float> inside;
  for (std::size_t i = lit - std::min(lit, plateau_begin); i + plateau_end < lit; ++i) {
    if (!rings[i].empty()) inside.push_back(percentile(rings[i], 0.5) - black);
  }
  const std::size_t bright = outermost(lit, 0.5, std::max(percentile(inside, 0.5), noise) / 2);
  LensRim rim;
  rim.dark = static_cast<double>(lit) * ring_width;
  rim.usable =
      std::max(static_cast<double>(bright) * ring_width, (1 - widest_reflections) * rim.dark);
  if (rim.usable < smallest_rim) return std::nullopt;
  return rim;
}

}  // namespace widestereo
