// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace widestereo::geometry {

/// A number with its derivative by three variables. Compiling shaders/camera.glsl with it as `real`
/// yields the exact Jacobian of every camera model without writing a formula twice.
struct Dual {
  double value = 0;
  Eigen::RowVector3d derivative = Eigen::RowVector3d::Zero();

  Dual() = default;
  explicit Dual(double v) : value(v) {}
  Dual(double v, const Eigen::RowVector3d& d) : value(v), derivative(d) {}
};

inline Dual operator+(const Dual& a, const Dual& b) {
  return {a.value + b.value, a.derivative + b.derivative};
}
inline Dual operator-(const Dual& a, const Dual& b) {
  return {a.value - b.value, a.derivative - b.derivative};
}
inline Dual operator-(const Dual& a) { return {-a.value, -a.derivative}; }
inline Dual operator*(const Dual& a, const Dual& b) {
  return {a.value * b.value, a.value * b.derivative + b.value * a.derivative};
}
inline Dual operator/(const Dual& a, const Dual& b) {
  const double quotient = a.value / b.value;
  return {quotient, (a.derivative - quotient * b.derivative) / b.value};
}
inline bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
inline bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }

/// The derivative at 0 is taken as 0: it only meets factors that vanish there.
inline Dual sqrt(const Dual& a) {
  const double root = std::sqrt(a.value);
  return {root,
          root > 0 ? Eigen::RowVector3d(a.derivative / (2 * root)) : Eigen::RowVector3d::Zero()};
}
inline Dual arc_tangent(const Dual& y, const Dual& x) {
  const double square = y.value * y.value + x.value * x.value;
  return {std::atan2(y.value, x.value), (x.value * y.derivative - y.value * x.derivative) / square};
}
inline Dual polar_angle(const Dual& y, const Dual& x) { return arc_tangent(y, x); }

}  // namespace widestereo::geometry
