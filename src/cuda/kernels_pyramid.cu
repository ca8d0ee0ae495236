// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {
namespace {

struct Get {
  template <class C>
  KernelTable operator()(C) const {
    static const KernelEntry entries[] = {
        KERNEL_ENTRY(sweep, C),       KERNEL_ENTRY(upsample, C),    KERNEL_ENTRY(search, C),
        KERNEL_ENTRY(measure, C),     KERNEL_ENTRY(regress, C),     KERNEL_ENTRY(adopt, C),
        KERNEL_ENTRY(check, C),       KERNEL_ENTRY(adopt_fill, C),  KERNEL_ENTRY(vote, C),
        KERNEL_ENTRY(renew_point, C), KERNEL_ENTRY(subpixel, C),    KERNEL_ENTRY(ambiguity, C),
        KERNEL_ENTRY(adopt_point, C), KERNEL_ENTRY(vote_normal, C), KERNEL_ENTRY(check_for_vote, C),
        KERNEL_ENTRY(fill, C),        KERNEL_ENTRY(structure, C),   KERNEL_ENTRY(merge, C)};
    return table_of(entries);
  }
};

}  // namespace

KernelTable pyramid_kernels(int camera_model, int source_count) {
  return for_rig<pyramid_window_radius, WARP_AFFINE, PATTERN_CHECKERBOARD, 2>(camera_model,
                                                                              source_count, Get());
}

}  // namespace widestereo::kernel::cuda
