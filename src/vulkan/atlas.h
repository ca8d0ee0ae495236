// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/types.hpp>
#include <vector>

namespace widestereo {

/// Where the maps of views of many sizes lie in layers of one size: coarse levels share a layer.
struct Atlas {
  struct Place {
    cv::Point origin;  ///< of pixel (0, 0)
    int layer = 0;
  };
  cv::Size size;  ///< of every layer
  int layers = 0;
  std::vector<Place> places;  ///< one for each view
};

Atlas pack_views(const std::vector<cv::Size>& sizes);

}  // namespace widestereo
