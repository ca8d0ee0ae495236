// SPDX-License-Identifier: MIT
// What the kernels of a schedule have to do at most (see KernelWork), for comparing times with what
// a device can do.
#pragma once

#include "schedule/schedule.h"
#include "widestereo/matcher.h"

namespace widestereo {

/// Single-precision operations of shaders/patch.glsl, each addition, subtraction, multiplication,
/// division, root or elementary function counting as one; comparisons, conversions, addresses and
/// factors of one count as none.
struct PatchOperations {
  int of_sample = 0;  ///< in the loop over a patch
  int of_patch = 0;   ///< around it, for each source
};
PatchOperations patch_operations(const KernelConstants& constants);

/// Work of one dispatch: of all pixels, patches at full windows (see KernelWork).
KernelWork work_of(const Schedule& schedule, const Dispatch& dispatch);

}  // namespace widestereo
