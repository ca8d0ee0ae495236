// SPDX-License-Identifier: MIT
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "acceptance.h"
#include "calibration_fit.h"
#include "commands.h"
#include "folder_format.h"
#include "frame_settings.h"
#include "image_checks.h"
#include "input_record.h"
#include "match_settings.h"
#include "matching_run.h"
#include "option_checks.h"
#include "pose_settings.h"
#include "progress_bar.h"
#include "result_folder.h"
#include "rig_settings.h"
#include "say.h"
#include "sequence_folder.h"
#include "sharpness_settings.h"
#include "size_settings.h"
#include "text/json_text.h"
#include "text/number.h"
#include "white_level.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"
#include "widestereo/motion.h"
#include "widestereo/sequence.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

/// Of a frame's overlap, for others to be started from it or compared with it. Noise alone has up
/// to 12 % accepted by chance, black frames nothing.
constexpr double least_accepted = 0.15;

struct SequenceArguments {
  std::string dataset;
  std::string output;
  PoseSettings poses;
  FrameSettings frames;
  double restart_below = 0.75;
  bool no_motion = false;
  bool no_warm_start = false;
  bool overwrite = false;
  RigSettings rig;
  SizeSettings size;
  WhiteLevel white_level;
  SharpnessSettings sharpness;
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

/// Frames to match, with the rig and its poses where they are known.
struct Selection {
  std::vector<ws::SequenceFrame> frames;
  ws::Rig calibrated;         ///< for the images as they are
  ws::Rig rig;                ///< as they are matched
  std::vector<double> blurs;  ///< of each view's images before they are matched, pixels
  RigPoses motion;            ///< no poses where they are not known
};

std::vector<cv::Mat> read_images(const ws::SequenceFrame& frame, const WhiteLevel& white_level) {
  std::vector<cv::Mat> images;
  for (const fs::path& path : frame.images) images.push_back(white_level.read_of_many(path));
  return images;
}

struct LoadedFrame {
  const ws::SequenceFrame& frame;
  std::vector<cv::Mat> images;
};

/// The first frame without a blank image, as cameras that are just starting give; else the first.
LoadedFrame first_with_content(const std::vector<ws::SequenceFrame>& frames,
                               const WhiteLevel& white_level) {
  for (const ws::SequenceFrame& frame : frames) {
    LoadedFrame loaded{frame, read_images(frame, white_level)};
    if (std::none_of(loaded.images.begin(), loaded.images.end(),
                     [](const cv::Mat& image) { return is_blank(image, cv::Mat()); })) {
      return loaded;
    }
  }
  return {frames.front(), read_images(frames.front(), white_level)};
}

/// A frame's images as they are matched; throws Error unless they have the calibrated sizes.
std::vector<cv::Mat> reduced(std::vector<cv::Mat> images, const ws::SequenceFrame& frame,
                             const ws::Rig& calibrated, const SizeSettings& size) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    images[i] = size.reduced(images[i], calibrated.views[i], frame.images[i].string());
  }
  return images;
}

/// A few pairs along the sequence, each of a frame's camera 0 and, in turn, a camera of the first
/// frame after it from where the rig has moved as far as its cameras are apart, if it soon does.
std::vector<MatchedViews> pairs_along(const Selection& selection, const SequenceArguments& a) {
  constexpr std::size_t places = 4;
  constexpr std::size_t soon = 10;  // frames
  const std::vector<Eigen::Isometry3d>& poses = selection.motion.poses;
  const std::vector<ws::View>& views = selection.rig.views;
  const auto view_at = [&](std::size_t frame, std::size_t camera) {
    return posed_view(views[camera], poses[frame], selection.frames[frame].name);
  };
  const auto image_at = [&](std::size_t frame, std::size_t camera) {
    const fs::path& file = selection.frames[frame].images[camera];
    return a.size.reduced(a.white_level.read_of_many(file), selection.calibrated.views[camera],
                          file.string());
  };
  std::vector<MatchedViews> pairs;
  for (std::size_t k = 0; k < places; ++k) {
    const std::size_t begin = k * poses.size() / places;
    const std::size_t last = std::min(begin + soon, poses.size() - 1);
    if (begin == last) continue;
    const ws::View first = view_at(begin, 0);
    std::size_t end = begin + 1;
    while (end < last && baseline(first, view_at(end, 0)) < baseline(views[0], views[1])) ++end;
    // What two cameras see depends on the poses' unit, too.
    const std::size_t camera = k % 2;
    const ws::Rig rig{.views = {first, view_at(end, camera)}};
    try {
      pairs.push_back(
          match_with_first(rig, {image_at(begin, 0), image_at(end, camera)}, a.settings.options())
              .front());
    } catch (const ws::Error&) {
      // of an image that cannot be read, of which matching will tell
    }
  }
  return pairs;
}

Selection select_frames(const SequenceArguments& a) {
  std::vector<int> cameras = a.rig.views;
  if (cameras.empty()) {
    cameras.resize(a.frames.folders.empty() ? 2 : a.frames.folders.size());
    std::iota(cameras.begin(), cameras.end(), 0);
  }
  if (cameras.size() == 1) {
    throw ws::Error(
        "A sequence is of two cameras or more; give one that moves to `reconstruct`, with "
        "--poses.");
  }
  require_different_cameras(cameras);
  const ChosenFrames frames = a.frames.choose(a.dataset, cameras);
  Selection selection;
  std::vector<fs::path> files;
  for (const std::size_t i : frames.chosen) {
    const ws::SequenceFrame& frame = selection.frames.emplace_back(frames.all[i]);
    files.insert(files.end(), frame.images.begin(), frame.images.end());
  }
  require_not_among(a.output, files);
  const auto& [start, images] = first_with_content(selection.frames, a.white_level);
  selection.calibrated = a.rig.rig_for_images(cameras.size(), images.front().size());
  selection.rig = selection.calibrated;
  for (ws::View& view : selection.rig.views) view = a.size.reduced(view);
  const std::vector<cv::Mat> first = reduced(images, start, selection.calibrated, a.size);
  require_different_pictures(selection.rig, first);
  report_blank_images(selection.rig, first);
  // The first frame that shows anything decides alone, so that more frames may follow later.
  a.rig.leave_out_dark_rims(selection.rig, first);
  const std::vector<MatchedViews> pairs =
      match_with_first(selection.rig, first, a.settings.options());
  selection.blurs = a.sharpness.blurs(selection.rig, first, pairs);
  report_calibration_errors(pairs, false);
  report_features_out_of_range(pairs, " m", report_long_baseline(selection.rig));
  if (a.poses.given()) {
    selection.motion = a.poses.read(selection.rig, a.rig.calibration, frames.all, frames.chosen,
                                    a.frames.skip_incomplete);
    selection.frames.clear();
    for (const std::size_t i : selection.motion.frames) selection.frames.push_back(frames.all[i]);
    report_pose_errors(pairs_along(selection, a));
  }
  return selection;
}

/// All that decides the results of a frame.
Json settings_of(const SequenceArguments& a, const Selection& selection, const ws::Options& options,
                 const ws::DeviceInfo& device) {
  Json settings = {{"program", "widestereo " WIDESTEREO_VERSION},
                   {"dataset", absolute_path(a.dataset)},
                   {"folders", a.frames.folders},
                   {"calibration", absolute_path(a.rig.calibration)},
                   {"masks", absolute_paths(a.rig.masks)},
                   {"white_level", a.white_level.value()},
                   {"blurs", selection.blurs},
                   {"poses", absolute_path(a.poses.file)},
                   {"poses_of", selection.motion.of},
                   {"poses_tolerance", a.poses.tolerance},
                   {"first", a.frames.first},
                   {"step", a.frames.step},
                   {"warm_start", !a.no_warm_start},
                   {"motion", !a.no_motion},
                   {"restart_below", a.restart_below},
                   {"formats", a.format.maps},
                   {"png_scale", a.format.png_scale},
                   {"clouds", !a.format.no_cloud},
                   {"pictures", !a.format.no_pictures},
                   {"device", device_record(device)},
                   {"options", Json::parse(ws::to_json(options))}};
  if (selection.motion.of == PoseSettings::imu) {
    settings["world_from_imu"] = to_json(*selection.rig.world_from_imu);
    settings["imu_time_offset"] = selection.rig.views.front().imu_time_offset;
  }
  for (const ws::View& view : selection.rig.views) settings["views"].push_back(to_json(view));
  return settings;
}

/// How well a frame was matched, over all its views.
struct Quality {
  double accepted = 0;
  double overlap = 0;
  double mean_cost = 0;  ///< NaN where no view has a plane
};

Quality quality_of(const ws::StereoResult& result) {
  Quality quality{.accepted = accepted_share(result.views), .overlap = overlap_share(result.views)};
  double views = 0;
  for (const ws::ViewResult& view : result.views) {
    const double mean_cost = ws::consistency_scores(view.differences, view.cost).mean_cost;
    if (std::isnan(mean_cost)) continue;
    quality.mean_cost += mean_cost;
    ++views;
  }
  quality.mean_cost /= views;
  return quality;
}

/// Matches frame after frame, each from the one before it.
class SequenceRun {
 public:
  SequenceRun(const SequenceArguments& arguments, Selection selection)
      : arguments_(arguments),
        selection_(std::move(selection)),
        options_(arguments.settings.options()),
        device_(open_device(arguments.settings)),
        folder_(arguments.output, settings_of(arguments, selection_, options_, device_.info()),
                arguments.overwrite),
        bar_("Matching on " + device_.info().name) {}

  void run() {
    std::vector<Json> wanted;
    for (std::size_t i = 0; i < selection_.frames.size(); ++i) wanted.push_back(input_of(i));
    const std::size_t earlier = std::min(folder_.frames().size(), wanted.size());
    const std::size_t finished = folder_.finished(wanted);
    if (finished < earlier) {
      say("Frames that an earlier run finished: " + std::to_string(earlier - finished) +
          " are matched again, from " + selection_.frames[finished].name +
          " on, whose images, pose or files have changed since.");
    }
    remaining_ = selection_.frames.size() - finished;
    if (remaining_ == 0) return;
    report_few_sources(options_, selection_.rig.views.size());
    ws::Matcher matcher(device_, selection_.rig, options_);
    if (finished > 0) take_up(finished - 1);
    for (std::size_t i = finished; i < selection_.frames.size(); ++i) match(matcher, i);
    folder_.finish();
  }

  const SequenceFolder& folder() const { return folder_; }

 private:
  /// What the next frame starts from.
  struct Previous {
    std::vector<cv::Mat> images;
    std::vector<ws::ViewResult> views;
    bool on_device = false;
  };

  struct Frame {
    Json input;  ///< of before the images were read
    MatchingRun run;
    std::string start = "cold";
    std::string motion;
    double motion_milliseconds = 0;
  };

  std::vector<cv::Mat> images_of(const ws::SequenceFrame& frame) const {
    const std::vector<cv::Mat> images = read_images(frame, arguments_.white_level);
    // An image of another size is the odd one out, as the first frame has been read before.
    return read_of_many(
        [&] { return reduced(images, frame, selection_.calibrated, arguments_.size); });
  }

  void take_up(std::size_t last) {
    for (const Json& record : folder_.frames()) note_cold(record);
    if (!is_of_use(folder_.frames().back())) return;
    const ws::SequenceFrame& frame = selection_.frames[last];
    const std::vector<cv::Mat> images = images_of(frame);
    previous_ = {blurred(images, selection_.blurs), folder_.planes(frame.name, selection_.rig)};
    if (previous_.views.empty() && !arguments_.no_warm_start) {
      say("The planes of frame " + frame.name + " are gone; the next one starts from none.");
    }
  }

  /// What a frame's record says of what it comes of. From before images are read on: one that
  /// takes their place later is another one.
  Json input_of(std::size_t index) const {
    const ws::SequenceFrame& frame = selection_.frames[index];
    Json input = {{"name", frame.name}};
    for (const fs::path& image : frame.images) input["files"].push_back(file_record(image));
    if (arguments_.poses.given()) input["pose"] = to_json(selection_.motion.poses[index]);
    return input;
  }

  /// To the frames after it: a black or blank one would spoil them, or hide a scene cut.
  static bool is_of_use(const Json& record) {
    return accepted_of_overlap(record["accepted"].get<double>(), record["overlap"].get<double>()) >=
           least_accepted;
  }

  void note_cold(const Json& record) {
    if (record["start"] == "warm" || !is_of_use(record)) return;
    accepted_of_cold_ = record["accepted"].get<double>();
  }

  void match(ws::Matcher& matcher, std::size_t index) {
    const ws::SequenceFrame& source = selection_.frames[index];
    Frame frame;
    frame.input = input_of(index);
    const std::vector<cv::Mat> taken = images_of(source);
    const std::vector<cv::Mat> images = blurred(taken, selection_.blurs);
    const ws::Matcher::Progress progress = bar_.part(matched_, remaining_);
    frame.run.options = options_;
    frame.run.device = device_.info();
    ws::StereoResult& result = frame.run.result;
    if (arguments_.no_warm_start || previous_.views.empty()) {
      result = matcher.match(images, progress);
    } else {
      result = matcher.match_next(images, warm_start(index, images, frame), progress);
      frame.start = "warm";
      if (is_worse(quality_of(result))) {
        const ws::StereoResult warm = std::move(result);
        result = matcher.match(images, progress);
        result.milliseconds += warm.milliseconds;
        result.samples += warm.samples;
        frame.start = "cold after warm";
      }
    }
    require_no_validation_messages(device_);
    write(index, taken, frame);
    previous_ = {};
    if (is_of_use(folder_.frames().back())) previous_ = {images, std::move(result.views), true};
    ++matched_;
  }

  ws::WarmStart warm_start(std::size_t index, const std::vector<cv::Mat>& images, Frame& frame) {
    ws::WarmStart start;
    start.frame = static_cast<int>(index);
    if (!previous_.on_device) {
      for (const ws::ViewResult& view : previous_.views)
        start.hypotheses.push_back(view.hypotheses);
    }
    if (arguments_.no_motion) {
      frame.motion = "none";
    } else if (arguments_.poses.given()) {
      const std::vector<Eigen::Isometry3d>& poses = selection_.motion.poses;
      frame.motion = "poses";
      start.now_from_previous = poses[index].inverse() * poses[index - 1];
    } else {
      const auto begin = std::chrono::steady_clock::now();
      start.now_from_previous =
          ws::estimate_motion(selection_.rig, previous_.images, previous_.views, images);
      frame.motion = start.now_from_previous ? "estimated" : "not found";
      frame.motion_milliseconds =
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
              .count();
    }
    return start;
  }

  /// Than the last cold frame: what is seen is another scene, or the planes went astray.
  bool is_worse(const Quality& quality) const {
    return quality.accepted < arguments_.restart_below * accepted_of_cold_;
  }

  void write(std::size_t index, const std::vector<cv::Mat>& images, const Frame& frame) {
    const ws::SequenceFrame& source = selection_.frames[index];
    const ws::StereoResult& result = frame.run.result;
    const Quality quality = quality_of(result);
    Json record = frame.input;
    record.update({{"start", frame.start},
                   {"motion", frame.motion},
                   {"milliseconds", result.milliseconds},
                   {"motion_milliseconds", frame.motion_milliseconds},
                   {"patch_samples", result.samples},
                   {"accepted", quality.accepted},
                   {"overlap", quality.overlap},
                   {"mean_cost", quality.mean_cost}});
    note_cold(record);
    folder_.add(source.name, result.views, [&](const fs::path& folder) {
      FolderContents contents{
          .rig = selection_.rig, .images = images, .run = frame.run, .blurs = selection_.blurs};
      contents.world =
          "the frame of camera 0 as it took this frame; input.frame.pose, where poses are given, "
          "leads from there to the trajectory's";
      contents.origin = folder_.origin();
      for (const fs::path& image : source.images)
        contents.origin["images"].push_back(image.string());
      contents.origin["calibration"] = arguments_.rig.calibration;
      contents.origin["frame"] = record;
      write_result_folder(folder, contents, arguments_.format);
      return record;
    });
    if (arguments_.as_json || bar_.visible()) return;
    std::printf("%s: %s%s%s, %.2f s, %.1f %% accepted, mean cost %s (%zu of %zu)\n",
                source.name.c_str(), frame.start.c_str(), frame.motion.empty() ? "" : ", motion ",
                frame.motion.c_str(), (result.milliseconds + frame.motion_milliseconds) / 1000,
                100 * quality.accepted, cost_text(quality.mean_cost).c_str(),
                folder_.frames().size(), selection_.frames.size());
    std::fflush(stdout);
  }

  const SequenceArguments& arguments_;
  Selection selection_;
  ws::Options options_;
  ws::Device device_;
  SequenceFolder folder_;
  ProgressBar bar_;
  Previous previous_;
  double accepted_of_cold_ = 0;
  std::size_t remaining_ = 0;
  std::size_t matched_ = 0;
};

/// Where most frames could not be started by their poses.
void report_poses_of_no_use(const Json& frames) {
  std::size_t started = 0;
  std::size_t again = 0;
  for (const Json& frame : frames) {
    if (frame["motion"] != "poses") continue;
    ++started;
    if (frame["start"] != "warm") ++again;
  }
  constexpr std::size_t fewest = 2;  // one may be a scene cut
  if (again < fewest || 2 * again <= started) return;
  say(std::to_string(again) + " of " + std::to_string(started) +
      " frames were matched again by themselves, as little was accepted where they were started by "
      "their poses; check --poses and its unit.");
}

/// Means over the frames of one kind.
void summarise(const Json& frames, bool warm) {
  double milliseconds = 0;
  double samples = 0;
  int count = 0;
  for (const Json& frame : frames) {
    if ((frame["start"] == "warm") != warm) continue;
    milliseconds +=
        frame["milliseconds"].get<double>() + frame["motion_milliseconds"].get<double>();
    samples += frame["patch_samples"].get<double>();
    ++count;
  }
  if (count == 0) return;
  std::printf("%d %s: %.2f s and %.0f million patch samples each\n", count,
              warm ? "started from the previous frame" : "cold", milliseconds / count / 1000,
              samples / count / 1e6);
}

void run_sequence(const SequenceArguments& arguments) {
  require_other_folder(arguments.output, arguments.dataset);
  const ws::Options options = arguments.settings.options();
  arguments.format.require_room_for(options.min_distance, options.max_distance);
  SequenceRun run(arguments, select_frames(arguments));
  run.run();
  report_little_accepted(mean_in(run.folder().frames(), "accepted"),
                         mean_in(run.folder().frames(), "overlap"), "the order of the cameras");
  report_poses_of_no_use(run.folder().frames());
  if (arguments.as_json) {
    std::cout << ws::to_text(run.folder().record()) << "\n";
    return;
  }
  std::printf("%zu frames are in %s\n", run.folder().frames().size(), arguments.output.c_str());
  summarise(run.folder().frames(), false);
  summarise(run.folder().frames(), true);
}

}  // namespace

void add_sequence_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "sequence",
      "Match many frames, each started from the planes of the one before; run it again to resume");
  auto a = std::make_shared<SequenceArguments>();
  command->add_option("dataset", a->dataset, FrameSettings::layouts)->required();
  a->rig.add_to(*command, "", "; by default the first two, or as many as --folders names");
  a->size.add_to(*command);
  a->white_level.add_to(*command);
  a->sharpness.add_to(*command);
  command
      ->add_option("-o,--output", a->output,
                   "Folder for the results: one folder for each frame, and sequence.json")
      ->required();
  a->frames.add_to(*command);
  const std::string start = "Warm start";
  a->poses.add_to(*command, "without it the motion is estimated from the images", start);
  command->add_flag("--no-motion", a->no_motion, "Start where the planes were: no motion")
      ->excludes("--poses")
      ->group(start);
  CLI::Option* no_warm_start =
      command->add_flag("--no-warm-start", a->no_warm_start, "Match every frame by itself")
          ->excludes("--poses")
          ->excludes("--no-motion")
          ->group(start);
  command
      ->add_option(
          "--restart-below", a->restart_below,
          "Match a frame by itself when less than this share of what the last such frame "
          "had is accepted; 0 = never. Frames with less than " +
              ws::text_of(least_accepted) +
              " accepted of what another camera sees (black, blank) do not count; the next one is "
              "matched by itself, too")
      ->check(CLI::Range(0.0, 1.0))
      ->excludes(no_warm_start)
      ->capture_default_str()
      ->group(start);
  command->add_flag("--overwrite", a->overwrite, "Remove the frames of an earlier run first");
  a->format.add_for_many_frames_to(*command);
  command->add_flag("--json", a->as_json, "Print the sequence's record as JSON");
  a->settings.add_to(*command, no_warm_start);
  command->callback([a] { run_sequence(*a); });
}
