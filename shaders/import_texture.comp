// SPDX-License-Identifier: MIT
// A view's intensities from an application's texture.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_samplerless_texture_functions : require

#include "portable.h"

#include "camera.glsl"
#include "parameters.glsl"

#define HAS_CONVERSION
#include "bindings.glsl"

#include "maps.glsl"

layout(set = 1, binding = 0) uniform texture2D image;

float imported(ivec2 pixel) {
  vec4 texel = texelFetch(image, pixel, 0);
  return intensity_or_masked(conversion.kind == TEXELS_COLOUR ? luma(texel.x, texel.y, texel.z) : texel.x);
}

void main() {
  ivec2 pixel;
  if (!thread_pixel(REFERENCE, pixel)) return;
  // Nobody can tell the size of an image view before.
  bool inside = all(lessThan(pixel, textureSize(image, 0)));
  bool usable = inside && ray_at(REFERENCE, pixel).w != 0.0f;
  store_intensity(REFERENCE, pixel, usable ? imported(pixel) : MASKED_INTENSITY);
}
