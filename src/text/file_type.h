// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <system_error>

#include "widestereo/error.h"

namespace widestereo {

/// What lies at a path, of type not_found if nothing does. Throws Error where that cannot be told.
inline std::filesystem::file_type type_of(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_type type = std::filesystem::status(path, error).type();
  if (type == std::filesystem::file_type::none) {
    throw Error("Cannot read " + path.string() + ": " + error.message() +
                "; check the permissions of its folder.");
  }
  return type;
}

}  // namespace widestereo
