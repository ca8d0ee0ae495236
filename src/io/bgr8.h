// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace widestereo {

/// Throws Error unless an image has pixels, of 8 or 16 bit, grey, BGR or BGRA. `name` begins the
/// message.
void require_image(const cv::Mat& image, const std::string& name);

/// The same, but float will do, too.
void require_image_or_float(const cv::Mat& image, const std::string& name);

/// An image of 8 or 16 bit as CV_8UC3; empty if it is empty.
cv::Mat to_bgr8(const cv::Mat& image);

}  // namespace widestereo
