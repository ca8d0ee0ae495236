// SPDX-License-Identifier: MIT
// The shared kernel source compiled for CUDA: accessors over device memory and one entry point for
// each kernel of the schedule. No algorithm here.
#pragma once

#include <cuda_fp16.h>
#include <cuda_runtime.h>

#include <string_view>
#include <type_traits>

#include "cuda/kernels.h"
#include "widestereo/options.h"

namespace widestereo::kernel::cuda {

/// Constants known at compile time; -1 = read from the context. Without a model each source's own
/// is used.
template <int Radius, int Warp, int Pattern, int Weighted, int Filter, int TexelsPerPixel,
          int Model, int Sources>
struct Constants {
  static constexpr int window_radius = Radius;
  static constexpr int warp = Warp;
  static constexpr int pattern = Pattern;
  static constexpr int weighted = Weighted;
  static constexpr int filter = Filter;
  static constexpr int texels_per_pixel = TexelsPerPixel;
  static constexpr int camera_model = Model;
  static constexpr int source_count = Sources;
  /// On the checkerboard rows start in turn one column later: two are the same for all turns.
  static constexpr int unrolled_rows =
      Pattern == static_cast<int>(PatchPattern::checkerboard) ? 2 : 1;
  static constexpr bool tiled = false;
};
/// The same for a kernel whose blocks share rays and intensities of their patches
/// (patch_tile.glsl).
template <class C>
struct Tiled : C {
  static constexpr bool tiled = true;
};
using AnyConstants = Constants<-1, -1, -1, -1, -1, -1, -1, -1>;

#define WINDOW_RADIUS (C::window_radius >= 0 ? C::window_radius : context.window_radius)
#define WARP (C::warp >= 0 ? C::warp : context.warp)
#define PATTERN (C::pattern >= 0 ? C::pattern : context.pattern)
#define WEIGHTED (C::weighted >= 0 ? C::weighted : context.weighted)
#define FILTER (C::filter >= 0 ? C::filter : context.filter)
#define TEXELS_PER_PIXEL (C::texels_per_pixel >= 0 ? C::texels_per_pixel : context.texels_per_pixel)
#define CAMERA_MODEL (C::camera_model >= 0 ? C::camera_model : context.camera_model)
#define SOURCE_COUNT (C::source_count >= 0 ? C::source_count : context.source_count)
#define ONE_SOURCE (C::source_count == 1)
#define VIEW_OF_LAUNCH static_cast<int>(blockIdx.z)
#define HAS_DEVICE_FILTER
#define HAS_PATCH_TILE
#define TILED C::tiled
#define GROUP_WIDTH block_width
#define GROUP_HEIGHT block_height
#define GROUP_OF_LAUNCH ivec2(static_cast<int>(blockIdx.x), static_cast<int>(blockIdx.y))
#define THREAD_OF_GROUP ivec2(static_cast<int>(threadIdx.x), static_cast<int>(threadIdx.y))
#define ROWS_AT_ONCE 1
#undef PARAMETERS
#define PARAMETERS (*context.parameters)
#undef FN
#define FN static __device__ inline

/// The algorithm as static functions of a class, which makes its constants template arguments.
///
/// Textures lie over plain memory, which `interpolate` writes like any other; gathering four texels
/// would need a CUDA array, so that exact filtering takes four loads. No kernel reads intensities
/// or rays that it writes, as textures and __ldg() ask; hypotheses, checks and priors are read and
/// written by the same kernels and are loaded normally.
template <class C>
struct Algorithm {
  FN int index_of(CONTEXT_ARGUMENT int view, ivec2 p) {
    return p.y * context.views[view].width + p.x;
  }
  FN vec4 to_vec4(float4 v) { return vec4(v.x, v.y, v.z, v.w); }
  FN float4 to_float4(vec4 v) { return make_float4(v.x, v.y, v.z, v.w); }

  using RayRow = const float4*;
  FN RayRow ray_row(CONTEXT_ARGUMENT int view, ivec2 p) {
    return context.views[view].rays + index_of(CONTEXT view, p);
  }
  FN vec4 ray_in_row(RayRow row, int dx) { return to_vec4(__ldg(row + dx)); }
  FN vec4 ray_at(CONTEXT_ARGUMENT int view, ivec2 p) {
    return ray_in_row(ray_row(CONTEXT view, p), 0);
  }
  FN float* intensity_address(CONTEXT_ARGUMENT int view, ivec2 p) {
    return context.views[view].intensities + (p.y * context.views[view].stride + p.x);
  }
  FN float intensity_at(CONTEXT_ARGUMENT int view, ivec2 p) {
    return __ldg(intensity_address(CONTEXT view, p));
  }
  template <class Texel>
  FN Texel* texel_address(CONTEXT_ARGUMENT int view, ivec2 p) {
    return static_cast<Texel*>(context.views[view].texels) +
           (p.y * context.views[view].texel_stride + p.x);
  }
  template <class Texel>
  FN vec4 taps_of(CONTEXT_ARGUMENT int view, ivec2 p) {
    const Texel* top = texel_address<Texel>(CONTEXT view, p);
    const Texel* bottom = top + context.views[view].texel_stride;
    return vec4(float(__ldg(top)), float(__ldg(top + 1)), float(__ldg(bottom)),
                float(__ldg(bottom + 1)));
  }
  FN vec4 texel_taps(CONTEXT_ARGUMENT int view, ivec2 p) {
    if (FILTER == FILTER_DEVICE) return taps_of<__half>(CONTEXT view, p);
    return taps_of<float>(CONTEXT view, p);
  }
  FN vec2 filtered_texel_unit(const Context&) { return vec2(1.0f, 1.0f); }
  FN float filtered_texel(CONTEXT_ARGUMENT int view, vec2 texel) {
    return tex2DLod<float>(context.views[view].texture, texel.x, texel.y, 0);
  }

  /// Two intensities of a row at a time, of half precision as samples of a source are: dense
  /// patches keep the data path of the first-level cache busy with little else.
  static constexpr bool reads_pairs = C::pattern == PATTERN_DENSE && C::window_radius > 0 &&
                                      C::texels_per_pixel == 1 && C::filter == FILTER_DEVICE;
  struct PairsOfRow {
    __half2 pairs[reads_pairs ? C::window_radius + 1 : 1];
  };
  using IntensityRow = std::conditional_t<reads_pairs, PairsOfRow, const float*>;
  FN IntensityRow intensity_row(CONTEXT_ARGUMENT int view, ivec2 p) {
    if constexpr (reads_pairs) {
      // Aligned words, from which an odd column begins half a word later.
      const auto* words = reinterpret_cast<const unsigned*>(
          texel_address<__half>(CONTEXT view, ivec2(p.x & ~1, p.y)));
      const unsigned bits = (p.x & 1) * 16;
      PairsOfRow row;
      unsigned word = __ldg(words);
      UNROLL for (int i = 0; i <= C::window_radius; ++i) {
        const unsigned next = i < C::window_radius ? __ldg(words + i + 1) : 0;
        const unsigned pair = __funnelshift_r(word, next, bits);
        memcpy(&row.pairs[i], &pair, sizeof pair);
        word = next;
      }
      return row;
    } else {
      return intensity_address(CONTEXT view, p);
    }
  }
  FN float intensity_in_row(const IntensityRow& row, int dx) {
    if constexpr (reads_pairs) {
      const __half2 pair = row.pairs[dx / 2];
      return dx % 2 == 0 ? __low2float(pair) : __high2float(pair);
    } else {
      return __ldg(row + dx);
    }
  }
  FN void store_texel(CONTEXT_ARGUMENT int view, ivec2 p, vec4 taps) {
    if (FILTER == FILTER_DEVICE) {
      const float representable = max(taps.x, LOWEST_HALF);
      *texel_address<__half>(CONTEXT view, p) = __float2half_rn(representable);
    } else {
      *texel_address<float>(CONTEXT view, p) = taps.x;
    }
  }
  FN void store_intensity(CONTEXT_ARGUMENT int view, ivec2 p, float intensity) {
    *intensity_address(CONTEXT view, p) = intensity;
  }
  FN vec4 hypothesis_at(CONTEXT_ARGUMENT int view, ivec2 p) {
    return to_vec4(context.views[view].hypotheses[index_of(CONTEXT view, p)]);
  }
  FN void store_hypothesis(CONTEXT_ARGUMENT int view, ivec2 p, vec4 h) {
    context.views[view].hypotheses[index_of(CONTEXT view, p)] = to_float4(h);
  }
  FN vec4 check_at(CONTEXT_ARGUMENT int view, ivec2 p) {
    return to_vec4(context.views[view].checks[index_of(CONTEXT view, p)]);
  }
  FN void store_check(CONTEXT_ARGUMENT int view, ivec2 p, vec4 c) {
    context.views[view].checks[index_of(CONTEXT view, p)] = to_float4(c);
  }
  FN vec4 prior_at(CONTEXT_ARGUMENT int view, ivec2 p) {
    return to_vec4(context.views[view].priors[index_of(CONTEXT view, p)]);
  }
  FN void store_prior(CONTEXT_ARGUMENT int view, ivec2 p, vec4 m) {
    context.views[view].priors[index_of(CONTEXT view, p)] = to_float4(m);
  }
  FN int transfer_index(CONTEXT_ARGUMENT ivec2 p) { return index_of(CONTEXT REFERENCE, p); }
  FN void transfer_reset(CONTEXT_ARGUMENT ivec2 p) {
    context.transfer_nearest[transfer_index(CONTEXT p)] = 0u;
    context.transfer_winner[transfer_index(CONTEXT p)] = 0xffffffffu;
  }
  FN uint transfer_nearest_at(CONTEXT_ARGUMENT ivec2 p) {
    return context.transfer_nearest[transfer_index(CONTEXT p)];
  }
  FN void transfer_nearest_raise(CONTEXT_ARGUMENT ivec2 p, uint bits) {
    atomicMax(context.transfer_nearest + transfer_index(CONTEXT p), bits);
  }
  FN uint transfer_winner_at(CONTEXT_ARGUMENT ivec2 p) {
    return context.transfer_winner[transfer_index(CONTEXT p)];
  }
  FN void transfer_winner_lower(CONTEXT_ARGUMENT ivec2 p, uint index) {
    atomicMin(context.transfer_winner + transfer_index(CONTEXT p), index);
  }

  /// Of the block (patch_tile.glsl).
  FN float4* tile() {
    __shared__ float4
        samples[C::tiled ? PATCH_TILE_SAMPLES(block_width, block_height, C::window_radius) : 1];
    return samples;
  }
  using TilePlace = float4*;
  FN TilePlace tile_place(const Context&, int index) {
    TilePlace place = tile() + index;
#ifdef __CUDA_ARCH__
    // Held in registers: the compiler would work it out anew for every row of a patch.
    asm("" : "+l"(place));
    __builtin_assume(__isShared(place));
#endif
    return place;
  }
  FN vec4 tile_at(const Context&, TilePlace place, int further) { return to_vec4(place[further]); }
  FN void store_tile(const Context&, TilePlace place, vec4 v) { *place = to_float4(v); }

#include "algorithm.glsl"

  /// This thread's place in its block, where consecutive threads fill tiles of such a size.
  template <int width, int height>
  FN ivec2 place_in_tiles() {
    const int thread = static_cast<int>(threadIdx.y * block_width + threadIdx.x);
    const int tile = thread / (width * height);
    constexpr int tiles_of_row = block_width / width;
    return ivec2(width * (tile % tiles_of_row) + thread % width,
                 height * (tile / tiles_of_row) + thread / width % height);
  }

  /// This thread's pixel; false outside the dispatch. With a colour, half the columns are launched.
  /// `warps_in_tiles`: those of draw4_of_tile().
  template <bool warps_in_tiles>
  FN bool thread_pixel(CONTEXT_ARGUMENT int view, ivec2& pixel) {
    ivec2 place = THREAD_OF_GROUP;
    if constexpr (warps_in_tiles) {
      place = place_in_tiles<TILE_WIDTH, TILE_HEIGHT>();
    } else if constexpr (reads_pairs && !C::tiled) {
      // Texture units take four threads at a time, whose samples lie closer in squares.
      place = place_in_tiles<2, 2>();
    }
    pixel = ivec2(static_cast<int>(blockIdx.x * block_width) + place.x,
                  static_cast<int>(blockIdx.y * block_height) + place.y + PASS.first_row);
    if (PASS.colour >= 0) pixel.x = 2 * pixel.x + ((pixel.y + PASS.colour) & 1);
    const ivec4 size = PARAMETERS.cameras[view].size;
    return pixel.x < size.x && pixel.y < min(PASS.last_row, size.y);
  }
};

// Blocks that a multiprocessor must be able to hold: with more ptxas spills registers, without a
// bound it does so as well or takes so many that a block fewer fits (tools/cuda_kernel_report).
// Measured on an H100 (docs/performance.md).
template <class C>
constexpr int least_blocks(std::string_view kernel) {
  if (C::camera_model < 0) return 4;
  if (kernel == "regress" || kernel == "vote_normal") return 5;
  return C::warp == WARP_AFFINE ? 8 : 5;
}

/// Whether the pixels of a tile look around from the same places, as the threads of a warp then do.
constexpr bool looks_around_by_tiles(std::string_view kernel) {
  return kernel == "regress" || kernel == "vote_normal";
}

#define KERNEL(name, view)                                                             \
  constexpr bool name##_in_tiles = looks_around_by_tiles(#name);                       \
  template <class C>                                                                   \
  __global__ void __launch_bounds__(block_width* block_height, least_blocks<C>(#name)) \
      name(const __grid_constant__ Context context) {                                  \
    if constexpr (C::tiled) {                                                          \
      Algorithm<C>::fill_tile(context);                                                \
      __syncthreads();                                                                 \
    }                                                                                  \
    ivec2 pixel;                                                                       \
    if (Algorithm<C>::template thread_pixel<name##_in_tiles>(context, view, pixel)) {  \
      Algorithm<C>::name##_pixel(context, pixel);                                      \
    }                                                                                  \
  }
#include "kernel_list.h"

// clang-format off
#define KERNEL_ENTRY(name, C) KernelEntry{#name, reinterpret_cast<const void*>(&name<C>)}
// clang-format on

template <int count>
KernelTable table_of(const KernelEntry (&entries)[count]) {
  return {entries, count};
}

/// Calls `get`, a callable over a Constants tag, with those of a camera model and a number of
/// sources. Pairs have instances of their own for each model, more views one for all.
template <int Radius, int Warp, int Pattern, int Texels, class Get>
KernelTable for_rig(int camera_model, int source_count, Get get) {
  constexpr int Weighted = 0;
  constexpr int Filter = FILTER_DEVICE;
  if (source_count != 1)
    return get(Constants<Radius, Warp, Pattern, Weighted, Filter, Texels, -1, -1>());
  switch (camera_model) {
    case CAMERA_KANNALA_BRANDT:
      return get(
          Constants<Radius, Warp, Pattern, Weighted, Filter, Texels, CAMERA_KANNALA_BRANDT, 1>());
    case CAMERA_DOUBLE_SPHERE:
      return get(
          Constants<Radius, Warp, Pattern, Weighted, Filter, Texels, CAMERA_DOUBLE_SPHERE, 1>());
    default:
      return get(Constants<Radius, Warp, Pattern, Weighted, Filter, Texels, -1, 1>());
  }
}

}  // namespace widestereo::kernel::cuda
