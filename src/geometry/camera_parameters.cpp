// SPDX-License-Identifier: MIT
#include "geometry/camera_parameters.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace widestereo {
namespace {

/// Stands for "no limit"; representable in single precision.
constexpr double unlimited = 1e30;

/// Smallest root in (low, high) of the polynomial with these Bernstein coefficients there, none:
/// high. Where they are not negative it has none.
double first_root(const Eigen::VectorXd& coefficients, double low, double high) {
  if (coefficients[0] > 0 && coefficients.minCoeff() >= 0) return high;
  const double middle = 0.5 * (low + high);
  if (middle <= low || middle >= high || high - low < 1e-15) return low;
  // De Casteljau's subdivision.
  Eigen::VectorXd left = coefficients;
  Eigen::VectorXd right = coefficients;
  for (Eigen::Index last = right.size() - 1; last > 0; --last) {
    right.head(last) = (0.5 * (right.head(last) + right.segment(1, last))).eval();
    left[right.size() - last] = right[0];
  }
  const double root = first_root(left, low, middle);
  return root < middle ? root : first_root(right, middle, high);
}

/// Smallest positive root of 1 + c[0] x + ... + c[n-1] x^n, `unlimited` if there is none.
double smallest_positive_root(const Eigen::VectorXd& c) {
  // With x = t / (1 - t) its Bernstein coefficients on [0, 1) are those divided by binomials.
  const Eigen::Index degree = c.size();
  Eigen::VectorXd bernstein(degree + 1);
  double binomial = 1;
  bernstein[0] = 1;
  for (Eigen::Index i = 1; i <= degree; ++i) {
    binomial *= static_cast<double>(degree - i + 1) / static_cast<double>(i);
    bernstein[i] = c[i - 1] / binomial;
  }
  const double t = first_root(bernstein, 0, 1);
  return t < 1 ? t / (1 - t) : unlimited;
}

/// Largest theta up to which theta (1 + k1 theta^2 + ...) increases, at most pi.
double kannala_brandt_limit(const Camera& c) {
  const Eigen::Vector4d derivative(3 * c.k1, 5 * c.k2, 7 * c.k3, 9 * c.k4);  // in theta^2
  return std::min(std::numbers::pi, std::sqrt(smallest_positive_root(derivative)));
}

/// What tangential terms and thin prisms take at most from the slope along a radius r: linear r +
/// cubic r^3. The tangential part changes it most against (p2, p1), by -6 |p| r, and there the
/// Jacobian first becomes singular: while that slope is positive, so is the other eigenvalue.
/// Prisms lower an eigenvalue by 2 r |(s1, s3) + 2 r^2 (s2, s4)| at most; as their directions
/// differ from (p2, p1), the sum is a bound that may be reached a little too early.
struct DecentringLoss {
  explicit DecentringLoss(const Camera& c)
      : linear(6 * std::hypot(c.p1, c.p2) + 2 * std::hypot(c.s1, c.s3)),
        cubic(4 * std::hypot(c.s2, c.s4)) {}
  double linear;
  double cubic;
};

double squared(double radius) { return std::min(unlimited, radius * radius); }

/// Largest squared radius up to which the distortion increases in every direction.
double radtan_limit(const Camera& c) {
  Eigen::Vector<double, 6> derivative;  // in r
  derivative << -DecentringLoss(c).linear, 3 * c.k1, 0, 5 * c.k2, 0, 7 * c.k3;
  return squared(smallest_positive_root(derivative));
}

/// Coefficients of a product of polynomials, lowest power first.
template <int a, int b>
Eigen::Vector<double, a + b - 1> product(const Eigen::Vector<double, a>& first,
                                         const Eigen::Vector<double, b>& second) {
  Eigen::Vector<double, a + b - 1> result = Eigen::Vector<double, a + b - 1>::Zero();
  // One by one: GCC 12 at -O3 miscompiles the sum of overlapping segments.
  for (int i = 0; i < a; ++i) {
    for (int j = 0; j < b; ++j) result[i + j] += first[i] * second[j];
  }
  return result;
}

/// The same of the rational distortion N/D in q = r^2, whose slope times D^2 is
/// N D + 2 q (N' D - N D').
double rational_limit(const Camera& c) {
  const Eigen::Vector4d n(1, c.k1, c.k2, c.k3);
  const Eigen::Vector4d d(1, c.k4, c.k5, c.k6);
  const auto q_times_derivative = [](const Eigen::Vector4d& of) -> Eigen::Vector4d {
    return of.cwiseProduct(Eigen::Vector4d(0, 1, 2, 3));
  };
  const Eigen::Vector<double, 7> radial =
      product<4, 4>(n, d) +
      2 * (product<4, 4>(q_times_derivative(n), d) - product<4, 4>(n, q_times_derivative(d)));
  const Eigen::Vector<double, 7> d2 = product<4, 4>(d, d);
  const DecentringLoss loss(c);
  Eigen::Vector<double, 16> slope = Eigen::Vector<double, 16>::Zero();  // in r
  for (int i = 0; i < 7; ++i) {
    slope[2 * i] += radial[i];
    slope[2 * i + 1] -= loss.linear * d2[i];
    slope[2 * i + 3] -= loss.cubic * d2[i];
  }
  // The slope grows without end towards a root of D, and is anything beyond it.
  const double pole = smallest_positive_root(d.tail<3>());
  return std::min(squared(smallest_positive_root(slope.tail<15>())), pole);
}

/// Largest theta up to which the distortion of a point in angles increases in every direction.
double thin_prism_limit(const Camera& c) {
  const DecentringLoss loss(c);
  Eigen::Vector<double, 8> derivative;  // in theta
  derivative << -loss.linear, 3 * c.k1, -loss.cubic, 5 * c.k2, 0, 7 * c.k3, 0, 9 * c.k4;
  return std::min(std::numbers::pi, smallest_positive_root(derivative));
}

/// Where k1..k6 are six radial coefficients.
template <class Real, class Parameters>
void set_radial(Parameters& p, const Camera& c) {
  const auto real = [](double value) { return static_cast<Real>(value); };
  p.shape = {real(c.k1), real(c.k2), real(c.k3), real(c.k4)};
  p.distortion = {real(c.k5), real(c.k6), real(c.p1), real(c.p2)};
}

/// Largest theta up to which the radial part increases and stays where the rest does.
double rad_tan_thin_prism_limit(const Camera& c) {
  Eigen::Vector<double, 6> derivative;  // in theta^2
  derivative << 3 * c.k1, 5 * c.k2, 7 * c.k3, 9 * c.k4, 11 * c.k5, 13 * c.k6;
  const DecentringLoss loss(c);
  const double radius = smallest_positive_root(Eigen::Vector3d(-loss.linear, 0, -loss.cubic));
  kernel::precise::CameraParameters p{};
  set_radial<double>(p, c);
  const auto radial = [&p](double theta) {
    return theta *
           kernel::precise::radial_distortion(p, CAMERA_RAD_TAN_THIN_PRISM_FISHEYE, theta * theta);
  };
  double inside = 0;
  double outside = std::min(std::numbers::pi, std::sqrt(smallest_positive_root(derivative)));
  if (radial(outside) <= radius) return outside;
  for (int i = 0; i < 60; ++i) {
    const double theta = 0.5 * (inside + outside);
    (radial(theta) <= radius ? inside : outside) = theta;
  }
  return inside;
}

/// Coefficients of 1 + k1 theta + ... + k11 theta^11, lowest power first.
Eigen::Vector<double, 12> angle_polynomial(const Camera& c) {
  Eigen::Vector<double, 12> k;
  k << 1, c.k1, c.k2, c.k3, c.k4, c.k5, c.k6, c.k7, c.k8, c.k9, c.k10, c.k11;
  return k;
}

/// Largest theta up to which theta times that increases, at most pi.
double polynomial_limit(const Camera& c) {
  const Eigen::Vector<double, 12> powers = Eigen::Vector<double, 12>::LinSpaced(1, 12);
  const Eigen::Vector<double, 12> derivative = angle_polynomial(c).cwiseProduct(powers);
  return std::min(std::numbers::pi, smallest_positive_root(derivative.tail<11>()));
}

/// The polynomial's coefficients in powers of theta - centre, by repeated division.
Eigen::Vector<double, 12> expanded_about(double centre, Eigen::Vector<double, 12> k) {
  for (int done = 0; done < 11; ++done) {
    for (int i = 10; i >= done; --i) k[i] += centre * k[i + 1];
  }
  return k;
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
  p.prism = {real(c.s1), real(c.s2), real(c.s3), real(c.s4)};
  double limit = unlimited;
  switch (c.model) {
    case CameraModel::pinhole:
    case CameraModel::equirectangular:
      break;
    case CameraModel::pinhole_radtan:
      limit = radtan_limit(c);
      break;
    case CameraModel::kannala_brandt:
      set_radial<Real>(p, c);
      limit = kannala_brandt_limit(c);
      break;
    case CameraModel::pinhole_rational:
      set_radial<Real>(p, c);
      limit = rational_limit(c);
      break;
    case CameraModel::thin_prism_fisheye:
      set_radial<Real>(p, c);
      limit = thin_prism_limit(c);
      break;
    case CameraModel::rad_tan_thin_prism_fisheye:
      set_radial<Real>(p, c);
      limit = rad_tan_thin_prism_limit(c);
      break;
    case CameraModel::polynomial_fisheye: {
      const Eigen::Vector<Real, 12> k =
          expanded_about(POLYNOMIAL_CENTRE, angle_polynomial(c)).template cast<Real>();
      p.shape = {k[0], k[1], k[2], k[3]};
      p.distortion = {k[4], k[5], k[6], k[7]};
      p.prism = {k[8], k[9], k[10], k[11]};
      limit = polynomial_limit(c);
      break;
    }
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
  const bool polynomial = c.model == CameraModel::polynomial_fisheye;
  p.domain = {real(cosine), real(limit), real(c.skew), real(polynomial ? c.shear : c.k3)};
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
