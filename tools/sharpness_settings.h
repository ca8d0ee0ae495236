// SPDX-License-Identifier: MIT
// The command line's option that makes the images of a pair equally sharp before they are matched.
#pragma once

#include <CLI/CLI.hpp>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "image_checks.h"
#include "widestereo/rig.h"

class SharpnessSettings {
 public:
  /// Adds --blur.
  void add_to(CLI::App& command);
  /// Standard deviations of the Gaussians that blur the views' images, pixels, as given or else
  /// found, which is said; one image for each view, and of two views their pair.
  std::vector<double> blurs(const widestereo::Rig& rig, const std::vector<cv::Mat>& images,
                            const std::vector<MatchedViews>& pairs) const;

 private:
  std::vector<double> given_;  ///< none, one for all views or one for each
};

/// Each image blurred as its view is.
std::vector<cv::Mat> blurred(const std::vector<cv::Mat>& images, const std::vector<double>& blurs);
