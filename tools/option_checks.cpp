// SPDX-License-Identifier: MIT
#include "option_checks.h"

#include "text/number.h"

namespace {

CLI::Validator word_check(bool of_number) {
  return CLI::Validator(
      [of_number](const std::string& word) -> std::string {
        if (word.empty()) return "the value is empty; give one, or leave the option out";
        if (of_number && !widestereo::number_of(word)) {
          return word + " is no finite number";
        }
        return "";
      },
      "");
}

}  // namespace

CLI::Validator positive_number() {
  return CLI::Validator(
      [](const std::string& word) -> std::string {
        return widestereo::number_of(word).value_or(0) > 0 ? "" : word + " is no number above 0";
      },
      "POSITIVE");
}

CLI::Validator non_negative_number() {
  return CLI::Validator(
      [](const std::string& word) -> std::string {
        return widestereo::number_of(word).value_or(-1) >= 0 ? ""
                                                             : word + " is no number from 0 on";
      },
      "NONNEGATIVE");
}

void check_words_of(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const bool is_flag = option->get_expected_max() == 0;
    // The first check of all, as others take NaN to be within their range.
    if (!is_flag) option->transform(word_check(option->get_type_name().starts_with("FLOAT")));
  }
  for (CLI::App* command : app.get_subcommands(nullptr)) check_words_of(*command);
}
