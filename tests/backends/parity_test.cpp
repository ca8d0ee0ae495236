// SPDX-License-Identifier: MIT
// Every back end must compute what the CPU reference computes: single steps to rounding, whole
// matches by statistics (PatchMatch turns rounding differences into different winners at ties).
#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>

#include "backend_fixture.h"
#include "data_folder.h"
#include "device_fixture.h"
#include "geometry/camera_parameters.h"
#include "kernel/kernel_fixture.h"
#include "match_fixture.h"
#include "matching/backend.h"
#include "non_occluded.h"
#include "same_bits.h"
#include "statistics/percentile.h"
#include "widestereo/calibration.h"
#include "widestereo/image_io.h"
#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

constexpr const char* other_devices[] = {"vulkan", "cuda"};

/// Of the same answer everywhere.
Options exact(Options options) {
  options.filter = Filter::exact;
  return options;
}

Options small_options() {
  Options options;
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.window_radius = 3;
  options.first_iterations = 4;
  options.second_iterations = 3;
  return options;
}

/// Ties and failures differ; where both are sure of themselves their distances must agree.
void expect_agreement(const ViewResult& expected, const ViewResult& actual, double tolerance) {
  const cv::Mat sure = (expected.reasons == 0) & (actual.reasons == 0);
  cv::Mat difference;
  cv::absdiff(expected.distance, actual.distance, difference);
  cv::divide(difference, expected.distance, difference);
  const double agreeing = cv::countNonZero((difference <= tolerance) & sure);
  EXPECT_GT(cv::countNonZero(sure), 0.3 * static_cast<double>(sure.total()));
  EXPECT_GT(agreeing / cv::countNonZero(sure), 0.97);
}

/// With the rays and the images.
std::unique_ptr<Backend> make_backend(Device& device, const Schedule& schedule,
                                      const RenderedPair& pair) {
  const std::vector<cv::Size> sizes = sizes_of(schedule.views);
  auto backend = device.implementation().make_backend(sizes, schedule.constants);
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    const int view = static_cast<int>(i);
    const cv::Mat rays = ray_image(schedule.views[i].camera, {});
    backend->set_rays(view, rays);
    if (i >= pair.views.size()) continue;
    cv::Mat usable;
    cv::extractChannel(rays, usable, 3);
    cv::Mat intensity = to_intensity(pair.views[i].image, "test");
    intensity.setTo(MASKED_INTENSITY, usable == 0);
    backend->set_intensity(view, intensity);
  }
  return backend;
}

/// Runs a schedule up to its first dispatch of a kernel; returns the hypotheses of every view.
std::vector<cv::Mat> run_up_to(Kernel last, Device& device, const RenderedPair& pair,
                               Schedule schedule) {
  keep_first(schedule, last);
  const auto backend = make_backend(device, schedule, pair);
  for (int i = 0; i < static_cast<int>(pair.views.size()); ++i) {
    backend->set_hypotheses(i,
                            cv::Mat(pair.views[i].image.size(), CV_32FC4, cv::Scalar(0, 0, 0, 2)));
  }
  backend->run(schedule, {});
  std::vector<cv::Mat> hypotheses;
  for (int i = 0; i < static_cast<int>(pair.views.size()); ++i) {
    hypotheses.push_back(backend->hypotheses(i).clone());
  }
  return hypotheses;
}

/// Of whole matches; returns what the CPU gives.
StereoResult expect_bits_of_the_cpu(Device& device, const Rig& rig,
                                    const std::vector<cv::Mat>& images, const Options& options) {
  Device cpu = Device::open("cpu");
  const StereoResult expected = Matcher(cpu, rig, options).match(images);
  const StereoResult actual = Matcher(device, rig, options).match(images);
  for (std::size_t view = 0; view < images.size(); ++view) {
    SCOPED_TRACE(view);
    expect_same_bits(expected.views[view], actual.views[view]);
  }
  return expected;
}

class Parity : public ::testing::TestWithParam<const char*> {};

TEST_P(Parity, InitialPlanesAndCostsAgree) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Device cpu = Device::open("cpu");
  const RenderedPair pair = render_demo(96);
  for (const auto& [warp, filter] : {std::pair(PatchWarp::exact, Filter::exact),
                                     {PatchWarp::affine, Filter::exact},
                                     {PatchWarp::quadratic, Filter::exact},
                                     {PatchWarp::affine, Filter::device}}) {
    // Texture units round positions to 1/256 pixel, and texels have half precision.
    const double rounding = filter == Filter::exact ? 1 : 20;
    Options options = small_options();
    options.warp = warp;
    options.filter = filter;
    const Schedule schedule = make_schedule(pair.rig, options);
    const cv::Mat_<cv::Vec4f> expected = run_up_to(Kernel::initialise, cpu, pair, schedule)[0];
    const cv::Mat_<cv::Vec4f> actual = run_up_to(Kernel::initialise, *device, pair, schedule)[0];
    int planes_differ = 0;
    int validity_differs = 0;
    std::vector<float> cost_differences;
    for (int y = 0; y < expected.rows; ++y) {
      for (int x = 0; x < expected.cols; ++x) {
        const cv::Vec4f& e = expected(y, x);
        const cv::Vec4f& a = actual(y, x);
        const cv::Vec3f em(e[0], e[1], e[2]);
        const cv::Vec3f am(a[0], a[1], a[2]);
        planes_differ += cv::norm(em - am) > 1e-4 * (1 + cv::norm(em));
        validity_differs += (e[3] >= 2) != (a[3] >= 2);
        if (e[3] < 2 && a[3] < 2) cost_differences.push_back(std::abs(e[3] - a[3]));
      }
    }
    ASSERT_GT(cost_differences.size(), 2000u);
    EXPECT_EQ(planes_differ, 0);
    EXPECT_LE(validity_differs, 3);
    EXPECT_LT(percentile(cost_differences, 0.5), 1e-5 * rounding);
    EXPECT_LT(percentile(cost_differences, 0.99), 2e-4 * rounding);
  }
  expect_no_validation_messages(*device);
}

TEST_P(Parity, PlanesThatIterateTakesCostWhatPatchesCost) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  for (const CameraModel model :
       {CameraModel::double_sphere, CameraModel::kannala_brandt, CameraModel::unified}) {
    SCOPED_TRACE(to_string(model));
    KernelFixture match = pair_to_iterate(model);
    expect_costs_of_patches(device->implementation(), match);
  }
  expect_no_validation_messages(*device);
  // In bands, whose first rows lie anywhere.
  Device splitting = open_validated(GetParam(), 100000);
  KernelFixture match = pair_to_iterate(CameraModel::double_sphere);
  expect_costs_of_patches(splitting.implementation(), match);
}

TEST_P(Parity, WholeMatchAgrees) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Device cpu = Device::open("cpu");
  const RenderedPair pair = render_demo(128);
  Options options = exact(small_options());
  options.first_iterations = 8;
  const StereoResult expected = Matcher(cpu, pair.rig, options).match(images_of(pair));
  const StereoResult actual = Matcher(*device, pair.rig, options).match(images_of(pair));
  for (int view = 0; view < 2; ++view) {
    const ViewResult& e = expected.views[view];
    const ViewResult& a = actual.views[view];
    expect_agreement(e, a, 0.005);
    EXPECT_NEAR(cv::mean(e.cost)[0], cv::mean(a.cost)[0], 0.01);
  }
  expect_no_validation_messages(*device);
}

TEST_P(Parity, PyramidMatchAgrees) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Device cpu = Device::open("cpu");
  const RenderedPair pair = render_demo(129);  // odd: levels with partial last pixels
  // Rounding is amplified at depth edges, of which so small an image has many: on the CPU alone,
  // intensities that differ by 1e-6 move an eighth of the pixels by more than 0.005.
  const double of_exact = why_bits_may_differ(*device).empty() ? 0.005 : 0.03;
  const double of_rounded_positions = 0.05;
  for (const auto& [preset, filter, tolerance] :
       {std::tuple("fast", Filter::exact, of_exact),
        {"quality", Filter::exact, of_exact},
        {"fast", Filter::device, of_rounded_positions},
        {"quality", Filter::device, of_rounded_positions}}) {
    SCOPED_TRACE(testing::Message() << preset << static_cast<int>(filter));
    Options options = Options::preset_named(preset);
    options.filter = filter;
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    options.sweep_steps = 24;
    options.regression_radius = 12;  // the images are a quarter of the usual size
    const StereoResult expected = Matcher(cpu, pair.rig, options).match(images_of(pair));
    const StereoResult actual = Matcher(*device, pair.rig, options).match(images_of(pair));
    for (int view = 0; view < 2; ++view) {
      expect_agreement(expected.views[view], actual.views[view], tolerance);
      const auto median_error = [&](const StereoResult& result) {
        return evaluate(result.views[view].distance, {}, pair.views[view].truth,
                        pair.rig.views[view], pair.rig.views[1 - view])[1]
            .median_relative;
      };
      // Another seed moves it by up to a tenth.
      EXPECT_NEAR(median_error(actual), median_error(expected), 0.2 * median_error(expected));
    }
  }
  expect_no_validation_messages(*device);
}

// Nothing but arithmetic that IEEE 754 defines, in one order.
TEST_P(Parity, ExactFilteringGivesTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  const RenderedPair pair = render_demo(72);
  for (const auto& [preset, model] : {std::pair("fast", CameraModel::kannala_brandt),
                                      {"quality", CameraModel::double_sphere},
                                      {"paper", CameraModel::double_sphere}}) {
    SCOPED_TRACE(preset);
    Rig rig = pair.rig;
    for (View& view : rig.views) view.camera.model = model;
    Options options = exact(Options::preset_named(preset));
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    options.sweep_steps = 16;
    options.first_iterations = 2;
    options.second_iterations = 2;
    const StereoResult result = expect_bits_of_the_cpu(*device, rig, images_of(pair), options);
    for (const ViewResult& view : result.views) {
      EXPECT_GT(cv::countNonZero(view.reasons == 0), 500);
    }
  }
}

// Of the demo's scene at 64x64 pixels a vote that adds in another order changes a fifth of the
// pixels, at 160x160 a vote on normals that factors differences one.
TEST_P(Parity, PresetsAsTheyAreGiveTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  for (const auto& [preset, size] : {std::pair("fast", 64), {"quality", 64}, {"fast", 160}}) {
    SCOPED_TRACE(preset + std::to_string(size));
    const RenderedPair pair = render_demo(size);
    Options options = exact(Options::preset_named(preset));
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    expect_bits_of_the_cpu(*device, pair.rig, images_of(pair), options);
  }
}

// Weak texture makes a quarter of the pixels another plane's for a rounding in the vote.
TEST_P(Parity, AStereoSetGivesTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  SKIP_WITHOUT_STEREO_SETS();
  const std::filesystem::path set = data_folder() / "synthetic/room_tumvi";
  const std::vector<cv::Mat> images = {read_image(set / "cam0.png"), read_image(set / "cam1.png")};
  Options options = exact(Options::preset_named("fast"));
  options.min_distance = 0.5;
  options.max_distance = 25;
  const Rig rig = read_calibration(set / "calib.yaml", images[0].size()).rig;
  expect_bits_of_the_cpu(*device, rig, images, options);
}

// Of few enough pixels that compilers unroll the loops over them.
TEST_P(Parity, TheSmallestPatchesGiveTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  Device cpu = Device::open("cpu");
  const RenderedPair pair = render_demo(64);
  for (const char* preset : {"fast", "paper"}) {
    for (const PatchWarp warp : {PatchWarp::exact, PatchWarp::affine, PatchWarp::quadratic}) {
      SCOPED_TRACE(preset + std::to_string(static_cast<int>(warp)));
      Options options = exact(Options::preset_named(preset));
      std::tie(options.min_distance, options.max_distance) = demo_distance_range();
      options.window_radius = 1;
      options.pattern = PatchPattern::dense;
      options.warp = warp;
      options.first_iterations = 2;
      options.second_iterations = 2;
      Matcher matcher(cpu, pair.rig, options);
      Matcher other(*device, pair.rig, options);
      for (const bool warm : {false, true}) {
        const auto match = [&](Matcher& m) {
          return warm ? m.match_next(images_of(pair), {}) : m.match(images_of(pair));
        };
        const StereoResult expected = match(matcher);
        const StereoResult actual = match(other);
        for (std::size_t view = 0; view < 2; ++view) {
          SCOPED_TRACE(view);
          expect_same_bits(expected.views[view], actual.views[view]);
        }
      }
    }
  }
}

TEST_P(Parity, AnyRangeOfDistancesGivesTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  const RenderedPair pair = render_demo(72);
  std::vector<cv::Mat> images;
  cv::RNG random(3);
  for (const cv::Mat& image : images_of(pair)) {
    images.push_back(image.clone());
    // Nothing matches there.
    random.fill(images.back().rowRange(0, 32), cv::RNG::UNIFORM, 0, 255);
  }
  for (const auto& [nearest, farthest] : {std::pair(0.2, 5.0), {0.5, 25.0}, {0.5, 50.0}}) {
    SCOPED_TRACE(farthest);
    Options options = exact(Options::preset_named("fast"));
    options.min_distance = nearest;
    options.max_distance = farthest;
    expect_bits_of_the_cpu(*device, pair.rig, images, options);
  }
}

/// Two cameras of the demo's room whose lens has every coefficient of the model.
Rig rig_of_model(CameraModel model, int size) {
  Rig rig = demo_rig(size);
  for (View& view : rig.views) {
    Camera& c = view.camera;
    c.model = model;
    c.fx = c.fy = 0.45 * size;
    c.xi = 0.4;
    c.alpha = 0.6;
    c.beta = 1.1;
    c.omega = 0.9;
    c.k1 = 0.05;
    c.k2 = -0.02;
    c.k3 = 0.01;
    c.k4 = 0.02;
    c.k5 = -0.01;
    c.k6 = 0.002;
    c.p1 = 0.001;
    c.p2 = -0.003;
    c.s1 = 0.004;
    c.s2 = -0.002;
    c.s3 = -0.005;
    c.s4 = 0.001;
    c.skew = -0.7;
    if (model == CameraModel::polynomial_fisheye) {
      c.shear = 0.6;
      c.k7 = -0.003;
      c.k8 = 0.002;
      c.k9 = -0.0005;
      c.k10 = 0.0003;
      c.k11 = -0.0001;
    }
  }
  return rig;
}

TEST_P(Parity, EveryCameraModelGivesTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  Device cpu = Device::open("cpu");
  RenderedPair pair = render_demo(64);  // what the images show does not matter
  for (int model = 0; model < camera_models; ++model) {
    SCOPED_TRACE(to_string(static_cast<CameraModel>(model)));
    pair.rig = rig_of_model(static_cast<CameraModel>(model), 64);
    Options options = exact(Options::preset_named("paper"));
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    options.window_radius = 2;
    const Schedule schedule = make_schedule(pair.rig, options);
    const cv::Mat expected = run_up_to(Kernel::initialise, cpu, pair, schedule)[0];
    const cv::Mat actual = run_up_to(Kernel::initialise, *device, pair, schedule)[0];
    cv::Mat costs;
    cv::extractChannel(expected, costs, 3);
    EXPECT_GT(cv::countNonZero(costs < INVALID_COST), 1000);
    EXPECT_TRUE(same_bits(expected, actual));
  }
  expect_no_validation_messages(*device);
}

/// Rows lie on each other but for rounding, the first and the last one on the border.
TEST_P(Parity, RectifiedPinholesGiveTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  Rig rig = demo_rig(96);
  for (View& view : rig.views) {
    view.camera = Camera{};
    view.camera.width = view.camera.height = 96;
    view.camera.fx = view.camera.fy = 45.83;
    view.camera.cx = 47.2;
    view.camera.cy = 48.3;
  }
  rig.views[1].world_from_camera = rig.views[0].world_from_camera * Eigen::Translation3d(0.1, 0, 0);
  const RenderedPair pair = render_demo_room(rig);
  Options options = exact(Options::preset_named("fast"));
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  const StereoResult result = expect_bits_of_the_cpu(*device, pair.rig, images_of(pair), options);
  const cv::Mat& reasons = result.views[0].reasons;
  for (const int row : {0, 95}) {
    EXPECT_LT(cv::countNonZero(reasons.row(row) & REASON_NO_OVERLAP), 5) << row;
  }
  expect_no_validation_messages(*device);
}

// Back ends number the views of all levels, and have memory of many sizes.
TEST_P(Parity, SixViewsOfTwoSizesGiveTheBitsOfTheCpu) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  if (const std::string why = why_bits_may_differ(*device); !why.empty()) GTEST_SKIP() << why;
  const Rig demo = demo_rig(64);
  Rig rig;
  for (int i = 0; i < 6; ++i) {
    View view = demo.views[0];
    view.name = "cam" + std::to_string(i);
    view.world_from_camera =
        Eigen::Translation3d(0.1 * (i % 3), 0.1 * (i / 3), 0) * view.world_from_camera;
    if (i % 2 == 1) {
      view.camera.height = 45;
      view.camera.cy -= 9.5;
    }
    rig.views.push_back(view);
  }
  const RenderedPair rendered = render_plane(rig, {0, 0.1, 1}, 1.2);
  Options options = exact(Options::preset_named("fast"));
  options.min_distance = 0.5;
  options.max_distance = 8;
  options.levels = 4;
  options.sweep_steps = 16;
  options.best_sources = 3;
  const StereoResult result = expect_bits_of_the_cpu(*device, rig, images_of(rendered), options);
  ASSERT_EQ(result.views.size(), 6u);
  for (std::size_t view = 0; view < 6; ++view) {
    const std::vector<RegionScores> scores =
        evaluate(result.views[view].distance, {}, rendered.views[view].truth, rig.views[view],
                 rig.views[(view + 1) % 6]);
    EXPECT_LT(non_occluded(scores).bad_pixels.at(1.0), 0.1) << to_table(scores);
  }
  expect_no_validation_messages(*device);
}

INSTANTIATE_TEST_SUITE_P(Devices, Parity, ::testing::ValuesIn(other_devices),
                         [](const auto& test) { return std::string(test.param); });

class EveryDevice : public ::testing::TestWithParam<const char*> {};

TEST_P(EveryDevice, FindsTheDemoSceneTwiceWithTheSameBits) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const RenderedPair pair = render_demo(128);
  Options options = small_options();
  options.first_iterations = 10;
  Matcher matcher(*device, pair.rig, options);
  const StereoResult first = matcher.match(images_of(pair));
  double done = 0;
  const StereoResult second = matcher.match(images_of(pair), [&done](double share) {
    EXPECT_GE(share, done);
    done = share;
  });
  EXPECT_EQ(done, 1);
  EXPECT_TRUE(device->info().filters_intensities || first.filter == Filter::exact);
  for (int view = 0; view < 2; ++view) {
    // What views tell of their differences is what they are rejected for.
    std::vector<cv::Mat> differences;
    cv::split(first.views[view].differences, differences);
    const cv::Mat too_large =
        (differences[1] < 1000) & ((differences[0] > options.consistency_relative) |
                                   (differences[1] > options.consistency_pixels));
    const cv::Mat inconsistent = (first.views[view].reasons & reason_inconsistent) != 0;
    EXPECT_GT(cv::countNonZero(inconsistent), 0);
    EXPECT_TRUE(same_bits(too_large, inconsistent));
    EXPECT_TRUE(same_bits(first.views[view].hypotheses, second.views[view].hypotheses));
    EXPECT_TRUE(same_bits(first.views[view].confidence, second.views[view].confidence));
    const std::vector<RegionScores> scores =
        evaluate(first.views[view].distance, first.views[view].normals, pair.views[view].truth,
                 pair.rig.views[view], pair.rig.views[1 - view]);
    EXPECT_LT(non_occluded(scores).bad_pixels.at(1.0), 0.25) << to_table(scores);
    // Rejection must leave a better map than it was given.
    const std::vector<RegionScores> accepted =
        evaluate(accepted_distance(first.views[view]), {}, pair.views[view].truth,
                 pair.rig.views[view], pair.rig.views[1 - view]);
    EXPECT_LT(accepted[0].median_relative, scores[0].median_relative);
  }
  expect_no_validation_messages(*device);
}

/// Of the pixels that both views see, before any rejection.
std::vector<RegionScores> expect_few_bad_pixels(double most, const StereoResult& result,
                                                const RenderedPair& pair, int view) {
  const std::vector<RegionScores> scores =
      evaluate(result.views[view].distance, {}, pair.views[view].truth, pair.rig.views[view],
               pair.rig.views[1 - view]);
  EXPECT_LT(non_occluded(scores).bad_pixels.at(1.0), most) << to_table(scores);
  return scores;
}

TEST_P(EveryDevice, HandlesViewsOfDifferentModelsAndSizes) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Rig rig = demo_rig(64);
  Camera& other = rig.views[1].camera;
  other.model = CameraModel::kannala_brandt;
  other.width = 80;
  other.height = 56;
  other.fx = other.fy = 22;
  other.cx = 39.5;
  other.cy = 27.5;
  other.k1 = -0.01;
  other.k2 = 0.004;
  const RenderedPair pair = render_plane(rig, {0.1, 0.2, 1}, 1.5);
  Options options;
  options.min_distance = 0.5;
  options.max_distance = 8;
  options.window_radius = 3;
  options.first_iterations = 8;
  const StereoResult result = Matcher(*device, rig, options).match(images_of(pair));
  for (int view = 0; view < 2; ++view) expect_few_bad_pixels(0.2, result, pair, view);
  expect_no_validation_messages(*device);
}

// By kernels that know no model beforehand.
TEST_P(EveryDevice, MatchesLensesOfManyCoefficients) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  using enum CameraModel;
  Rig rig = rig_of_model(thin_prism_fisheye, 72);
  rig.views[1].camera.model = rad_tan_thin_prism_fisheye;
  rig.views.push_back(rig_of_model(polynomial_fisheye, 72).views[1]);
  rig.views[2].world_from_camera.translation() = Eigen::Vector3d(0, 0.1, 0);
  const RenderedPair pair = render_demo_room(rig);
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.regression_radius = 12;
  const StereoResult result = Matcher(*device, rig, options).match(images_of(pair));
  for (std::size_t view = 0; view < 3; ++view) {
    const std::vector<RegionScores> scores =
        evaluate(result.views[view].distance, {}, pair.views[view].truth, rig.views[view],
                 rig.views[(view + 1) % 3]);
    EXPECT_LT(non_occluded(scores).bad_pixels.at(1.0), 0.05) << view << "\n" << to_table(scores);
  }
  expect_no_validation_messages(*device);
}

// Also what is behind and beside the cameras, but for the seam, the poles and the epipoles.
TEST_P(EveryDevice, MatchesPanoramas) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Rig rig = demo_rig(72);
  for (View& view : rig.views) view.camera = whole_sphere(144, 72);
  rig.views[1].world_from_camera.translation() = Eigen::Vector3d(0.1, 0.1, 0);
  const RenderedPair pair = render_demo_room(rig);
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  const StereoResult result = Matcher(*device, rig, options).match(images_of(pair));
  for (int view = 0; view < 2; ++view) {
    const std::vector<RegionScores> scores = expect_few_bad_pixels(0.05, result, pair, view);
    EXPECT_LT(scores.back().bad_pixels.at(1.0), 0.05) << "behind: " << to_table(scores);
  }
  expect_no_validation_messages(*device);
}

TEST_P(EveryDevice, UsesThreeViews) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Rig rig = demo_rig(64);
  rig.views.push_back(rig.views[1]);
  rig.views[2].name = "cam2";
  rig.views[2].world_from_camera =
      Eigen::Translation3d(0, 0.12, 0) * rig.views[0].world_from_camera;
  const RenderedPair pair = render_plane(rig, {0, 0.1, 1}, 1.2);
  Options options;
  options.min_distance = 0.5;
  options.max_distance = 8;
  options.window_radius = 3;
  options.first_iterations = 6;
  options.best_sources = 2;
  const StereoResult result = Matcher(*device, rig, options).match(images_of(pair));
  ASSERT_EQ(result.views.size(), 3u);
  for (int view = 0; view < 3; ++view) {
    const std::vector<RegionScores> scores =
        evaluate(result.views[view].distance, {}, pair.views[view].truth, rig.views[view],
                 rig.views[(view + 1) % 3]);
    EXPECT_LT(scores[0].bad_pixels.at(1.0), 0.3) << to_table(scores);
  }
  expect_no_validation_messages(*device);
}

// As where a moving camera stood still: what such a view shows fits every distance.
TEST_P(EveryDevice, AViewThatHardlyMovedMisleadsNoOther) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Rig rig = demo_rig(96);
  rig.views.push_back(rig.views[0]);
  rig.views[2].name = "again";
  rig.views[2].world_from_camera.translation().x() += 5e-4;
  const RenderedPair pair = render_demo_room(rig);
  std::vector<cv::Mat> images = images_of(pair);
  images[2] = images[0].clone();
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  const StereoResult result = Matcher(*device, rig, options).match(images);
  const std::vector<RegionScores> scores =
      evaluate(result.views[0].distance, {}, pair.views[0].truth, rig.views[0], rig.views[1]);
  EXPECT_LT(non_occluded(scores).bad_pixels.at(1.0), 0.05) << to_table(scores);
  expect_no_validation_messages(*device);
}

TEST_P(EveryDevice, RejectsWhatItCannotMatch) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const RenderedPair pair = render_demo(64);
  const Options options = small_options();
  Matcher matcher(*device, pair.rig, options);
  std::vector<cv::Mat> images = images_of(pair);
  EXPECT_THROW(matcher.match({images[0]}), Error);
  EXPECT_THROW(matcher.match(images[0], images[1](cv::Rect(0, 0, 32, 64))), Error);
  EXPECT_THROW(matcher.match(images[0], cv::Mat()), Error);
  Options bad = options;
  bad.max_distance = 0.1;
  EXPECT_THROW(Matcher(*device, pair.rig, bad), Error);
  Options deep = Options::preset_named("fast");
  deep.levels = 4;
  deep.level_iterations = deep.level_regressions = {1, 1, 1, 1};
  EXPECT_THROW(Matcher(*device, demo_rig(8), deep), Error) << "1 pixel at the coarsest level";
  Rig alone = pair.rig;
  alone.views.pop_back();
  EXPECT_THROW(Matcher(*device, alone, options), Error);
  if (device->info().kind != DeviceKind::cpu) {
    bad = options;
    bad.propagation = Propagation::raster;
    EXPECT_THROW(Matcher(*device, pair.rig, bad), Error);
  }
}

TEST_P(EveryDevice, PyramidBeatsRandomSearchWithAFractionOfTheWork) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const RenderedPair pair = render_demo(128);
  const auto scores_of = [&](const StereoResult& result) {
    return evaluate(result.views[0].distance, result.views[0].normals, pair.views[0].truth,
                    pair.rig.views[0], pair.rig.views[1])[1];
  };
  Options random = small_options();
  random.window_radius = 5;
  random.first_iterations = 8;
  Options fast = Options::preset_named("fast");
  std::tie(fast.min_distance, fast.max_distance) = demo_distance_range();
  const StereoResult of_random = Matcher(*device, pair.rig, random).match(images_of(pair));
  const StereoResult of_fast = Matcher(*device, pair.rig, fast).match(images_of(pair));
  EXPECT_LT(of_fast.samples, of_random.samples / 2);
  EXPECT_LT(scores_of(of_fast).median_relative, scores_of(of_random).median_relative);
  EXPECT_LT(scores_of(of_fast).bad_pixels.at(0.5), scores_of(of_random).bad_pixels.at(0.5));
  EXPECT_LT(scores_of(of_fast).median_normal_angle, 0.5 * scores_of(of_random).median_normal_angle);
  const StereoResult again = Matcher(*device, pair.rig, fast).match(images_of(pair));
  EXPECT_TRUE(same_bits(of_fast.views[0].hypotheses, again.views[0].hypotheses));
  expect_no_validation_messages(*device);
}

/// An application's images may have pixels that are no intensities; for them View::mask counts.
TEST_P(EveryDevice, TreatsPixelsWithoutIntensityAsMasked) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const RenderedPair pair = render_demo(64);
  const cv::Rect hole(24, 24, 12, 12);
  for (const char* preset : {"fast", "paper"}) {
    SCOPED_TRACE(preset);
    Options options = Options::preset_named(preset);
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    options.first_iterations = 2;
    options.second_iterations = 1;
    options.fill_radius = 32;
    const Schedule schedule = make_schedule(pair.rig, options);
    const auto backend = make_backend(*device, schedule, pair);
    for (int view = 0; view < static_cast<int>(pair.views.size()); ++view) {
      cv::Mat intensity = to_intensity(pair.views[view].image, "test");
      intensity(hole).setTo(MASKED_INTENSITY);
      backend->set_intensity(view, intensity);
    }
    backend->run(schedule, {});
    cv::Mat reasons;
    cv::extractChannel(backend->checks(0), reasons, 3);
    EXPECT_EQ(cv::countNonZero(reasons(hole) != static_cast<double>(reason_no_ray)), 0);
    reasons.convertTo(reasons, CV_16U);
    EXPECT_GT(cv::countNonZero(reasons & reason_filled), 0);
    cv::Mat cost;
    cv::extractChannel(backend->hypotheses(0), cost, 3);
    EXPECT_EQ(cv::countNonZero(cost(hole) < INVALID_COST), 0);
  }
  expect_no_validation_messages(*device);
}

TEST_P(EveryDevice, SeesNothingOfWhatIsMasked) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const RenderedPair pair = render_demo(64);
  Rig rig = pair.rig;
  const cv::Rect hole(24, 24, 12, 12);
  for (View& view : rig.views) {
    view.mask = cv::Mat(64, 64, CV_8UC1, cv::Scalar(255));
    view.mask(hole).setTo(0);
  }
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  Matcher matcher(*device, rig, options);
  const StereoResult expected = matcher.match(images_of(pair));
  std::vector<cv::Mat> other_images;
  for (const cv::Mat& image : images_of(pair)) {
    other_images.push_back(image.clone());
    cv::RNG(1).fill(other_images.back()(hole), cv::RNG::UNIFORM, 0, 255);
  }
  const StereoResult result = matcher.match(other_images);
  for (std::size_t view = 0; view < 2; ++view) {
    expect_same_bits(expected.views[view], result.views[view]);
  }
  expect_no_validation_messages(*device);
}

/// A source a centimetre away, which tells next to nothing about distances, comes before the one
/// that does.
TEST_P(EveryDevice, BelievesTheSourceThatTellsMost) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const RenderedPair pair = render_demo(128);
  const Eigen::Isometry3d step(Eigen::Translation3d(0.01, 0, 0));
  const RenderedPair moved = render_demo_from(step, 128);
  Rig rig{.views = {pair.rig.views[0], pair.rig.views[0], pair.rig.views[1]}};
  rig.views[1].name = "near";
  rig.views[1].world_from_camera = step * rig.views[1].world_from_camera;
  Options fast = Options::preset_named("fast");
  std::tie(fast.min_distance, fast.max_distance) = demo_distance_range();
  fast.best_sources = 2;
  const auto median_error = [&](const Rig& of, const std::vector<cv::Mat>& images) {
    const StereoResult result = Matcher(*device, of, fast).match(images);
    return evaluate(result.views[0].distance, {}, pair.views[0].truth, rig.views[0],
                    rig.views[2])[1]
        .median_relative;
  };
  const double of_pair = median_error(pair.rig, images_of(pair));
  // 1.8 times as much when the first source is believed.
  EXPECT_LT(median_error(rig, {pair.views[0].image, moved.views[0].image, pair.views[1].image}),
            1.2 * of_pair);
  expect_no_validation_messages(*device);
}

INSTANTIATE_TEST_SUITE_P(Devices, EveryDevice, ::testing::Values("cpu", "vulkan", "cuda"),
                         [](const auto& test) { return std::string(test.param); });

/// What a pixel holds and what it costs must not come from different planes, also where kernels
/// adopt planes without a cost at first.
TEST(Costs, AreThoseOfThePlanes) {
  constexpr int side = 96;
  // Inlined, it makes g++ warn of what it cannot see to be set.
  float (*volatile cost_of)(const kernel::cpu::Context&, kernel::ivec2, kernel::vec3) =
      &kernel::cpu::patch_cost;
  for (const char* preset : {"fast", "quality"}) {
    Options options = wide_range(preset);
    options.warm_regressions = 2;
    KernelFixture match(fisheye_rig(side), options);
    const Schedule& schedule = match.schedule();
    const std::vector<cv::Size> sizes = sizes_of(schedule.views);
    const Device cpu = Device::open("cpu");
    const auto backend = cpu.implementation().make_backend(sizes, schedule.constants);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      const int view = static_cast<int>(i);
      backend->set_rays(view, ray_image(schedule.views[i].camera, {}));
      if (view < 2) backend->set_intensity(view, match.view(view).image());
    }
    for (const int vote_radius : {options.vote_radius, 0}) {
      options.vote_radius = vote_radius;
      backend->run(make_schedule(match.rig(), options), {});
      for (const char* start : {"cold", "warm"}) {
        if (start == std::string("warm")) {
          backend->run(make_warm_schedule(match.rig(), options), {});
        }
        int wrong = 0;
        for (int view = 0; view < 2; ++view) {
          match.set_reference(view);
          const cv::Mat_<cv::Vec4f> planes = backend->hypotheses(view);
          for (int y = 0; y < side; ++y) {
            for (int x = 0; x < side; ++x) {
              const cv::Vec4f& plane = planes(y, x);
              if (plane[3] >= INVALID_COST) continue;
              const float cost = cost_of(match.context(), {x, y}, {plane[0], plane[1], plane[2]});
              // Filled planes, and those that no source sees, cost no information at most.
              const float expected = std::min(cost, NO_INFORMATION_COST);
              wrong += std::abs(std::min(plane[3], NO_INFORMATION_COST) - expected) > 1e-5f;
            }
          }
        }
        EXPECT_EQ(wrong, 0) << preset << " " << start << " " << vote_radius;
      }
    }
  }
}

/// The same with one launch for each view, the last view first.
Schedule of_single_views(const Schedule& schedule) {
  Schedule single = schedule;
  single.dispatches.clear();
  for (const Dispatch& dispatch : schedule.dispatches) {
    for (int view = dispatch.views - 1; view >= 0; --view) {
      Dispatch& one = single.dispatches.emplace_back(dispatch);
      one.views = 1;
      one.over += view;
      one.pass.reference += view;
      one.pass.other += view;
    }
  }
  return single;
}

TEST(Launches, OverSeveralViewsMayRunThemInAnyOrder) {
  const RenderedPair pair = render_demo(64);
  Device device = Device::open("cpu");
  for (const std::string& preset : Options::preset_names()) {
    SCOPED_TRACE(preset);
    Options options = Options::preset_named(preset);
    std::tie(options.min_distance, options.max_distance) = demo_distance_range();
    options.first_iterations = 2;
    options.second_iterations = 2;
    options.fill_radius = 8;
    const Schedule cold = make_schedule(pair.rig, options);
    const Schedule warm = make_warm_schedule(pair.rig, options);
    std::vector<std::unique_ptr<Backend>> backends;
    for (const bool as_one : {true, false}) {
      Backend& backend = *backends.emplace_back(make_backend(device, cold, pair));
      for (const Schedule& schedule : {cold, warm}) {
        backend.run(as_one ? schedule : of_single_views(schedule), {});
      }
    }
    for (int view = 0; view < 2; ++view) {
      EXPECT_TRUE(same_bits(backends[0]->hypotheses(view), backends[1]->hypotheses(view)));
      EXPECT_TRUE(same_bits(backends[0]->checks(view), backends[1]->checks(view)));
    }
  }
}

TEST(KernelTimes, AreTakenOnTheCpuInAnyCase) {
  const RenderedPair pair = render_demo(64);
  Device device = Device::open("cpu");
  Matcher matcher(device, pair.rig, small_options());
  matcher.time_kernels(false);
  const std::vector<KernelTime> times = matcher.match(images_of(pair)).times;
  ASSERT_FALSE(times.empty());
  for (const KernelTime& time : times) EXPECT_GT(time.milliseconds, 0) << time.kernel;
}

TEST(Checkerboard, ReachesRasterOrder) {
  Device cpu = Device::open("cpu");
  const RenderedPair pair = render_demo(96);
  Options options = small_options();
  options.first_iterations = 6;
  const StereoResult checkerboard = Matcher(cpu, pair.rig, options).match(images_of(pair));
  options.propagation = Propagation::raster;
  options.first_iterations = 8;  // 6 candidates a pixel instead of 8
  const StereoResult raster = Matcher(cpu, pair.rig, options).match(images_of(pair));
  const auto bad = [&](const StereoResult& result) {
    return evaluate(result.views[0].distance, {}, pair.views[0].truth, pair.rig.views[0],
                    pair.rig.views[1])[1]
        .bad_pixels.at(1.0);
  };
  EXPECT_LT(bad(checkerboard), bad(raster) + 0.05);
  EXPECT_NEAR(cv::mean(checkerboard.views[0].cost)[0], cv::mean(raster.views[0].cost)[0], 0.03);
}

TEST(AcceptedDistance, IsThatOfPixelsThatAreNotRejectedOrFilledAllTheSame) {
  ViewResult view;
  view.distance = (cv::Mat_<float>(1, 3) << 1, 2, 3);
  view.reasons = (cv::Mat_<std::uint16_t>(1, 3) << 0, reason_tilt, reason_tilt | reason_filled);
  const cv::Mat expected = (cv::Mat_<float>(1, 3) << 1, 0, 3);
  EXPECT_TRUE(same_bits(accepted_distance(view), expected));
  view.reasons = view.reasons.colRange(0, 2);
  EXPECT_THROW(accepted_distance(view), Error);
  EXPECT_THROW(accepted_distance({}), Error);
}

TEST(DeviceChoice, IsByNameOrByRequest) {
  const std::string name = "cpu";
  for (const Device& device :
       {Device::open("cpu"), Device::open(name), Device::open({.device = "cpu"}),
        Device::open({.device = "cpu", .validation = true})}) {
    EXPECT_EQ(device.info().id, "cpu");
  }
}

TEST(DeviceChoice, UnknownNamesAreErrors) {
  EXPECT_THROW(Device::open("gpu"), Error);
  EXPECT_THROW(Device::open("vulkan:no such device"), Error);
  EXPECT_THROW(Device::open("cuda:no such device"), Error);
  EXPECT_THROW(Device::open("cudax"), Error);
  EXPECT_THROW(Device::open(""), Error);
}

}  // namespace
}  // namespace widestereo::test
