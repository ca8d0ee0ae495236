// SPDX-License-Identifier: MIT
#pragma once

#include <random>
#include <string>

namespace widestereo::test {

/// Cuts a text short and puts random bytes into it, again and again; how often `error`, which gets
/// what is left, says something.
template <class ErrorOf>
int times_refused(const std::string& text, const ErrorOf& error) {
  std::mt19937 random(11);
  int refused = 0;
  for (std::size_t size = 0; size < text.size(); size += 7) {
    refused += !error(text.substr(0, size)).empty();
  }
  for (int round = 0; round < 300; ++round) {
    std::string damaged = text;
    for (int i = 0; i < 3; ++i) {
      damaged[random() % damaged.size()] = static_cast<char>(random() % 256);
    }
    refused += !error(damaged).empty();
  }
  return refused;
}

}  // namespace widestereo::test
