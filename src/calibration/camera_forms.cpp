// SPDX-License-Identifier: MIT
#include "calibration/camera_forms.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace widestereo::calibration {

void set_unified_from_alpha(Camera& camera, double alpha) {
  camera.model = CameraModel::unified;
  camera.xi = alpha / (1 - alpha);
  camera.fx *= 1 + camera.xi;
  camera.fy *= 1 + camera.xi;
}

double unified_alpha(const Camera& camera) { return camera.xi / (1 + camera.xi); }

Camera simplified(Camera camera) {
  const auto lacks = [&camera](auto... members) { return ((camera.*members == 0) && ...); };
  using C = Camera;
  switch (camera.model) {
    case CameraModel::pinhole_rational:
      if (lacks(&C::k4, &C::k5, &C::k6, &C::s1, &C::s2, &C::s3, &C::s4)) {
        camera.model = CameraModel::pinhole_radtan;
      }
      break;
    case CameraModel::thin_prism_fisheye:
    case CameraModel::rad_tan_thin_prism_fisheye:
      if (lacks(&C::k5, &C::k6, &C::p1, &C::p2, &C::s1, &C::s2, &C::s3, &C::s4)) {
        camera.model = CameraModel::kannala_brandt;
      }
      break;
    default:
      break;
  }
  return camera;
}

void require_zero(const Document& document, const std::string& what, std::span<const double> excess,
                  const std::string& remedy) {
  if (std::ranges::all_of(excess, [](double value) { return value == 0; })) return;
  document.fail(what + " has non-zero coefficients that are not supported", remedy);
}

void set_fisheye(Camera& camera, std::span<const double> coefficients) {
  camera.model = CameraModel::kannala_brandt;
  camera.k1 = coefficients[0];
  camera.k2 = coefficients[1];
  camera.k3 = coefficients[2];
  camera.k4 = coefficients[3];
}

Camera rational_camera(const Document& document, const std::string& what,
                       std::span<const double> coefficients) {
  using C = Camera;
  // A sensor's tilt may follow.
  constexpr double C::*members[] = {&C::k1, &C::k2, &C::p1, &C::p2, &C::k3, &C::k4,
                                    &C::k5, &C::k6, &C::s1, &C::s2, &C::s3, &C::s4};
  const std::size_t used = std::min(coefficients.size(), std::size(members));
  require_zero(document, what, coefficients.subspan(used), "calibrate without CALIB_TILTED_MODEL");
  Camera camera;
  camera.model = CameraModel::pinhole_rational;
  for (std::size_t i = 0; i < used; ++i) camera.*members[i] = coefficients[i];
  return simplified(camera);
}

void set_matrix(Camera& camera, const Document& document, const std::string& what,
                const Eigen::Matrix3d& k) {
  constexpr double rounding = 1e-9;
  const auto has_form = [](const Eigen::Matrix3d& m) {
    return std::abs(m(1, 0)) <= rounding &&
           (m.row(2) - Eigen::RowVector3d::UnitZ()).norm() <= rounding;
  };
  if (!has_form(k)) {
    document.fail(what + (has_form(k.transpose()) ? " is transposed, as MATLAB has it"
                                                  : " is no camera matrix"),
                  "write its rows as fx, skew, cx, then 0, fy, cy, then 0, 0, 1");
  }
  camera.fx = k(0, 0);
  camera.skew = k(0, 1);
  camera.cx = k(0, 2);
  camera.fy = k(1, 1);
  camera.cy = k(1, 2);
}

}  // namespace widestereo::calibration
