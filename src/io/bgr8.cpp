// SPDX-License-Identifier: MIT
#include "io/bgr8.h"

#include <opencv2/imgproc.hpp>

#include "geometry/validation.h"
#include "widestereo/error.h"

namespace widestereo {

namespace {

void require_depth(bool good, const cv::Mat& image, const std::string& name,
                   const std::string& depths) {
  require_pixels(image, name);
  const int channels = image.channels();
  if (good && (channels == 1 || channels == 3 || channels == 4)) return;
  throw Error(name + " is " + cv::typeToString(image.type()) + "; give " + depths +
              ", grey, BGR or BGRA.");
}

bool is_integer_image(const cv::Mat& image) {
  return image.depth() == CV_8U || image.depth() == CV_16U;
}

}  // namespace

void require_image(const cv::Mat& image, const std::string& name) {
  require_depth(is_integer_image(image), image, name, "8 or 16 bit");
}

void require_image_or_float(const cv::Mat& image, const std::string& name) {
  require_depth(is_integer_image(image) || image.depth() == CV_32F, image, name,
                "8 or 16 bit, or float in [0, 1]");
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
