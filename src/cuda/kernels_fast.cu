// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {
namespace {

struct Get {
  template <class C>
  KernelTable operator()(C) const {
    return pyramid_kernels<C>();
  }
};

}  // namespace

KernelTable fast_kernels(int source_model) {
  return for_model<pyramid_window_radius, WARP_AFFINE, PATTERN_CHECKERBOARD, 1>(source_model,
                                                                                Get());
}

}  // namespace widestereo::kernel::cuda
