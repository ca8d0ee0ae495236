// SPDX-License-Identifier: MIT
#include "schedule/schedule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.h"
#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Rig rig_of(std::size_t count) {
  Rig rig = fisheye_rig(64);
  while (rig.views.size() < count) {
    View view = rig.views.back();
    view.world_from_camera.translation().x() += 0.1;
    rig.views.push_back(view);
  }
  return rig;
}

TEST(ViewLimit, CountsImagesAndTheViewsOfAllLevels) {
  const Options three_levels = Options::preset_named("quality");
  EXPECT_EQ(make_schedule(rig_of(15), three_levels).views.size(), 45u);
  EXPECT_THAT(error_of([&] { make_schedule(rig_of(16), three_levels); }),
              AllOf(HasSubstr("16 views, but 3 pyramid level(s) allow 15"),
                    HasSubstr("fewer images"), Not(HasSubstr("--levels"))));
  EXPECT_NE(error_of([&] { make_warm_schedule(rig_of(16), three_levels); }), "");
  Options four_levels = three_levels;
  four_levels.levels = 4;
  four_levels.level_iterations.insert(four_levels.level_iterations.begin(), 1);
  four_levels.level_regressions.insert(four_levels.level_regressions.begin(), 0);
  EXPECT_EQ(make_schedule(rig_of(12), four_levels).views.size(), 48u);
  EXPECT_THAT(
      error_of([&] { make_schedule(rig_of(13), four_levels); }),
      AllOf(HasSubstr("13 views, but 4 pyramid level(s) allow 12"), HasSubstr("--levels 3 ")));
  const Options one_level = Options::preset_named("paper");
  EXPECT_EQ(make_schedule(rig_of(15), one_level).views.size(), 15u);
  EXPECT_THAT(
      error_of([&] { make_schedule(rig_of(16), one_level); }),
      AllOf(HasSubstr("16 views, but 1 pyramid level(s) allow 15"), Not(HasSubstr("--levels"))));
  Rig one = rig_of(2);
  one.views.pop_back();
  EXPECT_THAT(error_of([&] { make_schedule(one, one_level); }), HasSubstr("1 view(s)"));
}

/// Launches of one view each.
std::vector<Kernel> single_launches(const Schedule& schedule) {
  std::vector<Kernel> kernels;
  for (const Dispatch& dispatch : schedule.dispatches) {
    EXPECT_TRUE(dispatch.views == 1 || dispatch.over == dispatch.pass.reference);
    if (dispatch.views == 1) kernels.push_back(dispatch.kernel);
  }
  return kernels;
}

TEST(Launches, RunOverAllViewsOfALevelWhereTheseDoNotReadEachOther) {
  using ::testing::AnyOf;
  using ::testing::Each;
  using ::testing::SizeIs;
  const Rig rig = rig_of(3);
  const Options fast = Options::preset_named("fast");
  // At full size, views are measured against those before that are regressed already; three rounds,
  // the first with a sub-pixel match.
  const auto of_regression =
      AnyOf(Kernel::measure, Kernel::subpixel, Kernel::regress, Kernel::adopt_point);
  EXPECT_THAT(single_launches(make_schedule(rig, fast)),
              AllOf(SizeIs(3 * (3 * 3 + 1)), Each(of_regression)));
  // Planes that move on share the transfer buffers.
  EXPECT_THAT(single_launches(make_warm_schedule(rig, fast)), SizeIs(3 * 4));
  // All but the first iteration try the other views' planes; two colours.
  const Options quality = Options::preset_named("quality");
  EXPECT_THAT(single_launches(make_schedule(rig, quality)),
              AllOf(SizeIs(3 * (3 * 3 + 1 + 2 * (3 * 2 - 1))),
                    Each(AnyOf(of_regression, Kernel::search))));
}

TEST(Checks, AmbiguityIsLookedForOnceAndOnlyWhereItIsAskedFor) {
  const auto kernels = [](const Schedule& schedule) {
    std::vector<Kernel> all;
    for (const Dispatch& dispatch : schedule.dispatches) all.push_back(dispatch.kernel);
    return all;
  };
  Options options = Options::preset_named("fast");
  EXPECT_THAT(kernels(make_schedule(rig_of(2), options)), Not(Contains(Kernel::ambiguity)));
  options.ambiguity_margin = 0.2;
  options.fill_radius = 32;
  for (const Schedule& schedule :
       {make_schedule(rig_of(2), options), make_warm_schedule(rig_of(2), options)}) {
    const std::vector<Kernel> all = kernels(schedule);
    EXPECT_THAT(all, Contains(Kernel::ambiguity).Times(1));
    EXPECT_THAT(std::vector<Kernel>(all.end() - 4, all.end()),
                ElementsAre(Kernel::check, Kernel::ambiguity, Kernel::fill, Kernel::adopt_fill));
  }
}

}  // namespace
}  // namespace widestereo::test
