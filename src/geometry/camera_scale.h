// SPDX-License-Identifier: MIT
#pragma once

#include "widestereo/camera.h"

namespace widestereo {

/// The intrinsics of an image that is sx times as wide and sy times as high; its size stays.
inline void scale_intrinsics(Camera& camera, double sx, double sy) {
  camera.fx *= sx;
  camera.fy *= sy;
  camera.skew *= sx;
  camera.shear *= sy;
  camera.cx = sx * (camera.cx + 0.5) - 0.5;
  camera.cy = sy * (camera.cy + 0.5) - 0.5;
}

}  // namespace widestereo
