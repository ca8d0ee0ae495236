// SPDX-License-Identifier: MIT
// An application of the installed package, on a rendered pair.
#include <widestereo/matcher.h>
#include <widestereo/synthesis.h>

#include <cstdio>
#include <opencv2/core.hpp>

namespace ws = widestereo;

static_assert(__cplusplus >= 202002L, "the library's target must ask for C++20");

int main() {
  const ws::RenderedPair pair = ws::render_demo(160);
  ws::Options options = ws::Options::preset_named("fast");
  const auto [min_distance, max_distance] = ws::demo_distance_range();
  options.min_distance = min_distance;
  options.max_distance = max_distance;
  ws::Device device = ws::Device::open("cpu");
  ws::Matcher matcher(device, pair.rig, options);
  const ws::StereoResult result = matcher.match(pair.views[0].image, pair.views[1].image);
  const cv::Mat distance = ws::accepted_distance(result.views[0]);
  const cv::Mat error = cv::abs(distance / pair.views[0].truth.distance - 1.0);
  const int accepted = cv::countNonZero(distance);
  const int right = cv::countNonZero((error < 0.05) & (distance > 0));
  std::printf("%d of %d accepted distances are right within 5 %%\n", right, accepted);
  return accepted > 10000 && right > accepted * 8 / 10 ? 0 : 1;
}
