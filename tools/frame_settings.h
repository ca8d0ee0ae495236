// SPDX-License-Identifier: MIT
// The command line's options of which frames of a data set are taken.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "widestereo/error.h"
#include "widestereo/sequence.h"

struct ChosenFrames {
  std::vector<widestereo::SequenceFrame> all;
  std::vector<std::size_t> chosen;  ///< of these, at least one, each with an image of every camera
};

/// Says how many of these frames are left out and `why` ("as ...").
void report_left_out(std::size_t left_out, std::size_t frames, const std::string& why,
                     const std::string& first);

/// What `read` makes of a file among many that can do without it: its errors say how.
template <class Read>
auto read_of_many(const Read& read) {
  try {
    return read();
  } catch (const widestereo::Error& error) {
    throw widestereo::Error(
        error.what() + std::string(" Or remove it, and give --skip-incomplete to do without it."));
  }
}

struct FrameSettings {
  /// What a data set is.
  static constexpr const char* layouts =
      "Folder with cam0/, cam1/, ... (frames have equal file names, or numbers in them), or in "
      "EuRoC or TUM VI layout "
      "(mav0/camN/data, data.csv)";

  std::vector<std::string> folders;  ///< of the cameras' images in the data set; empty: cam0, ...
  int first = 0;
  int count = 0;  ///< 0 = all
  int step = 1;
  double time_tolerance = 0;  ///< seconds
  bool skip_incomplete = false;

  /// Adds --folders, --first, --count, --step, --time-tolerance and --skip-incomplete.
  /// `skipped_too`: what else the last one leaves out, in its help.
  void add_to(CLI::App& command, const std::string& skipped_too = {});
  /// Whether any but the last one were given.
  bool are_chosen() const {
    return !folders.empty() || first > 0 || count > 0 || step > 1 || time_tolerance > 0;
  }
  /// An image of the first of some cameras.
  std::filesystem::path example(const std::string& dataset, int first_camera) const;
  /// Of all frames of these cameras, those that all of them have; says where others are left out.
  ChosenFrames choose(const std::string& dataset, const std::vector<int>& cameras) const;
};
