// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "calibration/document.h"

namespace widestereo::calibration {

/// Throws Error where a key is there twice, of which parsers take the last one, and what
/// nlohmann::json throws where it is no JSON, or has numbers beyond what can be held. `Json`: one
/// of its types, as a conversion would call itself at each level.
template <class Json>
Json parsed_json(const Document& document) {
  std::vector<std::set<std::string>> keys;  // of the objects that are open
  using Event = typename Json::parse_event_t;
  return Json::parse(document.text, [&](int, Event event, Json& value) {
    if (event == Event::object_start) keys.emplace_back();
    if (event == Event::object_end) keys.pop_back();
    if (event == Event::key && !keys.back().insert(value.template get<std::string>()).second) {
      document.fail("The key " + value.template get<std::string>() + " is there twice",
                    "leave one");
    }
    return true;
  });
}

}  // namespace widestereo::calibration
