// SPDX-License-Identifier: MIT
// Images whose calibration is a COLMAP model or a transforms.json.
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "command_fixture.h"
#include "replaced.h"
#include "same_bits.h"

namespace widestereo {
namespace {

using test::Outcome;
using test::run;
using test::same_bits;

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

TEST_F(ColmapCommand, MapsAreScoredWithTheViewsOfTheirRecord) {
  ASSERT_EQ(run(depth("model", "out")).exit_code, 0);
  cv::imwrite(file("truth.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  const auto evaluate = [this](const std::string& map, const std::string& views) {
    return run("evaluate " + file(map) + " --json --truth " + file("truth.tiff") + views);
  };
  const auto scores = [&evaluate](const std::string& map, const std::string& views) {
    const Outcome outcome = evaluate(map, views);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return json_of(outcome)["regions"];
  };
  for (const auto& [map, views] : {std::pair("out/distance0.tiff", " --view 0 --source 1"),
                                   std::pair("out/distance1.tiff", " --view 1 --source 0")}) {
    const nlohmann::json expected = scores(map, " -c " + file("same.yaml") + views);
    EXPECT_TRUE(expected[0]["median_pixels"].is_number());
    for (const std::string& calibration : {std::string(), " -c " + file("model")}) {
      EXPECT_EQ(scores(map, calibration), expected) << map << calibration;
    }
  }
  const auto refuses = [&evaluate](const std::string& map, const std::string& views,
                                   const std::string& message) {
    const Outcome outcome = evaluate(map, views);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find(message), std::string::npos) << outcome.output;
  };
  std::filesystem::copy_file(file("out/distance0.tiff"), file("elsewhere.tiff"));
  refuses("elsewhere.tiff", " -c " + file("model"),
          file("elsewhere.tiff") + " is not; give the map there");
  refuses("elsewhere.tiff", "", "Give --truth and --calibration");
  folder_.write("out/result.json", R"({"views": [{"name": "a", "files": ["distance0.tiff"]}]})");
  refuses("out/distance0.tiff", "", file("out/result.json") + " is damaged");
}

TEST_F(ColmapCommand, MasksAreThoseOfColmap) {
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 48) = 0;
  std::filesystem::create_directories(folder_ / "masks");
  cv::imwrite(file("masks/left.png.png"), mask);
  const Outcome outcome = run(depth("model", "masked") + "--masks " + file("masks"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(cv::countNonZero(distance_in("masked").colRange(0, 48)), 0);
  EXPECT_GT(cv::countNonZero(distance_in("masked")), 1000);
  EXPECT_EQ(record_of("masked")["input"]["mask_folder"], file("masks"));
  expect_error(depth("same.yaml", "other") + "--masks " + file("masks"),
               "--masks is for images of a COLMAP model");
}

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
  EXPECT_TRUE(same_bits(distance_in("colmap"), distance_in("out")));
}

TEST_F(ColmapCommand, OneImageIsJoinedByTheBestOthers) {
  std::string one = depth("model", "one");
  one.erase(one.find(file("right.png")), file("right.png").size());
  const Outcome joined = run(one);
  ASSERT_EQ(joined.exit_code, 0) << joined.output;
  ASSERT_EQ(run(depth("model", "colmap")).exit_code, 0);
  EXPECT_TRUE(same_bits(distance_in("one"), distance_in("colmap")));
  expect_error("depth " + file("left.png") + " -c " + file("same.yaml") + " -o " + file("out"),
               "One image is not enough");
  expect_error("depth " + file("left.png") + " -c " + file("nowhere") + " -o " + file("out"),
               file("nowhere"));
  expect_error("depth " + file("l.png") + " -c " + file("same.yaml") + " -o " + file("out"),
               file("l.png"));
  expect_error("depth " + file("away.png") + " -c " + file("model") + " -o " + file("out"),
               "no image that sees the same as ");
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
  EXPECT_EQ(json_of(outcome)["views"][1]["max_theta_degrees"], 50);
  EXPECT_EQ(cv::countNonZero(distance_in("colmap").colRange(0, 48)), 0);
  EXPECT_GT(cv::countNonZero(distance_in("colmap").colRange(48, 96)), 500);
}

/// Poses are at fault, not a rig.
TEST_F(ColmapCommand, ImagesThatDoNotFitTheModelAreAskedAbout) {
  const auto write = [this](const std::string& name, int shift) {
    cv::Mat noise(96, 110, CV_8UC1);
    cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(noise, noise, {}, 1);
    cv::imwrite(file(name), noise.colRange(shift, shift + 96));
  };
  write("left.png", 0);
  write("right.png", 6);
  folder_.write("model/images.txt", test::replaced(bytes_of("model/images.txt"), "2 1 0 0 0 -0.1",
                                                   "2 0.97 0.26 0 0 -0.1"));
  const Outcome outcome = run("calibration check " + file("left.png") + " " + file("right.png") +
                              " -c " + file("model"));
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_NE(outcome.output.find("does not fit: are the poses those of these images, to world?\n"),
            std::string::npos)
      << outcome.output;
}

/// All of them, one of which sees nothing of the others.
class ReconstructCommand : public ColmapCommand {
 protected:
  void SetUp() override {
    ColmapCommand::SetUp();
    std::filesystem::create_directories(folder_ / "images/right");
    std::filesystem::copy_file(file("left.png"), folder_ / "images/left.png");
    std::filesystem::copy_file(file("right.png"), folder_ / "images/right/1.png");
    std::filesystem::copy_file(file("left.png"), folder_ / "images/away.png");
    replace_in_model("model/images.txt", "right.png", "right/1.png");
  }
  void replace_in_model(const std::string& name, const std::string& from, const std::string& to) {
    std::string text = bytes_of(name);
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
      text.replace(at, from.size(), to);
      at += to.size();
    }
    folder_.write(name, text);
  }
  std::string reconstruct(const std::string& output = "out") const {
    return "reconstruct " + file("images") + " -c " + file("model") + " -o " + file(output) +
           " --preset paper --device cpu --iterations 2 --second-iterations 1 --window-radius 2 ";
  }
  nlohmann::json record() const {
    return nlohmann::json::parse(bytes_of("out/reconstruction.json"));
  }
};

TEST_F(ReconstructCommand, MatchesEveryImageAndFusesTheirPoints) {
  // Three iterations leave little to be confident of.
  const std::string however_unlikely = " --min-confidence 0 ";
  const Outcome outcome = run(reconstruct() + however_unlikely);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("1 of 3 images see nothing that others see"), std::string::npos)
      << outcome.output;
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/away.png"));
  EXPECT_EQ(record()["images"][0]["group"][1]["name"], "right/1.png");
  EXPECT_EQ(options_of("out/left.png")["min_distance"], 0.75);
  // The same as by `depth`.
  const std::string pair = file("images/left.png") + " " + file("images/right/1.png");
  ASSERT_EQ(run("depth " + pair + " -c " + file("model") + " -o " + file("pair") +
                " --preset paper --device cpu --iterations 2 --second-iterations 1"
                " --window-radius 2" +
                however_unlikely)
                .exit_code,
            0);
  EXPECT_TRUE(same_bits(distance_in("out/left.png"), distance_in("pair")));
  const cv::Mat second = cv::imread(file("pair/distance1.tiff"), cv::IMREAD_UNCHANGED);
  EXPECT_TRUE(same_bits(distance_in("out/right/1.png"), second));
  const auto points = record()["cloud"]["points"].get<std::size_t>();
  const cv::Mat accepted = cv::imread(file("pair/distance_accepted0.tiff"), cv::IMREAD_UNCHANGED);
  EXPECT_GT(points, 0.3 * cv::countNonZero(accepted));
  EXPECT_NE(bytes_of("out/cloud.ply").find("element vertex " + std::to_string(points) + "\n"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/cloud_preview.png"));
  // One view will do, but only accepted pixels.
  ASSERT_EQ(run(reconstruct() + however_unlikely + "--min-views 1").exit_code, 0);
  const cv::Mat of_second = cv::imread(file("pair/distance_accepted1.tiff"), cv::IMREAD_UNCHANGED);
  EXPECT_LE(record()["cloud"]["points"], cv::countNonZero(accepted) + cv::countNonZero(of_second));
}

/// Positions are exact in binary in both places, so that single precision alone could differ.
TEST_F(ReconstructCommand, NationalGridsLoseNoPrecision) {
  replace_in_model("model/images.txt", "-0.1 0 0", "-0.125 0 0");
  const std::string pair = "depth " + file("images/left.png") + " " + file("images/right/1.png") +
                           " -c " + file("model") +
                           " --preset paper --device cpu --iterations 2"
                           " --second-iterations 1 --window-radius 2 --no-pictures -o ";
  ASSERT_EQ(run(reconstruct("near") + "--min-views 1").exit_code, 0);
  ASSERT_EQ(run(pair + file("near_pair")).exit_code, 0);
  const nlohmann::json near = nlohmann::json::parse(bytes_of("near/reconstruction.json"));
  EXPECT_EQ(near["cloud"]["origin"], (nlohmann::json{0, 0, 0}));
  EXPECT_EQ(record_of("near_pair")["origin"], (nlohmann::json{0, 0, 0}));

  replace_in_model("model/images.txt", "1 0 0 0 -0.125 0 0", "1 0 0 0 -600000.125 -5700000 0");
  replace_in_model("model/images.txt", "1 0 0 0 0 0 0", "1 0 0 0 -600000 -5700000 0");
  replace_in_model("model/images.txt", "1 0 0 0 5 0 0", "1 0 0 0 -599995 -5700000 0");
  replace_in_model("model/points3D.txt", " 0 0 1 ", " 600000 5700000 1 ");
  replace_in_model("model/points3D.txt", " 0 0 4 ", " 600000 5700000 4 ");
  const Outcome outcome = run(reconstruct("far") + "--min-views 1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(
      outcome.output.find("widestereo: Poses and clouds are relative to (600000, 5700000, 0)"),
      std::string::npos)
      << outcome.output;
  ASSERT_EQ(run(pair + file("far_pair")).exit_code, 0);
  const nlohmann::json origin = {600'000, 5'700'000, 0};
  const nlohmann::json far = nlohmann::json::parse(bytes_of("far/reconstruction.json"));
  EXPECT_EQ(far["cloud"]["origin"], origin);
  EXPECT_EQ(record_of("far/left.png")["origin"], origin);
  EXPECT_EQ(record_of("far_pair")["origin"], origin);
  EXPECT_EQ(record_of("far_pair")["views"][1]["world_from_camera"][3], 0.125);
  for (const std::string name : {"/cloud.ply", "_pair/cloud0.ply"}) {
    std::string near_cloud = bytes_of("near" + name);
    near_cloud.insert(near_cloud.find("element"),
                      "comment origin, to be added: 600000 5700000 0\n");
    EXPECT_TRUE(bytes_of("far" + name) == near_cloud) << name;
  }
}

TEST_F(ReconstructCommand, TakesUpWhatIsLeftToDo) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  const std::string left = bytes_of("out/left.png/result.json");
  const std::string right = bytes_of("out/right/1.png/distance0.tiff");
  const std::string cloud = bytes_of("out/cloud.ply");
  std::filesystem::remove_all(folder_ / "out/right");
  std::filesystem::remove(folder_ / "out/cloud.ply");
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  EXPECT_TRUE(bytes_of("out/left.png/result.json") == left);  // with the time it took
  EXPECT_TRUE(bytes_of("out/right/1.png/distance0.tiff") == right);
  EXPECT_TRUE(bytes_of("out/cloud.ply") == cloud);
  // Fusion may be repeated otherwise.
  ASSERT_EQ(run(reconstruct() + "--min-views 1").exit_code, 0);
  EXPECT_TRUE(bytes_of("out/left.png/result.json") == left);
  EXPECT_GT(bytes_of("out/cloud.ply").size(), cloud.size());
  expect_error(reconstruct() + "--max-cost 0.3", "made with other settings: options/max_cost");
  expect_error(reconstruct() + "--max-image-size 48", "made with other settings: max_image_size");
  expect_error(reconstruct() + "--max-theta 50", "made with other settings: max_theta_degrees");
  ASSERT_EQ(run(reconstruct() + "--max-cost 0.3 --overwrite").exit_code, 0);
}

/// Its first group sees nothing in common, so that it is matched in its second one.
TEST_F(ReconstructCommand, KeepsAnImageOfTwoGroupsWhicheverMatchedIt) {
  const std::string images = bytes_of("model/images.txt");
  const std::size_t first = images.find("1 1 0 0 0 0 0 0 1 left.png\n");
  ASSERT_NE(first, std::string::npos);
  const std::size_t observations = images.find('\n', first) + 1;
  folder_.write("model/images.txt",
                images + "4 1 0 0 0 0.02 0 0 1 a.png\n" +
                    images.substr(observations, images.find('\n', observations) - observations) +
                    "\n");
  cv::Mat turned;
  cv::flip(cv::imread(file("left.png")), turned, 0);
  cv::imwrite(file("images/a.png"), turned);
  std::filesystem::create_directories(folder_ / "masks");
  cv::imwrite(file("masks/a.png.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  const std::string command = reconstruct() + "--sources 1 --masks " + file("masks");
  const Outcome outcome = run(command);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  ASSERT_NE(outcome.output.find("a.png and 1 more see nothing in common"), std::string::npos)
      << outcome.output;
  const std::string left = bytes_of("out/left.png/result.json");
  const std::string right = bytes_of("out/right/1.png/result.json");
  ASSERT_EQ(run(command).exit_code, 0);
  EXPECT_TRUE(bytes_of("out/left.png/result.json") == left);  // with the time it took
  EXPECT_TRUE(bytes_of("out/right/1.png/result.json") == right);
}

TEST_F(ReconstructCommand, DamagedMapsOfAnEarlierRunAreNamedWithTheRemedy) {
  ASSERT_EQ(run(reconstruct() + "--min-views 1").exit_code, 0);
  folder_.write("out/right/1.png/normals0.tiff", "damaged");
  const Outcome damaged = run(reconstruct() + "--min-views 1");  // says also what is kept
  EXPECT_NE(damaged.exit_code, 0);
  EXPECT_NE(damaged.output.find("out/right/1.png/normals0.tiff; remove "), std::string::npos);
  std::filesystem::remove_all(folder_ / "out/right/1.png");
  EXPECT_EQ(run(reconstruct() + "--min-views 1").exit_code, 0);
  folder_.write("out/right/1.png/normals0.tiff", "");  // as a power failure leaves it
  const Outcome empty = run(reconstruct() + "--min-views 1");
  EXPECT_EQ(empty.exit_code, 0) << empty.output;
  EXPECT_NE(empty.output.find("1 are matched again"), std::string::npos) << empty.output;
}

TEST_F(ReconstructCommand, LittleThatIsAcceptedGivesAHint) {
  const std::string hint = "Little was accepted: check the poses";
  const Outcome outcome = run(reconstruct() + "--max-cost 0.01 --min-views 1");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.output.find(hint), std::string::npos) << outcome.output;
}

TEST_F(ReconstructCommand, ResultsOfImagesThatAreGoneAreRemoved) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  replace_in_model("model/images.txt", "right/1.png", "right/2.png");
  std::filesystem::rename(folder_ / "images/right/1.png", folder_ / "images/right/2.png");
  const Outcome outcome = run(reconstruct());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("Images that are not given now: 1. Their results will be removed."),
            std::string::npos)
      << outcome.output;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/right/2.png/result.json"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/right/1.png"));
}

TEST_F(ReconstructCommand, WhatIsGoneIsRemovedAlsoWhereNothingIsMatched) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  auto more = nlohmann::ordered_json::parse(bytes_of("out/reconstruction.json"));
  more["images"].push_back(more["images"][0]);
  more["images"].back()["name"] = "gone/1.png";
  folder_.write("out/reconstruction.json", more.dump());
  std::filesystem::create_directories(folder_ / "out/gone");
  std::filesystem::copy(folder_ / "out/left.png", folder_ / "out/gone/1.png");
  folder_.write("out/.writing-1-0", "a killed run's");
  const Outcome outcome = run(reconstruct());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("Kept as an earlier run matched them: 2 of 2 images."),
            std::string::npos)
      << outcome.output;
  EXPECT_EQ(record()["images"].size(), 2U);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/gone"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/.writing-1-0"));
}

TEST_F(ReconstructCommand, ImagesThatMovedAreMatchedAgain) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  const std::string before = bytes_of("out/left.png/distance0.tiff");
  replace_in_model("model/images.txt", "-0.1 0 0", "-0.2 0 0");
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  EXPECT_TRUE(bytes_of("out/left.png/distance0.tiff") != before);
  EXPECT_EQ(record()["images"].size(), 2U);
}

TEST_F(ReconstructCommand, PointsThatMovedAreMatchedAgainInTheirRange) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  replace_in_model("model/points3D.txt", "0 0 4", "0 0 5");
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  EXPECT_NEAR(record_of("out/left.png")["options"]["max_distance"], 1.25 * std::hypot(5, 0.1),
              1e-9);
  EXPECT_EQ(record()["images"].size(), 2U);
}

TEST_F(ReconstructCommand, ReplacedImagesAreMatchedAgain) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  const std::string before = bytes_of("out/left.png/distance0.tiff");
  cv::Mat image = cv::imread(file("images/left.png"), cv::IMREAD_UNCHANGED);
  cv::flip(image, image, 1);
  cv::imwrite(file("images/left.png"), image);
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  EXPECT_FALSE(bytes_of("out/left.png/distance0.tiff") == before);
}

TEST_F(ReconstructCommand, ResultsOfAnUnknownGroupAreMatchedAgain) {
  ASSERT_EQ(run(reconstruct()).exit_code, 0);
  const nlohmann::json whole = record();
  auto damaged = nlohmann::ordered_json::parse(bytes_of("out/reconstruction.json"));
  damaged["images"][0].erase("group");
  folder_.write("out/reconstruction.json", damaged.dump());
  const Outcome outcome = run(reconstruct());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  ASSERT_EQ(record()["images"].size(), 2U);
  // What was kept comes first.
  EXPECT_EQ(record()["images"][0], whole["images"][1]);
  EXPECT_EQ(record()["images"][1]["group"], whole["images"][0]["group"]);
}

TEST_F(ReconstructCommand, MasksAreOfEachImage) {
  std::filesystem::create_directories(folder_ / "masks/right");
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 48) = 0;
  cv::imwrite(file("masks/right/1.png.png"), mask);
  const Outcome outcome = run(reconstruct() + "--masks " + file("masks"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(cv::countNonZero(distance_in("out/right/1.png").colRange(0, 48)), 0);
  EXPECT_GT(cv::countNonZero(distance_in("out/right/1.png")), 1000);
  EXPECT_EQ(record()["images"][0]["group"][0]["masked_pixels"], 0);
  EXPECT_EQ(record()["images"][0]["group"][1]["masked_pixels"], 48 * 96);
  cv::imwrite(file("masks/right/1.png.png"), cv::Mat(mask, cv::Rect(0, 0, 9, 9)));
  expect_error(reconstruct() + "--overwrite --masks " + file("masks"),
               "1.png.png is 9x9 pixels, but the images of right/1.png have 96x96");
  cv::imwrite(file("masks/right/1.png.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  const std::string of_nothing = run(reconstruct() + "--overwrite --masks " + file("masks")).output;
  EXPECT_NE(of_nothing.find("1.png.png leaves no pixel of right/1.png"), std::string::npos)
      << of_nothing;
  EXPECT_EQ(of_nothing.find("is blank"), std::string::npos) << of_nothing;
}

TEST_F(ReconstructCommand, MasksOfImagesAddToThatOfAll) {
  std::filesystem::create_directories(folder_ / "masks");
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 20) = 0;
  cv::imwrite(file("masks/left.png.png"), mask);
  cv::flip(mask, mask, 1);
  cv::imwrite(file("all.png"), mask);
  const Outcome outcome =
      run(reconstruct() + "--masks " + file("masks") + " --mask " + file("all.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(record()["images"][0]["group"][0]["masked_pixels"], 40 * 96);
  EXPECT_EQ(record()["images"][0]["group"][1]["masked_pixels"], 20 * 96);
}

TEST_F(ReconstructCommand, ResultsDoNotTakeTheRunsOwnNames) {
  for (const char* name : {"cloud_preview.png", "reconstruction.json/1.png"}) {
    replace_in_model("model/images.txt", "right/1.png", name);
    std::filesystem::create_directories((folder_ / "images" / name).parent_path());
    std::filesystem::copy_file(folder_ / "images/right/1.png", folder_ / "images" / name);
    const Outcome outcome = run(reconstruct());
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("A result named " + std::string(name) + " would lie where the "),
              std::string::npos)
        << outcome.output;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/left.png"));
    replace_in_model("model/images.txt", name, "right/1.png");
  }
}

TEST_F(ReconstructCommand, BadInputIsRefusedBeforeAnythingIsWritten) {
  expect_error(reconstruct() + "--masks " + file("none"), "none is no folder");
  std::filesystem::create_directories(folder_ / "others");
  cv::imwrite(file("others/left.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  expect_error(reconstruct() + "--masks " + file("others"),
               "holds no mask of any image; there should be " + file("others/"));
  const std::string mask = " --mask " + file("left.png");
  expect_error(reconstruct() + mask + mask, "--mask is for all images");
  EXPECT_NE(run(reconstruct() + "--sources 0").exit_code, 0);
  expect_error(reconstruct() + "--min-views 3",
               "--min-views 3 leaves out every point of the 2 images that are matched; give 2");
  expect_error(reconstruct() + "--min-distance 1000",
               "left.png and 1 more have points from 0.75 to 5.00156, all beyond --min-distance");
  std::filesystem::remove(folder_ / "images/away.png");
  expect_error(reconstruct(), "away.png is missing");
  cv::imwrite(file("images/away.png"), cv::Mat(9, 9, CV_8UC1, cv::Scalar(0)));
  expect_error(reconstruct(), "away.png");
  std::filesystem::copy_file(file("left.png"), folder_ / "images/away.png",
                             std::filesystem::copy_options::overwrite_existing);
  std::filesystem::remove(folder_ / "model/points3D.txt");
  expect_error(reconstruct(), "give --min-distance and --max-distance");
  expect_error("reconstruct " + file("images") + " -c " + file("same.yaml") + " -o " + file("out"),
               "same.yaml is no COLMAP model");
  for (const char* part : {"cameras.txt", "images.txt"}) {
    expect_error(
        "reconstruct " + file("images") + " -c " + file("model/") + part + " -o " + file("out"),
        std::string(part) + " is a file of a COLMAP model; give its folder, " + file("model"));
  }
  std::filesystem::remove(folder_ / "model/images.txt");
  expect_error(reconstruct(), "is no whole COLMAP model: images.bin or images.txt is missing");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(ReconstructCommand, ImagesThatAreMissingMayBeLeftOut) {
  folder_.write("images/away.png", "");
  expect_error(reconstruct(),
               "away.png is empty; give an image file. Or remove it, and give --skip-incomplete");
  std::filesystem::remove(folder_ / "images/away.png");
  expect_error(reconstruct(), "away.png is missing (1 of 3 images in " + file("model") + " are)");
  expect_error(reconstruct(), "leave them out by --skip-incomplete");
  const Outcome outcome = run(reconstruct() + "--skip-incomplete --min-confidence 0");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("1 of 3 images in " + file("model") + " are missing and left out"),
            std::string::npos)
      << outcome.output;
  EXPECT_EQ(record()["images"].size(), 2u);
  // What was left out first by name has no part in what the others are.
  EXPECT_EQ(record()["images"][0]["name"], "left.png");
  EXPECT_EQ(options_of("out/left.png")["min_distance"], 0.75);
  std::filesystem::remove_all(folder_ / "images");
  expect_error(reconstruct("other") + "--skip-incomplete",
               "is missing (3 of 3 images in " + file("model") +
                   " are); give the folder that their paths begin in.");
}

TEST_F(ReconstructCommand, OneEndOfTheRangeWillDo) {
  // In units of a centimetre.
  replace_in_model("model/images.txt", "-0.1 0 0", "-10 0 0");
  replace_in_model("model/points3D.txt", "0 0 4", "0 0 400");
  const Outcome outcome = run(reconstruct() + "--min-distance 60");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json options = record_of("out/left.png")["options"];
  EXPECT_EQ(options["min_distance"], 60);
  EXPECT_NEAR(options["max_distance"], 1.25 * std::hypot(400, 10), 1e-9);
  EXPECT_FALSE(record()["settings"]["options"].contains("max_distance"));
}

/// An image that is matched with nothing may see what is nearer than the end given.
TEST_F(ReconstructCommand, OneEndOfTheRangeIsOfWhatIsMatched) {
  std::string observations, points;
  for (int i = 100; i < 140; ++i) {
    observations += "1 1 " + std::to_string(i) + " ";
    points += std::to_string(i) + " -5 0 2 0 0 0 1 3 0\n";
  }
  replace_in_model("model/images.txt", "away.png\n", "away.png\n" + observations);
  folder_.write("model/points3D.txt", bytes_of("model/points3D.txt") + points);
  const Outcome outcome = run(reconstruct() + "--min-distance 3");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(record()["images"].size(), 2U);
}

/// Two pairs, the second one a kilometre away and ten times as far from what it sees.
class ReconstructTwoPairs : public ReconstructCommand {
 protected:
  void SetUp() override {
    ReconstructCommand::SetUp();
    std::filesystem::create_directories(folder_ / "images/far");
    for (const char* name : {"left.png", "right.png"}) {
      std::filesystem::copy_file(file(name), folder_ / "images/far" / name);
    }
    std::string observations, points;
    for (int i = 100; i < 140; ++i) {
      observations += "1 1 " + std::to_string(i) + " ";
      points += std::to_string(i) + " 1000 0 " + (i == 100 ? "10" : "40") + " 0 0 0 1 1 0\n";
    }
    folder_.write("model/images.txt", bytes_of("model/images.txt") +
                                          "4 1 0 0 0 -1000 0 0 1 far/left.png\n" + observations +
                                          "\n5 1 0 0 0 -1001 0 0 1 far/right.png\n" + observations +
                                          "\n");
    folder_.write("model/points3D.txt", bytes_of("model/points3D.txt") + points);
  }
  void expect_only_first_pair(const Outcome& outcome, const std::string& because) const {
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("far/left.png and 1 more " + because), std::string::npos)
        << outcome.output;
    EXPECT_EQ(record()["images"].size(), 2U);
    EXPECT_EQ(record()["cloud"]["images"], 2);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/far"));
  }
};

TEST_F(ReconstructTwoPairs, OneWithoutOverlapIsLeftOut) {
  std::filesystem::create_directories(folder_ / "masks/far");
  cv::imwrite(file("masks/far/left.png.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  // And again.
  for (int i = 0; i < 2; ++i) {
    expect_only_first_pair(run(reconstruct() + "--masks " + file("masks")),
                           "see nothing in common within the range of distances");
  }
  std::filesystem::remove_all(folder_ / "masks/far");
  cv::imwrite(file("masks/left.png.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  const Outcome both = run(reconstruct() + "--overwrite --masks " + file("masks"));
  ASSERT_EQ(both.exit_code, 0) << both.output;
  EXPECT_EQ(record()["images"][0]["name"], "far/left.png");
}

TEST_F(ReconstructTwoPairs, OneBeyondTheRangeIsLeftOut) {
  expect_only_first_pair(run(reconstruct() + "--max-distance 7"),
                         "have points from 7.5 to 50.0156, all beyond --max-distance");
  const Outcome both = run(reconstruct("both") + "--max-distance 8");
  ASSERT_EQ(both.exit_code, 0) << both.output;
  EXPECT_TRUE(std::filesystem::exists(folder_ / "both/far/right.png/distance0.tiff"));
}

/// Where no points tell which images see the same, poses and the range do.
class TransformsCommand : public ReconstructCommand {
 protected:
  /// Of the pair, by the paths of its images.
  void write_transforms(const std::string& name, const std::string& left,
                        const std::string& right) {
    const auto frame = [](const std::string& path, const std::string& x) {
      return R"({"file_path": ")" + path + R"(", "transform_matrix": [[1, 0, 0, )" + x +
             "], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]}";
    };
    folder_.write(name, R"({"camera_model": "OPENCV_FISHEYE", "w": 96, "h": 96, "fl_x": 30,
                            "fl_y": 31, "cx": 48, "cy": 48.5, "k1": 0.01, "k2": -0.002, "frames": [)" +
                            frame(left, "0") + ", " + frame(right, "0.1") + "]}");
  }
  std::string reconstruct_with(const std::string& transforms) const {
    std::string arguments = reconstruct();
    const std::string model = file("model");
    return arguments.replace(arguments.find(model), model.size(), file(transforms));
  }
  static constexpr const char* range = "--min-distance 0.75 --max-distance 5 ";
};

TEST_F(TransformsCommand, TakesATransformsFile) {
  write_transforms("images/transforms.json", "left.png", "right/1.png");
  ASSERT_EQ(run(reconstruct("colmap") + range).exit_code, 0);
  const std::string with_transforms = reconstruct_with("images/transforms.json");
  expect_error(with_transforms, "give --min-distance and --max-distance");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
  const Outcome outcome = run(with_transforms + range);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  for (const char* image : {"left.png", "right/1.png"}) {
    EXPECT_TRUE(same_bits(distance_in("out/" + std::string(image)),
                          distance_in("colmap/" + std::string(image))));
  }
  EXPECT_EQ(record_of("out/left.png")["conventions"]["unit"], "that of the reconstruction");
  expect_error("calibration show " + file("images/transforms.json"),
               "is a COLMAP model or transforms.json");
}

TEST_F(TransformsCommand, OneImageIsJoinedByThoseThatSeeTheSameInTheRange) {
  write_transforms("images/transforms.json", "left.png", "right/1.png");
  const std::string left = file("images/left.png"), right = file("images/right/1.png");
  const auto depth_of_images = [&](const std::string& second, const std::string& output) {
    return test::replaced(
        test::replaced(depth("images/transforms.json", output), file("left.png"), left),
        file("right.png"), second);
  };
  expect_error(depth_of_images("", "out"), "give --min-distance and --max-distance");
  for (const auto& [second, output] : {std::pair<std::string, std::string>("", "one"),
                                       std::pair<std::string, std::string>(right, "both")}) {
    const Outcome outcome = run(depth_of_images(second, output) + range);
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  }
  EXPECT_TRUE(same_bits(distance_in("one"), distance_in("both")));
}

TEST_F(TransformsCommand, AMaskOfOneImageLeavesTheRimsOfOthers) {
  write_transforms("images/transforms.json", "left.png", "right/1.png");
  std::string frames = bytes_of("images/transforms.json");
  const std::string first = R"("file_path": "left.png", )";
  frames.insert(frames.find(first) + first.size(), R"("mask_path": "mask.png", )");
  folder_.write("images/transforms.json", frames);
  cv::Mat inside(96, 96, CV_8UC1, cv::Scalar(0));
  cv::circle(inside, {48, 48}, 36, cv::Scalar(255), cv::FILLED);
  cv::imwrite(file("images/mask.png"), inside);
  for (const char* name : {"images/left.png", "images/right/1.png"}) {
    cv::Mat image = cv::imread(file(name), cv::IMREAD_UNCHANGED);
    cv::Mat outside(image.size(), CV_8UC1, cv::Scalar(255));
    cv::circle(outside, {48, 48}, 40, cv::Scalar(0), cv::FILLED);
    image.setTo(0, outside);
    cv::imwrite(file(name), image);
  }
  // What is missing is said first, and alone.
  expect_error(reconstruct_with("images/transforms.json"),
               "give --min-distance and --max-distance");
  const Outcome outcome = run(reconstruct_with("images/transforms.json") + range);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("right/1.png is black from"), std::string::npos) << outcome.output;
  EXPECT_LT(record_of("out/right/1.png")["views"][0]["max_theta_degrees"], 120);
  const nlohmann::json group = record()["images"][0]["group"];
  EXPECT_EQ(group[0]["max_theta_degrees"], 180);
  EXPECT_LT(group[1]["max_theta_degrees"], 120);
  EXPECT_GT(group[1]["max_theta_degrees"], 30);
  EXPECT_EQ(record_of("out/left.png")["views"][0]["max_theta_degrees"], 180);
}

TEST_F(TransformsCommand, OneThatIsCutOffIsNamed) {
  write_transforms("images/transforms.json", "left.png", "right/1.png");
  const std::string whole = bytes_of("images/transforms.json");
  folder_.write("images/transforms.json", whole.substr(0, whole.size() / 2));
  expect_error(reconstruct_with("images/transforms.json") + range,
               "transforms.json: It is not valid JSON (");
}

/// Results of such images lie in the output's folder, and nowhere else.
TEST_F(TransformsCommand, ImagesMayLieOutsideOfTheFolder) {
  std::filesystem::create_directories(folder_ / "scene");
  const std::string source = bytes_of("images/left.png");
  const std::string absolute = file("images/left.png");
  write_transforms("scene/transforms.json", absolute, "../images/right/1.png");
  std::string arguments = reconstruct_with("scene/transforms.json") + range;
  const std::string images = file("images") + " ";
  arguments.replace(arguments.find(images), images.size(), file("scene") + " ");
  const Outcome outcome = run(arguments);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(std::filesystem::exists(folder_ / ("out" + absolute + "/result.json")));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "out/images/right/1.png/result.json"));
  EXPECT_TRUE(bytes_of("images/left.png") == source);
  EXPECT_FALSE(std::filesystem::is_directory(folder_ / "images/right/1.png"));
  const std::string written = bytes_of("out/images/right/1.png/result.json");
  ASSERT_EQ(run(arguments).exit_code, 0);
  EXPECT_TRUE(bytes_of("out/images/right/1.png/result.json") == written);

  // In the order of names.
  const std::string pair =
      file("images/right/1.png") + " " + absolute + " -c " + file("scene/transforms.json") + " ";
  const Outcome checked = run("calibration check " + pair);
  EXPECT_EQ(checked.output.find("no image whose name"), std::string::npos) << checked.output;
  const Outcome depth = run("depth " + pair + range + "-o " + file("pair") +
                            " --preset paper --device cpu --iterations 2 --second-iterations 1"
                            " --window-radius 2");
  ASSERT_EQ(depth.exit_code, 0) << depth.output;
  EXPECT_TRUE(same_bits(distance_in("out/images/right/1.png"), distance_in("pair")));
}

TEST_F(ReconstructCommand, FoldersOfOthersAreLeftAlone) {
  std::filesystem::create_directories(folder_ / "out/left.png");
  folder_.write("out/left.png/notes.txt", "mine");
  const Outcome outcome = run(reconstruct());
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(
      outcome.output.find("out/left.png is there already and is no result of a reconstruction"),
      std::string::npos)
      << outcome.output;
  EXPECT_EQ(bytes_of("out/left.png/notes.txt"), "mine");
}

TEST_F(ReconstructTwoPairs, WhatOthersHaveInTheFolderIsFoundBeforeAnythingIsMatched) {
  const auto expect_refusal = [this](const std::string& name) {
    const Outcome outcome = run(reconstruct());
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("out/" + name +
                                  " is there already and is no result of a reconstruction"),
              std::string::npos)
        << outcome.output;
    EXPECT_FALSE(std::filesystem::exists(folder_ / "out/left.png"));
  };
  std::filesystem::create_directories(folder_ / "out/far/right.png");
  folder_.write("out/far/right.png/notes.txt", "mine");
  expect_refusal("far/right.png");
  std::filesystem::remove_all(folder_ / "out/far");
  folder_.write("out/cloud.ply", "mine");
  expect_refusal("cloud.ply");
  EXPECT_EQ(bytes_of("out/cloud.ply"), "mine");
  std::filesystem::remove(folder_ / "out/cloud.ply");
  // That of a reconstruction is replaced.
  for (int i = 0; i < 2; ++i) ASSERT_EQ(run(reconstruct()).exit_code, 0);
}

}  // namespace
}  // namespace widestereo
