// SPDX-License-Identifier: MIT
#include "widestereo/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include "error_of.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string error_of_options(const Options& options) {
  return error_of([&] { validate(options); });
}

/// JSON, in which numbers are printed, has a null for them.
TEST(Options, NumbersThatAreNotFiniteAreNamed) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto error = [](double Options::*option, double value) {
    Options options;
    options.*option = value;
    return error_of_options(options);
  };
  EXPECT_THAT(error(&Options::max_cost, std::numeric_limits<double>::quiet_NaN()),
              HasSubstr("The option max cost is NaN (not a number); it must lie between 0.0"));
  EXPECT_THAT(error(&Options::min_parallax, infinity), HasSubstr("min parallax is infinity;"));
  EXPECT_THAT(error(&Options::max_tilt, -infinity), HasSubstr("max tilt is minus infinity;"));
  EXPECT_THAT(error(&Options::max_distance, infinity), HasSubstr("to infinity m is not usable"));
}

/// In single precision, as kernels have them: confidences would be no numbers.
TEST(Options, NearestAndFarthestDistanceMustDiffer) {
  const auto error = [](double farthest) {
    Options options;
    options.min_distance = 2;
    options.max_distance = farthest;
    return error_of_options(options);
  };
  EXPECT_EQ(error(2.0001), "");
  for (const double farthest : {1.0, 2.0, 2.00000001}) {
    EXPECT_THAT(error(farthest), HasSubstr("is not usable: give a nearest distance and a larger"));
  }
}

TEST(Options, RasterOrderBelongsToTheRandomSearch) {
  Options options = Options::preset_named("fast");
  options.propagation = Propagation::raster;
  EXPECT_THAT(error_of_options(options), HasSubstr("checkerboard propagation"));
  options.search = SearchMethod::random;
  EXPECT_EQ(error_of_options(options), "");
}

TEST(Options, WholeNumbersArePrintedAsSuch) {
  Options options;
  options.levels = -1;
  EXPECT_EQ(error_of_options(options), "The option levels is -1; it must lie between 0 and " +
                                           std::to_string(Options::most_levels) + ".");
}

TEST(Options, NumbersThatNoEnumeratorHasAreNamed) {
  const auto expect_refused = [](auto option, int count, const std::string& name) {
    using Enumeration = std::remove_reference_t<decltype(Options().*option)>;
    Options options;
    for (int i = 0; i < count; ++i) {
      options.*option = static_cast<Enumeration>(i);
      EXPECT_EQ(error_of_options(options), "") << name << i;
    }
    for (const int unknown : {-1, count, 1000}) {
      options.*option = static_cast<Enumeration>(unknown);
      EXPECT_THAT(error_of_options(options), StartsWith("The option " + name + " is " +
                                                        std::to_string(unknown) + ", which no"));
    }
  };
  expect_refused(&Options::search, 2, "search");
  expect_refused(&Options::warp, 3, "warp");
  expect_refused(&Options::sampling, 2, "sampling");
  expect_refused(&Options::propagation, 2, "propagation");
  expect_refused(&Options::pattern, 2, "pattern");
  expect_refused(&Options::interpolation, 2, "interpolation");
  expect_refused(&Options::filter, 2, "filter");
}

TEST(Options, NamesThatAreNoUtf8AreReplacedInJson) {
  Options options;
  options.preset = "\xff";
  EXPECT_THAT(to_json(options), HasSubstr("\"preset\": \"\xef\xbf\xbd\""));
}

template <class T>
struct Range {
  const char* name;
  T Options::*option;
  T least, most;
};

const std::vector<Range<int>> whole_numbers = {
    {"window radius", &Options::window_radius, 1, 15},
    {"first iterations", &Options::first_iterations, 1, 100000},
    {"second iterations", &Options::second_iterations, 0, 100000},
    {"refinements", &Options::refinements, 0, 16},
    {"best sources", &Options::best_sources, 1, 8},
    {"sweep steps", &Options::sweep_steps, 1, 10000},
    {"coarse planes", &Options::coarse_planes, 1, 4},
    {"regression radius", &Options::regression_radius, 2, 64},
    {"regression steps", &Options::regression_steps, 1, 16},
    {"warm iterations", &Options::warm_iterations, 0, 100000},
    {"warm regressions", &Options::warm_regressions, 0, 1000},
    {"vote radius", &Options::vote_radius, 0, 64},
    {"repair radius", &Options::repair_radius, 0, 10000},
    {"fill radius", &Options::fill_radius, 0, 10000}};

const std::vector<Range<double>> numbers = {
    {"weight scale", &Options::weight_scale, 0, 10000},
    {"regression scale", &Options::regression_scale, 0.1, 10000},
    {"regression precision", &Options::regression_precision, 1e-6, 1000},
    {"step pixels", &Options::step_pixels, 0, 1000},
    {"step normal", &Options::step_normal, 0, 2},
    {"max gain", &Options::max_gain, 1, 1000},
    {"min texture", &Options::min_texture, 0, 255},
    {"min visible", &Options::min_visible, 0.01, 1},
    {"consistency (relative)", &Options::consistency_relative, 0, 999},
    {"consistency (pixels)", &Options::consistency_pixels, 0, 999},
    {"max cost", &Options::max_cost, 0, 2},
    {"min parallax", &Options::min_parallax, 0, 10000},
    {"max tilt", &Options::max_tilt, 0, 90},
    {"min support", &Options::min_support, 0, 1},
    {"min confidence", &Options::min_confidence, 0, 1},
    {"ambiguity margin", &Options::ambiguity_margin, 0, 2},
    {"far preference", &Options::far_preference, 0, 1}};

TEST(Options, ReachToTheirLimitsAndNoFarther) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const auto expect = [](const auto& range, auto below, auto above) {
    const auto error = [&range](auto value) {
      Options options;
      options.*range.option = value;
      return error_of_options(options);
    };
    EXPECT_EQ(error(range.least), "");
    EXPECT_EQ(error(range.most), "");
    const std::string begin = "The option " + std::string(range.name) + " is ";
    EXPECT_THAT(error(below), StartsWith(begin));
    EXPECT_THAT(error(above), StartsWith(begin));
  };
  for (const Range<int>& range : whole_numbers) {
    expect(range, range.least - 1, range.most + 1);
  }
  for (const Range<double>& range : numbers) {
    expect(range, std::nextafter(range.least, -infinity), std::nextafter(range.most, infinity));
  }
}

TEST(Options, DistancesAreARange) {
  const auto error = [](double nearest, double farthest) {
    Options options;
    options.min_distance = nearest;
    options.max_distance = farthest;
    return error_of_options(options);
  };
  EXPECT_EQ(error(Options::least_distance, Options::most_distance), "");
  for (const auto& [nearest, farthest] : {std::pair(0.9 * Options::least_distance, 1.0),
                                          {1.0, 1.1 * Options::most_distance},
                                          {2.0, 2.0},
                                          {2.0, 1.0},
                                          {-1.0, 1.0}}) {
    EXPECT_THAT(error(nearest, farthest), HasSubstr("m is not usable")) << nearest << farthest;
  }
}

TEST(Options, HaveNumbersForLevels) {
  for (const auto& [list, name] : {std::pair(&Options::level_iterations, "level iterations"),
                                   {&Options::level_regressions, "level regressions"}}) {
    const auto error = [list = list](std::vector<int> of_levels, int levels = 0) {
      Options options;
      options.level_iterations = options.level_regressions = {1};
      options.levels = levels;
      options.*list = std::move(of_levels);
      return error_of_options(options);
    };
    EXPECT_EQ(error({0, 1000, 1}), "");
    EXPECT_EQ(error({0, 1000, 1}, 3), "");
    EXPECT_EQ(error({1}, 3), "");
    EXPECT_EQ(error(std::vector<int>(Options::most_levels, 1)), "");
    const std::string option = "The option " + std::string(name);
    EXPECT_THAT(error({1, -1, 1}), StartsWith(option + " is -1"));
    EXPECT_THAT(error({1, 1, 1001}), StartsWith(option + " is 1001"));
    EXPECT_THAT(error({1, 1, 1}, 2), StartsWith(option + " has 3 numbers; give 1 to 2, "));
    EXPECT_THAT(error({}), StartsWith(option + " has 0 numbers; give 1 to 8, "));
    EXPECT_THAT(error(std::vector<int>(9, 1)), StartsWith(option + " has 9 numbers; give 1 to 8"));
  }
  for (int levels = -1; levels <= 9; ++levels) {
    Options options;
    options.levels = levels;
    options.level_iterations = options.level_regressions = {1};
    const std::string error = error_of_options(options);
    if (levels >= 0 && levels <= 8) {
      EXPECT_EQ(error, "");
    } else {
      EXPECT_THAT(error, StartsWith("The option levels is "));
    }
  }
}

}  // namespace
}  // namespace widestereo::test
