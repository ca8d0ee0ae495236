// SPDX-License-Identifier: MIT
// Frames of a moving rig, each started from the one before: as accurate as by themselves, at a
// fraction of the work, on every back end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "device_fixture.h"
#include "error_of.h"
#include "kernel/host.h"
#include "match_fixture.h"
#include "same_bits.h"
#include "widestereo/matcher.h"
#include "widestereo/motion.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;

constexpr int size = 96;

/// Camera 0 to world of frame `k`, about three pixels from one to the next.
Eigen::Isometry3d pose(int k) { return pose_after(3 * k); }

Eigen::Isometry3d motion_to(int k) { return pose(k).inverse() * pose(k - 1); }

/// The demo scene as frame `k` sees it; rendered once.
const RenderedPair& frame(int k) {
  static std::vector<std::optional<RenderedPair>> frames(3);
  auto& rendered = frames.at(static_cast<std::size_t>(k));
  if (!rendered) rendered = render_demo_from(pose(k), size);
  return *rendered;
}

Options options_of(const std::string& preset) {
  Options options = Options::preset_named(preset);
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.regression_radius = 12;  // in proportion to the image
  return options;
}

RegionScores scores_of(const StereoResult& result, const RenderedPair& truth) {
  return evaluate(result.views[0].distance, result.views[0].normals, truth.views[0].truth,
                  truth.rig.views[0], truth.rig.views[1])[1];
}

class WarmStarts : public ::testing::TestWithParam<const char*> {};

TEST_P(WarmStarts, ReachColdAccuracyWithAQuarterOfTheWork) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const Options options = options_of("fast");
  Matcher warm(*device, frame(0).rig, options);
  Matcher alone(*device, frame(0).rig, options);
  warm.match(images_of(frame(0)));
  double more_wrong = 0;
  for (int k = 1; k < 3; ++k) {
    const StereoResult result =
        warm.match_next(images_of(frame(k)), {.now_from_previous = motion_to(k), .frame = k});
    const StereoResult cold = alone.match(images_of(frame(k)));
    EXPECT_LE(4 * result.samples, cold.samples);
    const RegionScores scores = scores_of(result, frame(k));
    const RegionScores expected = scores_of(cold, frame(k));
    EXPECT_LT(scores.bad_pixels.at(1.0), expected.bad_pixels.at(1.0) + 0.002) << k;
    EXPECT_LT(scores.bad_pixels.at(0.5), expected.bad_pixels.at(0.5) + 0.02) << k;
    more_wrong += scores.bad_relative.at(0.05) - expected.bad_relative.at(0.05);
    // Planes stay where the other view cuts their patches off.
    EXPECT_GT(scores.completeness, expected.completeness - 0.001) << k;
  }
  // At this size 5 % is a tenth of a pixel, and seeds differ by three points. Unmoved planes: 0.07.
  EXPECT_LT(more_wrong / 2, 0.04);
  expect_no_validation_messages(*device);
}

TEST_P(WarmStarts, FindWhatHasComeNear) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  const Rig rig = frame(0).rig;
  const RenderedPair far = render_plane(rig, {0, 0, 1}, 4);
  const RenderedPair near = render_plane(rig, {0, 0, 1}, 0.8);
  Matcher matcher(*device, rig, options_of("fast"));
  matcher.match(images_of(far));
  // Three pixels away, where no strip has its plane.
  const StereoResult result =
      matcher.match_next(images_of(near), {.now_from_previous = Eigen::Isometry3d::Identity()});
  EXPECT_LT(scores_of(result, near).bad_pixels.at(1.0), 0.1);
  expect_no_validation_messages(*device);
}

TEST_P(WarmStarts, FromPlanesGivenOrStillOnTheDeviceHaveTheSameBits) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  for (const char* preset : {"fast", "paper"}) {
    SCOPED_TRACE(preset);
    Options options = options_of(preset);
    options.window_radius = 2;
    options.first_iterations = 2;
    options.second_iterations = 1;
    options.warm_iterations = 1;
    Matcher matcher(*device, frame(0).rig, options);
    const StereoResult first = matcher.match(images_of(frame(0)));
    WarmStart start{.now_from_previous = motion_to(1)};
    const StereoResult held = matcher.match_next(images_of(frame(1)), start);
    for (const ViewResult& view : first.views) start.hypotheses.push_back(view.hypotheses);
    Matcher other(*device, frame(0).rig, options);
    const StereoResult given = other.match_next(images_of(frame(1)), start);
    EXPECT_TRUE(same_bits(held.views[0].hypotheses, given.views[0].hypotheses));
    EXPECT_TRUE(same_bits(held.views[1].hypotheses, given.views[1].hypotheses));
    start.frame = 2;
    const StereoResult redrawn = other.match_next(images_of(frame(1)), start);
    EXPECT_FALSE(same_bits(given.views[0].hypotheses, redrawn.views[0].hypotheses));
    // Cold frames do not depend on what was matched before.
    EXPECT_TRUE(same_bits(matcher.match(images_of(frame(0))).views[1].hypotheses,
                          first.views[1].hypotheses));
  }
  expect_no_validation_messages(*device);
}

TEST_P(WarmStarts, NeedPlanesThatFit) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Matcher matcher(*device, frame(0).rig, options_of("fast"));
  EXPECT_THAT(error_of([&] { matcher.match_next(images_of(frame(0)), {}); }),
              HasSubstr("no planes of a previous frame"));
  WarmStart start;
  start.hypotheses.resize(1);
  EXPECT_THAT(error_of([&] { matcher.match_next(images_of(frame(0)), start); }),
              HasSubstr("planes of 1"));
  start.hypotheses.assign(2, cv::Mat::zeros(3, 4, CV_32FC4));
  EXPECT_THAT(error_of([&] { matcher.match_next(images_of(frame(0)), start); }),
              HasSubstr("cam0 from is 4x3"));
  // Deeper than an image.
  const int sides[] = {size, size, 2};
  start.hypotheses.assign(2, cv::Mat(3, sides, CV_32FC4, cv::Scalar::all(0)));
  EXPECT_THAT(error_of([&] { matcher.match_next(images_of(frame(0)), start); }),
              HasSubstr("cam0 from has 3 dimensions"));
}

TEST_P(WarmStarts, NeedAMatchOfViewsThatOverlap) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Rig rig = frame(0).rig;
  rig.views[1].mask = cv::Mat::zeros(size, size, CV_8UC1);
  Matcher matcher(*device, rig, options_of("fast"));
  EXPECT_THAT(error_of([&] { matcher.match(images_of(frame(0))); }), HasSubstr("do not overlap"));
  EXPECT_THAT(error_of([&] { matcher.match_next(images_of(frame(0)), {}); }),
              HasSubstr("no planes of a previous frame"));
}

TEST_P(WarmStarts, ARefusedFrameChangesNothing) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Options options = options_of("fast");
  options.window_radius = 2;
  options.warm_iterations = 1;
  Matcher matcher(*device, frame(0).rig, options);
  Matcher untroubled(*device, frame(0).rig, options);
  matcher.match(images_of(frame(0)));
  untroubled.match(images_of(frame(0)));
  WarmStart bad{.now_from_previous = Eigen::Isometry3d::Identity()};
  bad.hypotheses.assign(2, cv::Mat(size, size, CV_32FC4, cv::Scalar(0, 0, 0, INVALID_COST)));
  const auto refused = [&](const std::vector<cv::Mat>& images) {
    return error_of([&] { matcher.match_next(images, bad); });
  };
  std::vector<cv::Mat> images = images_of(frame(1));
  images[1] = images[1](cv::Rect(0, 0, 9, 9));
  EXPECT_THAT(refused(images), HasSubstr("cam1"));
  bad.hypotheses[1] = cv::Mat::zeros(3, 4, CV_32FC4);
  EXPECT_THAT(refused(images_of(frame(1))), HasSubstr("cam1 from is 4x3"));
  bad.hypotheses.clear();
  Eigen::Matrix4d no_motion = Eigen::Matrix4d::Identity();
  no_motion(0, 3) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Matrix4d mirror = Eigen::Vector4d(-1, 1, 1, 1).asDiagonal();
  const Eigen::Matrix4d larger = Eigen::Vector4d(2, 2, 2, 1).asDiagonal();
  for (const Eigen::Matrix4d& wrong : {no_motion, mirror, larger}) {
    bad.now_from_previous->matrix() = wrong;
    EXPECT_THAT(refused(images_of(frame(1))), HasSubstr("is not a rigid motion")) << wrong;
  }

  const WarmStart start{.now_from_previous = motion_to(1)};
  const StereoResult expected = untroubled.match_next(images_of(frame(1)), start);
  const StereoResult result = matcher.match_next(images_of(frame(1)), start);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(same_bits(result.views[i].hypotheses, expected.views[i].hypotheses)) << i;
  }
  expect_no_validation_messages(*device);
}

TEST_P(WarmStarts, NeedAMatchThatWasNotAborted) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  device.emplace(open_validated(GetParam(), 1'000'000));  // in many submissions
  const Options options = options_of("fast");
  Matcher matcher(*device, frame(0).rig, options);
  const StereoResult expected = matcher.match(images_of(frame(0)));
  // With work left on the device, whose matcher may go at once, or be used again.
  const auto abort = [](double) { throw std::runtime_error("aborted"); };
  {
    Matcher abandoned(*device, frame(0).rig, options);
    EXPECT_THROW(abandoned.match(images_of(frame(1)), abort), std::runtime_error);
  }
  EXPECT_THROW(matcher.match(images_of(frame(1)), abort), std::runtime_error);
  EXPECT_THAT(error_of([&] { matcher.match_next(images_of(frame(0)), {}); }),
              HasSubstr("no planes of a previous frame"));
  EXPECT_THROW(matcher.match(images_of(frame(1)), abort), std::runtime_error);
  const StereoResult result = matcher.match(images_of(frame(0)));
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(same_bits(result.views[i].hypotheses, expected.views[i].hypotheses)) << i;
  }
  expect_no_validation_messages(*device);
}

/// Of a scene at rest, whose images have noise of their own.
TEST_P(WarmStarts, AverageOverFrames) {
  OPEN_DEVICE_OR_SKIP(device, GetParam());
  Matcher matcher(*device, frame(0).rig, options_of("fast"));
  cv::RNG noise(7);
  const auto noisy = [&] {
    std::vector<cv::Mat> images = images_of(frame(0));
    for (cv::Mat& image : images) {
      cv::Mat more(image.size(), CV_MAKETYPE(CV_16S, image.channels()));
      noise.fill(more, cv::RNG::NORMAL, 0, 5);
      image.convertTo(image, CV_16S);
      image += more;
      image.convertTo(image, CV_8U);
    }
    return images;
  };
  const double alone = scores_of(matcher.match(noisy()), frame(0)).median_pixels;
  double last = 0;
  for (int k = 1; k < 7; ++k) {
    last = scores_of(matcher.match_next(
                         noisy(), {.now_from_previous = Eigen::Isometry3d::Identity(), .frame = k}),
                     frame(0))
               .median_pixels;
  }
  EXPECT_LT(last, 0.85 * alone);
}

INSTANTIATE_TEST_SUITE_P(Devices, WarmStarts, ::testing::Values("cpu", "vulkan", "cuda"),
                         [](const auto& test) { return std::string(test.param); });

/// What a perfect match of frame 0 would have found.
std::vector<ViewResult> true_planes(const RenderedPair& pair) {
  std::vector<ViewResult> views(2);
  for (std::size_t i = 0; i < 2; ++i) {
    const cv::Mat_<float> distance = pair.views[i].truth.distance;
    const cv::Mat_<cv::Vec3f> normals = pair.views[i].truth.normals;
    const cv::Mat_<cv::Vec4f> rays = ray_image(pair.rig.views[i].camera, {});
    views[i].hypotheses = cv::Mat(distance.size(), CV_32FC4, cv::Scalar(0, 0, 0, 2));
    cv::Mat(distance == 0).convertTo(views[i].reasons, CV_16U);
    for (int y = 0; y < distance.rows; ++y) {
      for (int x = 0; x < distance.cols; ++x) {
        if (distance(y, x) == 0) continue;
        const cv::Vec3f n = normals(y, x);
        const cv::Vec4f r = rays(y, x);
        const float scale = 1 / (distance(y, x) * n.dot({r[0], r[1], r[2]}));
        views[i].hypotheses.at<cv::Vec4f>(y, x) = {scale * n[0], scale * n[1], scale * n[2], 0.1f};
      }
    }
  }
  return views;
}

TEST(Motion, IsFoundToAFractionOfAPixel) {
  for (const auto& [steps, radians, metres] :
       {std::tuple(1.0, 0.003, 0.005), std::tuple(3.0, 0.01, 0.01)}) {  // a pixel has 0.03 radians
    const Eigen::Isometry3d now = pose_after(steps);
    const std::vector<cv::Mat> same = images_of(render_demo_from(now, size));
    std::vector<cv::Mat> brighter(same.size());
    for (std::size_t i = 0; i < same.size(); ++i) same[i].convertTo(brighter[i], -1, 0.8, 12);
    std::vector<cv::Mat> unlike(same.size());  // one camera exposes longer, the other one less long
    same[0].convertTo(unlike[0], -1, 1.15, 8);
    same[1].convertTo(unlike[1], -1, 0.6, -5);
    std::vector<cv::Mat> passed_by;  // by something that moves by itself
    for (const cv::Mat& image : same) {
      const cv::Rect around(30, 30, 24, 24);
      passed_by.push_back(image.clone());
      cv::flip(image(around), passed_by.back()(around), 1);
    }
    for (const auto& images : {same, brighter, unlike, passed_by}) {
      SCOPED_TRACE(steps);
      const auto motion =
          estimate_motion(frame(0).rig, images_of(frame(0)), true_planes(frame(0)), images);
      ASSERT_TRUE(motion.has_value());
      const Eigen::Isometry3d error = now * *motion;
      EXPECT_LT(Eigen::AngleAxisd(error.linear()).angle(), radians);
      EXPECT_LT(error.translation().norm(), metres);
    }
  }
}

TEST(Motion, IsTheSameInEveryUnitOfLength) {
  const std::vector<cv::Mat> images = images_of(frame(1));
  const auto found =
      estimate_motion(frame(0).rig, images_of(frame(0)), true_planes(frame(0)), images);
  ASSERT_TRUE(found.has_value());
  for (const double unit : {1e-6, 1e7}) {
    Rig rig = frame(0).rig;
    for (View& view : rig.views) view.world_from_camera.translation() *= unit;
    std::vector<ViewResult> planes = true_planes(frame(0));
    for (ViewResult& view : planes) {
      view.hypotheses.forEach<cv::Vec4f>([unit](cv::Vec4f& plane, const int*) {
        const auto scale = static_cast<float>(1 / unit);
        plane = {scale * plane[0], scale * plane[1], scale * plane[2], plane[3]};
      });
    }
    const auto motion = estimate_motion(rig, images_of(frame(0)), planes, images);
    ASSERT_TRUE(motion.has_value());
    EXPECT_LT((motion->linear() - found->linear()).norm(), 1e-5);
    EXPECT_LT((motion->translation() / unit - found->translation()).norm(), 1e-5);
  }
}

TEST(Motion, IsTheSameWhereverTheRigsFrameBegins) {
  const std::vector<cv::Mat> images = images_of(frame(1));
  const auto estimate = [&](const Rig& rig) {
    return estimate_motion(rig, images_of(frame(0)), true_planes(frame(0)), images);
  };
  const auto found = estimate(frame(0).rig);
  ASSERT_TRUE(found.has_value());
  const Eigen::Translation3d away(2e4, 1e4, -300);
  Rig rig = frame(0).rig;
  for (View& view : rig.views) view.world_from_camera = away * view.world_from_camera;
  const auto motion = estimate(rig);
  ASSERT_TRUE(motion.has_value());
  const Eigen::Isometry3d brought_back = away.inverse() * *motion * away;
  EXPECT_LT((brought_back.linear() - found->linear()).norm(), 1e-6);
  EXPECT_LT((brought_back.translation() - found->translation()).norm(), 1e-6);
}

TEST(Motion, NeedsARigThatIsValid) {
  Rig rig = frame(0).rig;
  rig.views[1].camera.fx = -1;
  EXPECT_THAT(error_of([&] {
                estimate_motion(rig, images_of(frame(0)), true_planes(frame(0)),
                                images_of(frame(1)));
              }),
              HasSubstr("The rig: cam1: fx is -1"));
}

TEST(Motion, IsNotInventedBetweenFramesThatHaveNothingInCommon) {
  for (const double blur : {0.0, 1.0, 2.0, 4.0}) {
    std::vector<cv::Mat> images;
    for (int seed = 1; seed <= 4; ++seed) {
      cv::Mat noise(size, size, CV_8UC1);
      cv::RNG(seed).fill(noise, cv::RNG::UNIFORM, 0, 256);
      if (blur > 0) cv::GaussianBlur(noise, noise, {}, blur);
      images.push_back(noise);
    }
    EXPECT_FALSE(estimate_motion(frame(0).rig, {images[0], images[1]}, true_planes(frame(0)),
                                 {images[2], images[3]})
                     .has_value())
        << blur;
  }
}

TEST(Motion, IsNotInventedWhereNothingShowsIt) {
  const std::vector<cv::Mat> grey(2, cv::Mat(size, size, CV_8UC1, cv::Scalar(90)));
  EXPECT_FALSE(estimate_motion(frame(0).rig, grey, true_planes(frame(0)), grey).has_value());
  std::vector<ViewResult> nothing = true_planes(frame(0));
  for (ViewResult& view : nothing) view.reasons.setTo(reason_inconsistent);
  EXPECT_FALSE(
      estimate_motion(frame(0).rig, images_of(frame(0)), nothing, images_of(frame(1))).has_value());
  EXPECT_THAT(error_of([&] {
                estimate_motion(frame(0).rig, {grey[0], grey[1](cv::Rect(0, 0, 9, 9))},
                                true_planes(frame(0)), grey);
              }),
              HasSubstr("cam1"));
  EXPECT_THAT(error_of([&] {
                estimate_motion(frame(0).rig, grey, true_planes(frame(0)),
                                {grey[0], grey[1](cv::Rect(0, 0, 9, 9))});
              }),
              HasSubstr("The image of cam1 is 9x9"));
}

}  // namespace
}  // namespace widestereo::test
