// SPDX-License-Identifier: MIT
// What the words that options take must be like.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

/// CLI11's own checks let NaN pass and name limits of 309 digits.
CLI::Validator positive_number();
CLI::Validator non_negative_number();

/// One of these names, as text of the value's number, which is how CLI11 reads enumerations. Its
/// own transformer takes the numbers, too, and lists both.
template <class Value>
CLI::Validator name_among(const std::vector<std::pair<std::string, Value>>& names) {
  std::string list;
  for (const auto& [name, value] : names) list += (list.empty() ? "{" : ",") + name;
  list += "}";
  return CLI::Validator(
      [names, list](std::string& word) -> std::string {
        for (const auto& [name, value] : names) {
          if (word != name) continue;
          word = std::to_string(static_cast<int>(value));
          return "";
        }
        return word + " not in " + list;
      },
      list);
}

/// Throws Error where a file to be written is one of those that are read.
void require_other_file(const std::filesystem::path& output,
                        const std::vector<std::filesystem::path>& inputs);

/// Throws Error where the folder for results is that of the data.
void require_other_folder(const std::filesystem::path& output, const std::filesystem::path& data);
/// Throws Error where the output would lie among images, and be taken for some by the next run.
void require_not_among(const std::filesystem::path& output,
                       const std::vector<std::filesystem::path>& images);
/// Throws Error where --views names a camera twice: of one frame it has one image. `remedy`: what
/// the message goes on with.
void require_different_cameras(
    std::vector<int> cameras,
    const std::string& remedy = "which has one image of each frame; name it once");

/// Throws Error where an image is given twice: it would match itself at any distance.
void require_different_images(const std::vector<std::filesystem::path>& images);

/// Makes every option, of subcommands too, refuse an empty word, and where it takes numbers NaN and
/// infinity, and read whole numbers by their decimal digits.
void check_words_of(CLI::App& app);
