// SPDX-License-Identifier: MIT
#include "geometry/camera_parameters.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/Polynomials>

namespace widestereo {
namespace {

/// Stands for "no limit"; representable in single precision.
constexpr double unlimited = 1e30;

/// Smallest positive real root of c0 + c1 x + ... (lowest power first), `unlimited` if there is
/// none.
double smallest_positive_root(Eigen::VectorXd coefficients) {
  Eigen::Index degree = coefficients.size() - 1;
  while (degree > 0 && coefficients[degree] == 0) --degree;
  if (degree == 0) return unlimited;
  const Eigen::VectorXd polynomial = coefficients.head(degree + 1);
  Eigen::PolynomialSolver<double, Eigen::Dynamic> solver;
  solver.compute(polynomial);
  double smallest = unlimited;
  for (const std::complex<double>& root : solver.roots()) {
    const bool is_real = std::abs(root.imag()) <= 1e-9 * (1 + std::abs(root.real()));
    if (is_real && root.real() > 0) smallest = std::min(smallest, root.real());
  }
  return smallest;
}

/// Largest theta up to which theta (1 + k1 theta^2 + ...) increases, at most pi.
double kannala_brandt_limit(const Camera& c) {
  Eigen::VectorXd derivative(5);  // in theta^2
  derivative << 1, 3 * c.k1, 5 * c.k2, 7 * c.k3, 9 * c.k4;
  return std::min(std::numbers::pi, std::sqrt(smallest_positive_root(derivative)));
}

/// Largest squared radius up to which r (1 + k1 r^2 + k2 r^4 + k3 r^6) increases.
double radtan_limit(const Camera& c) {
  Eigen::VectorXd derivative(4);  // in r^2
  derivative << 1, 3 * c.k1, 5 * c.k2, 7 * c.k3;
  return smallest_positive_root(derivative);
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
  p.domain = {real(cosine), real(std::min(limit, unlimited)), real(c.skew), real(c.k3)};
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
