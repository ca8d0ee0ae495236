// SPDX-License-Identifier: MIT
// Numbers with a fixed number of digits in texts.
#pragma once

#include <cstddef>
#include <cstdio>
#include <string>

namespace widestereo {

/// What printf() would print.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  const auto length = static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...));
  std::string text(length, '\0');
  std::snprintf(text.data(), length + 1, format, values...);
  return text;
}

}  // namespace widestereo
