// SPDX-License-Identifier: MIT
// Sizes of images and maps in messages.
#pragma once

#include <string>

namespace widestereo {

/// As "640x480": pixels.
inline std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

}  // namespace widestereo
