// SPDX-License-Identifier: MIT
// Images whose calibration is a COLMAP model.
#include <nlohmann/json.hpp>

#include "command_fixture.h"

namespace widestereo {
namespace {

using test::Outcome;
using test::run;

/// The pair as COLMAP would have registered it, and the same calibration for Kalibr.
class ColmapCommand : public test::Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    const std::string camera = R"(  camera_model: pinhole
  intrinsics: [30, 31, 47.5, 48]
  distortion_model: equidistant
  distortion_coeffs: [0.01, -0.002, 0, 0]
  resolution: [96, 96]
)";
    folder_.write("same.yaml", "cam0:\n" + camera + "cam1:\n" + camera +
                                   "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], "
                                   "[0, 0, 0, 1]]\n");
    std::filesystem::create_directories(folder_ / "model");
    folder_.write("model/cameras.txt", "1 OPENCV_FISHEYE 96 96 30 31 48 48.5 0.01 -0.002 0 0\n");
    std::string observations, points;
    for (int i = 0; i < 40; ++i) {
      observations += "1 1 " + std::to_string(i) + " ";
      points += std::to_string(i) + " 0 0 " + (i == 0 ? "1" : "4") + " 0 0 0 1 1 0\n";
    }
    folder_.write("model/images.txt", "1 1 0 0 0 0 0 0 1 left.png\n" + observations +
                                          "\n2 1 0 0 0 -0.1 0 0 1 right.png\n" + observations +
                                          "\n3 1 0 0 0 5 0 0 1 away.png\n\n");
    folder_.write("model/points3D.txt", points);
  }

  /// `depth` in the images' own order with the preset's, or the model's, range.
  std::string depth(const std::string& calibration, const std::string& output) const {
    return "depth " + file("left.png") + " " + file("right.png") + " -c " + file(calibration) +
           " -o " + file(output) +
           " --preset paper --device cpu --iterations 2 --second-iterations 1 --window-radius 2 ";
  }
  nlohmann::json record_of(const std::string& output) const {
    std::ifstream stream(folder_ / (output + "/result.json"));
    return nlohmann::json::parse(stream);
  }
  nlohmann::json options_of(const std::string& output) const {
    return record_of(output)["options"];
  }
  cv::Mat distance_in(const std::string& output) const {
    return cv::imread(file(output + "/distance0.tiff"), cv::IMREAD_UNCHANGED);
  }
};

TEST_F(ColmapCommand, MatchesLikeTheSameCalibrationAndCoversTheModelsPoints) {
  const Outcome colmap = run(depth("model", "colmap"));
  ASSERT_EQ(colmap.exit_code, 0) << colmap.output;
  EXPECT_NE(colmap.output.find("right.png: "), std::string::npos) << colmap.output;
  EXPECT_EQ(record_of("colmap")["conventions"]["unit"], "that of the reconstruction");
  // From right.png, points at 1 and 4 are a little farther than from left.png.
  const nlohmann::json options = options_of("colmap");
  EXPECT_EQ(options["min_distance"], 0.75);
  EXPECT_NEAR(options["max_distance"], 1.25 * std::hypot(4, 0.1), 1e-9);
  const Outcome kalibr =
      run(depth("same.yaml", "out") + "--min-distance " + options["min_distance"].dump() +
          " --max-distance " + options["max_distance"].dump());
  ASSERT_EQ(kalibr.exit_code, 0) << kalibr.output;
  EXPECT_EQ(record_of("out")["conventions"]["unit"], "metre");
  ASSERT_GT(cv::countNonZero(distance_in("out")), 5000);
  EXPECT_EQ(cv::norm(distance_in("colmap"), distance_in("out"), cv::NORM_INF), 0);
}

TEST_F(ColmapCommand, OneImageIsJoinedByTheBestOthers) {
  std::string one = depth("model", "one");
  one.erase(one.find(file("right.png")), file("right.png").size());
  const Outcome joined = run(one);
  ASSERT_EQ(joined.exit_code, 0) << joined.output;
  ASSERT_EQ(run(depth("model", "colmap")).exit_code, 0);
  EXPECT_EQ(cv::norm(distance_in("one"), distance_in("colmap"), cv::NORM_INF), 0);
  expect_error("depth " + file("left.png") + " -c " + file("same.yaml") + " -o " + file("out"),
               "One image is not enough");
  expect_error("depth " + file("away.png") + " -c " + file("model") + " -o " + file("out"),
               "no image that shares points");
}

TEST_F(ColmapCommand, RangesGivenCountMore) {
  const Outcome outcome = run(depth("model", "colmap") + "--max-distance 9");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(options_of("colmap")["min_distance"], 0.75);
  EXPECT_EQ(options_of("colmap")["max_distance"], 9);
}

TEST_F(ColmapCommand, WhatItCannotTellIsAskedFor) {
  std::filesystem::remove(folder_ / "model/points3D.txt");
  expect_error(depth("model", "out") + "--max-distance 9",
               "give --min-distance and --max-distance");
  EXPECT_EQ(run(depth("model", "out") + "--min-distance 1 --max-distance 9").exit_code, 0);
}

TEST_F(ColmapCommand, OptionsWithoutMeaningAreRefused) {
  folder_.write("poses.txt", "0 0 0 0 0 0 0 1\n1 0.1 0 0 0 0 0 1\n");
  expect_error(depth("model", "out") + "--sources 1", "--sources chooses what joins one image");
  expect_error(depth("model", "out") + "--views 0,1", "--views has no meaning");
  expect_error(depth("model", "out") + "--poses " + file("poses.txt"), "--poses has no meaning");
  for (const char* camera : {"frames/cam0", "frames/cam1"}) {
    std::filesystem::create_directories(folder_ / camera);
    std::filesystem::copy_file(file("left.png"), folder_ / camera / "1.png");
  }
  expect_error("sequence " + file("frames") + " -c " + file("model") + " -o " + file("out"),
               "is a COLMAP model");
  expect_error("calibration show " + file("model"), "is a COLMAP model");
}

TEST_F(ColmapCommand, MasksAndFieldsOfViewApply) {
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 48) = 0;
  cv::imwrite(file("mask.png"), mask);
  const Outcome outcome =
      run(depth("model", "colmap") + "--max-theta 50 --json --mask " + file("mask.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(nlohmann::json::parse(outcome.output)["views"][1]["max_theta_degrees"], 50);
  EXPECT_EQ(cv::countNonZero(distance_in("colmap").colRange(0, 48)), 0);
  EXPECT_GT(cv::countNonZero(distance_in("colmap").colRange(48, 96)), 500);
}

}  // namespace
}  // namespace widestereo
