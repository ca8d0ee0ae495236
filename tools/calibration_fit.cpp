// SPDX-License-Identifier: MIT
#include "calibration_fit.h"

#include <optional>
#include <string>

#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/rig_refinement.h"

namespace ws = widestereo;

namespace {

/// What refining the rig would leave; nothing where the matches do not tell.
std::optional<ws::EpipolarReport> after_refinement(const ws::Rig& rig,
                                                   const std::vector<ws::PixelMatch>& matches) {
  try {
    return ws::refine_rig(rig, {{0, 1, matches}}).after.front();
  } catch (const ws::Error&) {
    return std::nullopt;
  }
}

}  // namespace

bool will_do(const ws::EpipolarReport& report) {
  constexpr double usable = 1;  // pixels
  return !lie_behind(report) && report.median_pixels < usable;
}

void report_calibration_errors(const ws::Rig& rig, const std::vector<ws::PixelMatch>& matches,
                               bool has_poses) {
  constexpr int fewest = 50;
  // Of pairs at hand whose calibration is right or nearly so 0.74 or more is left of the error, of
  // those turned by a quarter of a pixel half of it.
  constexpr double much_less = 0.65;
  constexpr double felt = 0.1;  // pixels
  if (rig.views.size() != 2) return;
  ws::EpipolarReport report;
  try {
    report = check_epipolar(rig.views[0], rig.views[1], matches);
  } catch (const ws::Error&) {
    return;  // hardly any, or the cameras share a centre, which matching will refuse
  }
  if (report.matches < fewest) return;
  const auto better = after_refinement(rig, matches);
  const double now = report.median_pixels;
  if (better && better->median_pixels < much_less * now && now - better->median_pixels > felt) {
    say(ws::formatted("The features of the images lie %.2f px off their epipolar curves (median), "
                      "and would lie %.2f px off if the calibration said how the cameras stand; ",
                      now, better->median_pixels) +
        (has_poses ? "get better poses." : "mend it by `widestereo calibration refine`."));
  } else if (!will_do(report)) {
    say("The features of the images do not fit the calibration; see `widestereo calibration "
        "check`.");
  }
}
