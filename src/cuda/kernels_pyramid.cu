// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {
KernelTable pyramid_kernels(int camera_model) {
  return for_model<pyramid_window_radius, WARP_AFFINE, PATTERN_CHECKERBOARD, 1>(camera_model,
                                                                                PyramidKernels());
}

}  // namespace widestereo::kernel::cuda
