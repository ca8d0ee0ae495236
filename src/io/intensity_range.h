// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <utility>

namespace widestereo {

/// The darkest and the brightest intensity (CV_32FC1, negative = masked) of an image, but for a
/// share of outliers each, by a sample; (0, 0) where all are masked.
std::pair<double, double> intensity_range(const cv::Mat& intensity, double outliers);

}  // namespace widestereo
