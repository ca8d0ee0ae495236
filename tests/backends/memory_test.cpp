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
                                                      // and of its half pixels and 32 around them
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
  const bool layers_are_equal = device->info().kind == DeviceKind::vulkan;
  for (const auto& [preset, levels] : {std::pair("paper", 1), std::pair("fast", 3)}) {
    const double levels_of_view = levels == 1 ? 1 : layers_are_equal ? 3 : 1 + 0.25 + 0.0625;
    // Vulkan stages transfers of one map in a buffer.
    const double of_largest = bytes_of_transfer + (layers_are_equal ? 16 : 0);
    double expected = side * side * (2 * levels_of_view * bytes_of_pixel + of_largest);
    for (int level = 0; level < levels; ++level) {
      const double own = layers_are_equal ? side : side / (1 << level);
      const double texels = texels_of(own + 2 * 16, line) + texels_of(2 * own + 2 * 32, line);
      expected += 2 * texels * bytes_of_intensity;
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
