// SPDX-License-Identifier: MIT
#include "calibration_fit.h"

#include <algorithm>
#include <optional>
#include <string>

#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/rig_refinement.h"

namespace ws = widestereo;

namespace {

/// Nothing where there are too few to tell.
std::optional<ws::EpipolarReport> report_of(const MatchedViews& pair) {
  constexpr int fewest = 50;
  try {
    const ws::EpipolarReport report = check_epipolar(pair.first, pair.second, pair.matches);
    if (report.matches >= fewest) return report;
  } catch (const ws::Error&) {
    // hardly any, or the cameras share a centre, which matching will refuse
  }
  return std::nullopt;
}

/// The median error that refining would leave; nothing where the matches do not tell.
std::optional<double> after_refinement(const MatchedViews& pair) {
  try {
    const ws::Rig rig{.views = {pair.first, pair.second}};
    return ws::refine_rig(rig, {{0, 1, pair.matches}}).after.front().median_pixels;
  } catch (const ws::Error&) {
    return std::nullopt;
  }
}

/// A pair whose calibration or poses are not right.
struct Misfit {
  const MatchedViews* pair = nullptr;
  double median_pixels = 0;
  std::optional<double> refined;  ///< where the error can be refined away

  bool is_worse_than(const Misfit& other) const {
    if (refined.has_value() != other.refined.has_value()) return !refined;
    return median_pixels > other.median_pixels;
  }
};

std::optional<Misfit> misfit_of(const MatchedViews& pair, const ws::EpipolarReport& report) {
  // Of pairs at hand whose calibration is right or nearly so 0.74 or more is left of the error, of
  // those turned by a quarter of a pixel half of it.
  constexpr double much_less = 0.65;
  constexpr double felt = 0.1;  // pixels
  const double now = report.median_pixels;
  const std::optional<double> better = after_refinement(pair);
  if (better && *better < much_less * now && now - *better > felt)
    return Misfit{&pair, now, better};
  if (will_do(report)) return std::nullopt;
  return Misfit{&pair, now, std::nullopt};
}

std::optional<Misfit> far_off(const MatchedViews& pair, const ws::EpipolarReport& report) {
  if (!lie_behind(report) && report.median_pixels < of_these_cameras) return std::nullopt;
  return Misfit{&pair, report.median_pixels, std::nullopt};
}

/// What sentences say of, and the worst of it.
struct Misfits {
  std::string subject;
  Misfit worst;
};

/// Nothing where all pairs, or all but a few of many, fit.
std::optional<Misfits> find_misfits(const std::vector<MatchedViews>& pairs,
                                    decltype(misfit_of)& judge) {
  constexpr std::size_t one_in = 4;
  std::size_t told = 0;
  std::vector<Misfit> misfits;
  for (const MatchedViews& pair : pairs) {
    const auto report = report_of(pair);
    if (!report) continue;
    ++told;
    if (const auto misfit = judge(pair, *report)) misfits.push_back(*misfit);
  }
  const auto unfit = static_cast<std::size_t>(
      std::count_if(misfits.begin(), misfits.end(),
                    [](const Misfit& misfit) { return !misfit.refined.has_value(); }));
  // Odometry is a little inaccurate here and there.
  if (misfits.empty() || (one_in * unfit < told && 2 * misfits.size() <= told)) return std::nullopt;
  const Misfit& worst =
      *std::min_element(misfits.begin(), misfits.end(),
                        [](const Misfit& a, const Misfit& b) { return a.is_worse_than(b); });
  if (pairs.size() == 1) return Misfits{"The features of the images", worst};
  return Misfits{"The features of " + worst.pair->first.name + " and " + worst.pair->second.name +
                     " (" + std::to_string(misfits.size()) + " of " + std::to_string(told) +
                     " pairs are like this)",
                 worst};
}

}  // namespace

bool will_do(const ws::EpipolarReport& report) {
  constexpr double usable = 1;  // pixels
  return !lie_behind(report) && report.median_pixels < usable;
}

bool report_long_baseline(const ws::Rig& rig) {
  constexpr double usual = 5;  // metres, at most
  double longest = 0;
  for (const ws::View& view : rig.views) {
    for (const ws::View& other : rig.views) longest = std::max(longest, baseline(view, other));
  }
  if (longest <= usual) return false;
  say(ws::formatted("The baseline is %.4g m long; calibrations are in metres, is this one?",
                    longest));
  return true;
}

void report_calibration_errors(const std::vector<MatchedViews>& pairs, bool has_poses) {
  const auto found = find_misfits(pairs, misfit_of);
  if (!found) return;
  const auto& [subject, worst] = *found;
  if (worst.refined) {
    say(subject +
        ws::formatted(" lie %.2f px off their epipolar curves (median), and would lie %.2f px off "
                      "if the calibration said how the cameras stand; ",
                      worst.median_pixels, *worst.refined) +
        (has_poses ? "get better poses." : "mend it by `widestereo calibration refine`."));
  } else {
    say(subject + " do not fit " + (has_poses ? "the poses, or " : "") +
        "the calibration; see `widestereo calibration check`.");
  }
}

void report_pose_errors(const std::vector<MatchedViews>& pairs) {
  const auto found = find_misfits(pairs, far_off);
  if (!found) return;
  say(found->subject +
      " do not fit --poses, which frames are started by; see `widestereo calibration check`.");
}
