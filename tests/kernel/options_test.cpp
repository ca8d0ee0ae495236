// SPDX-License-Identifier: MIT
#include "widestereo/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "error_of.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;

/// JSON, in which numbers are printed, has a null for them.
TEST(Options, NumbersThatAreNotFiniteAreNamed) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto error = [](double Options::*option, double value) {
    Options options;
    options.*option = value;
    return error_of([&] { validate(options); });
  };
  EXPECT_THAT(error(&Options::max_cost, std::numeric_limits<double>::quiet_NaN()),
              HasSubstr("The option max cost is NaN (not a number); it must lie between 0.0"));
  EXPECT_THAT(error(&Options::min_parallax, infinity), HasSubstr("min parallax is infinity;"));
  EXPECT_THAT(error(&Options::max_tilt, -infinity), HasSubstr("max tilt is minus infinity;"));
  EXPECT_THAT(error(&Options::max_distance, infinity), HasSubstr("to infinity m is not usable"));
}

TEST(Options, RasterOrderBelongsToTheRandomSearch) {
  Options options = Options::preset_named("fast");
  options.propagation = Propagation::raster;
  EXPECT_THAT(error_of([&] { validate(options); }), HasSubstr("checkerboard propagation"));
  options.search = SearchMethod::random;
  EXPECT_EQ(error_of([&] { validate(options); }), "");
}

}  // namespace
}  // namespace widestereo::test
