// SPDX-License-Identifier: MIT
// Images of the demo as applications have them in device memory.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "widestereo/image_io.h"
#include "widestereo/pixel_type.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {

inline std::vector<cv::Mat> device_images_of(const RenderedPair& pair, PixelType pixel) {
  std::vector<cv::Mat> images;
  for (const RenderedView& view : pair.views) {
    cv::Mat grey = to_intensity(view.image, "test");
    if (pixel == PixelType::grey8) grey.convertTo(grey, CV_8U, 255);
    if (pixel == PixelType::grey16) grey.convertTo(grey, CV_16U, 65535);
    images.push_back(grey);
  }
  return images;
}

inline std::string name_of(const ::testing::TestParamInfo<PixelType>& test) {
  constexpr const char* names[] = {"grey8", "grey16", "intensity"};
  return names[static_cast<int>(test.param)];
}

}  // namespace widestereo::test
