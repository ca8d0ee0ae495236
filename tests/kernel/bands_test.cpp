// SPDX-License-Identifier: MIT
// Cutting schedules into bands, which needs no device.
#include "schedule/bands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <vector>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

/// Of views of two sizes.
Schedule small_schedule() {
  Rig rig = fisheye_rig(45);
  rig.views[1].camera = fisheye_camera(38);
  Options options = wide_range();
  options.window_radius = 2;
  options.first_iterations = 2;
  options.second_iterations = 1;
  return make_schedule(rig, options);
}

TEST(Bands, CoverEveryRowOnceAndAddUp) {
  const Schedule schedule = small_schedule();
  for (const long long limit : {1LL, 999LL, 30000LL, 100000000LL}) {
    const std::vector<Band> bands = split_into_bands(schedule, limit);
    std::size_t next = 0;
    for (const Dispatch& dispatch : schedule.dispatches) {
      long long samples = 0;
      int row = 0;
      while (row < dispatch.height) {
        ASSERT_LT(next, bands.size());
        const Band& band = bands[next++];
        ASSERT_EQ(band.dispatch, &dispatch);
        ASSERT_EQ(band.first_row, row);
        ASSERT_GT(band.last_row, row);
        EXPECT_TRUE(band.work <= limit || band.last_row == row + 1);
        samples += band.samples;
        row = band.last_row;
      }
      EXPECT_EQ(row, dispatch.height);
      EXPECT_EQ(samples, dispatch.samples);
    }
    EXPECT_EQ(next, bands.size());
  }
}

TEST(Bands, AreGroupedWithinLimits) {
  const Schedule schedule = small_schedule();
  const std::vector<Band> bands = split_into_bands(schedule, 1000);
  const auto groups = group_for_submission(bands, 5000, 3);
  const Band* next = bands.data();
  for (const auto group : groups) {
    ASSERT_FALSE(group.empty());
    EXPECT_EQ(group.data(), next);
    EXPECT_LE(group.size(), 3u);
    long long work = 0;
    for (const Band& band : group) work += band.work;
    EXPECT_TRUE(work <= 5000 || group.size() == 1);
    next = group.data() + group.size();
  }
  EXPECT_EQ(next, bands.data() + bands.size());
  EXPECT_TRUE(group_for_submission({}, 1, 1).empty());
}

TEST(Bands, AreSharedOutEvenly) {
  const Schedule schedule = small_schedule();
  const std::vector<Band> bands = split_into_bands(schedule, 1000);
  long long total = 0;
  long long largest = 0;
  for (const Band& band : bands) {
    total += band.work;
    largest = std::max(largest, band.work);
  }
  for (const std::size_t count : {1u, 3u, 10u}) {
    const auto shares = share_out(bands, count);
    ASSERT_EQ(shares.size(), count);
    const Band* next = bands.data();
    for (const auto share : shares) {
      EXPECT_EQ(share.data(), next);
      next = share.data() + share.size();
      long long work = 0;
      for (const Band& band : share) work += band.work;
      EXPECT_NEAR(static_cast<double>(work),
                  static_cast<double>(total) / static_cast<double>(count),
                  static_cast<double>(largest));
    }
    EXPECT_EQ(next, bands.data() + bands.size());
  }
  const auto more_than_bands = share_out({bands.data(), 2}, 5);
  ASSERT_EQ(more_than_bands.size(), 5u);
  std::size_t shared = 0;
  for (const auto share : more_than_bands) shared += share.size();
  EXPECT_EQ(shared, 2u);
}

TEST(Bands, OfTheMostWorkAddUp) {
  Options options = Options::preset_named("fast");
  options.pattern = PatchPattern::dense;
  options.window_radius = 15;
  options.sweep_steps = 10000;
  options.levels = 1;
  options.level_iterations = options.level_regressions = {1};
  const Schedule schedule = make_schedule(fisheye_rig(8192), options);
  std::map<const Dispatch*, long long> samples;
  for (const Band& band : split_into_bands(schedule, 1LL << 40)) {
    EXPECT_GE(band.samples, 0);
    EXPECT_GE(band.work, band.samples);
    samples[band.dispatch] += band.samples;
  }
  for (const Dispatch& dispatch : schedule.dispatches) {
    EXPECT_EQ(samples[&dispatch], dispatch.samples) << to_string(dispatch.kernel);
  }
}

TEST(Bands, HoldWholeWorkgroups) {
  const Schedule schedule = make_schedule(fisheye_rig(96), wide_range("fast"));
  constexpr int rows_of_workgroup = 16;
  int cut = 0;
  for (const Band& band : split_into_bands(schedule, 3'000'000)) {
    const int rows = band.last_row - band.first_row;
    if (band.last_row == band.dispatch->height || rows < rows_of_workgroup) continue;
    ++cut;
    EXPECT_EQ(rows % rows_of_workgroup, 0);
  }
  EXPECT_GT(cut, 0);
}

}  // namespace
}  // namespace widestereo::test
