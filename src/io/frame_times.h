// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <vector>

#include "widestereo/sequence.h"

namespace widestereo {

inline constexpr double seconds_per_nanosecond = 1e-9;

inline bool has_time(const SequenceFrame& frame) { return frame.nanoseconds.has_value(); }

/// Whether all frames have one, without which they have an order alone.
inline bool have_times(const std::vector<SequenceFrame>& frames) {
  return std::all_of(frames.begin(), frames.end(), has_time);
}

}  // namespace widestereo
