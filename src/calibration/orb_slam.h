// SPDX-License-Identifier: MIT
// Cameras and rigs in the settings of ORB-SLAM3, also of its first version. Format: the project's
// sources.
#pragma once

#include "calibration/formats.h"

namespace widestereo::calibration {

/// Whether a document is settings of ORB-SLAM3.
bool is_orb_slam(const Document& document);
/// One camera or two, with the IMU where the settings have it. Throws Error naming the file and the
/// key.
Rig read_orb_slam(const Document& document);

}  // namespace widestereo::calibration
