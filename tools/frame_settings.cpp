// SPDX-License-Identifier: MIT
#include "frame_settings.h"

#include <algorithm>

#include "option_checks.h"
#include "say.h"
#include "widestereo/error.h"

namespace ws = widestereo;
namespace fs = std::filesystem;

void report_left_out(std::size_t left_out, std::size_t frames, const std::string& why,
                     const std::string& first) {
  say(std::to_string(left_out) + " of " + std::to_string(frames) + " frames are left out, " + why +
      "; the first is " + first + ".");
}

void FrameSettings::add_to(CLI::App& command, const std::string& skipped_too) {
  const std::string group = "Frames";
  command
      .add_option("--folders", folders,
                  "Folders of the cameras' images in the data set, in the order of the cameras; by "
                  "default cam0,cam1,...")
      ->delimiter(',')
      ->group(group);
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
  command
      .add_option(
          "--time-tolerance", time_tolerance,
          "Images that are this near in time are of one frame, seconds; otherwise times must "
          "be equal")
      ->check(non_negative_number())
      ->capture_default_str()
      ->group(group);
  command
      .add_flag("--skip-incomplete", skip_incomplete,
                "Leave out frames that a camera, or --poses, lacks" + skipped_too)
      ->group(group);
}

fs::path FrameSettings::example(const std::string& dataset, int first_camera) const {
  const std::vector<ws::SequenceFrame> frames =
      folders.empty() ? ws::read_sequence(dataset, {first_camera}, skip_incomplete)
                      : ws::read_sequence({fs::path(dataset) / folders.front()}, skip_incomplete);
  return frames.front().images.front();
}

ChosenFrames FrameSettings::choose(const std::string& dataset,
                                   const std::vector<int>& cameras) const {
  if (!folders.empty() && folders.size() != cameras.size()) {
    throw ws::Error("--folders names " + std::to_string(folders.size()) + " folders for " +
                    std::to_string(cameras.size()) + " cameras; give one for each.");
  }
  std::vector<fs::path> of_cameras;
  for (const std::string& folder : folders) of_cameras.push_back(fs::path(dataset) / folder);
  ChosenFrames frames{
      .all = folders.empty() ? ws::read_sequence(dataset, cameras, skip_incomplete, time_tolerance)
                             : ws::read_sequence(of_cameras, skip_incomplete, time_tolerance),
      .chosen = {}};
  if (time_tolerance > 0 && std::none_of(frames.all.begin(), frames.all.end(),
                                         [](const auto& frame) { return frame.nanoseconds; })) {
    throw ws::Error("--time-tolerance has no effect on " + dataset +
                    ", whose images have no times; leave it out.");
  }
  std::vector<std::size_t> complete;
  for (std::size_t i = 0; i < frames.all.size(); ++i) {
    if (ws::is_complete(frames.all[i])) complete.push_back(i);
  }
  if (complete.size() < frames.all.size()) {
    const auto lacking = std::find_if_not(frames.all.begin(), frames.all.end(), ws::is_complete);
    report_left_out(frames.all.size() - complete.size(), frames.all.size(),
                    "as a camera lacks them", lacking->name);
  }
  if (first >= static_cast<int>(complete.size())) {
    throw ws::Error(dataset + " has " + std::to_string(complete.size()) +
                    " frames; there is no frame " + std::to_string(first) +
                    " to start from (--first counts from 0).");
  }
  for (std::size_t i = static_cast<std::size_t>(first); i < complete.size();
       i += static_cast<std::size_t>(step)) {
    if (count > 0 && frames.chosen.size() == static_cast<std::size_t>(count)) break;
    frames.chosen.push_back(complete[i]);
  }
  return frames;
}
