// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "widestereo/rig.h"

namespace widestereo {

/// Another view's image, warped to where the distances say that its pixels lie.
struct SynthesisedView {
  cv::Mat image;       ///< CV_32FC1, grey levels, of the distance map's size
  cv::Mat visible;     ///< CV_8UC1, 255 where the point has a distance and the other view sees it
  long distances = 0;  ///< pixels with a distance, a ray and not masked in the view
};

/// `distance`: CV_32FC1, metres along the rays of `view` (<= 0 or non-finite: none); `other_image`:
/// CV_8UC1, grey levels. A point is hidden when another one that lands in the same cell of 2x2
/// pixels of the other image (a fixed grid from its corner) is nearer to the other camera by more
/// than 5 %. Throws Error for other types and sizes than those of the calibration, and where both
/// views have one centre.
SynthesisedView synthesise_view(const cv::Mat& distance, const View& view,
                                const cv::Mat& other_image, const View& other);

/// Quality without ground truth: correlation (ZNCC) of the view's image and the synthesised one in
/// windows of 11x11 pixels, of which 70 % or more are visible and whose grey levels deviate by 3 or
/// more. An image that took no part in matching makes it independent of the matcher's own cost.
/// Shares and means over nothing are NaN (null in JSON).
struct SynthesisScores {
  double visible = 0;  ///< share of SynthesisedView::distances that the other view sees
  long windows = 0;    ///< scored
  double mean = 0;     ///< of their ZNCC
  double above_0_7 = 0, above_0_8 = 0, above_0_9 = 0;  ///< shares of them
};

/// `image`: CV_8UC1, grey levels, of the view that was synthesised. Throws Error for maps of other
/// types or of different sizes.
SynthesisScores synthesis_scores(const cv::Mat& image, const SynthesisedView& synthesised);

/// The scores as a line and as JSON text.
std::string to_table(const SynthesisScores& scores);
std::string to_json(const SynthesisScores& scores);

}  // namespace widestereo
