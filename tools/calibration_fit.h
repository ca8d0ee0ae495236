// SPDX-License-Identifier: MIT
// How well matched features fit a calibration, and what the commands say of it.
#pragma once

#include <vector>

#include "widestereo/epipolar.h"
#include "widestereo/rig.h"

/// Whether the calibration will do for stereo.
bool will_do(const widestereo::EpipolarReport& report);

/// Says, on standard error, where the features of a pair fit its calibration much less than they
/// would fit a better one: patches are looked for on epipolar curves alone. `has_poses`: the views
/// stand as poses or a model say, not as cameras of a rig.
void report_calibration_errors(const widestereo::Rig& rig,
                               const std::vector<widestereo::PixelMatch>& matches, bool has_poses);
