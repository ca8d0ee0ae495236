// SPDX-License-Identifier: MIT
// The Vulkan entry point of a kernel of kernel_list.h: KERNEL is its function, VIEW the view over which it runs.
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

#include "portable.h"

#include "camera.glsl"
#include "parameters.glsl"

#include "bindings.glsl"

#include "algorithm.glsl"

void main() {
#ifdef HAS_PATCH_TILE
  fill_tile();
  barrier();
#endif
  ivec2 pixel;
  if (thread_pixel(VIEW, pixel)) KERNEL(pixel);
}
