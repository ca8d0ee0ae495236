// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {
namespace {

struct Get {
  template <class C>
  KernelTable operator()(C) const {
    // A pixel tries up to eight planes there, else one.
    using Iterate = std::conditional_t<C::warp == WARP_EXACT && C::source_count == 1, Tiled<C>, C>;
    static const KernelEntry entries[] = {
        KERNEL_ENTRY(initialise, C), KERNEL_ENTRY(iterate, Iterate),
        KERNEL_ENTRY(transfer_gather, C), KERNEL_ENTRY(structure, C), KERNEL_ENTRY(check, C)};
    return table_of(entries);
  }
};

}  // namespace

KernelTable paper_kernels(int camera_model, int source_count) {
  return for_rig<paper_window_radius, WARP_EXACT, PATTERN_DENSE, 1>(camera_model, source_count,
                                                                    Get());
}
KernelTable affine_paper_kernels(int camera_model, int source_count) {
  return for_rig<paper_window_radius, WARP_AFFINE, PATTERN_DENSE, 1>(camera_model, source_count,
                                                                     Get());
}

}  // namespace widestereo::kernel::cuda
