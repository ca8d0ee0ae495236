// SPDX-License-Identifier: MIT
// What DepthAI devices (Luxonis's OAK cameras) keep of their calibration, as JSON. Format: the
// library's sources.
#pragma once

#include "calibration/formats.h"

namespace widestereo::calibration {

/// Whether a document is a DepthAI calibration.
bool is_depthai(const Document& document);
/// All calibrated cameras by their sockets, from CAM_A on, with the IMU where it is known. Throws
/// Error naming the file, the camera and the key.
Rig read_depthai(const Document& document);

}  // namespace widestereo::calibration
