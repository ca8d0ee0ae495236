// SPDX-License-Identifier: MIT
#include "widestereo/evaluation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <clocale>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "comma_locale.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "widestereo/error.h"
#include "widestereo/synthesis.h"

namespace widestereo {
namespace {

/// Throws std::out_of_range where there is none of this name.
const RegionScores& region(const std::vector<RegionScores>& scores, const std::string& name) {
  const auto found = std::find_if(scores.begin(), scores.end(),
                                  [&](const RegionScores& s) { return s.region == name; });
  return scores.at(static_cast<std::size_t>(found - scores.begin()));
}

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
  EXPECT_TRUE(std::isnan(all.mean_normal_angle));
  EXPECT_EQ(region(scores, "0-30 deg").pixels, 4);
  EXPECT_EQ(region(scores, ">90 deg").pixels, 0);
  // Without an occlusion map nothing is known of what it would leave out.
  EXPECT_EQ(to_table(scores).find("non-occluded"), std::string::npos);
  EXPECT_EQ(to_json(scores).find("non-occluded"), std::string::npos);
}

TEST_F(FourPixels, TablesDoNotDependOnTheLocale) {
  const std::vector<RegionScores> scores =
      evaluate(truth_.distance, {}, truth_, reference_, source_);
  const std::string table = to_table(scores);
  const test::CommaNumbers numbers;
  if (!numbers.installed()) GTEST_SKIP() << "no locale with a decimal comma is installed";
  EXPECT_EQ(to_table(scores), table);
  EXPECT_STREQ(std::localeconv()->decimal_point, ",") << "the application's locale stays";
}

TEST_F(FourPixels, MediansOfAnEvenNumberAreBetweenTheMiddleTwo) {
  cv::Mat distance = truth_.distance.clone();
  cv::Mat_<float>({1, 4}, {2, 2.02f, 2.06f, 2.4f}).copyTo(distance.row(0));
  const RegionScores all = evaluate(distance, {}, truth_, reference_, source_)[0];
  EXPECT_NEAR(all.median_absolute, 0.04, 1e-6);
  EXPECT_NEAR(all.median_relative, 0.02, 1e-6);
  EXPECT_NEAR(all.mean_absolute, 0.12, 1e-6);
}

TEST_F(FourPixels, MissingNormalsDoNotCount) {
  const auto tilted = [](double degrees) {
    return cv::Vec3f(static_cast<float>(std::sin(degrees * radians_per_degree)), 0,
                     static_cast<float>(-std::cos(degrees * radians_per_degree)));
  };
  truth_.normals = cv::Mat(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  cv::Mat normals = cv::Mat::zeros(2, 4, CV_32FC3);
  normals.at<cv::Vec3f>(0, 0) = tilted(10);
  normals.at<cv::Vec3f>(0, 1) = tilted(20);
  normals.at<cv::Vec3f>(0, 3) = tilted(60);
  const RegionScores all = evaluate(truth_.distance, normals, truth_, reference_, source_)[0];
  EXPECT_NEAR(all.mean_normal_angle, 30, 1e-4);
  EXPECT_NEAR(all.median_normal_angle, 20, 1e-4);
  truth_.normals.at<cv::Vec3f>(0, 3) = {0, 0, 0};
  EXPECT_NEAR(evaluate(truth_.distance, normals, truth_, reference_, source_)[0].mean_normal_angle,
              15, 1e-4);
}

TEST_F(FourPixels, ThePixelOnTheAxisIsWithin30Degrees) {
  reference_.camera.cx = 1;
  reference_.camera.cy = 0;
  const auto scores = evaluate(truth_.distance, {}, truth_, reference_, source_);
  EXPECT_EQ(region(scores, "0-30 deg").pixels, 4);
}

/// No two of the figures are the same.
TEST_F(FourPixels, EveryFigureIsInItsColumnAndUnderItsKey) {
  cv::Mat distance = truth_.distance.clone();
  cv::Mat_<float>({1, 4}, {0, 2.004f, 2.06f, 2.4f}).copyTo(distance.row(0));
  truth_.normals = cv::Mat(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  cv::Mat normals(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  normals.at<cv::Vec3f>(0, 3) = {1, 0, 0};
  const std::vector<RegionScores> scores = evaluate(distance, normals, truth_, reference_, source_);
  const RegionScores& all = scores[0];
  const nlohmann::json json = nlohmann::json::parse(to_json(scores))[0];
  EXPECT_EQ(json["median_pixels"], all.median_pixels);
  EXPECT_EQ(json["median_relative"], all.median_relative);
  EXPECT_EQ(json["median_absolute"], all.median_absolute);
  EXPECT_EQ(json["mean_absolute"], all.mean_absolute);
  EXPECT_EQ(json["root_mean_square"], all.root_mean_square);
  EXPECT_EQ(json["mean_normal_angle"], all.mean_normal_angle);
  EXPECT_EQ(json["median_normal_angle"], all.median_normal_angle);
  EXPECT_EQ(json["bad_relative"]["0.02"], 3 / 4.0);
  EXPECT_EQ(json["bad_relative_predicted"]["0.02"], 2 / 3.0);
  EXPECT_EQ(json["bad_pixels"]["2.0"], 2 / 4.0);
  EXPECT_EQ(json["bad_pixels_predicted"]["2.0"], 1 / 3.0);
  // Errors of 4, 60 and 400 mm; z = 2.06 m is 100 / 2 - 100 / 2.06 = 1.456 px off.
  EXPECT_THAT(
      to_table(scores),
      ::testing::HasSubstr("all                      4  75.0% |  75.0%  75.0%  75.0%  50.0% |"
                           "  75.0%  75.0%  50.0% |   1.456   3.000  0.1547  0.2335 |   0.0"
                           "  30.0\n"));
}

TEST_F(FourPixels, AViewAloneHasNoDisplacements) {
  truth_.normals = cv::Mat(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  const std::vector<RegionScores> alone =
      evaluate(truth_.distance * 1.015, truth_.normals, truth_, reference_);
  EXPECT_EQ(alone[0].pixels, 4);
  EXPECT_EQ(alone[0].bad_relative.at(0.01), 1);
  EXPECT_EQ(alone[0].bad_relative.at(0.02), 0);
  EXPECT_EQ(alone[0].mean_normal_angle, 0);
  EXPECT_EQ(region(alone, "0-30 deg").pixels, 4);
  EXPECT_TRUE(std::isnan(alone[0].bad_pixels.at(2)));
  EXPECT_TRUE(std::isnan(alone[0].bad_pixels_predicted.at(2)));
  EXPECT_TRUE(std::isnan(alone[0].median_pixels));
  EXPECT_THAT(to_table(alone), ::testing::HasSubstr("|      -      -      - |       - "));
}

TEST_F(FourPixels, OcclusionAndNormalsCount) {
  truth_.occlusion = (cv::Mat_<uchar>(2, 4) << 255, 0, 128, 255, 255, 255, 255, 255);
  truth_.normals = cv::Mat(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  cv::Mat normals(2, 4, CV_32FC3, cv::Scalar(0, 0, -1));
  const double angle = 30 * radians_per_degree;
  normals.at<cv::Vec3f>(0, 3) = {static_cast<float>(std::sin(angle)), 0,
                                 static_cast<float>(-std::cos(angle))};
  const std::vector<RegionScores> scores =
      evaluate(truth_.distance, normals, truth_, reference_, source_);
  EXPECT_EQ(scores[0].pixels, 4);
  EXPECT_NEAR(scores[0].mean_normal_angle, 7.5, 1e-4);
  const RegionScores& visible = region(scores, "non-occluded");
  EXPECT_EQ(visible.pixels, 2);
  EXPECT_NEAR(visible.mean_normal_angle, 15, 1e-4);
  EXPECT_EQ(visible.bad_relative.at(0.005), 0);
}

TEST_F(FourPixels, DisplacementsAreOfPointsInTheSourceImage) {
  // Pixels 0 to 3 are at u = 250 to 253 there.
  source_.camera.width = 253;
  source_.camera.cx = 301.5;
  cv::Mat distance = truth_.distance.clone();
  distance.at<float>(0, 1) = 0;  // none
  std::vector<RegionScores> scores = evaluate(distance, {}, truth_, reference_, source_);
  for (const char* name : {"all", "0-30 deg"}) {
    EXPECT_EQ(region(scores, name).pixels, 4);
    EXPECT_NEAR(region(scores, name).bad_relative.at(0.01), 1 / 4.0, 1e-12);
    EXPECT_NEAR(region(scores, name).bad_pixels.at(1), 1 / 3.0, 1e-12);
    EXPECT_EQ(region(scores, name).bad_pixels_predicted.at(1), 0);
  }
  const cv::Mat confidence = (cv::Mat_<float>(2, 4) << 0.9, 0.1, 0.8, 0.7, 0, 0, 0, 0);
  const auto curve = sparsification(distance, confidence, truth_, reference_, source_);
  EXPECT_NEAR(curve.back().bad_pixels, 1 / 3.0, 1e-12);
  distance.at<float>(0, 3) = 0;  // none, outside of the source image
  EXPECT_NEAR(evaluate(distance, {}, truth_, reference_, source_)[0].bad_pixels.at(1), 1 / 3.0,
              1e-12);
  // A map that marks what lies outside says the same of what is visible.
  truth_.occlusion = (cv::Mat_<uchar>(2, 4) << 255, 255, 255, 128, 255, 255, 255, 255);
  scores = evaluate(distance, {}, truth_, reference_, source_);
  EXPECT_EQ(scores[0].pixels, 4);
  EXPECT_EQ(region(scores, "non-occluded").pixels, 3);
  for (const char* name : {"all", "non-occluded", "0-30 deg"}) {
    EXPECT_NEAR(region(scores, name).bad_pixels.at(1), 1 / 3.0, 1e-12);
  }
  truth_.occlusion(cv::Rect(1, 0, 1, 1)).setTo(0);  // what has none
  const auto of_visible = sparsification(distance, confidence, truth_, reference_, source_);
  EXPECT_EQ(of_visible.back().bad_pixels, 0);
}

TEST_F(FourPixels, FarThingsWithoutGroundTruthAreRightWithinTwoPixels) {
  truth_.distance.row(0).setTo(0);  // the other row has ground truth
  truth_.field_of_view = cv::Mat(2, 4, CV_8UC1, cv::Scalar(255));
  // At 100 m the last pixel's point lies right of the source image, at u = 300.3.
  source_.camera.width = 300;
  source_.camera.cx = 299.8;
  cv::Mat distance(2, 4, CV_32FC1, cv::Scalar(100));
  distance.at<float>(0, 1) = 40;  // 100 / 40 - 100 / 100 = 1.5 px
  distance.at<float>(0, 2) = 20;  // 4 px
  FarScores far = far_scores(distance, truth_, reference_, source_, 100);
  EXPECT_EQ(far.pixels, 3);
  EXPECT_NEAR(far.right, 2 / 3.0, 1e-12);
  EXPECT_NE(to_table(far).find("3 pixels, 66.7% within 2 px of 100 m"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(to_json(far))["pixels"], 3);
  distance.at<float>(0, 0) = 0;  // no prediction is not right
  EXPECT_NEAR(far_scores(distance, truth_, reference_, source_, 100).right, 1 / 3.0, 1e-12);
  truth_.field_of_view.at<uchar>(0, 0) = 0;
  far = far_scores(distance, truth_, reference_, source_, 100);
  EXPECT_EQ(far.pixels, 2);
  EXPECT_NEAR(far.right, 0.5, 1e-12);
  for (const double nowhere : {0.0, -5.0, std::nan(""), 1e300}) {
    EXPECT_THROW(far_scores(distance, truth_, reference_, source_, nowhere), Error) << nowhere;
  }
  truth_.field_of_view.release();
  EXPECT_THROW(far_scores(distance, truth_, reference_, source_, 100), Error);
}

TEST_F(FourPixels, SourcesTellDistances) {
  const auto error = [this] {
    return test::error_of([this] { evaluate(truth_.distance, {}, truth_, reference_, source_); });
  };
  EXPECT_EQ(error(), "");
  source_.camera.fx = std::nan("");
  EXPECT_THAT(error(), ::testing::HasSubstr("fx"));
  source_.camera.fx = 100;
  source_.world_from_camera.setIdentity();
  EXPECT_THAT(error(), ::testing::HasSubstr("the same centre"));
}

/// 40 x 24 pixels, stripes in the right half, a step of distance at column 30, a crease at row 20.
class TexturedScene : public ::testing::Test {
 protected:
  static constexpr int columns = 40;
  static constexpr int rows = 24;

  TexturedScene() {
    for (View* view : {&reference_, &source_}) {
      view->camera.width = columns;
      view->camera.height = rows;
      view->camera.fx = view->camera.fy = 100;
      view->camera.cx = 19.5;
      view->camera.cy = 11.5;
    }
    source_.world_from_camera.translation() = Eigen::Vector3d(0.01, 0, 0);
    truth_.distance = cv::Mat(rows, columns, CV_32FC1, cv::Scalar(2));
    truth_.distance.colRange(30, columns).setTo(3);
    truth_.normals = cv::Mat(rows, columns, CV_32FC3, cv::Scalar(0, 0, -1));
    truth_.normals.rowRange(20, rows).setTo(tilted(30));
    // One stripe of nine columns deviates by 3.8 grey levels, two by 5.0: textured from column 19.
    truth_.image = cv::Mat::zeros(rows, columns, CV_8UC1);
    for (int x = 21; x < columns; x += 2) truth_.image.col(x).setTo(12);
  }
  static cv::Scalar tilted(double degrees) {
    return {std::sin(degrees * radians_per_degree), 0, -std::cos(degrees * radians_per_degree)};
  }
  const RegionScores& textured(const cv::Mat& normals) {
    scores_ = evaluate(truth_.distance, normals, truth_, reference_, source_);
    return region(scores_, "textured");
  }
  const RegionScores& interior() const { return region(scores_, "textured interior"); }

  View reference_, source_;
  GroundTruth truth_;
  std::vector<RegionScores> scores_;
};

TEST_F(TexturedScene, TexturedAndInteriorPixelsAreAsCountedByHand) {
  cv::Mat normals = truth_.normals.clone();
  normals.col(20).rowRange(0, 20).setTo(tilted(40));
  EXPECT_EQ(textured(normals).pixels, 21 * 24);
  EXPECT_NEAR(region(scores_, "textured").mean_normal_angle, 20 * 40 / 504.0, 1e-3);
  // Eight pixels from columns 29 and 30: 19 to 21, 38 and 39; eight from rows 19 and 20: up to 11.
  EXPECT_EQ(interior().pixels, 5 * 12);
  EXPECT_NEAR(interior().mean_normal_angle, 12 * 40 / 60.0, 1e-3);
  EXPECT_NE(to_table(scores_).find("textured interior       60 "), std::string::npos);
}

TEST_F(TexturedScene, OcclusionAndMissingGroundTruthCount) {
  truth_.occlusion = cv::Mat(rows, columns, CV_8UC1, cv::Scalar(255));
  truth_.occlusion.at<uchar>(0, 19) = 0;
  // A hole in the corner is an edge, too: of columns 38 and 39 rows 9 to 11 remain.
  truth_.distance.at<float>(0, 39) = 0;
  EXPECT_EQ(textured({}).pixels, 504 - 2);
  EXPECT_EQ(interior().pixels, 3 * 12 - 1 + 2 * 3);
}

TEST_F(TexturedScene, SmallStepsAreNoEdges) {
  truth_.distance.colRange(30, columns).setTo(2.09);
  truth_.normals.rowRange(20, rows).setTo(tilted(19));
  EXPECT_EQ(textured({}).pixels, 504);
  EXPECT_EQ(interior().pixels, 504);
  truth_.distance.colRange(30, columns).setTo(2.11);
  truth_.normals.rowRange(20, rows).setTo(tilted(21));
  textured({});
  EXPECT_EQ(interior().pixels, 60);
}

TEST_F(TexturedScene, WithoutNormalsCreasesAreNotKnownAndTheRegionSaysSo) {
  truth_.normals.release();
  EXPECT_EQ(textured({}).pixels, 504);
  EXPECT_THROW(interior(), std::out_of_range);
  EXPECT_EQ(region(scores_, "textured no steps").pixels, 5 * 24);
  EXPECT_NE(to_table(scores_).find("textured no steps      120 "), std::string::npos);
}

TEST_F(TexturedScene, TheBorderOfTheFieldOfViewIsNoTexture) {
  reference_.camera.max_theta = std::atan(0.1);  // 10 pixels
  truth_.image.setTo(0);
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      if (std::hypot(x - 19.5, y - 11.5) <= 10) truth_.image.at<uchar>(y, x) = 100;
    }
  }
  EXPECT_EQ(textured({}).pixels, 0);
  truth_.image.setTo(200, truth_.image == 0);
  EXPECT_EQ(textured({}).pixels, 0);
  reference_.camera.max_theta = M_PI;
  EXPECT_GT(textured({}).pixels, 0);
}

TEST_F(FourPixels, WithoutARayAreNotScored) {
  // The four in the middle have one, the others would be more than 180 degrees off the axis.
  reference_.camera.model = CameraModel::kannala_brandt;
  reference_.camera.fx = reference_.camera.fy = 0.4;
  const RegionScores all = evaluate(truth_.distance, {}, truth_, reference_, source_)[0];
  EXPECT_EQ(all.pixels, 2);
  EXPECT_EQ(all.completeness, 1);
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
  GroundTruth truth = pair.views[0].truth;
  const auto score = [&] {
    return evaluate(truth.distance, truth.normals, truth, pair.rig.views[0], pair.rig.views[1]);
  };
  const std::vector<RegionScores> scores = score();
  long in_bands = 0;
  for (const RegionScores& s : scores) {
    EXPECT_GT(s.pixels, 0) << s.region;
    EXPECT_EQ(s.bad_relative.at(0.005), 0) << s.region;
    EXPECT_EQ(s.bad_pixels.at(0.5), 0) << s.region;
    EXPECT_LT(s.median_pixels, 1e-6) << s.region;
    EXPECT_LT(s.mean_normal_angle, 0.05) << s.region;
  }
  for (std::size_t i = 2; i < scores.size(); ++i) in_bands += scores[i].pixels;
  EXPECT_EQ(in_bands, region(scores, "non-occluded").pixels);
  truth.occlusion.release();
  for (const RegionScores& s : score()) EXPECT_EQ(s.bad_pixels.at(0.5), 0) << s.region;
}

TEST(Evaluation, ConsistencyScoresCountPixelsWithAPlane) {
  const cv::Mat cost = (cv::Mat_<float>(1, 4) << 0.1f, 0.3f, 0.1f, 2);
  cv::Mat differences(1, 4, CV_32FC2, cv::Scalar(0.019, 1.9));
  differences.at<cv::Vec2f>(0, 1) = {0.01f, 1.5f};
  differences.at<cv::Vec2f>(0, 2) = {1000, 1000};
  const ConsistencyScores s = consistency_scores(differences, cost);
  EXPECT_EQ(s.pixels, 3);
  EXPECT_NEAR(s.consistent_relative, 2 / 3.0, 1e-9);
  EXPECT_NEAR(s.consistent_pixels, 2 / 3.0, 1e-9);
  EXPECT_NEAR(s.low_cost, 2 / 3.0, 1e-9);
  EXPECT_NEAR(s.mean_cost, 0.5 / 3, 1e-6);
  differences.at<cv::Vec2f>(0, 0) = {0.021f, 2.1f};
  EXPECT_NEAR(consistency_scores(differences, cost).consistent_relative, 1 / 3.0, 1e-9);
  EXPECT_NEAR(consistency_scores(differences, cost).consistent_pixels, 1 / 3.0, 1e-9);
  const ConsistencyScores of_none =
      consistency_scores(differences, cv::Mat(1, 4, CV_32FC1, cv::Scalar(2)));
  EXPECT_EQ(of_none.pixels, 0);
  for (const double share : {of_none.mean_cost, of_none.low_cost, of_none.low_cost_textured,
                             of_none.consistent_relative, of_none.consistent_pixels}) {
    EXPECT_TRUE(std::isnan(share)) << share;
  }
}

TEST(Evaluation, MapsThatDoNotFitAreNamed) {
  using test::error_of;
  using ::testing::HasSubstr;
  const cv::Mat cost = cv::Mat::ones(2, 4, CV_32FC1), narrow = cv::Mat::ones(2, 3, CV_32FC1);
  const cv::Mat differences = cv::Mat::ones(2, 4, CV_32FC2), mask = cv::Mat::ones(2, 4, CV_8UC1);
  const auto consistency = [](const cv::Mat& a, const cv::Mat& b, const cv::Mat& c) {
    return error_of([&] { consistency_scores(a, b, c); });
  };
  EXPECT_EQ(consistency(differences, cost, mask), "");
  EXPECT_THAT(consistency({}, cost, {}), HasSubstr("map of differences is empty"));
  EXPECT_THAT(consistency(cost, cost, {}), HasSubstr("CV_32FC1 instead of CV_32FC2"));
  EXPECT_THAT(consistency(differences, narrow, {}), HasSubstr("4x2 pixels instead of 3x2"));
  EXPECT_THAT(consistency(differences, mask, {}), HasSubstr("cost map is CV_8UC1"));
  EXPECT_THAT(consistency(differences, cost, cost), HasSubstr("textured pixels is CV_32FC1"));
  EXPECT_THAT(error_of([&] { textured_pixels(cost, mask); }), HasSubstr("image is CV_32FC1"));
  EXPECT_THAT(error_of([&] { textured_pixels(mask, mask.colRange(0, 3)); }),
              HasSubstr("3x2 pixels instead of 4x2"));
  GroundTruth truth;
  const auto picture = [&truth](const cv::Mat& distance) {
    return error_of([&] { error_picture(distance, truth); });
  };
  EXPECT_THAT(picture(cost), HasSubstr("ground truth is empty"));
  truth.distance = cost;
  EXPECT_EQ(picture(cost), "");
  EXPECT_THAT(picture(narrow), HasSubstr("ground truth is 4x2 pixels instead of 3x2"));
  EXPECT_THAT(picture(mask), HasSubstr("distance map is CV_8UC1"));
  truth.valid = cost;
  EXPECT_THAT(picture(cost), HasSubstr("mask of valid pixels is CV_32FC1"));
  truth.valid = mask;
  truth.occlusion = mask.rowRange(0, 1);
  EXPECT_THAT(picture(cost), HasSubstr("occlusion map is 4x1"));
  truth.occlusion = cv::Mat(2, 4, CV_8UC1, cv::Scalar(255));
  truth.occlusion.at<uchar>(0, 1) = 128;
  truth.occlusion.at<uchar>(0, 2) = 0;
  EXPECT_EQ(picture(cost), "");
  truth.occlusion.at<uchar>(1, 3) = 1;
  EXPECT_THAT(picture(cost), HasSubstr("occlusion map has 1 at pixel (3, 1); give 255"));
}

/// The left half is blank: textured from column 19.
TEST_F(TexturedScene, LowCostIsAlsoCountedWhereThereIsTexture) {
  const cv::Mat field_of_view(rows, columns, CV_8UC1, cv::Scalar(255));
  const cv::Mat textured = textured_pixels(truth_.image, field_of_view);
  EXPECT_EQ(cv::countNonZero(textured.colRange(0, 19)), 0);
  EXPECT_EQ(cv::countNonZero(textured.colRange(19, columns)), 21 * 24);
  cv::Mat cost(rows, columns, CV_32FC1, cv::Scalar(1));
  cost.colRange(19, columns).setTo(0.1);
  cost.row(0).setTo(2);  // no plane
  cost.row(1).colRange(19, columns).setTo(0.5);
  const cv::Mat differences(rows, columns, CV_32FC2, cv::Scalar(0, 0));
  const ConsistencyScores s = consistency_scores(differences, cost, textured);
  EXPECT_EQ(s.textured, 21 * 23);
  EXPECT_NEAR(s.low_cost_textured, 22 / 23.0, 1e-9);
  EXPECT_NEAR(s.low_cost, 22 * 21 / (23.0 * 40), 1e-9);
  const ConsistencyScores without = consistency_scores(differences, cost);
  EXPECT_EQ(without.textured, 0);
  EXPECT_TRUE(std::isnan(without.low_cost_textured)) << without.low_cost_textured;
  EXPECT_EQ(without.low_cost, s.low_cost);
}

TEST_F(FourPixels, WhatNoPixelTellsIsUnknown) {
  const cv::Mat nothing = cv::Mat::zeros(2, 4, CV_32FC1);
  const std::vector<RegionScores> scores = evaluate(nothing, {}, truth_, reference_, source_);
  EXPECT_EQ(scores[0].completeness, 0);
  EXPECT_EQ(scores[0].bad_relative.at(0.02), 1);
  for (const double score :
       {scores[0].median_pixels, scores[0].median_relative, scores[0].mean_absolute,
        scores[0].root_mean_square, scores[0].bad_relative_predicted.at(0.02)}) {
    EXPECT_TRUE(std::isnan(score)) << score;
  }
  EXPECT_TRUE(nlohmann::json::parse(to_json(scores))[0]["mean_absolute"].is_null());
  EXPECT_EQ(to_table(scores).find("nan"), std::string::npos) << to_table(scores);
  truth_.field_of_view = nothing.clone();
  truth_.field_of_view.convertTo(truth_.field_of_view, CV_8U);
  const FarScores far = far_scores(nothing, truth_, reference_, source_, 50);
  EXPECT_TRUE(std::isnan(far.right)) << far.right;
  EXPECT_EQ(to_table(far), "without ground truth: 0 pixels, - within 2 px of 50 m\n");
  EXPECT_TRUE(nlohmann::json::parse(to_json(far))["right"].is_null());
  const auto bins = reliability(nothing, nothing, truth_, reference_, source_);
  const nlohmann::json first = nlohmann::json::parse(to_json(bins))[0];
  EXPECT_EQ(first["pixels"], 0);
  EXPECT_TRUE(first["right"].is_null());
  EXPECT_TRUE(first["mean_confidence"].is_null());
}

TEST_F(FourPixels, ConfidencesAreProbabilities) {
  const cv::Mat distance(2, 4, CV_32FC1, cv::Scalar(2));
  for (const float wrong : {1.5F, -0.1F, std::numeric_limits<float>::quiet_NaN()}) {
    const cv::Mat confidence(2, 4, CV_32FC1, cv::Scalar(wrong));
    const std::string error =
        test::error_of([&] { sparsification(distance, confidence, truth_, reference_, source_); });
    EXPECT_NE(error.find("at pixel (0, 0); give one of numbers from 0 to 1"), std::string::npos)
        << error;
  }
}

TEST_F(FourPixels, ConfidencesAreNotInvented) {
  const cv::Mat distance(2, 4, CV_32FC1, cv::Scalar(2));
  const auto expect_error = [&](const cv::Mat& confidence, const char* message) {
    const auto error = [&](auto score) {
      return test::error_of([&] { score(distance, confidence, truth_, reference_, source_); });
    };
    EXPECT_THAT(error(sparsification), ::testing::HasSubstr(message));
    EXPECT_THAT(error(reliability), ::testing::HasSubstr(message));
  };
  expect_error({}, "The confidence map is empty");
  expect_error(cv::Mat::ones(2, 4, CV_64FC1), "The confidence map is CV_64FC1");
  expect_error(cv::Mat::ones(2, 3, CV_32FC1), "The confidence map is 3x2");
}

TEST_F(FourPixels, SparsificationKeepsTheSurestPixels) {
  cv::Mat distance = truth_.distance.clone();
  cv::Mat_<float>({1, 4}, {2, 1, 2, 0}).copyTo(distance.row(0));
  const cv::Mat confidence = (cv::Mat_<float>(2, 4) << 0.25, 0.5, 1, 0.75, 0, 0, 0, 0);
  const auto curve = sparsification(distance, confidence, truth_, reference_, source_);
  ASSERT_EQ(curve.size(), 10U);
  // One of them at least, though a tenth is none.
  const std::vector<std::size_t> counts = {1, 1, 1, 1, 2, 2, 2, 3, 3, 4};
  const std::array bad = {0., 1 / 2., 2 / 3., 2 / 4.};
  for (std::size_t i = 0; i < 10; ++i) {
    const std::size_t kept = counts[i];
    EXPECT_EQ(curve[i].kept, static_cast<double>(kept) / 4);
    EXPECT_EQ(curve[i].confidence, 1.25 - 0.25 * static_cast<double>(kept));
    EXPECT_EQ(curve[i].bad_pixels, bad[kept - 1]);
  }
  EXPECT_THAT(to_table(curve), ::testing::HasSubstr("          75%      0.500       66.67%\n"));
}

TEST_F(FourPixels, ReliabilityIsOfBinsThatBeginWithTheirLowerEnd) {
  cv::Mat distance = truth_.distance.clone();
  distance.at<float>(0, 1) = 1;  // wrong
  const cv::Mat confidence = (cv::Mat_<float>(2, 4) << 0.5, 0.5, 1, 0, 0, 0, 0, 0);
  const auto bins = reliability(distance, confidence, truth_, reference_, source_);
  for (const ReliabilityBin& bin : bins) {
    EXPECT_EQ(bin.pixels, bin.low == 0.5 ? 2 : bin.low == 0 || bin.high == 1 ? 1 : 0) << bin.low;
  }
  EXPECT_THAT(
      to_table(bins),
      ::testing::HasSubstr("0.50 to 0.70      50.0%      0.500     50.0% |     75.0%     66.7%\n"));
  // Of 3 pixels at 0.5 and more, 1 is right now, whatever the confidences say.
  distance.row(0).colRange(1, 3).setTo(1);
  EXPECT_THAT(to_table(reliability(distance, confidence, truth_, reference_, source_)),
              ::testing::HasSubstr("     50.0% |     75.0%     33.3%\n"));
  truth_.distance.setTo(0);
  EXPECT_EQ(to_table(reliability(distance, confidence, truth_, reference_, source_)), "");
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
  distance.row(40).setTo(0);  // not predicted: not counted
  confidence.row(40).setTo(0.6);
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

TEST(Evaluation, ErrorPictureGoesFromGreenOverYellowToRed) {
  GroundTruth truth;
  truth.distance = cv::Mat(1, 5, CV_32FC1, cv::Scalar(1));
  truth.valid = (cv::Mat_<uchar>(1, 5) << 255, 255, 255, 255, 0);
  const cv::Mat distance = (cv::Mat_<float>(1, 5) << 1.0049f, 0.984f, 1.051f, 1, 1);
  const cv::Mat picture = error_picture(distance, truth);
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 200, 0));
  EXPECT_GT(picture.at<cv::Vec3b>(0, 1)[1], 190);
  EXPECT_GT(picture.at<cv::Vec3b>(0, 1)[2], 240);
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 2), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 4), cv::Vec3b(0, 0, 0)) << "not valid";
  truth.occlusion = (cv::Mat_<uchar>(1, 5) << 255, 0, 255, 128, 255);
  const cv::Mat dimmed = error_picture(distance, truth);
  for (int x : {0, 2}) EXPECT_EQ(dimmed.at<cv::Vec3b>(0, x), picture.at<cv::Vec3b>(0, x));
  for (int x : {1, 3}) {
    EXPECT_LT(dimmed.at<cv::Vec3b>(0, x)[1], 0.6 * picture.at<cv::Vec3b>(0, x)[1]);
  }
}

}  // namespace
}  // namespace widestereo
