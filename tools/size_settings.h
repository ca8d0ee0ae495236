// SPDX-License-Identifier: MIT
// The command line's option to match images smaller than they are.
#pragma once

#include <CLI/CLI.hpp>
#include <opencv2/core/mat.hpp>
#include <string>

#include "widestereo/rig.h"

class SizeSettings {
 public:
  static constexpr const char* of_a_match =
      "Largest width and height to match at, pixels; larger images are reduced first, and results "
      "have their size then";

  /// Adds --max-image-size.
  void add_to(CLI::App& command, const std::string& help = of_a_match);
  /// A calibrated view as it is matched.
  widestereo::View reduced(const widestereo::View& calibrated) const;
  /// Its image likewise. Throws Error unless it has the calibrated size; `name` begins the message.
  cv::Mat reduced(const cv::Mat& image, const widestereo::View& calibrated,
                  const std::string& name) const;

  /// Largest width and height, pixels; 0 = as large as they are.
  int value() const { return largest_side_; }

 private:
  cv::Size size_of(const widestereo::Camera& camera) const;

  int largest_side_ = 0;  ///< pixels, 0 = as large as they are
};
