// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace widestereo::test {

/// A text with the first occurrence of `from`, which there must be, replaced.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  if (at == std::string::npos) {
    ADD_FAILURE() << "no \"" << from << "\" in:\n" << text;
    return text;
  }
  return text.replace(at, from.size(), to);
}

}  // namespace widestereo::test
