// SPDX-License-Identifier: MIT
#include "geometry/validation.h"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "geometry/angle.h"
#include "text/formatted.h"
#include "text/number.h"
#include "text/size_text.h"
#include "widestereo/error.h"
#include "widestereo/rig.h"

namespace widestereo {
namespace {

constexpr double longest_time_offset = 3600;  // seconds

void require(bool good, const std::string& name, const std::string& what, double value,
             const std::string& remedy) {
  if (good) return;
  throw Error(name + ": " + what + " is " + formatted("%g", value) + "; " + remedy + ".");
}

void require_finite(const Camera& c, const std::string& name) {
  const auto check = [&name](const char* what, double value) {
    // Far beyond any calibration, yet safe to square in single precision.
    require(std::isfinite(value) && std::abs(value) < 1e9, name, what, value,
            "it must be a finite number of ordinary size");
  };
  for (const auto& [what, member] : intrinsics()) check(what, c.*member);
  check("max_theta", c.max_theta);
}

/// But for entries rounded to four digits.
bool is_rotation(const Eigen::Matrix3d& matrix) {
  constexpr double rounding = 3.1e-4;  // 2 * 3 * 0.5e-4, and what is of second order
  return (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).norm() <= rounding &&
         matrix.determinant() > 0;
}

}  // namespace

void require_rigid(const Eigen::Isometry3d& pose, const std::string& name) {
  const bool finite = pose.matrix().allFinite();
  const Eigen::Matrix3d& rotation = pose.linear();
  if (finite && is_rotation(rotation)) return;
  std::string remedy =
      "its rotation must be orthonormal with determinant +1 and all entries finite";
  const double scale = finite ? std::cbrt(rotation.determinant()) : 0;
  if (scale > 0 && is_rotation(rotation / scale)) {
    remedy = "its rotation is " + formatted("%g", scale) + " times one; divide these nine by that";
  } else if (scale < 0 && is_rotation(rotation / scale)) {
    remedy = "it mirrors, as between frames of left and right hands; negate an axis";
  }
  throw Error(name + ": the pose is not a rigid motion; " + remedy + ".");
}

void validate(const Camera& c, const std::string& name) {
  const auto require_side = [&name](const char* what, int side) {
    require(side >= 2 && side <= largest_image_side, name, what, side,
            "it must be 2 to " + std::to_string(largest_image_side) + " pixels");
  };
  require_side("the image width", c.width);
  require_side("the image height", c.height);
  require_finite(c, name);
  require(c.fx > 0, name, "fx", c.fx, "it must be positive");
  require(c.fy > 0, name, "fy", c.fy, "it must be positive");
  require(c.max_theta > 0 && c.max_theta <= std::numbers::pi + 1e-12, name, "max_theta (degrees)",
          c.max_theta * degrees_per_radian, "it must be more than 0 and at most 180");
  require(c.shear == 0 || c.model == CameraModel::polynomial_fisheye, name, "shear", c.shear,
          "only polynomial_fisheye has one");
  switch (c.model) {
    case CameraModel::pinhole:
    case CameraModel::pinhole_radtan:
    case CameraModel::kannala_brandt:
    case CameraModel::equirectangular:
    case CameraModel::pinhole_rational:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::rad_tan_thin_prism_fisheye:
      break;
    case CameraModel::polynomial_fisheye:
      require(c.fx * c.fy > c.skew * c.shear, name, "the determinant of fx, skew, shear and fy",
              c.fx * c.fy - c.skew * c.shear, "it must be positive");
      break;
    case CameraModel::double_sphere:
      require(c.xi > -1 && c.xi <= 1, name, "xi", c.xi, "a double sphere needs it in (-1, 1]");
      require(c.alpha >= 0 && c.alpha <= 1, name, "alpha", c.alpha,
              "a double sphere needs it in [0, 1]");
      break;
    case CameraModel::unified:
    case CameraModel::mei:
      require(c.xi >= 0, name, "xi", c.xi, "the unified model needs it to be 0 or more");
      break;
    case CameraModel::extended_unified:
      require(c.alpha >= 0 && c.alpha <= 1, name, "alpha", c.alpha,
              "the extended unified model needs it in [0, 1]");
      require(c.beta > 0, name, "beta", c.beta, "the extended unified model needs it positive");
      break;
    case CameraModel::field_of_view:
      require(c.omega > 1e-6 && c.omega < std::numbers::pi, name, "omega (radians)", c.omega,
              "the field-of-view model needs it in (0, pi)");
      break;
    default:
      throw Error(name + ": the camera model number " + std::to_string(static_cast<int>(c.model)) +
                  " is unknown.");
  }
}

Eigen::Quaterniond require_unit(const Eigen::Quaterniond& quaternion, const std::string& name,
                                const std::string& remedy) {
  const double length = quaternion.norm();
  if (std::abs(length - 1) <= 1e-2) return quaternion.normalized();
  // Single precision has no digits of rounding.
  throw Error(name + " has a quaternion of length " + text_of(static_cast<float>(length)) +
              " instead of 1; " + remedy + ".");
}

void require_number(std::size_t number, std::size_t count, const std::string& name,
                    const std::string& of) {
  if (number < count) return;
  throw Error(of + " has no " + name + " number " + std::to_string(number) + " among its " +
              std::to_string(count) + "; they are numbered from 0.");
}

void require_cameras(const Rig& rig, const std::string& name) {
  if (rig.views.empty()) throw Error(name + " has no cameras; give at least one.");
}

void require_baseline(const View& a, const View& b, const std::string& name) {
  if (has_baseline(a.world_from_camera.translation(), b.world_from_camera.translation())) return;
  throw Error(name + ": " + a.name + " and " + b.name +
              " have the same centre; stereo needs a baseline.");
}

void require_pixels(const cv::Mat& map, const std::string& name) {
  if (map.empty()) throw Error(name + " is empty; give one that has pixels.");
}

void require_type(const cv::Mat& map, int type, const std::string& name) {
  require_pixels(map, name);
  if (map.type() == type) return;
  throw Error(name + " is " + cv::typeToString(map.type()) + " instead of " +
              cv::typeToString(type) + "; convert it or give another one.");
}

void require_two_dimensions(const cv::Mat& map, const std::string& name) {
  if (map.dims <= 2) return;
  throw Error(name + " has " + std::to_string(map.dims) +
              " dimensions instead of 2; use maps of one view.");
}

void require_size(const cv::Mat& map, cv::Size size, const std::string& name) {
  require_two_dimensions(map, name);
  if (map.size() == size) return;
  throw Error(name + " is " + size_text(map.cols, map.rows) + " pixels instead of " +
              size_text(size.width, size.height) + "; use maps of one view.");
}

void require_map(const cv::Mat& map, cv::Size size, int type, const std::string& name) {
  require_type(map, type, name);
  require_size(map, size, name);
}

void require_optional_map(const cv::Mat& map, cv::Size size, int type, const std::string& name) {
  if (!map.empty()) require_map(map, size, type, name);
}

std::string remedy_of_size(cv::Size given, cv::Size calibrated) {
  const std::string same = "both must have the same size";
  if (given == cv::Size(calibrated.height, calibrated.width)) {
    return same + "; where images are turned by 90 degrees, turn them back";
  }
  // To within half a pixel of either side, and by more than a crop of a few pixels.
  const double share = static_cast<double>(given.width) / calibrated.width;
  const bool is_scaled = std::abs(given.height - share * calibrated.height) <= 0.5 + 0.5 * share;
  if (is_scaled && share < 0.95) {
    return same +
           "; `calibration convert --scale` makes a calibration for reduced images, but not of a "
           "COLMAP model, which needs the original ones (and --max-image-size)";
  }
  if (is_scaled && share > 1.05) {
    return same +
           formatted(
               "; reduce images to that calibrated, or make a calibration for larger ones by "
               "`calibration convert --scale %.6g`",
               share);
  }
  if (given.width <= calibrated.width && given.height <= calibrated.height) {
    return same +
           "; where images are cropped, subtract what is missing on their left and top from cx and "
           "cy, and set the calibration's size to theirs";
  }
  if (given.width >= calibrated.width && given.height >= calibrated.height) {
    return same + "; where those calibrated were cropped, crop these likewise";
  }
  return same;
}

void require_fitting_mask(const cv::Mat& mask, const Camera& camera, const std::string& name) {
  if (mask.empty()) return;
  require_type(mask, CV_8UC1, name + ": the mask");
  if (mask.cols == camera.width && mask.rows == camera.height) return;
  throw Error(name + ": the mask is " + size_text(mask.cols, mask.rows) +
              " pixels, but the camera has " + size_text(camera.width, camera.height) +
              "; use one of that size.");
}

void require_valid(const View& view, const std::string& name) {
  const std::string of_view = name + ": " + view.name;
  validate(view.camera, of_view);
  require_rigid(view.world_from_camera, of_view);
  require_fitting_mask(view.mask, view.camera, of_view);
  if (!(std::abs(view.imu_time_offset) <= longest_time_offset)) {
    throw Error(of_view + ": the IMU's clock is ahead by " + text_of(view.imu_time_offset) +
                " s; give less than an hour, in seconds.");
  }
}

void validate(const Rig& rig, const std::string& name) {
  require_cameras(rig, name);
  for (const View& view : rig.views) require_valid(view, name);
  if (rig.world_from_imu) require_rigid(*rig.world_from_imu, name + ": IMU");
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    for (std::size_t j = i + 1; j < rig.views.size(); ++j) {
      require_baseline(rig.views[i], rig.views[j], name);
    }
  }
}

}  // namespace widestereo
