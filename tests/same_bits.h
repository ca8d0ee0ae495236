// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core.hpp>

namespace widestereo::test {

/// Whether two matrices, which must not be empty, have the same size, type and bits. (For
/// cv::norm() a matrix of NaN does not differ from any other.)
inline ::testing::AssertionResult same_bits(const cv::Mat& a, const cv::Mat& b) {
  if (a.empty() || b.empty()) ADD_FAILURE() << "nothing to compare";
  if (a.size() != b.size() || a.type() != b.type()) {
    return ::testing::AssertionFailure() << a.size() << " of type " << a.type() << ", but "
                                         << b.size() << " of type " << b.type();
  }
  long differing = 0;
  cv::Point first;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      if (std::memcmp(a.ptr(y, x), b.ptr(y, x), a.elemSize()) == 0) continue;
      if (differing++ == 0) first = {x, y};
    }
  }
  if (differing == 0) return ::testing::AssertionSuccess() << "all bits are the same";
  const cv::Rect pixel(first, cv::Size(1, 1));
  return ::testing::AssertionFailure() << differing << " of " << a.total() << " differ, first at "
                                       << first << ": " << a(pixel) << ", but " << b(pixel);
}

}  // namespace widestereo::test
