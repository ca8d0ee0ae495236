// SPDX-License-Identifier: MIT
#include "benchmark_plot.h"

#include <gmock/gmock.h>

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(BenchmarkPlot, SharesOfTheRooflineNeedATimeOnTheDevice) {
  PlotBar bar{.label = "vulkan:0",
              .wall = 9,
              .wall_min = 8,
              .wall_max = 10,
              .device = 4,
              .roofline = {3, "texels"}};
  EXPECT_THAT(benchmark_plot({bar}), HasSubstr("9.00 (4.00), 75 % of texels"));
  bar.device = 0;
  EXPECT_THAT(benchmark_plot({bar}), Not(HasSubstr("% of texels")));
}

}  // namespace
}  // namespace widestereo::test
