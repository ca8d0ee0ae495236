// SPDX-License-Identifier: MIT
#include "cuda/kernels.cuh"

namespace widestereo::kernel::cuda {

KernelTable generic_kernels() {
  static const KernelEntry entries[] = {
#define KERNEL(name, view) KERNEL_ENTRY(name, AnyConstants),
#include "kernel_list.h"
  };
  return table_of(entries);
}

}  // namespace widestereo::kernel::cuda
