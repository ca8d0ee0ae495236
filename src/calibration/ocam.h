// SPDX-License-Identifier: MIT
// Cameras of OCam (Scaramuzza, Martinelli, Siegwart, IROS 2006): one of the OCamCalib toolbox
// (calib_results.txt), and rigs of OmniMVS (config.yaml). Format: the toolbox's and OmniMVS's
// sources.
#pragma once

#include <Eigen/Core>
#include <numbers>
#include <vector>

#include "calibration/formats.h"

namespace widestereo::calibration {

/// OCam's model: a pixel is `matrix` (x, y) + centre, its ray (x, y, z) with the polynomial f of
/// the radius of (x, y), in pixels, for z, or for -z where f(0) is negative, as OCamCalib's is.
struct OCamLens {
  std::vector<double> polynomial;  ///< of f, lowest power first
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Identity();
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();  ///< pixels
  double max_theta = std::numbers::pi;               ///< radians

  /// The matrix of affine parameters for (row, column), as OCamCalib's, or (column, row).
  void set_rows_first(double c, double d, double e) { matrix << 1, e, d, c; }
  void set_columns_first(double c, double d, double e) { matrix << c, d, e, 1; }
};

/// The polynomial_fisheye camera nearest to the lens, for an image of width x height: within a
/// ten thousandth of the distance from the centre to the farthest corner, else its field of view
/// ends where that is reached. Throws Error, naming `what`, where there is none.
Camera camera_of(const OCamLens& lens, int width, int height, const Document& document,
                 const std::string& what);

/// Whether a document is OCamCalib's.
bool is_ocam(const Document& document);
/// A rig of one camera. Throws Error naming the file and what is wrong.
Rig read_ocam(const Document& document);

/// Whether a document is OmniMVS's.
bool is_omnimvs(const Document& document);
/// Throws Error naming the file, the camera and the key.
Rig read_omnimvs(const Document& document);

}  // namespace widestereo::calibration
