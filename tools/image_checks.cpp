// SPDX-License-Identifier: MIT
#include "image_checks.h"

#include <algorithm>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"
#include "widestereo/rig_refinement.h"

namespace ws = widestereo;

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

std::vector<MatchedViews> match_with_first(const ws::Rig& rig, const std::vector<cv::Mat>& images,
                                           const ws::Options& options) {
  std::vector<MatchedViews> pairs;
  const ws::View& first = rig.views.front();
  for (std::size_t i = 1; i < rig.views.size(); ++i) {
    const ws::View& second = rig.views[i];
    const bool are_matched = ws::has_baseline(first.world_from_camera.translation(),
                                              second.world_from_camera.translation()) &&
                             share_field_of_view(first, second, options);
    if (!are_matched && rig.views.size() > 2) continue;
    pairs.push_back({first,
                     second,
                     ws::match_features(images.front(), images[i]),
                     {options.min_distance, options.max_distance}});
  }
  return pairs;
}

void report_features_out_of_range(const std::vector<MatchedViews>& pairs, const std::string& unit,
                                  bool is_unit_doubtful) {
  /// What lies beyond one end of the ranges.
  struct Beyond {
    int features = 0;
    int most = 0;        // of one pair,
    double limit = 0;    // where its range ends
    double reached = 0;  // by 99 % of all
  };
  int matches = 0;
  Beyond nearer{.reached = std::numeric_limits<double>::infinity()};
  Beyond farther;
  for (const MatchedViews& pair : pairs) {
    if (pair.matches.empty()) continue;
    const ws::RangeReport report = ws::check_range(pair.first, pair.second, pair.matches,
                                                   pair.range.nearest, pair.range.farthest);
    matches += report.matches;
    const auto add = [](Beyond& beyond, int features, double limit) {
      beyond.features += features;
      if (features <= beyond.most) return;
      beyond.most = features;
      beyond.limit = limit;
    };
    add(nearer, report.nearer, pair.range.nearest);
    add(farther, report.farther, pair.range.farthest);
    if (report.nearest > 0) nearer.reached = std::min(nearer.reached, report.nearest);
    farther.reached = std::max(farther.reached, report.farthest);
  }
  // False matches are fewer: at most 0.5 % of any pair at hand whose range fits.
  constexpr double many = 0.01;
  constexpr int fewest = 5;
  const auto report_if_many = [&](const Beyond& beyond, const char* where, const std::string& most,
                                  const char* remedy) {
    const double share = static_cast<double>(beyond.features) / std::max(matches, 1);
    if (beyond.features < fewest || share < many) return;
    say(ws::formatted("%.0f %% of the features that match lie ", 100 * share) +
        ws::formatted(where, beyond.limit) + unit + most +
        ", and nothing there can be found; give a " + remedy + ".");
  };
  const auto most = [&](const char* words, double distance) {
    return ws::formatted(" (99 %% of all %s %.3g", words, distance) + unit + ")";
  };
  report_if_many(nearer, "nearer than --min-distance %g",
                 nearer.reached < nearer.limit ? most("beyond", nearer.reached) : "",
                 "smaller one");
  report_if_many(farther, "farther than --max-distance %g",
                 // Those of hardly any parallax have no distance.
                 farther.reached > farther.limit ? most("within", farther.reached) : "",
                 is_unit_doubtful ? "larger one, or correct the calibration's unit" : "larger one");
}
