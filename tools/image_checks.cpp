// SPDX-License-Identifier: MIT
#include "image_checks.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

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
