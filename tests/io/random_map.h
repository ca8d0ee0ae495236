// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core.hpp>

namespace widestereo::test {

/// The same values each time, also negative ones.
inline cv::Mat random_map(int type) {
  cv::Mat map(37, 53, type);
  cv::theRNG().state = 12;
  cv::randu(map, -3, 9);
  return map;
}

}  // namespace widestereo::test
