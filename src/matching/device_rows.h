// SPDX-License-Identifier: MIT
// Rows of images and maps in an application's device memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "widestereo/pixel_type.h"

namespace widestereo {

/// Throws Error for what is no PixelType.
std::size_t bytes_of(PixelType pixel);

struct DeviceRows {
  std::uintmax_t place = 0;   ///< address or offset of the first element
  std::size_t pitch = 0;      ///< bytes from row to row
  std::size_t element = 1;    ///< bytes of one, to whose multiples place and pitch must be
  std::size_t row = 0;        ///< bytes of a row
  const char* place_is = "";  ///< "pointer" or "offset"
};

/// Throws Error where a rig's views, images and maps are not as many.
void require_one_for_each_view(std::size_t views, std::size_t images, std::size_t maps);

/// Throws Error naming `what` where rows overlap or elements are not aligned.
void require_rows(const DeviceRows& rows, const std::string& what);

}  // namespace widestereo
