// SPDX-License-Identifier: MIT
#include "geometry/camera_parameters.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <unsupported/Eigen/Polynomials>

namespace widestereo {
namespace {

/// Stands for "no limit"; representable in single precision.
constexpr double unlimited = 1e30;

/// Smallest positive root of 1 + c[0] x + ... + c[n-1] x^n, `unlimited` if there is none.
template <int degree>
double smallest_positive_root(const Eigen::Matrix<double, degree, 1>& c) {
  // In 1/x the polynomial is monic, so that vanishing high coefficients do no harm.
  Eigen::Matrix<double, degree + 1, 1> reversed;
  reversed << c.reverse(), 1;
  const Eigen::PolynomialSolver<double, degree> solver(reversed);
  double largest = 1 / unlimited;
  for (const std::complex<double>& root : solver.roots()) {
    const bool is_real = std::abs(root.imag()) <= 1e-9 * (1 + std::abs(root.real()));
    if (is_real) largest = std::max(largest, root.real());
  }
  return 1 / largest;
}

/// Largest theta up to which theta (1 + k1 theta^2 + ...) increases, at most pi.
double kannala_brandt_limit(const Camera& c) {
  const Eigen::Vector4d derivative(3 * c.k1, 5 * c.k2, 7 * c.k3, 9 * c.k4);  // in theta^2
  return std::min(std::numbers::pi, std::sqrt(smallest_positive_root<4>(derivative)));
}

/// Largest squared radius up to which the distortion increases in every direction. The tangential
/// part changes the slope along the radius most against (p2, p1), by -6 |p| r, and there the
/// Jacobian first becomes singular: while that slope is positive, so is the other eigenvalue.
double radtan_limit(const Camera& c) {
  Eigen::Vector<double, 6> derivative;  // in r
  derivative << -6 * std::hypot(c.p1, c.p2), 3 * c.k1, 0, 5 * c.k2, 0, 7 * c.k3;
  const double radius = smallest_positive_root<6>(derivative);
  return std::min(unlimited, radius * radius);
}

/// The domain factor w of the sphere models: alpha / (1 - alpha) or its inverse, at most 1.
double sphere_factor(double alpha) {
  return alpha <= 0.5 ? alpha / (1 - alpha) : (1 - alpha) / alpha;
}

template <class Parameters, class Real>
Parameters fill(const Camera& c) {
  const auto real = [](double value) { return static_cast<Real>(value); };
  Parameters p{};
  p.intrinsics = {real(c.fx), real(c.fy), real(c.cx), real(c.cy)};
  p.distortion = {real(c.k1), real(c.k2), real(c.p1), real(c.p2)};
  double limit = unlimited;
  switch (c.model) {
    case CameraModel::pinhole:
    case CameraModel::equirectangular:
      break;
    case CameraModel::pinhole_radtan:
      limit = radtan_limit(c);
      break;
    case CameraModel::kannala_brandt:
      p.shape = {real(c.k1), real(c.k2), real(c.k3), real(c.k4)};
      limit = kannala_brandt_limit(c);
      break;
    case CameraModel::double_sphere:
      p.shape = {real(c.xi), real(c.alpha), real(sphere_factor(c.alpha)), 0};
      break;
    case CameraModel::mei:
      limit = radtan_limit(c);
      [[fallthrough]];
    case CameraModel::unified:
      p.shape = {real(c.xi), real(c.xi > 1 ? 1 / c.xi : c.xi), 0, 0};
      break;
    case CameraModel::extended_unified:
      p.shape = {real(c.alpha), real(c.beta), real(sphere_factor(c.alpha)), 0};
      break;
    case CameraModel::field_of_view:
      p.shape = {real(c.omega), real(2 * std::tan(c.omega / 2)), 0, 0};
      break;
  }
  // -2: every direction, whatever rounding does to cos(pi).
  const double cosine = c.max_theta >= std::numbers::pi ? -2 : std::cos(c.max_theta);
  p.domain = {real(cosine), real(limit), real(c.skew), real(c.k3)};
  p.size = {c.width, c.height, static_cast<int>(c.model), 0};
  return p;
}

}  // namespace

kernel::precise::CameraParameters camera_parameters(const Camera& camera) {
  return fill<kernel::precise::CameraParameters, double>(camera);
}

kernel::CameraParameters kernel_camera(const Camera& camera) {
  return fill<kernel::CameraParameters, float>(camera);
}

}  // namespace widestereo
