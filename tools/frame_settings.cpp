// SPDX-License-Identifier: MIT
#include "frame_settings.h"

#include "option_checks.h"
#include "widestereo/error.h"

namespace ws = widestereo;

void FrameSettings::add_to(CLI::App& command) {
  const std::string group = "Frames";
  command.add_option("--first", first, "First frame, counted from 0")
      ->check(non_negative_number())
      ->capture_default_str()
      ->group(group);
  command.add_option("--count", count, "Number of frames at most, 0 = all")
      ->check(non_negative_number())
      ->capture_default_str()
      ->group(group);
  command.add_option("--step", step, "Take every so many frames")
      ->check(positive_number())
      ->capture_default_str()
      ->group(group);
  command.add_flag("--skip-incomplete", skip_incomplete, "Leave out frames that a camera lacks")
      ->group(group);
}

ChosenFrames FrameSettings::choose(const std::string& dataset,
                                   const std::vector<int>& cameras) const {
  ChosenFrames frames{.all = ws::read_sequence(dataset, cameras, skip_incomplete), .chosen = {}};
  if (first >= static_cast<int>(frames.all.size())) {
    throw ws::Error(dataset + " has " + std::to_string(frames.all.size()) +
                    " frames; there is no frame " + std::to_string(first) +
                    " to start from (--first counts from 0).");
  }
  for (std::size_t i = static_cast<std::size_t>(first); i < frames.all.size();
       i += static_cast<std::size_t>(step)) {
    if (count > 0 && frames.chosen.size() == static_cast<std::size_t>(count)) break;
    frames.chosen.push_back(i);
  }
  return frames;
}
