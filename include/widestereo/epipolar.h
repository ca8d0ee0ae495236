// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/rig.h"

namespace widestereo {

/// A pair of pixels believed to show the same point.
struct PixelMatch {
  Eigen::Vector2d first;
  Eigen::Vector2d second;
};

/// How well matched features obey the calibration. False matches are included, so medians count.
struct EpipolarReport {
  int matches = 0;
  double median_pixels = 0;   ///< distance in the second image to the epipolar curve
  double median_degrees = 0;  ///< angle of the second ray to the epipolar plane
  double below_1_pixel = 0;   ///< share of matches
  double below_5_pixels = 0;  ///< share of matches
  /// Share of matches whose point, at 0.3 degrees of parallax or more, lies behind the first
  /// camera.
  double behind = 0;
  /// Percentiles 5, 50, 95 of the distance (metres) from the first camera, over matches below 5
  /// pixels with at least 0.3 degrees of parallax; zeros without any. They suggest a distance
  /// range.
  double nearest = 0, typical = 0, farthest = 0;
};

/// SIFT features matched mutually with a ratio test; both images 8 or 16 bit. Throws Error.
std::vector<PixelMatch> match_features(const cv::Mat& first, const cv::Mat& second);

/// Scores matches between two calibrated views, those on masked pixels and at the epipole left out.
/// Throws Error when there are fewer than 8 or the views share a centre.
EpipolarReport check_epipolar(const View& first, const View& second,
                              const std::vector<PixelMatch>& matches);

}  // namespace widestereo
