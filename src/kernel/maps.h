// SPDX-License-Identifier: MIT
// What the maps of a match mean, for the host and for CUDA.
#pragma once

#include "kernel/host.h"
#include "widestereo/pixel_type.h"

namespace widestereo::kernel {
#include "maps.glsl"

static_assert(PIXEL_GREY8 == static_cast<int>(PixelType::grey8));
static_assert(PIXEL_GREY16 == static_cast<int>(PixelType::grey16));
static_assert(PIXEL_INTENSITY == static_cast<int>(PixelType::intensity));

}  // namespace widestereo::kernel
