// SPDX-License-Identifier: MIT
#include "cuda/architectures.h"

#include <cctype>
#include <sstream>

#ifndef WIDESTEREO_CUDA_ARCHITECTURES
#define WIDESTEREO_CUDA_ARCHITECTURES ""
#endif

namespace widestereo {
namespace {

bool one_runs_on(const std::string& architecture, int major, int minor) {
  std::size_t digits = 0;
  int number = 0;
  while (digits < architecture.size() && digits < 4 &&
         std::isdigit(static_cast<unsigned char>(architecture[digits])) != 0) {
    number = 10 * number + (architecture[digits++] - '0');
  }
  if (digits == 0) return true;
  const std::string rest = architecture.substr(digits);
  // "90a": features of one architecture alone, forward compatible to none.
  if (!rest.empty() && rest[0] == 'a') return number == 10 * major + minor;
  const bool same_major = number / 10 == major && number % 10 <= minor;
  const bool older = number <= 10 * major + minor;
  // "100f": those of one family.
  if (rest.ends_with("-real") || (!rest.empty() && rest[0] == 'f')) return same_major;
  return older;  // PTX, which plain numbers include
}

}  // namespace

bool runs_on(const std::string& architectures, int major, int minor) {
  std::string words = architectures;
  for (char& c : words) {
    if (c == ';') c = ' ';
  }
  std::istringstream stream(words);
  std::string word;
  while (stream >> word) {
    if (one_runs_on(word, major, minor)) return true;
  }
  return false;
}

std::string built_architectures() { return WIDESTEREO_CUDA_ARCHITECTURES; }

}  // namespace widestereo
