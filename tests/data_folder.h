// SPDX-License-Identifier: MIT
#pragma once

#include <cstdlib>
#include <filesystem>

namespace widestereo::test {

/// The folder of data sets beside the project (../shared/data, or WIDESTEREO_DATA); empty if there
/// is none.
inline std::filesystem::path data_folder() {
  const char* given = std::getenv("WIDESTEREO_DATA");
  const std::filesystem::path folder =
      given != nullptr ? std::filesystem::path(given)
                       : std::filesystem::path(WIDESTEREO_SOURCE_DIR) / "../shared/data";
  return std::filesystem::is_directory(folder) ? folder : std::filesystem::path();
}

}  // namespace widestereo::test
