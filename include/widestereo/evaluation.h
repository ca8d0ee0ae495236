// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/rig.h"

namespace widestereo {

/// What a distance map is scored against. Maps have the reference view's size.
struct GroundTruth {
  cv::Mat distance;   ///< CV_32FC1, metres along the unit ray; <= 0 or non-finite: no ground truth
  cv::Mat valid;      ///< empty, or CV_8UC1, 0 = do not score
  cv::Mat occlusion;  ///< empty, or CV_8UC1: 255 visible in the source view, 0 occluded, 128 outside it
  cv::Mat normals;    ///< empty, or CV_32FC3, unit, reference frame
};

/// Scores over one set of pixels. Shares lie in [0, 1]. A pixel without prediction counts as bad.
struct RegionScores {
  std::string region;               ///< "all", "non-occluded", "0-30", "30-60", "60-90", ">90" degrees
  long pixels = 0;                  ///< pixels scored
  double completeness = 0;          ///< share with a prediction
  std::map<double, double> bad_relative;  ///< threshold (0.005 = 0.5 %) -> share with larger relative error
  std::map<double, double> bad_pixels;    ///< threshold (px) -> share with larger displacement in the source
  double median_pixels = 0;         ///< px, predicted pixels
  double mean_absolute = 0;         ///< metres, predicted pixels
  double root_mean_square = 0;      ///< metres, predicted pixels
  double median_absolute = 0;       ///< metres, predicted pixels
  double median_relative = 0;       ///< share, predicted pixels
  double mean_normal_angle = -1;    ///< degrees, -1 where there are no normals
  double median_normal_angle = -1;  ///< degrees
};

/// Scores `distance` (CV_32FC1, metres along the ray; <= 0 or non-finite = no prediction) of view
/// `reference` against ground truth. Displacements are those of the predicted point's projection in view
/// `source` from the true one's; a point that does not project there counts as bad.
/// `normals` (may be empty) as in GroundTruth. Field-angle bands are taken over the non-occluded pixels.
std::vector<RegionScores> evaluate(const cv::Mat& distance, const cv::Mat& normals,
                                   const GroundTruth& truth, const View& reference,
                                   const View& source);

/// The scores as a fixed-width table and as JSON text.
std::string to_table(const std::vector<RegionScores>& scores);
std::string to_json(const std::vector<RegionScores>& scores);

/// BGR picture of the relative error: green <= 0.5 %, yellow about 2 %, red >= 5 %, blue = no prediction,
/// dimmed = occluded or outside the source view, black = no ground truth.
cv::Mat error_picture(const cv::Mat& distance, const GroundTruth& truth);

}  // namespace widestereo
