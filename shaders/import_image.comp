// SPDX-License-Identifier: MIT
// A view's intensities from an image in an application's buffer, as the host makes them.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

#include "portable.h"

#include "camera.glsl"
#include "parameters.glsl"

#define HAS_CONVERSION
#include "bindings.glsl"

#include "maps.glsl"

layout(set = 1, binding = 0, std430) readonly buffer ImageBlock { uint image_words[]; };

// The value of a pixel of 8 or 16 bits: words need no extension, and no alignment of rows.
float value_at(uint byte, uint largest) { return float(image_words[byte >> 2] >> 8u * (byte & 3u) & largest); }

float imported(ivec2 pixel) {
  uint row = conversion.first + uint(pixel.y) * conversion.pitch;
  uint x = uint(pixel.x);
  if (conversion.kind == PIXEL_GREY8) return value_at(row + x, 0xffu) * SCALE_OF_8_BITS;
  if (conversion.kind == PIXEL_GREY16) return value_at(row + 2u * x, 0xffffu) * SCALE_OF_16_BITS;
  return intensity_or_masked(uint_as_float(image_words[(row >> 2) + x]));
}

void main() {
  ivec2 pixel;
  if (!thread_pixel(REFERENCE, pixel)) return;
  bool usable = ray_at(REFERENCE, pixel).w != 0.0f;
  store_intensity(REFERENCE, pixel, usable ? imported(pixel) : MASKED_INTENSITY);
}
