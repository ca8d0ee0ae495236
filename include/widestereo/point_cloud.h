// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "widestereo/eigen_layout.h"
#include "widestereo/error.h"

namespace widestereo {

struct CloudPoint {
  Eigen::Vector3f position;  ///< metres; tells millimetres apart up to 10 km from the origin
  Eigen::Vector3f normal;    ///< unit, or zero
  std::uint8_t red, green, blue;
  float confidence;  ///< [0, 1]
};
using PointCloud = std::vector<CloudPoint>;

/// The points of every pixel with a ray and a positive, finite distance (CV_32FC1, metres along the
/// ray), row by row, in the world frame: where the camera lies far from its origin, move that first
/// (local_origin()). `rays`: CV_32FC4 as from ray_image(). `normals` (CV_32FC3), `image` (8 or 16
/// bit, grey, BGR or BGRA) and `confidence` (CV_32FC1) may be empty. Throws Error for maps of other
/// types or of different sizes.
PointCloud make_point_cloud(const cv::Mat& distance, const cv::Mat& rays, const cv::Mat& normals,
                            const cv::Mat& image, const cv::Mat& confidence,
                            const Eigen::Isometry3d& world_from_camera);

/// Writes a binary little-endian PLY: x y z nx ny nz red green blue confidence. A comment has the
/// origin of the cloud's frame in that of the poses, where that is not 0. Throws Error.
void write_ply(const std::filesystem::path& path, const PointCloud& cloud,
               const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());

}  // namespace widestereo
