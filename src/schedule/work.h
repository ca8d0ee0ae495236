// SPDX-License-Identifier: MIT
// What the kernels of a schedule have to do (see KernelWork), for comparing times with what a
// device can do.
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

/// Those of shaders/plane_fit.glsl, counted likewise.
struct FitOperations {
  int of_neighbour = 73;         ///< in the loop over a row of neighbours
  int of_neighbours_plane = 10;  ///< besides, in rounds after the first
  int of_row = 1;
  int of_fit = 49;  ///< around both loops, after random numbers
};

/// Neighbours on a side of the grid to which a plane is fitted.
int side_of_fit(int radius, int steps);

/// Work of one dispatch: of all pixels, patches at full windows, regressions with the fewest rounds
/// (see KernelWork).
KernelWork work_of(const Schedule& schedule, const Dispatch& dispatch);

/// Whether each view of a dispatch may run as soon as its own dispatches before have: it is over
/// all views of a level, reads no planes of other views and writes no texels, which these
/// read.
bool views_are_independent(const Schedule& schedule, const Dispatch& dispatch);

}  // namespace widestereo
