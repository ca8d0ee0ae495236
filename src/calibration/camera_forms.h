// SPDX-License-Identifier: MIT
// Cameras from the forms of other programs that several formats share.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "calibration/document.h"
#include "widestereo/camera.h"

namespace widestereo::calibration {

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

/// Fails where one of the coefficients that a model lacks is not 0: if they were dropped, rays
/// would be wrong without a word. `what` has them, `remedy` ends the message.
void require_zero(const Document& document, const std::string& what, std::span<const double> excess,
                  const std::string& remedy);

}  // namespace widestereo::calibration
