// SPDX-License-Identifier: MIT
// A calibration file being read, and numbers in it.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>

namespace widestereo::calibration {

/// A file being read: its content, and its name for messages.
struct Document {
  std::filesystem::path path;
  std::string text;

  /// Outside comments.
  bool contains(const char* words) const;

  /// Throws Error: the file's name, what was found there and what to do about it.
  [[noreturn]] void fail(const std::string& finding, const std::string& remedy) const;
};

/// A count that a file states, as of pixels; none where it is no whole number from 1 to a million.
std::optional<int> whole_number(double value);

/// Throws Error unless this is the last row of a 4x4 transform. `what` names it.
void require_last_row(const Document& document, const std::string& what,
                      const Eigen::RowVector4d& row);

/// The rotation nearest to a matrix (orthonormal but for rounding) and a translation as a rigid
/// motion; fails when they are not one.
Eigen::Isometry3d rigid(const Document& document, const std::string& what,
                        const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation);

}  // namespace widestereo::calibration
