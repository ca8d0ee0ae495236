// SPDX-License-Identifier: MIT
#include "widestereo/view_synthesis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "error_of.h"
#include "same_bits.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

/// The demo scene with its true distances.
class ViewSynthesis : public ::testing::Test {
 protected:
  static cv::Mat grey(const RenderedView& view) {
    cv::Mat image;
    cv::cvtColor(view.image, image, cv::COLOR_BGR2GRAY);
    return image;
  }
  SynthesisScores scores_of(const cv::Mat& distance, const Rig& rig) const {
    return synthesis_scores(
        grey(pair.views[0]),
        synthesise_view(distance, rig.views[0], grey(pair.views[1]), rig.views[1]));
  }
  const RenderedPair pair = render_demo(256);
  const cv::Mat truth = pair.views[0].truth.distance;
};

TEST_F(ViewSynthesis, OfTrueDistancesFitsAndOfWrongOnesDoesNot) {
  const SynthesisScores right = scores_of(truth, pair.rig);
  EXPECT_GT(right.mean, 0.95);
  EXPECT_GT(right.above_0_8, 0.95);
  EXPECT_GT(right.windows, 10000);
  const SynthesisScores wrong = scores_of(0.4 * truth, pair.rig);
  EXPECT_LT(wrong.mean, 0.6);
  EXPECT_LT(wrong.above_0_8, 0.5 * right.above_0_8);
}

TEST_F(ViewSynthesis, SeesWhatIsNotOccluded) {
  const SynthesisedView synthesised =
      synthesise_view(truth, pair.rig.views[0], grey(pair.views[1]), pair.rig.views[1]);
  const cv::Mat occlusion = pair.views[0].truth.occlusion;
  const cv::Mat scored = truth > 0;
  cv::Mat differs;
  cv::compare(synthesised.visible, occlusion == 255, differs, cv::CMP_NE);
  EXPECT_LT(cv::countNonZero(differs & scored), 0.02 * cv::countNonZero(scored));
  const cv::Mat hidden = scored & (occlusion == 0);
  EXPECT_GT(cv::countNonZero(hidden & (synthesised.visible == 0)), 0.5 * cv::countNonZero(hidden));
}

TEST_F(ViewSynthesis, LeavesOutWhatHasNoDistanceOrIsMasked) {
  cv::Mat half = truth.clone();
  half.colRange(0, 128).setTo(0);
  const SynthesisedView synthesised =
      synthesise_view(half, pair.rig.views[0], grey(pair.views[1]), pair.rig.views[1]);
  EXPECT_EQ(cv::countNonZero(synthesised.visible.colRange(0, 128)), 0);
  EXPECT_DOUBLE_EQ(
      scores_of(half, pair.rig).visible,
      static_cast<double>(cv::countNonZero(synthesised.visible)) / cv::countNonZero(half > 0));
  View masked = pair.rig.views[0];
  masked.mask = half > 0;
  const SynthesisedView unmasked =
      synthesise_view(truth, masked, grey(pair.views[1]), pair.rig.views[1]);
  EXPECT_TRUE(same_bits(unmasked.visible, synthesised.visible));
  EXPECT_EQ(unmasked.distances, cv::countNonZero(half > 0)) << "what is masked is left out";
  Rig rig = pair.rig;
  rig.views[1].mask = cv::Mat(256, 256, CV_8UC1, cv::Scalar(0));
  EXPECT_EQ(scores_of(truth, rig).windows, 0);
  EXPECT_EQ(scores_of(truth, rig).visible, 0);
  EXPECT_NE(to_json(scores_of(truth, rig)).find("\"mean_zncc\": null"), std::string::npos);
  const cv::Mat flat(256, 256, CV_8UC1, cv::Scalar(90));
  EXPECT_EQ(synthesis_scores(flat, synthesised).windows, 0) << "nothing to compare";
}

/// Stripes two pixels wide and noise, whose correlation follows from their variances.
TEST(SynthesisScores, AreOfTexturedWindowsThatAreMostlyVisible) {
  constexpr int side = 66;
  const auto scores = [&](double contrast, double noise, int visible_of_20) {
    cv::Mat image(side, side, CV_8UC1), visible(side, side, CV_8UC1);
    cv::Mat synthesised(side, side, CV_32FC1);
    cv::RNG random(7);
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double stripe = x / 2 % 2 == 0 ? contrast : -contrast;
        image.at<uchar>(y, x) = cv::saturate_cast<uchar>(100 + stripe);
        synthesised.at<float>(y, x) = static_cast<float>(50 + stripe + random.gaussian(noise));
        visible.at<uchar>(y, x) = (7 * x + 3 * y) % 20 < visible_of_20 ? 255 : 0;
      }
    }
    return synthesis_scores(
        image, {.image = synthesised, .visible = visible, .distances = long{side} * side});
  };
  const SynthesisScores exact = scores(20, 0, 20);
  EXPECT_GT(exact.windows, 50 * 50);
  EXPECT_NEAR(exact.mean, 1, 1e-6);
  EXPECT_EQ(exact.above_0_9, 1);
  const SynthesisScores noisy = scores(20, 13, 20);  // 1 / sqrt(1 + (13 / 20)^2) = 0.84
  EXPECT_NEAR(noisy.mean, 0.84, 0.02);
  EXPECT_LT(noisy.above_0_9, 0.05);
  EXPECT_GT(noisy.above_0_8, 0.8);
  EXPECT_GT(noisy.above_0_7, 0.99);
  EXPECT_EQ(scores(2, 0, 20).windows, 0) << "of too little texture";
  EXPECT_GT(scores(5, 0, 20).windows, 50 * 50);
  const SynthesisScores mostly = scores(20, 0, 16);
  EXPECT_NEAR(mostly.visible, 0.8, 0.01);
  EXPECT_GT(mostly.windows, 0.7 * 50 * 50);
  EXPECT_EQ(scores(20, 0, 11).windows, 0) << "of too little that is seen";
}

TEST_F(ViewSynthesis, NeedsMapsOfTheCalibratedSize) {
  EXPECT_THAT(error_of([&] { scores_of(cv::Mat(9, 8, CV_32FC1, cv::Scalar(1)), pair.rig); }),
              ::testing::HasSubstr("distance map of cam0 is 8x9 pixels"));
}

TEST_F(ViewSynthesis, NeedsABaseline) {
  Rig rig = pair.rig;
  rig.views[1].world_from_camera.translation() = rig.views[0].world_from_camera.translation();
  EXPECT_THAT(error_of([&] { scores_of(truth, rig); }), ::testing::HasSubstr("the same centre"));
  rig.views[1].camera.fx = -1;
  EXPECT_THAT(error_of([&] { scores_of(truth, rig); }), ::testing::HasSubstr("fx"));
}

TEST_F(ViewSynthesis, NeedsMapsOfTheDocumentedTypes) {
  using ::testing::HasSubstr;
  const View& view = pair.rig.views[0];
  const View& other = pair.rig.views[1];
  const cv::Mat image = grey(pair.views[0]);
  const auto synthesise = [&](const cv::Mat& distance, const cv::Mat& of_other) {
    return error_of([&] { synthesise_view(distance, view, of_other, other); });
  };
  EXPECT_THAT(synthesise(cv::Mat(256, 256, CV_32FC3, cv::Scalar(1)), image),
              HasSubstr("distance map of cam0 is CV_32FC3 instead of CV_32FC1"));
  EXPECT_THAT(synthesise(cv::Mat(256, 256, CV_64FC1, cv::Scalar(1)), image), HasSubstr("CV_64FC1"));
  EXPECT_THAT(synthesise(truth, pair.views[1].image),
              HasSubstr("image of cam1 is CV_8UC3 instead of CV_8UC1"));
  const SynthesisedView good = synthesise_view(truth, view, image, other);
  const auto score = [&](const cv::Mat& of_view, const SynthesisedView& synthesised) {
    return error_of([&] { synthesis_scores(of_view, synthesised); });
  };
  EXPECT_EQ(score(image, good), "");
  EXPECT_THAT(score(pair.views[0].image, good), HasSubstr("CV_8UC3"));
  EXPECT_THAT(score(image, {.image = good.visible, .visible = good.visible}),
              HasSubstr("CV_8UC1 instead of CV_32FC1"));
  EXPECT_THAT(score(image, {.image = good.image, .visible = good.image}),
              HasSubstr("CV_32FC1 instead of CV_8UC1"));
  EXPECT_THAT(score(image, {.image = good.image, .visible = good.visible.rowRange(0, 9)}),
              HasSubstr("view shows is 256x9 pixels instead of 256x256"));
}

}  // namespace
}  // namespace widestereo::test
