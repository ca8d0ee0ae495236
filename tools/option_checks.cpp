// SPDX-License-Identifier: MIT
#include "option_checks.h"

#include <sys/stat.h>

#include <algorithm>
#include <set>
#include <stdexcept>
#include <utility>

#include "text/number.h"
#include "widestereo/error.h"

namespace ws = widestereo;

namespace {

/// CLI11 takes 010 for 8 and 0x10 for 16, but frames are named with leading zeros.
std::string make_decimal(std::string& word) {
  const std::size_t sign = word.starts_with('-') || word.starts_with('+') ? 1 : 0;
  if (word.size() == sign || word.find_first_not_of("0123456789", sign) != std::string::npos) {
    return word + " is no whole number";
  }
  word.erase(sign, std::min(word.find_first_not_of('0', sign), word.size() - 1) - sign);
  return "";
}

bool is_truth_value(const std::string& word) {
  try {
    CLI::detail::to_flag_value(word);
    return true;
  } catch (const std::invalid_argument&) {
    return false;
  }
}

CLI::Validator word_check(const std::string& type) {
  const bool of_truth = type == "BOOLEAN";
  const bool of_number = type.starts_with("FLOAT");
  const bool of_whole_number = type.starts_with("INT") || type.starts_with("UINT");
  return CLI::Validator(
      [of_truth, of_number, of_whole_number](std::string& word) -> std::string {
        if (word.empty()) return "the value is empty; give one, or leave the option out";
        if (of_truth && !is_truth_value(word)) return word + " is neither true nor false";
        if (of_number && !widestereo::number_of(word)) {
          return word + " is no finite number";
        }
        return of_whole_number ? make_decimal(word) : "";
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

void require_other_file(const std::filesystem::path& output,
                        const std::vector<std::filesystem::path>& inputs) {
  for (const std::filesystem::path& input : inputs) {
    std::error_code missing;
    if (!std::filesystem::equivalent(input, output, missing)) continue;
    throw ws::Error(output.string() +
                    " is among the files that are read; choose another file to write.");
  }
}

void require_other_folder(const std::filesystem::path& output, const std::filesystem::path& data) {
  std::error_code missing;
  if (!std::filesystem::equivalent(output, data, missing)) return;
  throw ws::Error(output.string() +
                  " is the folder of the images; choose another one, or one within it, for the "
                  "results.");
}

void require_not_among(const std::filesystem::path& output,
                       const std::vector<std::filesystem::path>& images) {
  std::set<std::filesystem::path> folders;
  for (const std::filesystem::path& image : images) folders.insert(image.parent_path());
  for (const std::filesystem::path& folder : folders) require_other_folder(output, folder);
}

void require_different_cameras(std::vector<int> cameras, const std::string& remedy) {
  std::sort(cameras.begin(), cameras.end());
  const auto twice = std::adjacent_find(cameras.begin(), cameras.end());
  if (twice == cameras.end()) return;
  throw ws::Error("--views names camera " + std::to_string(*twice) + " twice, " + remedy + ".");
}

void require_different_images(const std::vector<std::filesystem::path>& images) {
  std::set<std::pair<dev_t, ino_t>> files;  // links have one in common
  for (const std::filesystem::path& image : images) {
    struct stat file {};
    if (stat(image.c_str(), &file) != 0) continue;  // reading says what is wrong
    if (files.insert({file.st_dev, file.st_ino}).second) continue;
    throw ws::Error(image.string() + " is given twice; give another image for each view.");
  }
}

void check_words_of(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const bool is_flag = option->get_expected_max() == 0;
    // The first check of all, as others take NaN to be within their range.
    if (!is_flag) option->transform(word_check(option->get_type_name()));
  }
  for (CLI::App* command : app.get_subcommands(nullptr)) check_words_of(*command);
}
