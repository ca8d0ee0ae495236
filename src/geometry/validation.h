// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>
#include <string>

#include "widestereo/rig.h"

namespace widestereo {

/// Width and height of a camera's image at most, pixels.
inline constexpr int largest_image_side = 16384;

/// The unit quaternion that one read from a file is, but for rounding. Throws Error where its
/// length is not 1 within 1 %. `name`, what has it, begins the message, and `remedy` ends it: a
/// clause.
Eigen::Quaterniond require_unit(const Eigen::Quaterniond& quaternion, const std::string& name,
                                const std::string& remedy);

/// Throws Error unless a pose is a rigid motion. `name` begins the message.
void require_rigid(const Eigen::Isometry3d& pose, const std::string& name);

/// Throws Error unless camera, pose and mask of a view are as they must be. `name` begins the
/// message.
void require_valid(const View& view, const std::string& name);

/// Throws Error unless `number` is that of one of `count` things called `name` ("view"), numbered
/// from 0. `of`, what has them, begins the message.
void require_number(std::size_t number, std::size_t count, const std::string& name,
                    const std::string& of);

/// Throws Error where a rig has no views. `name` begins the message.
void require_cameras(const Rig& rig, const std::string& name);

/// Throws Error where two views share a centre. `name` begins the message.
void require_baseline(const View& a, const View& b, const std::string& name);

/// Throws Error unless a map or an image has pixels. `name` begins the message.
void require_pixels(const cv::Mat& map, const std::string& name);
/// Throws Error unless a map has pixels, of a type such as CV_32FC1. `name` begins the message.
void require_type(const cv::Mat& map, int type, const std::string& name);
/// Throws Error where a map has more than rows and columns. `name` begins the message.
void require_two_dimensions(const cv::Mat& map, const std::string& name);
/// Throws Error unless a map has the size of the others of its view. `name` begins the message.
void require_size(const cv::Mat& map, cv::Size size, const std::string& name);
/// Type and size.
void require_map(const cv::Mat& map, cv::Size size, int type, const std::string& name);
/// Both, of a map that may be empty.
void require_optional_map(const cv::Mat& map, cv::Size size, int type, const std::string& name);

/// What to do about an image of another size than that calibrated, for the end of a message: a
/// clause.
std::string remedy_of_size(cv::Size given, cv::Size calibrated);

/// Throws Error unless `mask` is empty or CV_8UC1 of the camera's size. `name` begins the message.
void require_fitting_mask(const cv::Mat& mask, const Camera& camera, const std::string& name);

}  // namespace widestereo
