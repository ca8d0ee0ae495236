// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace widestereo::test {

/// Cuts a text short and puts random bytes into it, again and again; how often `error`, which gets
/// what is left, says something, each time with a remedy.
template <class ErrorOf>
int times_refused(const std::string& text, const ErrorOf& error) {
  std::mt19937 random(11);
  int refused = 0;
  const auto give = [&](const std::string& left) {
    const std::string message = error(left);
    if (message.empty()) return;
    ++refused;
    EXPECT_NE(message.find("; "), std::string::npos) << message;
  };
  for (std::size_t size = 0; size < text.size(); size += 7) give(text.substr(0, size));
  for (int round = 0; round < 300; ++round) {
    std::string damaged = text;
    for (int i = 0; i < 3; ++i) {
      damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
    }
    give(damaged);
  }
  return refused;
}

}  // namespace widestereo::test
