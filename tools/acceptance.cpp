// SPDX-License-Identifier: MIT
#include "acceptance.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "say.h"
#include "text/formatted.h"

namespace ws = widestereo;

double share_of_usable(const ws::ViewResult& view, const cv::Mat& pixels) {
  const int usable = cv::countNonZero((view.reasons & ws::reason_no_ray) == 0);
  return cv::countNonZero(pixels) / std::max<double>(usable, 1);
}

double accepted_share(const ws::ViewResult& view) {
  return share_of_usable(view, view.reasons == 0);
}

double accepted_share(const std::vector<ws::ViewResult>& views) {
  double share = 0;
  for (const ws::ViewResult& view : views) {
    share += accepted_share(view) / static_cast<double>(views.size());
  }
  return share;
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

void report_little_accepted(double share, const std::string& first_cause) {
  constexpr double little = 0.4;  // pairs that fit have half or more (docs/accuracy.md)
  if (share >= little) return;
  say("Little was accepted: check " + first_cause +
      ", the calibration and its unit, and the range of distances (`widestereo calibration "
      "check`).");
}
