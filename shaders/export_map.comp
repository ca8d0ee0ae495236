// SPDX-License-Identifier: MIT
// A map of a view into an application's buffer, as the host makes it.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

#include "portable.h"

#include "camera.glsl"
#include "parameters.glsl"

#define HAS_CONVERSION
#include "bindings.glsl"

#include "maps.glsl"

layout(set = 1, binding = 0, std430) writeonly buffer MapBlock { uint map_words[]; };

void main() {
  ivec2 pixel;
  if (!thread_pixel(REFERENCE, pixel)) return;
  uint row = conversion.first + uint(pixel.y) * conversion.pitch;
  uint x = uint(pixel.x);
  vec4 hypothesis = hypothesis_at(REFERENCE, pixel);
  vec4 ray = ray_at(REFERENCE, pixel);
  vec4 checked = check_at(REFERENCE, pixel);
  if (conversion.kind == MAP_NORMALS) {
    vec3 normal = plane_normal(hypothesis, ray);
    map_words[row + 3u * x] = float_as_uint(normal.x);
    map_words[row + 3u * x + 1u] = float_as_uint(normal.y);
    map_words[row + 3u * x + 2u] = float_as_uint(normal.z);
  } else if (conversion.kind == MAP_REASONS) {
    map_words[row + x] = uint(checked.w);
  } else {
    float value = conversion.kind == MAP_DISTANCE ? plane_distance(hypothesis, ray)
                  : conversion.kind == MAP_COST   ? hypothesis.w
                                                  : checked.z;
    map_words[row + x] = float_as_uint(value);
  }
}
