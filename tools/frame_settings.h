// SPDX-License-Identifier: MIT
// The command line's options of which frames of a data set are taken.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "widestereo/sequence.h"

struct ChosenFrames {
  std::vector<widestereo::SequenceFrame> all;
  std::vector<std::size_t> chosen;  ///< of these, at least one
};

struct FrameSettings {
  /// What a data set is.
  static constexpr const char* layouts =
      "Folder with cam0/, cam1/, ... (frames have equal file names), or in EuRoC or TUM VI layout "
      "(mav0/camN/data, data.csv)";

  int first = 0;
  int count = 0;  ///< 0 = all
  int step = 1;
  bool skip_incomplete = false;

  /// Adds --first, --count, --step and --skip-incomplete.
  void add_to(CLI::App& command);
  bool given() const { return first > 0 || count > 0 || step > 1 || skip_incomplete; }
  ChosenFrames choose(const std::string& dataset, const std::vector<int>& cameras) const;
};
