// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {

KernelTable generic_kernels() {
  using C = AnyConstants;
  static const KernelEntry entries[] = {KERNEL_ENTRY(initialise, C),
                                        KERNEL_ENTRY(iterate, C),
                                        KERNEL_ENTRY(transfer_clear, C),
                                        KERNEL_ENTRY(transfer_nearest, C),
                                        KERNEL_ENTRY(transfer_winner, C),
                                        KERNEL_ENTRY(transfer_gather, C),
                                        KERNEL_ENTRY(check, C),
                                        KERNEL_ENTRY(downsample, C),
                                        KERNEL_ENTRY(sweep, C),
                                        KERNEL_ENTRY(upsample, C),
                                        KERNEL_ENTRY(search, C),
                                        KERNEL_ENTRY(measure, C),
                                        KERNEL_ENTRY(regress, C),
                                        KERNEL_ENTRY(adopt, C),
                                        KERNEL_ENTRY(fill, C),
                                        KERNEL_ENTRY(adopt_fill, C),
                                        KERNEL_ENTRY(vote, C),
                                        KERNEL_ENTRY(transfer_keep, C),
                                        KERNEL_ENTRY(renew, C),
                                        KERNEL_ENTRY(interpolate, C),
                                        KERNEL_ENTRY(subpixel, C),
                                        KERNEL_ENTRY(ambiguity, C),
                                        KERNEL_ENTRY(adopt_point, C)};
  return table_of(entries);
}

}  // namespace widestereo::kernel::cuda
