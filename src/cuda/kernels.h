// SPDX-License-Identifier: MIT
// What the host must know to launch the CUDA kernels.
#pragma once

#include <texture_types.h>
#include <vector_types.h>

#include "kernel/host.h"

namespace widestereo::kernel::cuda {

/// Threads of a block: pixels of a column, or every other one with a colour.
constexpr int block_width = 16;
constexpr int block_height = 8;

/// Device memory of one view, row-major, `width` pixels a row.
struct ViewMemory {
  const float4* rays;
  float* intensities;  ///< of pixel (0, 0); APRON masked ones surround the image
  /// Likewise; TEXEL_APRON masked ones surround them. Of half precision where texture units filter,
  /// else floats.
  void* texels;
  cudaTextureObject_t texture;  ///< over the texels, bilinear; its (0, 0) is in the apron
  float4* hypotheses;
  float4* checks;
  float4* priors;
  int width;
  int stride;        ///< of the intensities: pixels from row to row
  int texel_stride;  ///< likewise
};

/// Of LOWEST_HALF.
constexpr unsigned short lowest_half_bits = 0xfbff;

/// What a kernel sees besides its pixel: the one argument of every kernel.
struct Context {
  /// In device memory: 15 KiB exceed the 4 KiB of arguments that CUDA allows before 12.1.
  const MatchParameters* parameters;
  PassParameters pass;
  ViewMemory views[MAX_VIEWS];
  uint* transfer_nearest;  ///< of the reference view
  uint* transfer_winner;
  int camera_model, window_radius, warp, pattern, weighted, filter, texels_per_pixel;
  int source_count;
};
static_assert(sizeof(Context) <= 4096);

/// The entry points of one instance of the kernels.
struct KernelEntry {
  const char* name;  ///< as to_string(Kernel) says
  const void* function;
};
struct KernelTable {
  const KernelEntry* entries;
  int count;
};

/// Window radii of the presets that have kernels of their own.
inline constexpr int paper_window_radius = 5;
inline constexpr int pyramid_window_radius = 3;

/// Every kernel, for any constants.
KernelTable generic_kernels();
/// The kernels that take most of the time, with filtering by the texture units, compiled for the
/// window and the constants of a preset: `paper` (exact warp, dense), the same with the affine
/// warp, `quality` and `fast` (affine, checkerboard).
/// `camera_model`: a camera model that has kernels of its own (kannala_brandt, double_sphere),
/// anything else selects those for all models. With one source, they are compiled for that, too.
KernelTable paper_kernels(int camera_model, int source_count);
KernelTable affine_paper_kernels(int camera_model, int source_count);
KernelTable pyramid_kernels(int camera_model, int source_count);

}  // namespace widestereo::kernel::cuda
