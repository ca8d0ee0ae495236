// SPDX-License-Identifier: MIT
#include "widestereo/camera.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "geometry/camera_parameters.h"
#include "geometry/camera_scale.h"
#include "geometry/dual.h"
#include "geometry/validation.h"
#include "text/number.h"
#include "text/size_text.h"
#include "widestereo/error.h"

namespace widestereo::kernel::dual {
using real = geometry::Dual;
using real2 = Vector2<real>;
using real3 = Vector3<real>;
using real4 = Vector4<real>;
using geometry::arc_tangent;
using geometry::polar_angle;
using geometry::sqrt;
#include "camera.glsl"
}  // namespace widestereo::kernel::dual

namespace widestereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using geometry::Dual;

/// Largest error of a ray, in pixels, before it counts as not found.
constexpr double unprojection_tolerance = 1e-6;

bool project_with(const kernel::precise::CameraParameters& parameters, const Vector3d& point,
                  Vector2d& pixel) {
  kernel::precise::real2 u{};
  const bool inside = kernel::precise::project(
      parameters, parameters.size.z, kernel::precise::real3(point.x(), point.y(), point.z()), u);
  pixel = {u.x, u.y};
  return inside && pixel.allFinite();
}

kernel::dual::real4 constant(const kernel::precise::real4& v) {
  return {Dual(v.x), Dual(v.y), Dual(v.z), Dual(v.w)};
}

kernel::dual::CameraParameters constant(const kernel::precise::CameraParameters& p) {
  return {constant(p.intrinsics), constant(p.shape),  constant(p.distortion),
          constant(p.prism),      constant(p.domain), p.size};
}

/// Root of an increasing function on [low, high]: Newton, falling back to bisection.
template <class Function>
double increasing_root(Function value_and_slope, double low, double high, double start) {
  double x = std::clamp(start, low, high);
  for (int i = 0; i < 100; ++i) {
    const auto [value, slope] = value_and_slope(x);
    const double step = value / slope;
    if (std::abs(step) <= 4e-16 * (1 + std::abs(x))) return x;
    (value > 0 ? high : low) = x;
    x -= step;
    if (!(x > low && x < high)) x = 0.5 * (low + high);
  }
  return x;
}

/// A radius after radial distortion less `target`, and its slope.
std::pair<double, double> radial_residual(const kernel::dual::CameraParameters& p, double radius,
                                          double target) {
  const Dual r(radius, Eigen::RowVector3d::UnitX());
  const Dual distorted = r * kernel::dual::radial_distortion(p, p.size.z, r * r);
  return {distorted.value - target, distorted.derivative.x()};
}

/// A fisheye's radius at an angle less `target`, and its slope.
std::pair<double, double> fisheye_residual(const kernel::dual::CameraParameters& p, double theta,
                                           double target) {
  const Dual radius =
      kernel::dual::fisheye_radius(p, p.size.z, Dual(theta, Eigen::RowVector3d::UnitX()));
  return {radius.value - target, radius.derivative.x()};
}

/// theta of a radius r on the normalised plane, or a negative number beyond the model's limit.
double fisheye_theta(const kernel::dual::CameraParameters& p, double r) {
  const auto value_and_slope = [&](double theta) { return fisheye_residual(p, theta, r); };
  const double limit = p.domain.y.value;
  if (value_and_slope(limit).first < 0) return -1;
  return increasing_root(value_and_slope, 0, limit, r);
}

/// End of the domain of distort(), a radius.
double distortion_limit(const kernel::dual::CameraParameters& p) {
  const double limit = p.domain.y.value;
  if (p.size.z == CAMERA_RAD_TAN_THIN_PRISM_FISHEYE) return fisheye_residual(p, limit, 0).first;
  return kernel::dual::is_fisheye(p.size.z) ? limit : std::sqrt(limit);
}

/// Distortion of a point on the normalised plane less `target`, with its Jacobian.
Vector2d distortion_residual(const kernel::dual::CameraParameters& p, const Vector2d& point,
                             const Vector2d& target, Eigen::Matrix2d& jacobian) {
  const Dual x(point.x(), Eigen::RowVector3d::UnitX());
  const Dual y(point.y(), Eigen::RowVector3d::UnitY());
  const kernel::dual::real2 d = kernel::dual::distort(p, p.size.z, x, y, x * x + y * y);
  jacobian << d.x.derivative.head<2>(), d.y.derivative.head<2>();
  return Vector2d(d.x.value, d.y.value) - target;
}

/// Radius whose radial distortion alone has the length `norm`, or the end of the domain.
double undistorted_radius(const kernel::dual::CameraParameters& p, double norm, double largest) {
  if (p.size.z == CAMERA_RAD_TAN_THIN_PRISM_FISHEYE) return std::min(norm, largest);
  const auto value_and_slope = [&](double r) { return radial_residual(p, r, norm); };
  double high = std::min(largest, std::max(1.0, 2 * norm));
  while (high < largest && value_and_slope(high).first < 0) high = std::min(largest, 2 * high);
  return increasing_root(value_and_slope, 0, high, norm);
}

/// Inverts distort() of a point in place; false outside the increasing part.
bool undistort(const kernel::dual::CameraParameters& p, Vector2d& point) {
  const Vector2d target = point;
  const double norm = target.norm();
  const double limit = distortion_limit(p);
  // The Jacobian is singular at the end of the domain: start inside it.
  const double start = std::min(undistorted_radius(p, norm, limit), 0.999 * limit);
  if (norm > 0) point = target * (start / norm);

  Eigen::Matrix2d jacobian;
  Vector2d residual = distortion_residual(p, point, target, jacobian);
  for (int i = 0; i < 50 && residual.norm() > 1e-15 * (1 + norm); ++i) {
    const Vector2d step = -jacobian.inverse() * residual;
    if (!step.allFinite()) return false;
    // Within the domain the Jacobian is positive definite: a short enough step always improves.
    double scale = 1;
    Vector2d next;
    Vector2d next_residual;
    do {
      next = point + scale * step;
      next_residual = distortion_residual(p, next, target, jacobian);
      scale *= 0.5;
    } while (scale > 1e-4 && (next.norm() >= limit || next_residual.norm() > residual.norm()));
    const bool improved = next_residual.norm() < residual.norm();
    if (!improved) break;
    point = next;
    residual = next_residual;
  }
  return point.norm() < limit;
}

/// Direction (any length) of a point on the model's normalised plane, before checking the domain.
bool direction_of(const Camera& c, const kernel::dual::CameraParameters& p, Vector2d m,
                  Vector3d& direction) {
  if (kernel::dual::is_distorted(p.size.z) && !undistort(p, m)) return false;
  const double r2 = m.squaredNorm();
  const double r = std::sqrt(r2);
  switch (c.model) {
    case CameraModel::pinhole:
    case CameraModel::pinhole_radtan:
    case CameraModel::pinhole_rational:
      direction = m.homogeneous();
      return true;
    case CameraModel::kannala_brandt:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::rad_tan_thin_prism_fisheye:
    case CameraModel::polynomial_fisheye: {
      const double theta = c.model == CameraModel::thin_prism_fisheye ? r : fisheye_theta(p, r);
      if (theta < 0) return false;
      direction << (r > 0 ? std::sin(theta) / r : 1.0) * m, std::cos(theta);
      return true;
    }
    case CameraModel::double_sphere: {
      const double a = c.alpha;
      const double mz = (1 - a * a * r2) / (a * std::sqrt(1 - (2 * a - 1) * r2) + 1 - a);
      const double scale =
          (mz * c.xi + std::sqrt(mz * mz + (1 - c.xi * c.xi) * r2)) / (mz * mz + r2);
      direction << scale * m, scale * mz - c.xi;
      return true;
    }
    case CameraModel::unified:
    case CameraModel::mei: {
      const double scale = (c.xi + std::sqrt(1 + (1 - c.xi * c.xi) * r2)) / (1 + r2);
      direction << scale * m, scale - c.xi;
      return true;
    }
    case CameraModel::extended_unified: {
      const double a = c.alpha;
      const double b = c.beta;
      direction << m, (1 - b * a * a * r2) / (a * std::sqrt(1 - (2 * a - 1) * b * r2) + 1 - a);
      return true;
    }
    case CameraModel::field_of_view: {
      const double angle = r * c.omega;
      if (angle >= std::numbers::pi) return false;
      direction << (r > 0 ? std::sin(angle) / r : c.omega) * m,
          2 * std::tan(c.omega / 2) * std::cos(angle);
      return true;
    }
    case CameraModel::equirectangular: {
      if (std::abs(m.x()) >= std::numbers::pi || std::abs(m.y()) >= std::numbers::pi / 2) {
        return false;
      }
      const double level = std::cos(m.y());
      direction << level * std::sin(m.x()), std::sin(m.y()), level * std::cos(m.x());
      return true;
    }
  }
  return false;
}

}  // namespace

std::string to_string(CameraModel model) {
  static const std::array<const char*, camera_models> names = {
      "pinhole",           "pinhole_radtan",   "kannala_brandt",     "double_sphere",
      "unified",           "extended_unified", "field_of_view",      "mei",
      "equirectangular",   "pinhole_rational", "thin_prism_fisheye", "rad_tan_thin_prism_fisheye",
      "polynomial_fisheye"};
  const auto index = static_cast<std::size_t>(model);
  if (index >= names.size()) {
    throw Error("The camera model number " + std::to_string(static_cast<int>(model)) +
                " is unknown; use one of CameraModel.");
  }
  return names[index];
}

std::span<const Intrinsic> intrinsics() {
  using C = Camera;
  static constexpr Intrinsic all[] = {
      {"fx", &C::fx},     {"fy", &C::fy},       {"cx", &C::cx}, {"cy", &C::cy},
      {"skew", &C::skew}, {"shear", &C::shear}, {"xi", &C::xi}, {"alpha", &C::alpha},
      {"beta", &C::beta}, {"omega", &C::omega}, {"k1", &C::k1}, {"k2", &C::k2},
      {"k3", &C::k3},     {"k4", &C::k4},       {"k5", &C::k5}, {"k6", &C::k6},
      {"k7", &C::k7},     {"k8", &C::k8},       {"k9", &C::k9}, {"k10", &C::k10},
      {"k11", &C::k11},   {"p1", &C::p1},       {"p2", &C::p2}, {"s1", &C::s1},
      {"s2", &C::s2},     {"s3", &C::s3},       {"s4", &C::s4}};
  return all;
}

Camera whole_sphere(int width, int height) {
  Camera camera;
  camera.model = CameraModel::equirectangular;
  camera.width = width;
  camera.height = height;
  camera.fx = width / (2 * std::numbers::pi);
  camera.fy = height / std::numbers::pi;
  camera.cx = 0.5 * (width - 1);
  camera.cy = 0.5 * (height - 1);
  return camera;
}

class PreparedCamera::Implementation {
 public:
  explicit Implementation(const Camera& of)
      : camera(of), parameters(camera_parameters(of)), dual(constant(parameters)) {}

  const Camera camera;
  const kernel::precise::CameraParameters parameters;
  const kernel::dual::CameraParameters dual;
};

PreparedCamera::PreparedCamera(const Camera& camera)
    : implementation_(std::make_shared<const Implementation>(camera)) {}

bool PreparedCamera::project(const Vector3d& point, Vector2d& pixel) const {
  return project_with(implementation_->parameters, point, pixel);
}

bool PreparedCamera::project(const Vector3d& point, Vector2d& pixel,
                             Eigen::Matrix<double, 2, 3>& jacobian) const {
  const kernel::dual::CameraParameters& parameters = implementation_->dual;
  const kernel::dual::real3 variable(Dual(point.x(), Eigen::RowVector3d::UnitX()),
                                     Dual(point.y(), Eigen::RowVector3d::UnitY()),
                                     Dual(point.z(), Eigen::RowVector3d::UnitZ()));
  kernel::dual::real2 u{};
  const bool inside = kernel::dual::project(parameters, parameters.size.z, variable, u);
  pixel = {u.x.value, u.y.value};
  jacobian << u.x.derivative, u.y.derivative;
  return inside && pixel.allFinite();
}

bool PreparedCamera::unproject(const Vector2d& pixel, Vector3d& ray) const {
  const Camera& c = implementation_->camera;
  Vector2d m;
  const Vector2d offset(pixel.x() - c.cx, pixel.y() - c.cy);
  const double slant = c.shear / c.fx;
  m.y() = (offset.y() - slant * offset.x()) / (c.fy - slant * c.skew);
  m.x() = (offset.x() - c.skew * m.y()) / c.fx;
  if (!direction_of(c, implementation_->dual, m, ray)) return false;
  ray.normalize();
  // Projecting back checks the domain and the field of view and catches every way of not
  // converging.
  Vector2d again;
  return ray.allFinite() && project(ray, again) &&
         (again - pixel).norm() <= unprojection_tolerance * (1 + pixel.norm() / 1000);
}

bool PreparedCamera::project_into_image(const Vector3d& point, Vector2d& pixel) const {
  const Camera& camera = implementation_->camera;
  return project(point, pixel) && pixel.x() >= -0.5 && pixel.y() >= -0.5 &&
         pixel.x() < camera.width - 0.5 && pixel.y() < camera.height - 0.5;
}

bool project(const Camera& camera, const Vector3d& point, Vector2d& pixel) {
  return PreparedCamera(camera).project(point, pixel);
}

bool project(const Camera& camera, const Vector3d& point, Vector2d& pixel,
             Eigen::Matrix<double, 2, 3>& jacobian) {
  return PreparedCamera(camera).project(point, pixel, jacobian);
}

bool unproject(const Camera& camera, const Vector2d& pixel, Vector3d& ray) {
  return PreparedCamera(camera).unproject(pixel, ray);
}

double model_max_theta(const Camera& camera) {
  Camera unlimited_view = camera;
  unlimited_view.max_theta = std::numbers::pi;
  const kernel::precise::CameraParameters parameters = camera_parameters(unlimited_view);
  double inside = 0;
  double outside = std::numbers::pi;
  for (int i = 0; i < 60; ++i) {
    const double theta = 0.5 * (inside + outside);
    Vector2d pixel;
    const bool seen = project_with(parameters, {std::sin(theta), 0, std::cos(theta)}, pixel);
    (seen ? inside : outside) = theta;
  }
  return inside;
}

namespace {

/// Of an image that is sx times as wide and sy times as high, but for what the size leaves out.
Camera scaled_apart(const Camera& camera, double sx, double sy, int width, int height) {
  if (camera.width < 1 || camera.height < 1 || width < 1 || height < 1) {
    throw Error("Cannot resize a camera of " + size_text(camera.width, camera.height) + " to " +
                size_text(width, height) + "; both must have at least one pixel.");
  }
  Camera result = camera;
  result.width = width;
  result.height = height;
  scale_intrinsics(result, sx, sy);
  return result;
}

}  // namespace

Camera resized(const Camera& camera, int width, int height) {
  return scaled_apart(camera, static_cast<double>(width) / camera.width,
                      static_cast<double>(height) / camera.height, width, height);
}

Camera scaled(const Camera& camera, double factor) {
  const double largest = std::numeric_limits<int>::max();
  if (!(factor > 0 && factor * std::max(camera.width, camera.height) < largest)) {
    throw Error("A camera cannot be scaled by " + text_of(factor) + "; give a positive factor.");
  }
  return scaled_apart(camera, factor, factor, cvRound(factor * camera.width),
                      cvRound(factor * camera.height));
}

cv::Mat ray_image(const Camera& camera, const cv::Mat& mask) {
  validate(camera, "The camera of the ray image");
  require_fitting_mask(mask, camera, "The ray image");
  Camera whole = camera;
  whole.max_theta = std::numbers::pi;
  const PreparedCamera prepared(whole);
  const double cosine = camera_parameters(camera).domain.x;
  cv::Mat rays = cv::Mat::zeros(camera.height, camera.width, CV_32FC4);
  cv::parallel_for_(cv::Range(0, camera.height), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < camera.width; ++x) {
        Vector3d ray;
        if (!prepared.unproject({x, y}, ray)) continue;
        const bool usable = ray.z() >= cosine && (mask.empty() || mask.at<uchar>(y, x) != 0);
        const Eigen::Vector3f single = ray.cast<float>();
        rays.at<cv::Vec4f>(y, x) = {single.x(), single.y(), single.z(), usable ? 1.0f : 0.0f};
      }
    }
  });
  return rays;
}

}  // namespace widestereo
