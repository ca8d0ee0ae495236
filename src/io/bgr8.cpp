// SPDX-License-Identifier: MIT
#include "io/bgr8.h"

#include <opencv2/imgproc.hpp>

#include "widestereo/error.h"

namespace widestereo {

void require_image(const cv::Mat& image, const std::string& name) {
  if (image.empty()) throw Error(name + " is empty; give one that has pixels.");
  const int depth = image.depth(), channels = image.channels();
  if ((depth == CV_8U || depth == CV_16U) && (channels == 1 || channels == 3 || channels == 4)) {
    return;
  }
  throw Error(name + " is " + cv::typeToString(image.type()) +
              "; give 8 or 16 bit, grey, BGR or BGRA.");
}

cv::Mat to_bgr8(const cv::Mat& image) {
  if (image.empty()) return {};
  cv::Mat eight;
  image.convertTo(eight, CV_8U, image.depth() == CV_16U ? 1 / 257.0 : 1.0);
  if (eight.channels() == 1) cv::cvtColor(eight, eight, cv::COLOR_GRAY2BGR);
  if (eight.channels() == 4) cv::cvtColor(eight, eight, cv::COLOR_BGRA2BGR);
  return eight;
}

}  // namespace widestereo
