// SPDX-License-Identifier: MIT
// What the maps of a match mean, for the host and for CUDA: intensities from pixels, distances and
// normals from plane hypotheses. Both must be compiled without contraction to agree bit by bit.
#pragma once

#include "kernel/host.h"

namespace widestereo::kernel {

constexpr float no_plane_cost = 2;  ///< INVALID_COST of shaders/patch.glsl
/// Intensities end here: 1, with room for rounding.
constexpr float above_intensity = 1 + 1e-6f;

/// Largest values of 8 and 16 bits become 1.
constexpr float scale_of_8_bits = static_cast<float>(1 / 255.0);
constexpr float scale_of_16_bits = static_cast<float>(1 / 65535.0);

/// Distance along the unit ray of the plane (m, cost) at a pixel, 0 where it holds none.
FN float plane_distance(vec4 hypothesis, vec4 ray) {
  const float w = hypothesis.x * ray.x + hypothesis.y * ray.y + hypothesis.z * ray.z;
  if (hypothesis.w >= no_plane_cost || !(w > 0)) return 0;
  return 1 / w;
}

/// Unit normal, facing the camera, of a plane (m, cost) that the pixel holds.
FN vec3 plane_normal(vec4 hypothesis) {
  const double x = hypothesis.x;
  const double y = hypothesis.y;
  const double z = hypothesis.z;
  const float inverse = 1 / static_cast<float>(sqrt(x * x + y * y + z * z));
  return {-hypothesis.x * inverse, -hypothesis.y * inverse, -hypothesis.z * inverse};
}

}  // namespace widestereo::kernel
