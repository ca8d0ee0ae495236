// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>

#include "widestereo/rig.h"

namespace widestereo {

/// Whether a matrix is a rotation, but for entries rounded to four digits.
bool is_rotation(const Eigen::Matrix3d& matrix);

/// Throws Error where two views share a centre. `name` begins the message.
void require_baseline(const View& a, const View& b, const std::string& name);

/// Throws Error unless `mask` is empty or CV_8UC1 of the camera's size. `name` begins the message.
void require_fitting_mask(const cv::Mat& mask, const Camera& camera, const std::string& name);

}  // namespace widestereo
