// SPDX-License-Identifier: MIT
// The shared kernel source compiled for the CPU: the accessors it reads and writes through, then
// the algorithm itself.
#pragma once

#include <atomic>
#include <opencv2/core/mat.hpp>

#include "matching/backend.h"

namespace widestereo::kernel::cpu {

/// Memory of one view: row-major, width pixels a row.
struct ViewMemory {
  cv::Mat_<cv::Vec4f> rays;
  cv::Mat_<float> intensities;  ///< surrounded by APRON masked pixels
  cv::Mat_<float> texels;       ///< by TEXEL_APRON masked ones
  cv::Mat_<cv::Vec4f> hypotheses;
  cv::Mat_<cv::Vec4f> checks;
  cv::Mat_<cv::Vec4f> priors;

  void set_size(cv::Size size, const KernelConstants& constants) {
    for (cv::Mat_<cv::Vec4f>* map : {&rays, &hypotheses, &checks, &priors}) {
      *map = cv::Mat_<cv::Vec4f>(size, cv::Vec4f());
    }
    intensities = cv::Mat_<float>(with_apron(size), MASKED_INTENSITY);
    texels = cv::Mat_<float>(size_of_texels(size, constants), MASKED_INTENSITY);
  }
  /// The intensities without the apron.
  cv::Mat_<float> image() { return intensities(cv::Rect({APRON, APRON}, rays.size())); }
};

/// What a kernel sees besides its pixel.
struct Context {
  const MatchParameters& parameters;
  const PassParameters& pass;
  const KernelConstants& constants;
  ViewMemory* views;
  cv::Mat_<int>& transfer_nearest;  ///< of the reference view; bit patterns of unsigned integers
  cv::Mat_<int>& transfer_winner;
  int view_of_launch = 0;  ///< see shaders/portable.h
};

#define WINDOW_RADIUS context.constants.window_radius
#define WARP context.constants.warp
#define CAMERA_MODEL context.constants.camera_model
#define SOURCE_COUNT context.constants.source_count
#define ONE_SOURCE false
#define VIEW_OF_LAUNCH context.view_of_launch
#define PATTERN context.constants.pattern
#define WEIGHTED context.constants.weighted
#define FILTER FILTER_EXACT
#define ROWS_AT_ONCE 1
#define TEXELS_PER_PIXEL context.constants.texels_per_pixel

inline vec4 to_vec4(const cv::Vec4f& v) { return {v[0], v[1], v[2], v[3]}; }

inline vec4 ray_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].rays(p.y, p.x));
}
struct RayRow {
  const cv::Mat_<cv::Vec4f>& rays;
  ivec2 first;
};
inline RayRow ray_row(CONTEXT_ARGUMENT int view, ivec2 p) { return {context.views[view].rays, p}; }
inline vec4 ray_in_row(const RayRow& row, int dx) {
  return to_vec4(row.rays(row.first.y, clamp(row.first.x + dx, 0, row.rays.cols - 1)));
}
using IntensityRow = const float*;
inline IntensityRow intensity_row(CONTEXT_ARGUMENT int view, ivec2 p) {
  return &context.views[view].intensities(p.y + APRON, p.x + APRON);
}
inline float intensity_in_row(IntensityRow row, int dx) { return row[dx]; }
inline float intensity_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return *intensity_row(CONTEXT view, p);
}
inline float* texel_address(CONTEXT_ARGUMENT int view, ivec2 p) {
  return &context.views[view].texels(p.y + TEXEL_APRON, p.x + TEXEL_APRON);
}
inline vec4 texel_taps(CONTEXT_ARGUMENT int view, ivec2 p) {
  const float* top = texel_address(CONTEXT view, p);
  const float* bottom = texel_address(CONTEXT view, ivec2(p.x, p.y + 1));
  return {top[0], top[1], bottom[0], bottom[1]};
}
inline void store_texel(CONTEXT_ARGUMENT int view, ivec2 p, vec4 taps) {
  *texel_address(CONTEXT view, p) = taps.x;
}
inline void store_intensity(CONTEXT_ARGUMENT int view, ivec2 p, float intensity) {
  context.views[view].intensities(p.y + APRON, p.x + APRON) = intensity;
}
inline void store(cv::Mat_<cv::Vec4f>& map, ivec2 p, vec4 v) {
  map(p.y, p.x) = {v.x, v.y, v.z, v.w};
}
inline vec4 hypothesis_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].hypotheses(p.y, p.x));
}
inline void store_hypothesis(CONTEXT_ARGUMENT int view, ivec2 p, vec4 h) {
  store(context.views[view].hypotheses, p, h);
}
inline vec4 check_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].checks(p.y, p.x));
}
inline void store_check(CONTEXT_ARGUMENT int view, ivec2 p, vec4 c) {
  store(context.views[view].checks, p, c);
}
inline vec4 prior_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return to_vec4(context.views[view].priors(p.y, p.x));
}
inline void store_prior(CONTEXT_ARGUMENT int view, ivec2 p, vec4 m) {
  store(context.views[view].priors, p, m);
}

inline std::atomic_ref<uint> atomic_at(cv::Mat_<int>& buffer, ivec2 p) {
  return std::atomic_ref<uint>(reinterpret_cast<uint&>(buffer(p.y, p.x)));
}
inline void transfer_reset(CONTEXT_ARGUMENT ivec2 p) {
  atomic_at(context.transfer_nearest, p) = 0u;
  atomic_at(context.transfer_winner, p) = 0xffffffffu;
}
inline uint transfer_nearest_at(CONTEXT_ARGUMENT ivec2 p) {
  return atomic_at(context.transfer_nearest, p);
}
inline uint transfer_winner_at(CONTEXT_ARGUMENT ivec2 p) {
  return atomic_at(context.transfer_winner, p);
}
inline void transfer_nearest_raise(CONTEXT_ARGUMENT ivec2 p, uint bits) {
  auto cell = atomic_at(context.transfer_nearest, p);
  uint seen = cell;
  while (seen < bits && !cell.compare_exchange_weak(seen, bits)) {
  }
}
inline void transfer_winner_lower(CONTEXT_ARGUMENT ivec2 p, uint index) {
  auto cell = atomic_at(context.transfer_winner, p);
  uint seen = cell;
  while (seen > index && !cell.compare_exchange_weak(seen, index)) {
  }
}

#include "algorithm.glsl"

}  // namespace widestereo::kernel::cpu
