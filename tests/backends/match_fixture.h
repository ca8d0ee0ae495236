// SPDX-License-Identifier: MIT
// What tests of whole matches share, on any back end.
#pragma once

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <vector>

#include "non_occluded.h"
#include "same_bits.h"
#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {

inline std::vector<cv::Mat> images_of(const RenderedPair& pair) {
  std::vector<cv::Mat> images;
  for (const RenderedView& view : pair.views) images.push_back(view.image);
  return images;
}

/// Camera 0's maps by the CPU, looked for between these distances (metres).
inline ViewResult match_on_cpu(const RenderedPair& pair, Options options, double nearest,
                               double farthest) {
  options.min_distance = nearest;
  options.max_distance = farthest;
  Device device = Device::open("cpu");
  return Matcher(device, pair.rig, options).match(images_of(pair)).views[0];
}

/// Of camera 0's pixels that are not occluded, the share that is wrong by more than `pixels`.
inline double wrong_by(int pixels, const ViewResult& view, const RenderedPair& pair) {
  return non_occluded(
             evaluate(view.distance, {}, pair.views[0].truth, pair.rig.views[0], pair.rig.views[1]))
      .bad_pixels.at(pixels);
}

/// Camera 0 to world after steps of 5 cm and two degrees.
inline Eigen::Isometry3d pose_after(double steps) {
  return Eigen::Translation3d(0.05 * steps, -0.01 * steps, 0.02 * steps) *
         Eigen::AngleAxisd(0.035 * steps, Eigen::Vector3d(0.2, 1, 0.1).normalized());
}

inline void expect_same_bits(const ViewResult& expected, const ViewResult& actual) {
  EXPECT_TRUE(same_bits(expected.hypotheses, actual.hypotheses));
  EXPECT_TRUE(same_bits(expected.confidence, actual.confidence));
  EXPECT_TRUE(same_bits(expected.reasons, actual.reasons));
}

inline void expect_same_bits(const StereoResult& expected, const StereoResult& actual) {
  ASSERT_EQ(expected.views.size(), actual.views.size());
  for (std::size_t i = 0; i < expected.views.size(); ++i) {
    SCOPED_TRACE(i);
    expect_same_bits(expected.views[i], actual.views[i]);
  }
}

}  // namespace widestereo::test
