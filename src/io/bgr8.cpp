// SPDX-License-Identifier: MIT
#include "io/bgr8.h"

#include <opencv2/imgproc.hpp>

namespace widestereo {

cv::Mat to_bgr8(const cv::Mat& image) {
  if (image.empty()) return {};
  cv::Mat eight;
  image.convertTo(eight, CV_8U, image.depth() == CV_16U ? 1 / 257.0 : 1.0);
  if (eight.channels() == 1) cv::cvtColor(eight, eight, cv::COLOR_GRAY2BGR);
  if (eight.channels() == 4) cv::cvtColor(eight, eight, cv::COLOR_BGRA2BGR);
  return eight;
}

}  // namespace widestereo
