// SPDX-License-Identifier: MIT
// Sizes of memory in messages.
#pragma once

#include <cstdint>
#include <string>

namespace widestereo {

/// In whole mebibytes, rounded up, with their unit.
inline std::string mebibytes(std::uint64_t bytes) {
  constexpr std::uint64_t mebibyte = 1u << 20;
  return std::to_string(bytes / mebibyte + (bytes % mebibyte != 0)) + " MiB";
}

}  // namespace widestereo
