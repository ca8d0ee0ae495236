// SPDX-License-Identifier: MIT
// The counted work of a schedule against what the shared source does when it runs.
#include "schedule/work.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "counting_kernels.h"
#include "schedule/bands.h"

namespace widestereo::test {
namespace {

Camera camera_of(CameraModel model) {
  Camera camera = fisheye_camera(96, 1.2);
  camera.model = model;
  camera.xi = model == CameraModel::double_sphere ? -0.17 : 0.8;
  camera.alpha = 0.59;
  camera.beta = 1.1;
  camera.omega = 0.9;
  camera.k4 = 0.01;
  return camera;
}

/// What evaluating one patch that the source sees whole takes.
counting::Counts run_patch(const Options& options, CameraModel model) {
  Rig rig = fisheye_rig(96);
  for (View& view : rig.views) view.camera = camera_of(model);
  KernelFixture fixture(rig, options);
  fixture.set_reference(0);
  const counting::Context context = counting::context_of(fixture);
  counting::counts = {};
  const counting::Number cost =
      counting::source_cost(context, 1, {48, 49}, counting::vec3(0.1f, 0.05f, 0.4f));
  EXPECT_LT(cost.value, INVALID_COST);
  return counting::counts;
}

TEST(Work, OfPositionsInTexelsIsNothingWhereTextureUnitsTakePixels) {
  for (const PatchWarp warp : {PatchWarp::exact, PatchWarp::affine, PatchWarp::quadratic}) {
    KernelConstants constants{.warp = static_cast<int>(warp),
                              .filter = static_cast<int>(Filter::device),
                              .texels_per_pixel = 2};
    const PatchOperations of_half_pixels = patch_operations(constants);
    constants.texels_per_pixel = 1;
    const PatchOperations of_pixels = patch_operations(constants);
    // Positions of two numbers: the centre's, and those of the map. Where each sample is projected,
    // the camera has its scale: the principal point, and focal lengths and skew.
    EXPECT_EQ(of_half_pixels.of_sample - of_pixels.of_sample, 0);
    EXPECT_EQ(of_half_pixels.of_patch - of_pixels.of_patch,
              warp == PatchWarp::exact ? 7 : (warp == PatchWarp::affine ? 8 : 14));
  }
}

TEST(Work, OfAPatchIsWhatRunningItTakes) {
  for (int model = 0; model < camera_models; ++model) {
    for (const PatchWarp warp : {PatchWarp::exact, PatchWarp::affine, PatchWarp::quadratic}) {
      for (const double weight_scale : {0.0, 12.0}) {
        for (const PatchPattern pattern : {PatchPattern::dense, PatchPattern::checkerboard}) {
          SCOPED_TRACE(testing::Message() << model << static_cast<int>(warp) << weight_scale);
          Options options;
          options.warp = warp;
          options.weight_scale = weight_scale;
          options.pattern = pattern;
          options.window_radius = 3;
          options.interpolation = Interpolation::cubic;
          const counting::Counts run = run_patch(options, static_cast<CameraModel>(model));
          const KernelConstants constants{.camera_model = model,
                                          .window_radius = 3,
                                          .warp = static_cast<int>(warp),
                                          .pattern = static_cast<int>(pattern),
                                          .weighted = weight_scale > 0 ? 1 : 0,
                                          .texels_per_pixel = 2};
          const long long samples = kernel::samples_of_patch(3, static_cast<int>(pattern));
          const PatchOperations expected = patch_operations(constants);
          // Two products with the weight, which compilers leave out where it is one, and of two
          // constants, texels a pixel drawn to the middle.
          const long long left_out = (weight_scale > 0 ? 0 : 2 * samples) + 3;
          EXPECT_EQ(run.operations - left_out, expected.of_sample * samples + expected.of_patch);
          EXPECT_EQ(run.texels, 4 * (samples + 1));  // and the centre's
        }
      }
    }
  }
}

/// What fitting a plane around a pixel takes, and the neighbours that it asks, relative to the
/// pixel.
counting::Counts counts_of_fit(KernelFixture& fixture, cv::Point pixel, int radius, int steps,
                               float tolerance = 1) {
  fixture.set_reference(0);
  fixture.view(0).checks.setTo(cv::Scalar(0.01, 3, 0.5, 0.5));
  fixture.pass().steps = steps;
  fixture.pass().tolerance = tolerance;
  const counting::Context context = counting::context_of(fixture);
  const counting::vec3 ray(0, 0, 1), east(TANGENT_SCALE, 0, 0), south(0, TANGENT_SCALE, 0);
  const counting::LocalPlane guess{0.5f, 0.0f, 0.0f};
  const counting::vec4 own = counting::check_at(context, 0, {pixel.x, pixel.y});
  counting::PlaneFit fit;
  counting::counts = {};
  EXPECT_TRUE(counting::fit_plane(context, {pixel.x, pixel.y}, ray, east, south, own, 0, radius,
                                  guess, fit));
  for (cv::Point& neighbour : counting::counts.checks) neighbour -= pixel;
  return counting::counts;
}

TEST(Work, OfAPlaneFitIsWhatRunningItTakes) {
  KernelFixture fixture(fisheye_rig(96), Options::preset_named("fast"));
  for (const auto& [radius, steps] : {std::pair(1, 4), std::pair(5, 4), std::pair(12, 6)}) {
    SCOPED_TRACE(radius);
    const FitOperations expected;
    const long side = side_of_fit(radius, steps);
    const counting::Counts counts = counts_of_fit(fixture, {48, 48}, radius, steps);
    EXPECT_EQ(counts.operations,
              expected.of_fit + side * (expected.of_row + side * expected.of_neighbour));
    EXPECT_EQ(counts.checks.size(), static_cast<std::size_t>(side * side));
    const counting::Counts later = counts_of_fit(fixture, {48, 48}, radius, steps, 0.6f);
    EXPECT_EQ(later.operations - counts.operations, side * side * expected.of_neighbours_plane);
  }
}

TEST(Work, OfPlaneFitsOfATileReadsSideBySide) {
  KernelFixture fixture(fisheye_rig(96), Options::preset_named("fast"));
  std::set<std::pair<int, int>> places;
  for (int y = 40; y < 48; y += 4) {
    for (int x = 40; x < 56; x += 8) {
      const std::vector<cv::Point> first = counts_of_fit(fixture, {x, y}, 30, 4).checks;
      EXPECT_EQ(counts_of_fit(fixture, {x + 7, y + 3}, 30, 4).checks, first);
      places.emplace(first.front().x, first.front().y);
    }
  }
  EXPECT_GT(places.size(), 2u) << "other tiles' grids lie elsewhere";
}

TEST(Work, OfABandCoversFillsThatReachAcrossTheImage) {
  Options options = Options::preset_named("fast");
  options.fill_radius = 10000;
  const Schedule schedule = make_schedule(fisheye_rig(96), options);
  const std::vector<Band> bands = split_into_bands(schedule, std::numeric_limits<long long>::max());
  const Band& last_fill = *std::find_if(bands.rbegin(), bands.rend(), [](const Band& band) {
    return band.dispatch->kernel == Kernel::fill;
  });
  EXPECT_GE(last_fill.work, 8 * 96 * last_fill.dispatch->pixels);
  EXPECT_LE(last_fill.work, 16 * 96 * last_fill.dispatch->pixels);
}

/// What splitting counts for a dispatch of each kernel, in operations a pixel.
std::map<Kernel, std::vector<double>> operations_of_bands(const Schedule& schedule) {
  std::map<Kernel, std::vector<double>> operations;
  const double of_sample = patch_operations(schedule.constants).of_sample;
  for (const Band& band : split_into_bands(schedule, std::numeric_limits<long long>::max())) {
    operations[band.dispatch->kernel].push_back(of_sample * static_cast<double>(band.work) /
                                                static_cast<double>(band.dispatch->pixels));
  }
  return operations;
}

TEST(Work, OfABandIsThatOfPixelsThatAskTheirWholeNeighbourhood) {
  Options options = Options::preset_named("fast");
  options.regression_steps = 6;
  options.regression_radius = 11;  // four times as much for normals lies in the image
  KernelFixture fixture(fisheye_rig(96), options);
  const std::vector<double> of_bands = operations_of_bands(fixture.schedule()).at(Kernel::regress);
  std::size_t band = 0;
  for (const Dispatch& dispatch : fixture.schedule().dispatches) {
    if (dispatch.kernel != Kernel::regress) continue;
    const double operations = of_bands.at(band++);
    if (dispatch.pass.first_view != 0) continue;  // whose grids the coarse images cut
    const kernel::PassParameters& pass = dispatch.pass;
    const auto rounds = pass.deviation > 0 ? REGRESSION_ROUNDS : NORMAL_ROUNDS;
    const long of_fit = counts_of_fit(fixture, {48, 48}, pass.radius, pass.steps).operations;
    EXPECT_GE(operations, 0.7 * static_cast<double>(rounds * of_fit));
    EXPECT_LE(operations, 3.0 * static_cast<double>(rounds * of_fit));
  }
  EXPECT_EQ(band, of_bands.size());
}

TEST(Work, OfABandGrowsWithTheVoters) {
  const auto of_vote = [](int radius) {
    Options options = Options::preset_named("fast");
    options.vote_radius = radius;
    return operations_of_bands(make_schedule(fisheye_rig(96), options)).at(Kernel::vote).front();
  };
  // Each compares its plane with the pixel's own and 16 others: a difference, its scale, two
  // squares and what is added, five operations or more for each.
  EXPECT_GE(of_vote(30) - of_vote(9), (15 * 21 - 5 * 7) * 17 * 5);
  EXPECT_LE(of_vote(30) - of_vote(9), (15 * 21 - 5 * 7) * 17 * 20);
}

TEST(Work, OfAScheduleAddsUp) {
  Options options = Options::preset_named("paper");
  options.first_iterations = 1;
  options.second_iterations = 0;
  const Schedule schedule = make_schedule(fisheye_rig(64), options);
  const auto is_iterate = [](const Dispatch& d) { return d.kernel == Kernel::iterate; };
  const Dispatch& iterate = *std::ranges::find_if(schedule.dispatches, is_iterate);
  const KernelWork work = work_of(schedule, iterate);
  constexpr double pixels = 64 * 64;
  EXPECT_EQ(work.samples, pixels / 2 * 8 * 121);
  EXPECT_EQ(work.texels, 4 * work.samples);
  const PatchOperations of = patch_operations(schedule.constants);
  EXPECT_EQ(work.operations, pixels / 2 * 8 * (121 * of.of_sample + of.of_patch));
  // Rays, the image, the source's texels, all planes and when they were taken read, one colour's
  // written.
  EXPECT_EQ(work.bytes, pixels * (16 + 4 + 2 + 2 * 16) + pixels / 2 * (2 * 16));
  options.filter = Filter::exact;
  EXPECT_EQ(work_of(make_schedule(fisheye_rig(64), options), iterate).bytes,
            pixels * (16 + 4 + 4 + 2 * 16) + pixels / 2 * (2 * 16));
  options.interpolation = Interpolation::cubic;
  EXPECT_EQ(work_of(make_schedule(fisheye_rig(64), options), iterate).bytes,
            pixels * (16 + 4 + 4 * 4 + 2 * 16) + pixels / 2 * (2 * 16));
  for (const Dispatch& dispatch : schedule.dispatches) {
    EXPECT_GT(work_of(schedule, dispatch).bytes, 0) << to_string(dispatch.kernel);
  }
}

TEST(Work, OfASubPixelMatchIsAPatchInEachSource) {
  Rig rig = fisheye_rig(64);
  rig.views.push_back(rig.views[1]);
  rig.views[2].world_from_camera.translation().y() += 0.1;
  const Schedule schedule = make_schedule(rig, Options::preset_named("fast"));
  const KernelConstants& constants = schedule.constants;
  const long long samples = kernel::samples_of_patch(constants.window_radius, constants.pattern);
  int matches = 0;
  for (const Dispatch& dispatch : schedule.dispatches) {
    if (dispatch.kernel == Kernel::subpixel) {
      EXPECT_EQ(dispatch.samples, 2 * dispatch.pixels * samples);
      matches += dispatch.views;
    }
    if (dispatch.kernel == Kernel::sweep) {
      EXPECT_EQ(dispatch.samples % (2 * dispatch.pixels * samples), 0);
    }
  }
  EXPECT_EQ(matches, 3 * 3) << "one for each view and level";
}

}  // namespace
}  // namespace widestereo::test
