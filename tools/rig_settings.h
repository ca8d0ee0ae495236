// SPDX-License-Identifier: MIT
// The command line's options of a calibrated rig, shared by all commands that match images.
#pragma once

#include <CLI/CLI.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/rig.h"

struct RigSettings {
  std::string calibration;
  std::vector<int> views;          ///< cameras of the calibration; empty: the first ones
  std::vector<std::string> masks;  ///< none, one for all images or one for each
  double max_theta = 0;            ///< degrees, 0 = as calibrated

  /// Adds --calibration, --views, --mask and --max-theta.
  void add_to(CLI::App& command);
  /// The calibrated views of `image_count` images, in their order, with masks; `size` of the first
  /// image.
  widestereo::Rig rig_for_images(std::size_t image_count, cv::Size size) const;
};
