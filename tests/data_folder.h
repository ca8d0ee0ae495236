// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>

namespace widestereo::test {

/// The folder of stereo sets (WIDESTEREO_DATA, or ../shared/data beside the project); empty if
/// there is none.
inline std::filesystem::path data_folder() {
  const char* given = std::getenv("WIDESTEREO_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(WIDESTEREO_SOURCE_DIR) / "../shared/data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

/// Skips a test that needs them where there are none; where WIDESTEREO_DATA names no folder it
/// fails instead.
#define SKIP_WITHOUT_STEREO_SETS()                                            \
  do {                                                                        \
    if (!::widestereo::test::data_folder().empty()) break;                    \
    if (const char* named = std::getenv("WIDESTEREO_DATA")) {                 \
      FAIL() << "WIDESTEREO_DATA is \"" << named << "\", which is no folder"; \
    }                                                                         \
    GTEST_SKIP() << "no stereo sets; WIDESTEREO_DATA names their folder";     \
  } while (false)

}  // namespace widestereo::test
