// SPDX-License-Identifier: MIT
#include "acceptance.h"

#include <algorithm>
#include <functional>
#include <opencv2/core.hpp>

#include "say.h"
#include "text/formatted.h"

namespace ws = widestereo;

namespace {

double mean_of(const std::vector<ws::ViewResult>& views,
               const std::function<double(const ws::ViewResult&)>& share) {
  double sum = 0;
  for (const ws::ViewResult& view : views) sum += share(view);
  return sum / static_cast<double>(views.size());
}

}  // namespace

double share_of_usable(const ws::ViewResult& view, const cv::Mat& pixels) {
  const int usable = cv::countNonZero((view.reasons & ws::reason_no_ray) == 0);
  return cv::countNonZero(pixels) / std::max<double>(usable, 1);
}

double accepted_share(const ws::ViewResult& view) {
  return share_of_usable(view, view.reasons == 0);
}

double accepted_share(const std::vector<ws::ViewResult>& views) {
  return mean_of(views, [](const ws::ViewResult& view) { return accepted_share(view); });
}

double overlap_share(const std::vector<ws::ViewResult>& views) {
  return mean_of(views, [](const ws::ViewResult& view) {
    constexpr int alone = ws::reason_no_ray | ws::reason_no_overlap;
    // Frames that start from others hold planes without a match, too, where nothing is seen.
    constexpr double no_match = 1;
    return share_of_usable(view, ((view.reasons & alone) == 0) & (view.cost != no_match));
  });
}

double mean_in(const nlohmann::ordered_json& records, const char* key) {
  double sum = 0;
  for (const auto& record : records) sum += record[key].get<double>();
  return sum / static_cast<double>(records.size());
}

double accepted_of_overlap(double accepted, double overlap) {
  constexpr double least_overlap = 0.05;  // of rigs; less comes of a wrong calibration
  return accepted / std::max(overlap, least_overlap);
}

void report_nearest(const std::vector<ws::ViewResult>& views, double min_distance) {
  constexpr double near = 1.03;  // of the nearest distance
  constexpr double much = 0.01;  // none lie there where the range fits
  double accepted = 0, nearest = 0;
  for (const ws::ViewResult& view : views) {
    const cv::Mat distance = ws::accepted_distance(view);
    accepted += cv::countNonZero(distance > 0);
    nearest += cv::countNonZero((distance > 0) & (distance < near * min_distance));
  }
  if (nearest <= much * accepted) return;
  say(
      ws::formatted("%.0f %% of what was accepted lies at the nearest distance, and is wrong where "
                    "the scene is nearer: give a smaller --min-distance.",
                    100 * nearest / accepted));
}

void report_little_accepted(double accepted, double overlap, const std::string& first_cause) {
  constexpr double little = 0.4;  // pairs that fit have half or more (docs/accuracy.md)
  if (accepted >= little) return;
  if (accepted_of_overlap(accepted, overlap) >= little) {
    say(
        ws::formatted("Other views see only %.0f %% of what a view sees, and the rest has no "
                      "distance; images from more places would give it one (`widestereo "
                      "reconstruct --poses`).",
                      100 * overlap));
    return;
  }
  say("Little was accepted: check " + first_cause +
      ", the calibration and its unit, and the range of distances (`widestereo calibration "
      "check`).");
}
