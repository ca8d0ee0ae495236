// SPDX-License-Identifier: MIT
#pragma once

#include <istream>

namespace widestereo {

/// Some editors begin text files with one. The stream must be at its start.
inline void skip_byte_order_mark(std::istream& text) {
  bool at_start = true;
  for (const int byte : {0xef, 0xbb, 0xbf}) {
    if (text.peek() != byte) {
      text.clear();
      if (!at_start) text.seekg(0);  // pipes cannot
      return;
    }
    text.get();
    at_start = false;
  }
}

}  // namespace widestereo
