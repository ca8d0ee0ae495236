// SPDX-License-Identifier: MIT
// Pixels of images in an application's device memory. Needs C++11 only, for .cu files.
#pragma once

namespace widestereo {

enum class PixelType : int {
  grey8 = 0,      ///< std::uint8_t
  grey16 = 1,     ///< std::uint16_t, 65535 is white
  intensity = 2,  ///< float in [0, 1]; other values, NaN included, count as masked
};

}  // namespace widestereo
