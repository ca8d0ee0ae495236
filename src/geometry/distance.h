// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <opencv2/core/matx.hpp>

namespace widestereo {

/// Whether a value of a distance map stands for a point.
inline bool has_distance(float distance) { return distance > 0 && std::isfinite(distance); }

/// Whether a pixel of a distance map and of ray_image() stands for a point: where there is no ray,
/// every distance would end in the camera's centre.
inline bool has_point(float distance, const cv::Vec4f& ray) {
  return has_distance(distance) && (ray[0] != 0 || ray[1] != 0 || ray[2] != 0);
}

}  // namespace widestereo
