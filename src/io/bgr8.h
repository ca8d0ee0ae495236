// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>

namespace widestereo {

/// An 8- or 16-bit image, grey, BGR or BGRA, as CV_8UC3; empty if it is empty.
cv::Mat to_bgr8(const cv::Mat& image);

}  // namespace widestereo
