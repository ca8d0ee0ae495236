// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/camera.h"

namespace widestereo {

/// One calibrated camera of a rig.
struct View {
  std::string name;  ///< "cam0", ... as in the calibration file
  Camera camera;
  Eigen::Isometry3d world_from_camera = Eigen::Isometry3d::Identity();  ///< metres
  cv::Mat mask;  ///< empty, or CV_8UC1 of the camera's size, 0 = excluded
  /// Seconds to add to the times of its images for those of the IMU's clock (timeshift_cam_imu of
  /// Kalibr, cam_time_offset_ns of Basalt, td of VINS-Fusion).
  double imu_time_offset = 0;
};

/// Calibrated cameras with poses in a common frame (view 0's camera frame when read from a
/// rig's file, the reconstruction's with SfmModel, whose unit then stands for metres).
struct Rig {
  std::vector<View> views;
  /// X = T X_imu in the common frame, metres; none where no IMU was calibrated.
  std::optional<Eigen::Isometry3d> world_from_imu = std::nullopt;
};

/// Pose of view `source` relative to view `reference`: X_source = T X_reference.
inline Eigen::Isometry3d source_from_reference(const View& source, const View& reference) {
  return source.world_from_camera.inverse() * reference.world_from_camera;
}

/// Distance between two camera centres in metres.
inline double baseline(const View& a, const View& b) {
  return (a.world_from_camera.translation() - b.world_from_camera.translation()).norm();
}

/// Where to put the origin of a frame in which a view and what it sees have small coordinates, as
/// single precision (CloudPoint) needs them: whole thousands of metres on axes along which the view
/// lies 10 km or more from the world's origin, as in national grids, else 0. To be subtracted from
/// the positions of all views that are used together.
Eigen::Vector3d local_origin(const View& view);

/// Whether two camera centres (world frame) are far enough apart to tell distances at all, and not
/// one place that has been rounded, as in national grids.
inline bool has_baseline(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  constexpr double least = 1e-9;      // metres
  constexpr double rounding = 1e-14;  // of a centre, share of its distance from the origin
  return (a - b).norm() > least + rounding * std::max(a.norm(), b.norm());
}

/// The view of an image that is scaled to another size by its corners. A pixel is excluded where
/// the mask excludes any that it covers. Throws Error where either size has no pixel or the mask
/// does not fit.
View resized(const View& view, int width, int height);

/// Whether the view's mask excludes the pixel nearest to a position, or what lies outside the mask.
bool is_masked(const View& view, const Eigen::Vector2d& position);

/// Throws Error unless an image or map has the size that the view is calibrated for. `name` (a
/// file, say) begins the message.
void require_calibrated_size(const cv::Mat& map, const View& view, const std::string& name);
/// Likewise of a mask, which must change if they differ.
void require_mask_size(const cv::Mat& mask, const View& view, const std::string& name);

/// Throws Error unless every camera is valid, every pose (the IMU's, too) is rigid and finite,
/// masks fit and no two views share a centre. `name` (a file, say) begins the message.
void validate(const Rig& rig, const std::string& name);

}  // namespace widestereo
