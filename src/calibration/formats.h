// SPDX-License-Identifier: MIT
// One reader for each calibration format, told apart by content in read_calibration().
#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>

#include "widestereo/calibration.h"

namespace widestereo::calibration {

/// Extra key of ours in camchains and Basalt's JSON: half angles of the fields of view in degrees.
inline constexpr const char* max_theta_key = "max_theta_deg";

/// A file being read: its content, and its name for messages.
struct Document {
  std::filesystem::path path;
  std::string text;

  /// Outside comments.
  bool contains(const char* words) const;

  /// Throws Error: the file's name, what was found there and what to do about it.
  [[noreturn]] void fail(const std::string& finding, const std::string& remedy) const;
};

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

/// A count that a file states, as of pixels; none where it is no whole number from 1 to a million.
std::optional<int> whole_number(double value);

/// xi form of the unified model from the alpha form: xi = alpha / (1 - alpha), f_xi = f_alpha (1 +
/// xi).
void set_unified_from_alpha(Camera& camera, double alpha);
/// alpha = xi / (1 + xi); the focal length of the alpha form is f_xi / (1 + xi).
double unified_alpha(const Camera& camera);

/// cv::fisheye's model and its four coefficients.
void set_fisheye(Camera& camera, std::span<const double> coefficients);
/// A pinhole with coefficients in cv::stereoCalibrate()'s order, in as simple a model as they
/// allow. Fails where those of a tilted sensor are not 0; `what` has them.
Camera rational_camera(const Document& document, const std::string& what,
                       std::span<const double> coefficients);
/// Focal lengths, skew and centre of a camera matrix, `what`. Fails where it is none.
void set_matrix(Camera& camera, const Document& document, const std::string& what,
                const Eigen::Matrix3d& k);

/// The same camera in a simpler model, where what a rational or thin prism model has more is 0.
Camera simplified(Camera camera);

/// Throws Error unless this is the last row of a 4x4 transform. `what` names it.
void require_last_row(const Document& document, const std::string& what,
                      const Eigen::RowVector4d& row);

/// The rotation nearest to a matrix (orthonormal but for rounding) and a translation as a rigid
/// motion; fails when they are not one.
Eigen::Isometry3d rigid(const Document& document, const std::string& what,
                        const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);

}  // namespace widestereo::calibration
