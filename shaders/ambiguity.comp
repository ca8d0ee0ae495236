// SPDX-License-Identifier: MIT
#version 450
#extension GL_GOOGLE_include_directive : require

#include "portable.h"

#include "camera.glsl"
#include "parameters.glsl"

#include "bindings.glsl"

#include "plane.glsl"
#include "patch.glsl"
#include "consistency.glsl"
#include "check.glsl"
#include "ambiguity.glsl"

void main() {
  ivec2 pixel;
  if (thread_pixel(REFERENCE, pixel)) ambiguity_pixel(pixel);
}
