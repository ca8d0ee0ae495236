// SPDX-License-Identifier: MIT
// Images of little contrast are matched as if they had more.
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <string>
#include <tuple>
#include <vector>

#include "match_fixture.h"
#include "same_bits.h"
#include "widestereo/evaluation.h"
#include "widestereo/image_io.h"
#include "widestereo/matcher.h"

namespace widestereo::test {
namespace {

constexpr int size = 64;

StereoResult match(const Rig& rig, const std::vector<cv::Mat>& images, double max_gain) {
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.sweep_steps = 8;
  options.max_gain = max_gain;
  Device device = Device::open("cpu");
  return Matcher(device, rig, options).match(images);
}

TEST(Contrast, OfDarkImagesIsStretched) {
  const RenderedPair pair = render_demo(size);
  std::vector<cv::Mat> dark;
  for (const cv::Mat& image : images_of(pair)) dark.push_back(0.05 * to_intensity(image, "demo"));
  const StereoResult result = match(pair.rig, dark, 20);
  std::vector<cv::Mat> stretched;
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_GT(result.views[i].gain, 3) << i;
    stretched.push_back(dark[i] * result.views[i].gain);
    // All but the 2 % darkest and brightest pixels then lie within a quarter of all values.
    std::vector<float> values;
    const cv::Mat_<cv::Vec4f> rays = ray_image(pair.rig.views[i].camera, {});
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        if (rays(y, x)[3] != 0) values.push_back(stretched[i].at<float>(y, x));
      }
    }
    std::ranges::sort(values);
    const std::size_t outliers = values.size() / 50;
    EXPECT_NEAR(values[values.size() - 1 - outliers] - values[outliers], 0.25, 0.01);
  }
  const StereoResult by_hand = match(pair.rig, stretched, 1);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(by_hand.views[i].gain, 1);
    EXPECT_TRUE(same_bits(result.views[i].hypotheses, by_hand.views[i].hypotheses));
  }
  EXPECT_EQ(match(pair.rig, dark, 2).views[0].gain, 2) << "no more than it may be";
}

TEST(Contrast, ThatIsUsualIsLeftAsItIs) {
  const RenderedPair pair = render_demo(size);
  for (const ViewResult& view : match(pair.rig, images_of(pair), 20).views) {
    EXPECT_EQ(view.gain, 1);
  }
}

/// Grey levels times `gain`, plus `offset`.
cv::Mat seen_through(const cv::Mat& image, double gain, double offset) {
  cv::Mat seen;
  to_grey_levels(image, "demo").convertTo(seen, CV_8UC1, gain, offset);
  return seen;
}

/// Pixels that are white after that take part like all others.
TEST(Contrast, OfHazyImagesIsStretchedAsThatOfDarkOnes) {
  const RenderedPair pair = render_demo(96);
  const auto wrong = [&](double black) {
    std::vector<cv::Mat> images;
    for (const cv::Mat& image : images_of(pair)) {
      images.push_back(seen_through(image, 0.15, black));
    }
    const ViewResult view = match(pair.rig, images, 20).views[0];
    EXPECT_GT(view.gain, 3);
    return wrong_by(1, view, pair);
  };
  const double of_dark = wrong(5);
  EXPECT_LT(of_dark, 0.3);
  for (const double black : {70, 140, 200}) EXPECT_LT(wrong(black), of_dark + 0.05) << black;
}

/// A veil of light over one camera, or a black level, changes intensities, but not what they show.
TEST(Contrast, AnOffsetInOneCameraCostsLittle) {
  const RenderedPair pair = render_demo(128);
  const auto wrong = [&](const std::string& name, double gain, double offset) {
    const std::vector<cv::Mat> images = images_of(pair);
    const StereoResult result =
        match(pair.rig, {seen_through(images[0], 1, 0), seen_through(images[1], gain, offset)}, 1);
    const double share = wrong_by(1, result.views[0], pair);
    RecordProperty(name, std::to_string(share));
    return share;
  };
  const double as_rendered = wrong("as_rendered", 1, 0);
  EXPECT_LT(as_rendered, 0.03);
  EXPECT_LT(wrong("darker", 0.5, 0), as_rendered + 0.01);
  EXPECT_LT(wrong("veiled", 0.5, 100), as_rendered + 0.01);
}

}  // namespace
}  // namespace widestereo::test
