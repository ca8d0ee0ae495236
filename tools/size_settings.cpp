// SPDX-License-Identifier: MIT
#include "size_settings.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "geometry/validation.h"

namespace ws = widestereo;

void SizeSettings::add_to(CLI::App& command, const std::string& help) {
  command.add_option("--max-image-size", largest_side_, help)
      ->check(CLI::Range(32, ws::largest_image_side));
}

cv::Size SizeSettings::size_of(const ws::Camera& camera) const {
  const int side = std::max(camera.width, camera.height);
  if (largest_side_ == 0 || side <= largest_side_) return {camera.width, camera.height};
  const double factor = static_cast<double>(largest_side_) / side;
  return {std::max(cvRound(factor * camera.width), 2),
          std::max(cvRound(factor * camera.height), 2)};
}

ws::View SizeSettings::reduced(const ws::View& calibrated) const {
  const cv::Size size = size_of(calibrated.camera);
  return ws::resized(calibrated, size.width, size.height);
}

cv::Mat SizeSettings::reduced(const cv::Mat& image, const ws::View& calibrated,
                              const std::string& name) const {
  ws::require_calibrated_size(image, calibrated, name);
  const cv::Size size = size_of(calibrated.camera);
  if (size == image.size()) return image;
  cv::Mat smaller;
  cv::resize(image, smaller, size, 0, 0, cv::INTER_AREA);
  return smaller;
}
