// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "widestereo/point_cloud.h"
#include "widestereo/rig.h"

namespace widestereo {

/// What was found in one view; maps of its camera's size.
struct ViewMaps {
  cv::Mat distance;    ///< CV_32FC1, metres along the unit ray; <= 0 or not finite: none
  cv::Mat normals;     ///< empty, or CV_32FC3, unit, camera frame
  cv::Mat image;       ///< empty, or 8 or 16 bit, grey, BGR or BGRA
  cv::Mat confidence;  ///< empty, or CV_32FC1 in [0, 1]
};

/// When the points of two views are the same point of a surface, and how many views make one.
struct FusionOptions {
  int min_views = 2;             ///< views that have the point, at least; 1 keeps all
  double max_relative = 0.01;    ///< difference of distance from the other view, share
  double max_pixels = 2;         ///< displacement in the view that is joined
  double max_normal_angle = 45;  ///< degrees, where both have normals
  std::size_t cache_bytes = std::size_t{2} << 30;  ///< memory for the clouds of views, about
};

/// Gives the maps of a view, by its index. Called again for views that left the cache.
using MapsOfView = std::function<ViewMaps(std::size_t view)>;

/// One cloud from the maps of many views, in the frame of their poses, whose origin must not be
/// far: positions are single precision (local_origin()). View after view, each pixel that is not
/// part of a point yet is joined by those pixels of the view's `others` (indices, best first, the
/// view itself and repeats ignored; one list for each view, of which as many are used as fit in
/// half of the cache, ten at least) that its point projects to and that agree. Where one of them is
/// part of a point already, seen about as finely, that point stands for the new pixel, too, and for
/// what later agrees with it. Else the point is their mean, weighted by the inverse square of the
/// spacing of each one's pixels there; its confidence that of the surest. A point that more views
/// see through, to a farther surface, than have it is left out, unless min_views is 1. The same
/// input gives the same cloud. `progress` is told the share done. Throws Error when maps do not fit
/// their view, for views that are not valid and limits below 0 or NaN, and what `maps` throws.
PointCloud fuse(const std::vector<View>& views, const std::vector<std::vector<std::size_t>>& others,
                const MapsOfView& maps, const FusionOptions& options = {},
                const std::function<void(double)>& progress = {});

}  // namespace widestereo
