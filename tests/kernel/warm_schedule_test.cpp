// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

long long samples_of(const Schedule& schedule) {
  long long samples = 0;
  for (const Dispatch& dispatch : schedule.dispatches) samples += dispatch.samples;
  return samples;
}

TEST(WarmSchedule, CostsAtMostAQuarterOfAColdOne) {
  const Rig rig = fisheye_rig(64);
  for (const std::string& preset : Options::preset_names()) {
    SCOPED_TRACE(preset);
    const Options options = Options::preset_named(preset);
    EXPECT_LE(4 * samples_of(make_warm_schedule(rig, options)),
              samples_of(make_schedule(rig, options)));
  }
}

TEST(WarmSchedule, RunsOnWhatAColdOneNeeds) {
  const Rig rig = fisheye_rig(64);
  for (const std::string& preset : Options::preset_names()) {
    const Options options = Options::preset_named(preset);
    const Schedule cold = make_schedule(rig, options);
    const Schedule warm = make_warm_schedule(rig, options);
    EXPECT_EQ(warm.constants, cold.constants);
    EXPECT_EQ(warm.views.size(), cold.views.size());
    EXPECT_EQ(warm.dispatches.front().kernel, Kernel::interpolate);
    EXPECT_EQ(warm.dispatches.back().kernel, cold.dispatches.back().kernel);
    for (const Dispatch& dispatch : warm.dispatches) {
      EXPECT_LT(dispatch.pass.reference, 2) << "no coarser levels";
      EXPECT_EQ(dispatch.pass.other, dispatch.pass.reference);
    }
  }
}

/// A search that does not vote leaves planes with the costs that they started with.
TEST(WarmSchedule, PlanesStartWithoutCostsWhereVotesGiveThem) {
  const auto starts_with_costs = [](const Options& options) {
    const Schedule warm = make_warm_schedule(fisheye_rig(64), options);
    const auto runs = [&warm](Kernel kernel) {
      return std::any_of(warm.dispatches.begin(), warm.dispatches.end(),
                         [kernel](const Dispatch& dispatch) { return dispatch.kernel == kernel; });
    };
    EXPECT_NE(runs(Kernel::renew), runs(Kernel::renew_point));
    return runs(Kernel::renew);
  };
  EXPECT_FALSE(starts_with_costs(Options::preset_named("fast")));
  EXPECT_FALSE(starts_with_costs(Options::preset_named("quality")));
  EXPECT_TRUE(starts_with_costs(Options::preset_named("paper")));
  Options options = Options::preset_named("fast");
  options.vote_radius = 0;
  EXPECT_TRUE(starts_with_costs(options));
  options = Options::preset_named("fast");
  options.warm_regressions = 0;
  EXPECT_TRUE(starts_with_costs(options));
}

TEST(WarmSchedule, MotionChangesParametersOnly) {
  const Rig rig = fisheye_rig(64);
  const Schedule still = make_warm_schedule(rig, Options::preset_named("fast"));
  Schedule moved = still;
  const Eigen::Isometry3d motion(Eigen::Translation3d(0.1, 0.2, 0.3));
  set_motion(moved, rig, motion, 3);
  EXPECT_EQ(moved.parameters.frame.x, 3);
  // Camera 0 is the rig's frame.
  const kernel::ViewPair& own = moved.parameters.pairs[0];
  EXPECT_FLOAT_EQ(own.row0.w, 0.1f);
  EXPECT_FLOAT_EQ(own.row2.w, 0.3f);
  EXPECT_EQ(
      std::memcmp(&moved.parameters.pairs[1], &still.parameters.pairs[1], sizeof(kernel::ViewPair)),
      0);
  ASSERT_EQ(moved.dispatches.size(), still.dispatches.size());
  for (std::size_t i = 0; i < still.dispatches.size(); ++i) {
    const Dispatch &a = moved.dispatches[i], &b = still.dispatches[i];
    EXPECT_TRUE(a.kernel == b.kernel && a.over == b.over && a.views == b.views &&
                std::memcmp(&a.pass, &b.pass, sizeof a.pass) == 0)
        << "dispatch " << i;
  }
}

}  // namespace
}  // namespace widestereo::test
