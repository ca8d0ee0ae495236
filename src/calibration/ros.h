// SPDX-License-Identifier: MIT
// camera_info of ROS: one file a camera, as camera_calibration writes it or the message is printed.
// Format: sensor_msgs/CameraInfo and REP 104.
#pragma once

#include <filesystem>
#include <vector>

#include "calibration/formats.h"

namespace widestereo::calibration {

bool is_ros(const Document& document);

/// A rig of one file for each camera, in their order; what relates them is what they are rectified
/// by. Throws Error naming the file and the key, or where two cameras are at the same place.
Rig read_ros(const std::vector<Document>& documents);

}  // namespace widestereo::calibration
