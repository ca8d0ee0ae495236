// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

namespace widestereo {

/// Whether a value of a distance map stands for a point.
inline bool has_distance(float distance) { return distance > 0 && std::isfinite(distance); }

}  // namespace widestereo
