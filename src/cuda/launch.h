// SPDX-License-Identifier: MIT
// Which kernel is launched with which grid.
#pragma once

#include "cuda/kernels.h"
#include "schedule/schedule.h"

namespace widestereo {

/// Blocks in x and y.
struct LaunchGrid {
  unsigned columns = 0;
  unsigned rows = 0;
};

/// Covers `rows` rows of `width` pixels; with a colour (>= 0) every other pixel of each row.
LaunchGrid launch_grid(int width, int rows, int colour);

/// The entry point for these constants: the specialised one where there is one, else the generic.
/// Throws Error when there is no such kernel.
const void* kernel_function(Kernel kernel, const KernelConstants& constants);

}  // namespace widestereo
