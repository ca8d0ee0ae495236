// SPDX-License-Identifier: MIT
#include "schedule/schedule.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
#include <set>

#include "error_of.h"
#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

Rig rig_of(std::size_t count, int size = 64) {
  Rig rig = fisheye_rig(size);
  while (rig.views.size() < count) {
    View view = rig.views.back();
    view.world_from_camera.translation().x() += 0.1;
    rig.views.push_back(view);
  }
  return rig;
}

int levels_of(const Rig& rig, const Options& options) {
  return static_cast<int>(make_schedule(rig, options).views.size() / rig.views.size());
}

TEST(Levels, Leave40PixelsInTheSmallestImageUnlessListsAskForMore) {
  Options options = Options::preset_named("fast");
  const auto levels = [&options](int width, int height) {
    Rig rig = fisheye_rig(2048);
    rig.views[1].camera.width = width;
    rig.views[1].camera.height = height;
    return levels_of(rig, options);
  };
  EXPECT_EQ(levels(64, 64), 3);
  EXPECT_EQ(levels(512, 319), 3);
  EXPECT_EQ(levels(512, 320), 4);
  EXPECT_EQ(levels(512, 512), 4);
  EXPECT_EQ(levels(639, 640), 4);
  EXPECT_EQ(levels(640, 640), 5);
  EXPECT_EQ(levels(2048, 2048), 6);
  options.level_iterations = {1};
  options.level_regressions = {0, 1};
  EXPECT_EQ(levels(64, 64), 2);
  EXPECT_EQ(levels(1280, 1024), 5);
  options.levels = 2;
  EXPECT_EQ(levels(1280, 1024), 2);
  options.levels = 5;
  EXPECT_EQ(levels(64, 64), 5);
  EXPECT_EQ(levels_of(fisheye_rig(512), Options::preset_named("paper")), 1);
}

TEST(Levels, AreFewerForManyViews) {
  const Options options = Options::preset_named("fast");
  for (const auto& [views, levels] :
       {std::pair(8, 6), {9, 5}, {10, 4}, {12, 4}, {13, 3}, {15, 3}}) {
    EXPECT_EQ(levels_of(rig_of(static_cast<std::size_t>(views), 2048), options), levels) << views;
  }
}

TEST(Levels, TakeTheListsNumbersFromTheFinestOn) {
  Options options = Options::preset_named("fast");
  options.levels = 4;
  options.level_iterations = {3, 1};
  options.level_regressions = {2};
  std::map<int, int> searches;
  std::map<int, int> regressions;
  for (const Dispatch& dispatch : make_schedule(rig_of(2), options).dispatches) {
    const int level = dispatch.pass.first_view / 2;
    if (dispatch.kernel == Kernel::search && dispatch.pass.colour == 0) ++searches[level];
    // Those of normals alone, once more at the end, are not asked for precision.
    if (dispatch.kernel == Kernel::regress && dispatch.pass.deviation > 0) ++regressions[level];
  }
  EXPECT_EQ(searches, (std::map<int, int>{{0, 1}, {1, 3}, {2, 3}, {3, 3}}));
  EXPECT_EQ(regressions, (std::map<int, int>{{0, 2}, {1, 2}, {2, 2}, {3, 2}}));
}

TEST(OtherSurfaces, AreLookedForOnceAtEveryLevelButTheCoarsest) {
  std::map<int, int> searches;
  for (const Dispatch& dispatch :
       make_schedule(rig_of(2), Options::preset_named("fast")).dispatches) {
    if (dispatch.kernel != Kernel::search || dispatch.pass.colour != 0) continue;
    if ((dispatch.pass.candidates & 1u << CANDIDATE_OTHER_SURFACE) == 0) continue;
    EXPECT_EQ(dispatch.pass.iteration, 1);
    ++searches[dispatch.pass.first_view / 2];
  }
  const int levels = levels_of(rig_of(2), Options::preset_named("fast"));
  EXPECT_EQ(searches.size(), static_cast<std::size_t>(levels - 1));
  for (const auto& [level, times] : searches) EXPECT_EQ(times, 1) << level;
  EXPECT_FALSE(searches.contains(levels - 1));
}

TEST(ViewLimit, CountsImagesAndTheViewsOfAllLevels) {
  const Options three_levels = Options::preset_named("quality");
  EXPECT_EQ(make_schedule(rig_of(15), three_levels).views.size(), 45u);
  EXPECT_THAT(error_of([&] { make_schedule(rig_of(16), three_levels); }),
              AllOf(HasSubstr("16 views, but 3 pyramid level(s) allow 15"),
                    HasSubstr("fewer images"), Not(HasSubstr("choose"))));
  EXPECT_NE(error_of([&] { make_warm_schedule(rig_of(16), three_levels); }), "");
  Options four_levels = three_levels;
  four_levels.levels = 4;
  EXPECT_EQ(make_schedule(rig_of(12), four_levels).views.size(), 48u);
  EXPECT_THAT(error_of([&] { make_schedule(rig_of(13), four_levels); }),
              AllOf(HasSubstr("13 views, but 4 pyramid level(s) allow 12"),
                    HasSubstr("choose 3 level(s) with no more level iterations")));
  const Options one_level = Options::preset_named("paper");
  EXPECT_EQ(make_schedule(rig_of(15), one_level).views.size(), 15u);
  EXPECT_THAT(
      error_of([&] { make_schedule(rig_of(16), one_level); }),
      AllOf(HasSubstr("16 views, but 1 pyramid level(s) allow 15"), Not(HasSubstr("choose"))));
  Rig one = rig_of(2);
  one.views.pop_back();
  EXPECT_THAT(error_of([&] { make_schedule(one, one_level); }), HasSubstr("1 view(s)"));
}

TEST(ImageSize, LeavesRoomForPatches) {
  Options options = Options::preset_named("fast");
  options.window_radius = 15;
  EXPECT_EQ(error_of([&] { make_schedule(fisheye_rig(32), options); }), "");
  EXPECT_THAT(error_of([&] { make_schedule(fisheye_rig(31), options); }),
              HasSubstr("31x31 pixels; patches of radius 15 need 32 both ways"));
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
  using ::testing::Each;
  using ::testing::SizeIs;
  const Rig rig = rig_of(3);
  const Options fast = Options::preset_named("fast");
  EXPECT_THAT(single_launches(make_schedule(rig, fast)), SizeIs(0));
  // Planes that move on share the transfer buffers.
  EXPECT_THAT(single_launches(make_warm_schedule(rig, fast)), SizeIs(3 * 4));
  // The last iteration tries the other views' planes; two colours.
  const Options quality = Options::preset_named("quality");
  EXPECT_THAT(single_launches(make_schedule(rig, quality)),
              AllOf(SizeIs(3 * 2), Each(Kernel::search)));
}

/// Passes of a kernel, over the first view where each view has its own.
std::vector<kernel::PassParameters> passes(const Schedule& schedule, Kernel kernel) {
  std::vector<kernel::PassParameters> all;
  for (const Dispatch& dispatch : schedule.dispatches) {
    if (dispatch.kernel == kernel && dispatch.pass.reference == dispatch.pass.first_view) {
      all.push_back(dispatch.pass);
    }
  }
  return all;
}

TEST(Passes, OfTheSearchTakeBothColoursAndHalveTheirSteps) {
  Options options = Options::preset_named("fast");
  options.level_iterations = {1, 2, 3};
  const auto all = passes(make_schedule(rig_of(2), options), Kernel::search);
  const std::vector<double> shares = {1, 1, 0.5, 1, 0.5, 0.25};  // levels from the coarsest on
  ASSERT_EQ(all.size(), 2 * shares.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].colour, static_cast<int>(i % 2));
    EXPECT_FLOAT_EQ(all[i].step_pixels, static_cast<float>(options.step_pixels * shares[i / 2]));
    EXPECT_FLOAT_EQ(all[i].step_normal, static_cast<float>(options.step_normal * shares[i / 2]));
  }
}

TEST(Passes, OfTheSearchMayTakeFarPlanesAndNearOnesByTurns) {
  Options options = Options::preset_named("fast");
  for (const bool alternate : {false, true}) {
    options.alternate_strips = alternate;
    const auto all = passes(make_schedule(rig_of(2), options), Kernel::search);
    ASSERT_EQ(all.size(), 3u * 2 * 2);
    for (std::size_t i = 0; i < all.size(); ++i) {
      const bool coarsest = i < 4;
      const bool second = i / 2 % 2 == 1;
      EXPECT_EQ((all[i].candidates >> STRIP_UP & 1u) != 0, coarsest || !alternate || second) << i;
      EXPECT_EQ((all[i].candidates >> (NEAR_STRIPS + STRIP_UP) & 1u) != 0,
                coarsest || !alternate || !second)
          << i;
    }
  }
}

TEST(Passes, OfAWarmSearchBringPlanesFromAllSides) {
  const auto all =
      passes(make_warm_schedule(rig_of(2), Options::preset_named("fast")), Kernel::search);
  unsigned candidates = 0;
  for (const kernel::PassParameters& pass : all) candidates |= pass.candidates;
  for (const int strip : {STRIP_UP, STRIP_DOWN, STRIP_LEFT, STRIP_RIGHT}) {
    EXPECT_NE(candidates & 1u << strip, 0u) << strip;
  }
}

TEST(Passes, OfTheRegressionAskForMoreFromRoundToRound) {
  const Options options = Options::preset_named("quality");
  const auto all = passes(make_schedule(rig_of(2), options), Kernel::regress);
  const std::vector<double> shares = {1, 1, 0.6, 1, 0.6, 0.36, 0};       // at last normals alone
  const std::vector<double> tolerances = {1, 1, 1, 1, 0.6, 0.36, 0.36};  // less on the finest level
  ASSERT_EQ(all.size(), shares.size());
  std::set<int> draws;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_FLOAT_EQ(all[i].deviation, static_cast<float>(options.regression_precision * shares[i]));
    EXPECT_FLOAT_EQ(all[i].tolerance, static_cast<float>(tolerances[i]));
    EXPECT_EQ(all[i].radius, (shares[i] > 0 ? 1 : 4) * options.regression_radius);
    draws.insert(all[i].iteration);
  }
  EXPECT_EQ(draws.size(), all.size()) << "each has grids of its own";
}

TEST(Passes, OfNormalsComeLastAndMayBeVotedOn) {
  const auto last_kernels = [](bool vote) {
    Options options = Options::preset_named("fast");
    options.normal_vote = vote;
    std::vector<Kernel> kernels;
    for (const Dispatch& dispatch : make_schedule(rig_of(2), options).dispatches) {
      if (dispatch.kernel == Kernel::measure) kernels.clear();
      kernels.push_back(dispatch.kernel);
    }
    return kernels;
  };
  using ::testing::ElementsAre;
  EXPECT_THAT(last_kernels(true),
              ElementsAre(Kernel::measure, Kernel::regress, Kernel::adopt_point,
                          Kernel::vote_normal, Kernel::adopt, Kernel::structure, Kernel::check));
  EXPECT_THAT(last_kernels(false), ElementsAre(Kernel::measure, Kernel::regress, Kernel::adopt,
                                               Kernel::structure, Kernel::check));
}

/// Normals are those of merged distances; until then each view's planes are its own.
TEST(Passes, MergeTheViewsOnceAfterTheLastVoteAndBeforeNormals) {
  const Rig rig = rig_of(2);
  const auto around_merge = [](const Schedule& schedule) {
    std::vector<Kernel> kernels;
    for (std::size_t i = 0; i < schedule.dispatches.size(); ++i) {
      if (schedule.dispatches[i].kernel != Kernel::merge) continue;
      EXPECT_EQ(schedule.dispatches[i].views, 2) << "at once, as each reads the other's planes";
      for (std::size_t j = i - 2; j <= i + 2; ++j) {
        kernels.push_back(schedule.dispatches[j].kernel);
      }
    }
    return kernels;
  };
  using ::testing::ElementsAre;
  using ::testing::IsEmpty;
  for (const char* preset : {"fast", "quality"}) {
    Options options = Options::preset_named(preset);
    EXPECT_THAT(around_merge(make_schedule(rig, options)),
                ElementsAre(Kernel::vote, Kernel::adopt_point, Kernel::merge, Kernel::adopt,
                            Kernel::measure));
    EXPECT_THAT(around_merge(make_warm_schedule(rig, options)),
                ElementsAre(Kernel::vote, Kernel::adopt_point, Kernel::merge, Kernel::adopt,
                            Kernel::structure));
    options.merge_views = false;
    EXPECT_THAT(around_merge(make_schedule(rig, options)), IsEmpty());
    EXPECT_THAT(around_merge(make_warm_schedule(rig, options)), IsEmpty());
  }
  EXPECT_THAT(around_merge(make_schedule(rig, Options::preset_named("paper"))), IsEmpty());
}

TEST(Passes, OfRepairsSpareMatchesAndThoseOfTheFillingDoNot) {
  Options options = Options::preset_named("fast");
  options.fill_radius = 20;
  const auto all = passes(make_schedule(rig_of(2), options), Kernel::adopt_fill);
  ASSERT_EQ(all.size(), 4u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(all[i].radius, options.repair_radius);
    EXPECT_EQ(all[i].candidates, REASON_NO_RAY | REASON_NO_OVERLAP | FILL_WITH_MATCHES);
  }
  EXPECT_EQ(all[3].radius, options.fill_radius);
  EXPECT_EQ(all[3].candidates, static_cast<unsigned>(REASON_NO_RAY)) << "also what has no overlap";
}

TEST(Passes, InRasterOrderComeFromEitherSideByTurns) {
  Options options = Options::preset_named("paper");
  options.propagation = Propagation::raster;
  options.first_iterations = 4;
  options.second_iterations = 0;
  const auto all = passes(make_schedule(rig_of(2), options), Kernel::iterate_raster);
  ASSERT_EQ(all.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(all[i].neighbours,
              i % 2 == 0 ? NEIGHBOUR_LEFT | NEIGHBOUR_UP : NEIGHBOUR_RIGHT | NEIGHBOUR_DOWN);
  }
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

TEST(WarmRegressions, AreOverHalfTheNeighboursAndTheLastOneFindsNormals) {
  for (const auto& [preset, steps] : {std::pair("fast", 2), {"quality", 4}}) {
    Options options = Options::preset_named(preset);
    options.warm_regressions = 3;
    const auto all = passes(make_warm_schedule(rig_of(2), options), Kernel::regress);
    ASSERT_EQ(all.size(), 3u);
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ((all[i].candidates & REGRESS_NORMALS) != 0, i == 2);
      EXPECT_EQ(all[i].steps, steps);
    }
  }
}

TEST(Votes, HaveGridsThatLieElsewhereEachTime) {
  const auto all = passes(make_schedule(rig_of(2), Options::preset_named("fast")), Kernel::vote);
  std::set<int> iterations;
  for (const kernel::PassParameters& pass : all) iterations.insert(pass.iteration);
  EXPECT_GT(all.size(), 1u);
  EXPECT_EQ(iterations.size(), all.size());
}

}  // namespace
}  // namespace widestereo::test
