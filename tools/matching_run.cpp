// SPDX-License-Identifier: MIT
#include "matching_run.h"

#include <opencv2/core.hpp>

#include "image_checks.h"
#include "progress_bar.h"
#include "result_folders.h"
#include "say.h"
#include "widestereo/error.h"
#include "widestereo/files.h"

namespace ws = widestereo;

namespace {

[[noreturn]] void refuse_without_effect(const std::string& option, const ws::DeviceInfo& device,
                                        const std::string& other) {
  throw ws::Error(option + " has no effect on " + device.name + "; leave it out, or choose " +
                  other + ".");
}

}  // namespace

MatchSettings with_range(MatchSettings settings, const ws::CalibratedImages& images,
                         const std::string& calibration) {
  if (settings.min_distance && settings.max_distance) return settings;
  if (images.distances) {
    if (!settings.min_distance) settings.min_distance = images.distances->nearest;
    if (!settings.max_distance) settings.max_distance = images.distances->farthest;
  } else if (!images.in_metres) {
    throw ws::Error(calibration +
                    " has no points in these images, or too few, to tell how far the scene "
                    "reaches; give "
                    "--min-distance and --max-distance.");
  }
  return settings;
}

void require_device_filter(const ws::DeviceInfo& device) {
  if (!device.filters_intensities) refuse_without_effect("--filter device", device, "a GPU");
}

ws::Device open_device(const MatchSettings& settings) {
  ws::Device device = ws::Device::open(settings.device);
  if (!device.note().empty()) say(device.note());
  const ws::DeviceInfo& info = device.info();
  if (info.kind != ws::DeviceKind::vulkan) {
    if (settings.device.validation) refuse_without_effect("--validation", info, "--device vulkan");
    if (!settings.device.pipeline_cache.empty())
      refuse_without_effect("--pipeline-cache", info, "--device vulkan");
  }
  if (info.kind == ws::DeviceKind::cpu && settings.device.max_samples_per_dispatch > 0)
    refuse_without_effect("--max-samples-per-dispatch", info, "a GPU");
  if (settings.asks_for_device_filter()) require_device_filter(info);
  return device;
}

void require_no_validation_messages(const ws::Device& device) {
  const std::vector<std::string> messages = device.validation_messages();
  if (messages.empty()) return;
  throw ws::Error(std::to_string(messages.size()) +
                  " message(s) of the Vulkan validation layers; the first: " + messages.front());
}

void report_views_without_overlap(const ws::Rig& rig, const ws::StereoResult& result) {
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    const cv::Mat alone = result.views[i].reasons & (ws::reason_no_ray | ws::reason_no_overlap);
    if (cv::countNonZero(alone) < static_cast<int>(alone.total())) continue;
    say("No pixel of " + rig.views[i].name +
        " is seen by another view within the distance range; check its calibration and mask, or "
        "leave it out.");
  }
}

void report_few_sources(const ws::Options& options, std::size_t views) {
  if (static_cast<std::size_t>(options.best_sources) < views) return;
  say("--best-sources " + std::to_string(options.best_sources) + " is more than the other views, " +
      std::to_string(views - 1) + "; costs are means over all of them.");
}

MatchingRun match_images(const MatchSettings& settings, const ws::Rig& rig,
                         const std::vector<cv::Mat>& images, const std::string& output) {
  MatchingRun run;
  run.options = settings.options();
  ws::Device device = open_device(settings);
  run.device = device.info();
  report_few_sources(run.options, rig.views.size());
  ws::Matcher matcher(device, rig, run.options);
  require_different_pictures(rig, images);
  report_blank_images(rig, images);
  ResultFolders::require_none(output);
  ws::prepare_output_folder(output);
  run.lock = std::make_shared<const FolderLock>(output);
  {
    ProgressBar bar("Matching on " + device.info().name);
    run.result = matcher.match(images, bar.part(0, 1));
  }
  require_no_validation_messages(device);
  report_views_without_overlap(rig, run.result);
  return run;
}
