// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

#include "widestereo/camera.h"

namespace widestereo {

/// Throws Error unless `mask` is empty or CV_8UC1 of the camera's size. `name` begins the message.
void require_fitting_mask(const cv::Mat& mask, const Camera& camera, const std::string& name);

}  // namespace widestereo
