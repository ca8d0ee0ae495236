// SPDX-License-Identifier: MIT
// Numbers with a fixed number of digits in texts.
#pragma once

#include <locale.h>

#include <cstddef>
#include <cstdio>
#include <string>

namespace widestereo {

/// In its scope C's functions take a point for the decimal point in this thread.
class PointForDecimals {
 public:
  PointForDecimals() : before_(uselocale(of_c())) {}
  ~PointForDecimals() { uselocale(before_); }
  PointForDecimals(const PointForDecimals&) = delete;
  PointForDecimals& operator=(const PointForDecimals&) = delete;

 private:
  static locale_t of_c() {
    static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
    return locale;
  }
  locale_t before_;
};

/// What printf() would print in the locale "C".
template <class... Values>
std::string formatted(const char* format, Values... values) {
  const PointForDecimals point;
  const auto length = static_cast<std::size_t>(std::snprintf(nullptr, 0, format, values...));
  std::string text(length, '\0');
  std::snprintf(text.data(), length + 1, format, values...);
  return text;
}

}  // namespace widestereo
