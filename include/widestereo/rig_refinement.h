// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "widestereo/epipolar.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"

namespace widestereo {

/// Matches between two views of a rig, of one frame or of many.
struct ViewMatches {
  std::size_t first = 0, second = 1;  ///< views of the rig
  std::vector<PixelMatch> matches;
};

/// A change, and the standard deviation with which the matches (and the calibration) determine it.
struct RefinedValue {
  double change = 0;
  double deviation = 0;
};

/// What refining changed of a view, as sizes; of vectors the deviation is that of the least certain
/// direction.
struct ViewRefinement {
  RefinedValue rotation;         ///< degrees; none of view 0
  RefinedValue direction;        ///< of the view as seen from view 0, degrees
  RefinedValue focal_length;     ///< percent
  RefinedValue principal_point;  ///< pixels
};

struct RigRefinement {
  Rig rig;
  std::vector<ViewRefinement> views;
  std::vector<EpipolarReport> before, after;  ///< of each pair of views; empty of those left out
  std::vector<std::string> left_out;          ///< why each pair did not count; empty where it did
};

/// Whether enough of what one view sees, in the options' range of distances, is in the other one
/// for features to be matched: more than 2 %.
bool share_field_of_view(const View& first, const View& second, const Options& options = {});

/// The rig that matches fit best, near the calibrated one: for cameras that have moved since they
/// were calibrated, or were calibrated less well than their images allow. Refined are the rotations
/// of all views but view 0 and the directions in which view 0 sees them; with `intrinsics` also
/// focal lengths (both axes alike) and principal points of all views. Lengths of the baselines from
/// view 0 stay as calibrated: matches tell nothing of scale. What matches do not determine stays
/// near the calibration, which is taken to be accurate to 0.5 degrees of rotation, 2 degrees of
/// direction, 0.2 % of focal length (rays hardly tell a factor that all cameras share) and one
/// pixel of principal point. Minimises Sampson's epipolar error (Hartley, Zisserman, Multiple View
/// Geometry, 2nd ed., section 11.4.3, with rays in place of homogeneous pixels), robustly, so that
/// false matches do no harm; those whose rays meet behind a camera, or ten times nearer than most,
/// are left out. Of three views or more a pair is left out that has fewer than 8 matches, or whose
/// matches contradict each other or lie behind the cameras, as those of views do that look away
/// from each other. Throws Error for a rig that validate() refuses, when a pair names no two views
/// of the rig, when the pairs do not connect every view with view 0, directly or by others, or when
/// matches contradict each other, lie behind the cameras, or move a view by more than five times
/// the accuracy above: images of other cameras or times can be fitted, too.
RigRefinement refine_rig(const Rig& rig, const std::vector<ViewMatches>& pairs,
                         bool intrinsics = false);

}  // namespace widestereo
