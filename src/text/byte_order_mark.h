// SPDX-License-Identifier: MIT
#pragma once

#include <istream>

namespace widestereo {

/// Some editors begin text files with one. The stream must be at its start.
inline void skip_byte_order_mark(std::istream& text) {
  for (const int byte : {0xef, 0xbb, 0xbf}) {
    if (text.peek() != byte) {
      text.clear();
      text.seekg(0);
      return;
    }
    text.get();
  }
}

}  // namespace widestereo
