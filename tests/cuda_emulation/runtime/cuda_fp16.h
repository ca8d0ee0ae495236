// SPDX-License-Identifier: MIT
// Half precision on the CPU.
#pragma once

#include <opencv2/core/cvdef.h>

using __half = cv::float16_t;

struct __half2 {
  unsigned short x, y;  // bits, which can be copied into it as on a device
};

inline __half __float2half_rn(float value) { return __half(value); }
inline float __low2float(__half2 pair) { return __half::fromBits(pair.x); }
inline float __high2float(__half2 pair) { return __half::fromBits(pair.y); }
