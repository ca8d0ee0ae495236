// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {
KernelTable fast_kernels(int source_model) {
  return for_model<pyramid_window_radius, WARP_AFFINE, PATTERN_CHECKERBOARD, 1>(source_model,
                                                                                PyramidKernels());
}

}  // namespace widestereo::kernel::cuda
