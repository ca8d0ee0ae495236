// SPDX-License-Identifier: MIT
// The command line's option for images of cameras with fewer bits than their files.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <opencv2/core/mat.hpp>

class WhiteLevel {
 public:
  static constexpr int lowest = 255, highest = 65535;
  /// Adds --white-level.
  void add_to(CLI::App& command);
  /// As ws::read_image(), stretched to all of 16 bits where a level is given. Where none is, says
  /// so once of a 16-bit image that looks as if one were needed. `otherwise`: of a 16-bit image
  /// where none is given, 0 = not known.
  cv::Mat read(const std::filesystem::path& file, int otherwise = 0) const;
  /// The same of a file among many that can do without it: the message says how.
  cv::Mat read_of_many(const std::filesystem::path& file) const;
  /// 0: none given.
  int value() const { return value_; }

 private:
  int value_ = 0;
  mutable bool told_ = false;
};
