// SPDX-License-Identifier: MIT
// Compiled only: what an application includes that chose C++17.
#include "widestereo/calibration.h"
#include "widestereo/matcher.h"

static_assert(__cplusplus >= 202002L, "the library's target must ask for C++20");
