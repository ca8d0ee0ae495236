// SPDX-License-Identifier: MIT
// How well matched features fit a calibration, and what the commands say of it.
#pragma once

#include <vector>

#include "image_checks.h"
#include "widestereo/epipolar.h"
#include "widestereo/rig.h"

/// Pixels of median epipolar error, at most, of the right calibration at all.
constexpr double of_these_cameras = 3;

/// Whether the calibration will do for stereo.
bool will_do(const widestereo::EpipolarReport& report);

/// Asks, on standard error, whether lengths are in metres where cameras of one rig stand farther
/// apart than any that are usually mounted. Whether they do.
bool report_long_baseline(const widestereo::Rig& rig);

/// Says, on standard error, where the features of pairs fit their calibration much less than they
/// would fit a better one: patches are looked for on epipolar curves alone. Of many pairs a few,
/// which may hardly see the same, do not count, nor do small errors but of most. `has_poses`: the
/// views stand as poses or a model say, not as cameras of a rig.
void report_calibration_errors(const std::vector<MatchedViews>& pairs, bool has_poses);
/// Likewise of frames that are started from the planes of the one before by the poses of --poses,
/// which need not be as accurate.
void report_pose_errors(const std::vector<MatchedViews>& pairs);
