// SPDX-License-Identifier: MIT
// What is read between pixels against the functions that the images are sampled from.
#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::vec2;
using Function = std::function<double(double x, double y)>;

class Interpolated : public ::testing::TestWithParam<Interpolation> {
 protected:
  static constexpr int size = 64;

  Interpolated() : fixture_(fisheye_rig(size), options()) {}

  static Options options() {
    Options options;
    options.interpolation = GetParam();
    return options;
  }

  void fill(const Function& function) {
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        fixture_.view(0).image()(y, x) = static_cast<float>(function(x, y));
      }
    }
    fixture_.interpolate();
  }

  /// At a position in pixels; negative where it is not seen.
  float sample(double x, double y) {
    const vec2 position(static_cast<float>(x), static_cast<float>(y));
    const kernel::cpu::Context context = fixture_.context();
    const kernel::ivec4 of_image = context.parameters.cameras[0].size;
    return kernel::cpu::sample_image(context, 0, of_image,
                                     kernel::cpu::texel_at(context, of_image, position));
  }

  double root_mean_square_error(const Function& function) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> coordinate(3, size - 4);
    double sum = 0;
    constexpr int count = 2000;
    for (int i = 0; i < count; ++i) {
      const double x = coordinate(random);
      const double y = coordinate(random);
      const double error = static_cast<double>(sample(x, y)) - function(x, y);
      sum += error * error / count;
    }
    return std::sqrt(sum);
  }

  KernelFixture fixture_;
};

TEST_P(Interpolated, PixelsKeepTheirIntensitiesAndRampsAreExact) {
  const Function ramp = [](double x, double y) { return 0.1 + 0.007 * x + 0.004 * y; };
  fill(ramp);
  EXPECT_FLOAT_EQ(sample(20, 31), fixture_.view(0).image()(31, 20));
  EXPECT_LT(root_mean_square_error(ramp), 1e-6);
}

TEST_P(Interpolated, CubicFollowsFineTexture) {
  constexpr double per_pixel = 2 * std::numbers::pi / 6;  // waves of 6 pixels
  const Function waves = [](double x, double y) {
    return 0.5 + 0.4 * std::sin(per_pixel * (0.8 * x + 0.6 * y));
  };
  fill(waves);
  const double error = root_mean_square_error(waves);
  if (GetParam() == Interpolation::linear) {
    EXPECT_GT(error, 0.02);
  } else {
    EXPECT_LT(error, 0.01);
  }
}

TEST_P(Interpolated, StaysInRangeBesideASharpEdge) {
  fill([](double x, double) { return x < 30 ? 0.0 : 1.0; });
  for (double x = 26; x < 34; x += 0.25) {
    EXPECT_GE(sample(x, 20), 0) << "a negative intensity would count as masked";
    EXPECT_LE(sample(x, 20), 1);
  }
}

TEST_P(Interpolated, NothingIsSeenBesideMaskedPixelsAndTheBorder) {
  const Function ramp = [](double x, double y) { return 0.1 + 0.007 * x + 0.004 * y; };
  fill(ramp);
  fixture_.view(0).image()(30, 30) = MASKED_INTENSITY;
  fixture_.interpolate();
  for (const auto& [x, y] : {std::pair(29.1, 30.0),
                             {30.9, 30.0},
                             {30.0, 29.1},
                             {29.4, 30.9},
                             {-0.1, 20.0},
                             {63.1, 20.0},
                             {20.0, -0.9},
                             {20.0, 64.0}}) {
    EXPECT_LT(sample(x, y), 0) << x << ", " << y;
  }
  for (const auto& [x, y] : {std::pair(28.99, 30.0),
                             {28.5, 30.3},
                             {31.7, 30.5},
                             {30.4, 28.5},
                             {0.0, 0.0},
                             {0.5, 0.7},
                             {62.5, 63.0},
                             {63.0, 63.0}}) {
    EXPECT_NEAR(static_cast<double>(sample(x, y)), ramp(x, y), 1e-6) << x << ", " << y;
  }
}

/// Rows of rectified cameras lie on each other but for rounding.
TEST_P(Interpolated, PixelsOfTheBorderAreSeenInSpiteOfRounding) {
  const Function ramp = [](double x, double y) { return 0.1 + 0.007 * x + 0.004 * y; };
  fill(ramp);
  for (const double beyond : {0.0, 1e-9, 1e-8, 3e-8, 1e-6, 5e-6}) {
    for (const double at : {0.0, 10.0, 63.0}) {
      for (const double border : {-beyond, 63 + beyond}) {
        EXPECT_NEAR(static_cast<double>(sample(at, border)), ramp(at, border), 1e-5) << beyond;
        EXPECT_NEAR(static_cast<double>(sample(border, at)), ramp(border, at), 1e-5) << beyond;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Methods, Interpolated,
                         ::testing::Values(Interpolation::linear, Interpolation::cubic),
                         [](const auto& test) {
                           return test.param == Interpolation::linear ? "linear" : "cubic";
                         });

}  // namespace
}  // namespace widestereo::test
