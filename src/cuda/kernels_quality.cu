// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {
KernelTable quality_kernels(int camera_model, int source_count) {
  return for_rig<quality_window_radius, WARP_AFFINE, PATTERN_CHECKERBOARD, 1>(
      camera_model, source_count, PyramidKernels());
}

}  // namespace widestereo::kernel::cuda
