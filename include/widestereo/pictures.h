// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/point_cloud.h"

namespace widestereo {

/// Distances (metres) at the two ends of a colour map, 0 < nearest < farthest.
struct ColourRange {
  double nearest = 0;
  double farthest = 0;
};

/// The 2nd and 98th percentile of the inverse distances of a map (CV_32FC1, metres), as distances;
/// 1 to 10, which will do for any legend, where it has none. This and all pictures of maps throw
/// Error for other types than these, empty maps, different sizes, and ranges that hold nothing.
ColourRange robust_range(const cv::Mat& distance);

/// All pictures are CV_8UC3 BGR of the map's size; pixels without a value are dark grey.
/// Inverse distance (CV_32FC1, metres) in colours: near red, far blue.
cv::Mat distance_picture(const cv::Mat& distance, const ColourRange& range);
/// Normals (CV_32FC3: x right, y down, z forward, facing the camera) as red = (1 + x) / 2, green =
/// (1 - y) / 2, blue = (1 - z) / 2: a wall that faces the camera is bluish, a floor green.
cv::Mat normal_picture(const cv::Mat& normals);
/// A map (CV_32FC1) between two values, the lower one first, from dark to bright.
cv::Mat scalar_picture(const cv::Mat& map, double low, double high);
/// Reason bits (CV_16UC1): the colour of filled pixels, else of the first bit set, the image (8 or
/// 16 bit, grey, BGR or BGRA) where accepted.
cv::Mat reason_picture(const cv::Mat& reasons, const cv::Mat& image);

/// A cloud in its own colours as a pinhole camera of 90 degrees across sees it from
/// `world_from_viewer` (metres; x right, y down, z forward), nearest points first, 3x3 pixels each.
cv::Mat cloud_picture(const PointCloud& cloud, const Eigen::Isometry3d& world_from_viewer,
                      cv::Size size);

/// A picture (CV_8UC3) with a legend below, 128 pixels wide or more: the colour bar of
/// distance_picture() with distances in `unit`.
cv::Mat with_distance_legend(const cv::Mat& picture, const ColourRange& range,
                             const std::string& unit = " m");
/// ... the colour bar of scalar_picture() with its end values.
cv::Mat with_scalar_legend(const cv::Mat& picture, double low, double high);
/// ... the colours of reason_picture().
cv::Mat with_reason_legend(const cv::Mat& picture);

struct Panel {
  std::string title;
  cv::Mat picture;  ///< 8 or 16 bit, grey, BGR or BGRA
};
/// Panels side by side, `columns` in a row, each scaled to the width of the first (128 pixels or
/// more) and titled; farther apart where a title is wider. Throws Error where there are none or no
/// columns, and for pictures of other types.
cv::Mat panel_sheet(const std::vector<Panel>& panels, int columns);

}  // namespace widestereo
