// SPDX-License-Identifier: MIT
// One reader for each calibration format, told apart by content in read_calibration().
#pragma once

#include <string>

#include "calibration/document.h"
#include "widestereo/calibration.h"

namespace widestereo::calibration {

/// Extra key of ours in camchains and Basalt's JSON: half angles of the fields of view in degrees.
inline constexpr const char* max_theta_key = "max_theta_deg";

/// Adds a view whose pose in a body is known. The first view's frame is the world, the body the
/// IMU.
void add_view_of_body(Rig& rig, View view, const Eigen::Isometry3d& body_from_camera);

bool has_kalibr_form(const Camera& camera);
bool has_basalt_form(const Camera& camera);
bool has_opencv_form(const Camera& camera);
/// What an error says of a view that the format cannot hold: which other one can. `more`: what the
/// format lacks besides the model.
std::string no_form(const View& view, CalibrationFormat format, const std::string& more = "");

Rig read_kalibr(const Document& document);
Rig read_basalt(const Document& document);
Rig read_opencv(const Document& document, cv::Size image_size);
/// Whether it has a camera matrix by one of the names that read_opencv() knows.
bool has_opencv_matrix(const Document& document);

}  // namespace widestereo::calibration
