// SPDX-License-Identifier: MIT
// Half precision on the CPU.
#pragma once

#include <opencv2/core/cvdef.h>

using __half = cv::float16_t;

inline __half __float2half_rn(float value) { return __half(value); }
