// SPDX-License-Identifier: MIT
#pragma once

#include <cstdio>
#include <string>

/// Prints a sentence of the command's own on standard error, where std::cerr is silent: libraries
/// write there what the command says in a sentence.
inline void say(const std::string& sentence) {
  std::fflush(stdout);  // where both go to one file, lines stay whole and in order
  std::fprintf(stderr, "widestereo: %s\n", sentence.c_str());
}
