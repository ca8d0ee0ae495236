// SPDX-License-Identifier: MIT
#include "widestereo/evaluation.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "widestereo/error.h"
#include "widestereo/synthesis.h"

namespace widestereo {
namespace {

/// Four pixels at the centre of a pinhole pair, 1 m apart, looking the same way; f = 100 px.
class FourPixels : public ::testing::Test {
 protected:
  FourPixels() {
    for (View* view : {&reference_, &source_}) {
      view->camera.width = 4;
      view->camera.height = 2;
      view->camera.fx = view->camera.fy = 100;
      view->camera.cx = 1.5;
      view->camera.cy = 0.5;
    }
    source_.camera.width = 400;
    source_.camera.cx = 300;
    source_.world_from_camera.translation() = Eigen::Vector3d(1, 0, 0);
    truth_.distance = cv::Mat(2, 4, CV_32FC1, cv::Scalar(2));
    truth_.valid = cv::Mat(2, 4, CV_8UC1, cv::Scalar(0));
    truth_.valid.row(0).setTo(255);
  }
  View reference_, source_;
  GroundTruth truth_;
};

TEST_F(FourPixels, EveryFigureIsAsCountedByHand) {
  cv::Mat distance = cv::Mat::zeros(2, 4, CV_32FC1);
  distance.at<float>(0, 0) = 2;      // exact
  distance.at<float>(0, 1) = 2.03f;  // 1.5 %
  distance.at<float>(0, 2) = 1.8f;   // 10 %
  distance.at<float>(0, 3) = 0;      // none
  distance.at<float>(1, 0) = 99;     // not scored
  const std::vector<RegionScores> scores = evaluate(distance, {}, truth_, reference_, source_);
  const RegionScores& all = scores[0];
  EXPECT_EQ(all.region, "all");
  EXPECT_EQ(all.pixels, 4);
  EXPECT_DOUBLE_EQ(all.completeness, 0.75);
  EXPECT_DOUBLE_EQ(all.bad_relative.at(0.01), 0.75);
  EXPECT_DOUBLE_EQ(all.bad_relative.at(0.02), 0.5);
  EXPECT_DOUBLE_EQ(all.bad_relative.at(0.05), 0.5);
  EXPECT_NEAR(all.bad_relative_predicted.at(0.02), 1 / 3.0, 1e-12);
  EXPECT_NEAR(all.mean_absolute, (0 + 0.03 + 0.2) / 3, 1e-6);
  EXPECT_NEAR(all.root_mean_square, std::sqrt((0.03 * 0.03 + 0.2 * 0.2) / 3), 1e-6);
  EXPECT_NEAR(all.median_absolute, 0.03, 1e-6);
  EXPECT_NEAR(all.median_relative, 0.015, 1e-6);
  // z = 2 m is 50 px of disparity; 2.03 m moves it by 0.74 px, 1.8 m by 5.56 px.
  EXPECT_NEAR(all.median_pixels, 100 / 2.0 - 100 / 2.03, 1e-3);
  EXPECT_DOUBLE_EQ(all.bad_pixels.at(0.5), 0.75);
  EXPECT_DOUBLE_EQ(all.bad_pixels.at(1), 0.5);
  EXPECT_NEAR(all.bad_pixels_predicted.at(1), 1 / 3.0, 1e-12);
  EXPECT_EQ(all.mean_normal_angle, -1);
  EXPECT_EQ(scores[2].pixels, 4) << "all within 30 degrees";
  EXPECT_EQ(scores[5].pixels, 0);
}

TEST_F(FourPixels, OcclusionAndNormalsCount) {
  truth_.occlusion = (cv::Mat_<uchar>(2, 4) << 255, 0, 128, 255, 255, 255, 255, 255);
  truth_.normals = cv::Mat(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  cv::Mat normals(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  const double angle = 30 * M_PI / 180;
  normals.at<cv::Vec3f>(0, 3) = {static_cast<float>(std::sin(angle)), 0,
                                 static_cast<float>(-std::cos(angle))};
  const std::vector<RegionScores> scores =
      evaluate(truth_.distance, normals, truth_, reference_, source_);
  EXPECT_EQ(scores[0].pixels, 4);
  EXPECT_EQ(scores[1].pixels, 2);
  EXPECT_NEAR(scores[1].mean_normal_angle, 15, 1e-4);
  EXPECT_NEAR(scores[0].mean_normal_angle, 7.5, 1e-4);
  EXPECT_EQ(scores[1].bad_relative.at(0.005), 0);
}

TEST_F(FourPixels, EmptyAndWrongInputs) {
  truth_.valid.setTo(0);
  const std::vector<RegionScores> none = evaluate(truth_.distance, {}, truth_, reference_, source_);
  EXPECT_EQ(none[0].pixels, 0);
  EXPECT_EQ(none[0].completeness, 0);
  EXPECT_NO_THROW(to_table(none));
  EXPECT_EQ(nlohmann::json::parse(to_json(none)).size(), none.size());
  EXPECT_THROW(evaluate(cv::Mat(3, 4, CV_32FC1), {}, truth_, reference_, source_), Error);
  EXPECT_THROW(evaluate(cv::Mat(2, 4, CV_64FC1), {}, truth_, reference_, source_), Error);
  EXPECT_THROW(evaluate(cv::Mat(), {}, truth_, reference_, source_), Error);
  EXPECT_THROW(evaluate(truth_.distance, cv::Mat(2, 3, CV_32FC3), truth_, reference_, source_),
               Error);
  truth_.valid = cv::Mat(1, 4, CV_8UC1);
  EXPECT_THROW(evaluate(truth_.distance, {}, truth_, reference_, source_), Error);
  truth_.valid.release();
  reference_.camera.width = 5;
  EXPECT_THROW(evaluate(truth_.distance, {}, truth_, reference_, source_), Error);
}

TEST(Evaluation, TruthScoresPerfectlyInEveryBand) {
  const RenderedPair pair = render_demo(96);
  const std::vector<RegionScores> scores =
      evaluate(pair.views[0].truth.distance, pair.views[0].truth.normals, pair.views[0].truth,
               pair.rig.views[0], pair.rig.views[1]);
  long in_bands = 0;
  for (const RegionScores& s : scores) {
    EXPECT_GT(s.pixels, 0) << s.region;
    EXPECT_EQ(s.bad_relative.at(0.005), 0) << s.region;
    EXPECT_LT(s.median_pixels, 1e-6) << s.region;
    EXPECT_LT(s.mean_normal_angle, 0.05) << s.region;
  }
  for (std::size_t i = 2; i < scores.size(); ++i) in_bands += scores[i].pixels;
  EXPECT_EQ(in_bands, scores[1].pixels);
}

TEST(Evaluation, ConsistencyScoresCountPixelsWithAPlane) {
  const cv::Mat cost = (cv::Mat_<float>(1, 4) << 0.1f, 0.3f, 0.1f, 2);
  cv::Mat differences(1, 4, CV_32FC2, cv::Scalar(0, 0));
  differences.at<cv::Vec2f>(0, 1) = {0.05f, 1.5f};
  differences.at<cv::Vec2f>(0, 2) = {1000, 1000};
  const ConsistencyScores s = consistency_scores(differences, cost);
  EXPECT_EQ(s.pixels, 3);
  EXPECT_NEAR(s.consistent_relative, 1 / 3.0, 1e-9);
  EXPECT_NEAR(s.consistent_pixels, 2 / 3.0, 1e-9);
  EXPECT_NEAR(s.low_cost, 2 / 3.0, 1e-9);
  EXPECT_NEAR(s.mean_cost, 0.5 / 3, 1e-6);
}

TEST(Evaluation, SparsificationFallsWhenConfidenceIsRight) {
  const RenderedPair pair = render_demo(96);
  const GroundTruth& truth = pair.views[0].truth;
  cv::Mat distance = truth.distance.clone();
  cv::Mat confidence(distance.size(), CV_32FC1, cv::Scalar(0.9));
  // The upper half is wrong and known to be.
  distance.rowRange(0, 48) *= 0.3;
  confidence.rowRange(0, 48).setTo(0.1);
  const std::vector<SparsificationPoint> curve =
      sparsification(distance, confidence, truth, pair.rig.views[0], pair.rig.views[1]);
  ASSERT_EQ(curve.size(), 10u);
  EXPECT_EQ(curve[2].bad_pixels, 0);
  EXPECT_GT(curve[9].bad_pixels, 0.3);
  EXPECT_NEAR(curve[2].confidence, 0.9, 1e-6);
  EXPECT_NEAR(curve[9].kept, 1, 1e-12);
}

TEST(Evaluation, ReliabilityCountsWhatIsRightInEachBin) {
  const RenderedPair pair = render_demo(96);
  const GroundTruth& truth = pair.views[0].truth;
  cv::Mat distance = truth.distance.clone();
  cv::Mat confidence(distance.size(), CV_32FC1, cv::Scalar(1));
  distance.rowRange(0, 48) *= 0.1;  // wrong
  confidence.rowRange(0, 48).setTo(0.1);
  distance.row(0).setTo(0);  // not predicted: not counted
  const std::vector<ReliabilityBin> bins =
      reliability(distance, confidence, truth, pair.rig.views[0], pair.rig.views[1]);
  EXPECT_NEAR(bins.front().mean_confidence, 0.1, 1e-6);
  EXPECT_LT(bins.front().right, 0.1);
  EXPECT_NEAR(bins.back().mean_confidence, 1, 1e-6);
  EXPECT_EQ(bins.back().right, 1);
  long pixels = 0;
  for (const ReliabilityBin& bin : bins) {
    if (bin.pixels == 0) continue;
    EXPECT_TRUE(&bin == &bins.front() || &bin == &bins.back());
    pixels += bin.pixels;
  }
  EXPECT_GT(bins.front().pixels, 1000);
  EXPECT_LE(pixels, cv::countNonZero(distance));
  EXPECT_NE(to_table(bins).find("0.98 to 1.00"), std::string::npos);
  EXPECT_EQ(to_table(bins).find("0.50 to 0.70"), std::string::npos) << "empty bins are left out";
}

TEST(Evaluation, ErrorPictureColours) {
  GroundTruth truth;
  truth.distance = (cv::Mat_<float>(1, 4) << 2, 2, 2, 0);
  const cv::Mat distance = (cv::Mat_<float>(1, 4) << 2, 3, 0, 2);
  const cv::Mat picture = error_picture(distance, truth);
  EXPECT_GT(picture.at<cv::Vec3b>(0, 0)[1], 150) << "right: green";
  EXPECT_GT(picture.at<cv::Vec3b>(0, 1)[2], 200) << "wrong: red";
  EXPECT_GT(picture.at<cv::Vec3b>(0, 2)[0], 150) << "missing: blue";
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 3), cv::Vec3b(0, 0, 0));
}

}  // namespace
}  // namespace widestereo
