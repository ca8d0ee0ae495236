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

constexpr double maps = 4;                // ray, plane, checks, prior
constexpr double bytes_of_map = 16;       // at each pixel
constexpr double bytes_of_intensity = 4;  // of the image and 16 pixels around it
constexpr double bytes_of_transfer = 4 + 4;
constexpr double side = 128;
constexpr double bytes_of_largest_tile = 65536;

double rounded_up(double texels, double multiple) {
  return multiple * std::ceil(texels / multiple);
}

/// Of an image in square tiles of so many bytes, which it takes whole; of single texels where 0.
double bytes_of_image(double wide, double high, double bytes_of_texel, double bytes_of_tile) {
  const double tile = bytes_of_tile > 0 ? std::sqrt(bytes_of_tile / bytes_of_texel) : 1;
  return rounded_up(wide, tile) * rounded_up(high, tile) * bytes_of_texel;
}

/// What docs/performance.md states for two views of `side`.
double documented_bytes(const DeviceInfo& device, int levels, int texels_per_pixel,
                        double bytes_of_tile) {
  // Rows of CUDA are whole lines of 128 bytes.
  const bool cuda = device.kind == DeviceKind::cuda;
  const auto bytes_of_rows = [&](double wide, double texel) {
    return wide * rounded_up(wide * texel, cuda ? 128 : 1);
  };
  // Vulkan stages transfers of one map in a buffer.
  const bool vulkan = device.kind == DeviceKind::vulkan;
  double bytes = side * side * (bytes_of_transfer + (vulkan ? 16 : 0));
  // Software Vulkan keeps each texel with its right, lower and lower right neighbour; texture
  // units filter half precision.
  const bool loads = vulkan && device.type == "cpu";
  const double bytes_of_texel = loads                            ? 4 * bytes_of_intensity
                                : device.kind == DeviceKind::cpu ? bytes_of_intensity
                                                                 : 2;
  for (int level = 0; level < levels; ++level) {
    const double own = side / (1 << level);
    const double texels = texels_per_pixel * (own + 2 * 16);
    bytes += 2 * bytes_of_rows(own + 2 * 16, bytes_of_intensity);
    bytes += 2 * (vulkan ? bytes_of_image(texels, texels, bytes_of_texel, bytes_of_tile)
                         : bytes_of_rows(texels, bytes_of_texel));
    bytes += 2 * own * own * maps * bytes_of_map;
  }
  return bytes;
}

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
  const DeviceInfo& info = device->info();
  const bool has_tiles = info.kind == DeviceKind::vulkan && info.type != "cpu";
  for (const auto& [preset, levels, texels_per_pixel] :
       {std::tuple("paper", 1, 1), std::tuple("fast", 3, 2)}) {
    const double bytes = bytes_on(*device, preset);
    EXPECT_GE(bytes, documented_bytes(info, levels, texels_per_pixel, 0)) << preset;
    // Drivers choose smaller tiles where they waste less; the rest is rounding, and parameters.
    const double most =
        documented_bytes(info, levels, texels_per_pixel, has_tiles ? bytes_of_largest_tile : 0);
    EXPECT_LE(bytes, 1.01 * most + 3 * 16384) << preset;
  }
}

INSTANTIATE_TEST_SUITE_P(Devices, Memory, ::testing::Values("cpu", "vulkan", "cuda"),
                         [](const auto& test) { return std::string(test.param); });

}  // namespace
}  // namespace widestereo::test
