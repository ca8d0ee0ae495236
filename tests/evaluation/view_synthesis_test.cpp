// SPDX-License-Identifier: MIT
#include "widestereo/view_synthesis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "error_of.h"
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
        distance, grey(pair.views[0]),
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
  Rig rig = pair.rig;
  rig.views[1].mask = cv::Mat(256, 256, CV_8UC1, cv::Scalar(0));
  EXPECT_EQ(scores_of(truth, rig).windows, 0);
  EXPECT_EQ(scores_of(truth, rig).visible, 0);
  const cv::Mat flat(256, 256, CV_8UC1, cv::Scalar(90));
  EXPECT_EQ(synthesis_scores(truth, flat, synthesised).windows, 0) << "nothing to compare";
}

TEST_F(ViewSynthesis, NeedsMapsOfTheCalibratedSize) {
  EXPECT_THAT(error_of([&] { scores_of(cv::Mat(9, 8, CV_32FC1, cv::Scalar(1)), pair.rig); }),
              ::testing::HasSubstr("distance map of cam0 is 8x9 pixels"));
}

TEST_F(ViewSynthesis, NeedsABaseline) {
  Rig rig = pair.rig;
  rig.views[1].world_from_camera.translation() = rig.views[0].world_from_camera.translation();
  EXPECT_THAT(error_of([&] { scores_of(truth, rig); }), ::testing::HasSubstr("the same centre"));
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
  const auto score = [&](const cv::Mat& distance, const cv::Mat& of_view,
                         const SynthesisedView& synthesised) {
    return error_of([&] { synthesis_scores(distance, of_view, synthesised); });
  };
  EXPECT_EQ(score(truth, image, good), "");
  cv::Mat wide;
  truth.convertTo(wide, CV_64F);
  EXPECT_THAT(score(wide, image, good), HasSubstr("CV_64FC1"));
  EXPECT_THAT(score(truth, pair.views[0].image, good), HasSubstr("CV_8UC3"));
  EXPECT_THAT(score(truth, image, {.image = good.visible, .visible = good.visible}),
              HasSubstr("CV_8UC1 instead of CV_32FC1"));
  EXPECT_THAT(score(truth, image, {.image = good.image, .visible = good.image}),
              HasSubstr("CV_32FC1 instead of CV_8UC1"));
  EXPECT_THAT(score(truth, image, {.image = good.image, .visible = good.visible.rowRange(0, 9)}),
              HasSubstr("view shows is 256x9 pixels instead of 256x256"));
}

}  // namespace
}  // namespace widestereo::test
