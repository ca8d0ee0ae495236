// SPDX-License-Identifier: MIT
#version 450
#extension GL_GOOGLE_include_directive : require

#include "portable.h"

#include "camera.glsl"
#include "parameters.glsl"

#include "bindings.glsl"

#include "plane.glsl"
#include "random.glsl"
#include "patch.glsl"
#include "search.glsl"
#include "plane_fit.glsl"
#include "regression.glsl"

void main() {
  ivec2 pixel;
  if (thread_pixel(REFERENCE, pixel)) adopt_point_pixel(pixel);
}
