// SPDX-License-Identifier: MIT
// What a matcher takes on its device, as docs/performance.md states it.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "device_fixture.h"
#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

constexpr double bytes_of_pixel = 16 + 16 + 16 + 16;  // ray, plane, checks, prior
constexpr double bytes_of_intensity = 4;              // of the image and 16 pixels around it,
                                                      // or a half pixel and 32 around them
constexpr double bytes_of_transfer = 4 + 4;
constexpr double side = 128;

/// Of a square image whose rows are whole lines of this many texels.
double texels_of(double wide, double line) { return wide * line * std::ceil(wide / line); }

class Memory : public ::testing::TestWithParam<const char*> {};

double bytes_on(Device& device, const std::string& preset) {
  Options options = Options::preset_named(preset);
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.window_radius = 2;
  options.first_iterations = 1;
  options.second_iterations = 1;
  options.sweep_steps = 4;
  const RenderedPair pair = render_demo(static_cast<int>(side));
  Matcher matcher(device, pair.rig, options);
  return static_cast<double>(matcher.match(pair.views[0].image, pair.views[1].image).device_bytes);
}

TEST_P(Memory, IsWhatIsDocumented) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const double line = device->info().kind == DeviceKind::cuda ? 128 / bytes_of_intensity : 1;
  const bool levels_share_layers = device->info().kind == DeviceKind::vulkan;
  // Software Vulkan keeps each half pixel with its right, lower and lower right neighbour.
  const bool loads = levels_share_layers && device->info().type == "cpu";
  const double bytes_of_half_pixel = (loads ? 4 : 1) * bytes_of_intensity;
  for (const auto& [preset, levels] : {std::pair("paper", 1), std::pair("fast", 3)}) {
    // Vulkan stages transfers of one map in a buffer.
    double expected = side * side * (bytes_of_transfer + (levels_share_layers ? 16 : 0));
    for (int level = 0; level < levels; ++level) {
      const double own = side / (1 << level);
      const double intensities = levels_share_layers ? 0 : texels_of(own + 2 * 16, line);
      expected += 2 * intensities * bytes_of_intensity;
      expected += 2 * texels_of(2 * own + 2 * 32, line) * bytes_of_half_pixel;
      if (!levels_share_layers) expected += 2 * own * own * bytes_of_pixel;
    }
    if (levels_share_layers) {
      const double layers = levels == 1 ? 2 : 3;  // one for all that is coarse
      const double width = levels == 1 ? side + 2 * 16 : side + 4 * 16;  // two half as wide
      expected +=
          layers * (side * side * bytes_of_pixel + width * (side + 2 * 16) * bytes_of_intensity);
    }
    const double bytes = bytes_on(*device, preset);
    EXPECT_GE(bytes, expected) << preset;
    EXPECT_LE(bytes, 1.01 * expected + 3 * 16384) << preset;  // rounding, and parameters
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, Memory, ::testing::Values("cpu", "vulkan", "cuda"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace widestereo::test
