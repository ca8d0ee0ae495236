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
  /// Share of matches whose point lies behind the first camera, at 0.3 degrees of parallax or more,
  /// or more than 2 pixels along the curve from where the second image has what is infinitely far.
  double behind = 0;
  /// Percentiles 5, 50, 95 of the distance (metres) from the first camera, over matches below 5
  /// pixels with at least 0.3 degrees of parallax; zeros without any. They suggest a distance
  /// range.
  double nearest = 0, typical = 0, farthest = 0;
};

/// SIFT features matched mutually with a ratio test; both images 8 or 16 bit. Throws Error.
std::vector<PixelMatch> match_features(const cv::Mat& first, const cv::Mat& second);

/// Whether most of the points lie behind the cameras. Then the epipolar error tells nothing: where
/// cameras look the same way, it is as small with one in the other's place.
bool lie_behind(const EpipolarReport& report);

/// Scores matches between two calibrated views, those on masked pixels and at the epipole left out.
/// Throws Error when there are fewer than 8 or the views share a centre.
EpipolarReport check_epipolar(const View& first, const View& second,
                              const std::vector<PixelMatch>& matches);

/// Whether matched features lie within a range of distances from the first camera.
struct RangeReport {
  int matches = 0;  ///< within a pixel of their epipolar curves
  int nearer = 0;   ///< of these, by more than 2 pixels in the second image
  int farther = 0;  ///< likewise; points behind the cameras, where rays diverge, are not
  /// Percentiles 1 and 99 of the distances (metres) of matches with at least 0.3 degrees of
  /// parallax, points behind the cameras left out; zeros without any.
  double nearest = 0, farthest = 0;
};

/// Matches on masked pixels and at the epipole are left out. Throws Error when the views share a
/// centre, or for distances that are not 0 < min_distance < max_distance.
RangeReport check_range(const View& first, const View& second,
                        const std::vector<PixelMatch>& matches, double min_distance,
                        double max_distance);

}  // namespace widestereo
