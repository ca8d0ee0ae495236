// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>

#include "widestereo/evaluation.h"

namespace widestereo {

/// In GroundTruth::occlusion, of what the source view sees.
inline constexpr uchar visible_label = 255;
inline constexpr uchar hidden_label = 0;
inline constexpr uchar outside_label = 128;  ///< its image or field of view

/// Throws Error unless a distance map and what it is scored against are as GroundTruth documents
/// them.
void require_truth(const cv::Mat& distance, const GroundTruth& truth);

}  // namespace widestereo
