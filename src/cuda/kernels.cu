// SPDX-License-Identifier: MIT
// The shared kernel source compiled for CUDA: accessors over device memory and one entry point for each
// kernel of the schedule. No algorithm here.
#include <cuda_runtime.h>

#include "kernel/host.h"

namespace widestereo::kernel::cuda {

/// Device memory of one view, row-major.
struct ViewMemory {
  const float4* rays;
  float* intensities;
  float4* hypotheses;
  float4* checks;
  float4* priors;
  int width;
};

/// What a kernel sees besides its pixel.
struct Context {
  MatchParameters parameters;
  PassParameters pass;
  ViewMemory views[MAX_VIEWS];
  uint* transfer_nearest;  // of the reference view
  uint* transfer_winner;
  int window_radius, warp, source_model, view_count, pattern, weighted;
};

#define WINDOW_RADIUS context.window_radius
#define WARP context.warp
#define SOURCE_MODEL context.source_model
#define VIEW_COUNT context.view_count
#define PATTERN context.pattern
#define WEIGHTED context.weighted

#define DEVICE __device__ inline

DEVICE int index_of(CONTEXT_ARGUMENT int view, ivec2 p) {
  return p.y * context.views[view].width + p.x;
}
DEVICE vec4 to_vec4(float4 v) { return vec4(v.x, v.y, v.z, v.w); }
DEVICE float4 to_float4(vec4 v) { return make_float4(v.x, v.y, v.z, v.w); }

DEVICE vec4 ray_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(__ldg(context.views[view].rays + index_of(CONTEXT view, p)));
}
DEVICE float intensity_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return context.views[view].intensities[index_of(CONTEXT view, p)];
}
DEVICE void store_intensity(CONTEXT_ARGUMENT int view, ivec2 p, float intensity) {
  context.views[view].intensities[index_of(CONTEXT view, p)] = intensity;
}
DEVICE vec4 intensity_taps(CONTEXT_ARGUMENT int view, ivec2 p) {
  const float* top = context.views[view].intensities + index_of(CONTEXT view, p);
  const float* bottom = top + context.views[view].width;
  return vec4(top[0], top[1], bottom[0], bottom[1]);
}
DEVICE vec4 hypothesis_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].hypotheses[index_of(CONTEXT view, p)]);
}
DEVICE void store_hypothesis(CONTEXT_ARGUMENT int view, ivec2 p, vec4 h) {
  context.views[view].hypotheses[index_of(CONTEXT view, p)] = to_float4(h);
}
DEVICE vec4 check_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].checks[index_of(CONTEXT view, p)]);
}
DEVICE void store_check(CONTEXT_ARGUMENT int view, ivec2 p, vec4 c) {
  context.views[view].checks[index_of(CONTEXT view, p)] = to_float4(c);
}
DEVICE vec4 prior_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].priors[index_of(CONTEXT view, p)]);
}
DEVICE void store_prior(CONTEXT_ARGUMENT int view, ivec2 p, vec4 m) {
  context.views[view].priors[index_of(CONTEXT view, p)] = to_float4(m);
}
DEVICE void transfer_reset(CONTEXT_ARGUMENT ivec2 p) {
  const int i = index_of(CONTEXT context.pass.reference, p);
  context.transfer_nearest[i] = 0u;
  context.transfer_winner[i] = 0xffffffffu;
}
DEVICE uint transfer_nearest_at(CONTEXT_ARGUMENT ivec2 p) {
  return context.transfer_nearest[index_of(CONTEXT context.pass.reference, p)];
}
DEVICE void transfer_nearest_raise(CONTEXT_ARGUMENT ivec2 p, uint bits) {
  atomicMax(context.transfer_nearest + index_of(CONTEXT context.pass.reference, p), bits);
}
DEVICE uint transfer_winner_at(CONTEXT_ARGUMENT ivec2 p) {
  return context.transfer_winner[index_of(CONTEXT context.pass.reference, p)];
}
DEVICE void transfer_winner_lower(CONTEXT_ARGUMENT ivec2 p, uint index) {
  atomicMin(context.transfer_winner + index_of(CONTEXT context.pass.reference, p), index);
}

// From here on the shared functions run on the device only, as their accessors do.
#undef FN
#define FN DEVICE
// The order matters.
// clang-format off
#include "random.glsl"
#include "plane.glsl"
#include "patch.glsl"
#include "search.glsl"
#include "pyramid.glsl"
#include "adaptive_search.glsl"
#include "consistency.glsl"
#include "regression.glsl"
#include "transfer.glsl"
#include "check.glsl"
// clang-format on

/// This thread's pixel; false outside the dispatch. With a colour, half the columns are launched.
DEVICE bool thread_pixel(CONTEXT_ARGUMENT int view, ivec2& pixel) {
  pixel = ivec2(static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x),
                static_cast<int>(blockIdx.y * blockDim.y + threadIdx.y) + context.pass.first_row);
  if (context.pass.colour >= 0) pixel.x = 2 * pixel.x + ((pixel.y + context.pass.colour) & 1);
  return pixel.x < context.parameters.cameras[view].size.x && pixel.y < context.pass.last_row;
}

#define ENTRY_POINT(name, view)                                      \
  __global__ void name(const __grid_constant__ Context context) {    \
    ivec2 pixel;                                                     \
    if (thread_pixel(context, view, pixel)) name##_pixel(context, pixel); \
  }

ENTRY_POINT(initialise, context.pass.reference)
ENTRY_POINT(iterate, context.pass.reference)
ENTRY_POINT(transfer_clear, context.pass.reference)
ENTRY_POINT(transfer_nearest, context.pass.other)
ENTRY_POINT(transfer_winner, context.pass.other)
ENTRY_POINT(transfer_gather, context.pass.reference)
ENTRY_POINT(check, context.pass.reference)
ENTRY_POINT(downsample, context.pass.reference)
ENTRY_POINT(sweep, context.pass.reference)
ENTRY_POINT(upsample, context.pass.reference)
ENTRY_POINT(search, context.pass.reference)
ENTRY_POINT(measure, context.pass.reference)
ENTRY_POINT(regress, context.pass.reference)
ENTRY_POINT(adopt, context.pass.reference)

}  // namespace widestereo::kernel::cuda
