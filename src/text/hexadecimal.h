// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace widestereo {

/// Two digits for each byte, in lower case.
template <class Bytes>
std::string hexadecimal(const Bytes& bytes) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const auto byte : bytes) {
    const auto value = static_cast<unsigned char>(byte);
    text += digits[value >> 4];
    text += digits[value & 15];
  }
  return text;
}

}  // namespace widestereo
