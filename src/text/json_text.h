// SPDX-License-Identifier: MIT
// Records as text, for standard output and files.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace widestereo {

/// JSON is UTF-8, but names of files and presets need not be: what is not becomes U+FFFD.
inline std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace widestereo
