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

/// Skips a test that needs them where there are none.
#define SKIP_WITHOUT_STEREO_SETS()               \
  if (::widestereo::test::data_folder().empty()) \
  GTEST_SKIP() << "no stereo sets; WIDESTEREO_DATA names their folder"

}  // namespace widestereo::test
