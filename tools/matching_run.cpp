// SPDX-License-Identifier: MIT
#include "matching_run.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "progress_bar.h"
#include "result_folders.h"
#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/image_io.h"

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

bool is_blank(const cv::Mat& image, const cv::Mat& mask) {
  constexpr double noise = 4 / 255.0;  // of black pixels
  constexpr double share_in_means = 0.35;
  constexpr int side = 9;
  cv::Mat intensity = ws::to_intensity(image, "The image");
  double darkest = 0;
  double brightest = 0;
  cv::minMaxLoc(intensity, &darkest, &brightest, nullptr, nullptr, mask);
  if (brightest - darkest > noise) return false;
  // Of cameras with fewer bits than their files no image differs by more, but not from pixel to
  // pixel alone.
  const auto mean_and_deviation = [&] {
    cv::Scalar mean;
    cv::Scalar deviation;
    cv::meanStdDev(intensity, mean, deviation, mask);
    return std::pair(mean[0], deviation[0]);
  };
  const auto [mean, deviation] = mean_and_deviation();
  if (!mask.empty()) intensity.setTo(mean, mask == 0);
  cv::blur(intensity, intensity, {side, side});
  return mean_and_deviation().second <= share_in_means * deviation;
}

std::string same_pictures(const ws::Rig& rig, const std::vector<cv::Mat>& images) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const bool alike = images[i].size() == images[j].size() &&
                         images[i].type() == images[j].type() &&
                         cv::norm(images[i], images[j], cv::NORM_INF) == 0;
      if (!alike || is_blank(images[i], cv::Mat())) continue;
      return "The images of " + rig.views[j].name + " and " + rig.views[i].name +
             " are one picture, pixel by pixel; give each its own.";
    }
  }
  return "";
}

void require_different_pictures(const ws::Rig& rig, const std::vector<cv::Mat>& images) {
  const std::string same = same_pictures(rig, images);
  if (!same.empty()) throw ws::Error(same);
}

void report_blank_images(const ws::Rig& rig, const std::vector<cv::Mat>& images) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    const ws::View& view = rig.views[i];
    const bool masked = !view.mask.empty() && cv::countNonZero(view.mask) == 0;
    if (masked || !is_blank(images[i], view.mask)) continue;
    say("The image of " + view.name + " is blank but for noise; check its camera and lens.");
  }
}

std::vector<ws::PixelMatch> features_of_pair(const std::vector<cv::Mat>& images) {
  if (images.size() != 2) return {};
  return ws::match_features(images[0], images[1]);
}

void report_features_out_of_range(const ws::Rig& rig, const std::vector<ws::PixelMatch>& matches,
                                  const ws::Options& options, const std::string& unit) {
  if (matches.empty()) return;
  const ws::RangeReport range = ws::check_range(rig.views[0], rig.views[1], matches,
                                                options.min_distance, options.max_distance);
  // False matches are fewer: at most 0.5 % of any pair at hand whose range fits.
  constexpr double many = 0.01;
  constexpr int fewest = 5;
  const auto report_if_many = [&](int outside, const char* where, const std::string& most,
                                  const char* remedy) {
    const double share = static_cast<double>(outside) / std::max(range.matches, 1);
    if (outside < fewest || share < many) return;
    say(ws::formatted("%.0f %% of the features that match lie ", 100 * share) + where + unit +
        most + ", and nothing there can be found; give a " + remedy + " one.");
  };
  const auto most = [&](const char* words, double distance) {
    return ws::formatted(" (99 %% of all %s %.3g", words, distance) + unit + ")";
  };
  report_if_many(
      range.nearer, ws::formatted("nearer than --min-distance %g", options.min_distance).c_str(),
      range.nearest < options.min_distance ? most("beyond", range.nearest) : "", "smaller");
  report_if_many(
      range.farther, ws::formatted("farther than --max-distance %g", options.max_distance).c_str(),
      // Those of hardly any parallax have no distance.
      range.farthest > options.max_distance ? most("within", range.farthest) : "", "larger");
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
