// SPDX-License-Identifier: MIT
// The command as a user meets it: results, messages, exit codes, and nothing half-written.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "command_fixture.h"
#include "data_folder.h"
#include "geometry/angle.h"
#include "replaced.h"
#include "same_bits.h"
#include "text/formatted.h"
#include "widestereo/calibration.h"
#include "widestereo/image_io.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

TEST_F(Command, DemoScoresItself) {
  const Outcome outcome =
      run("demo --size 96 --preset paper --device cpu --iterations 6 --second-iterations 3 "
          "--window-radius 3 -o " +
          file("demo"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("non-occluded"), std::string::npos);
  for (const char* name : {"distance0.tiff", "distance1.tiff", "distance_accepted0.tiff",
                           "normals0.tiff", "cost0.tiff", "confidence0.tiff", "reasons0.png",
                           "cloud0.ply", "summary0.png", "distance_preview0.png", "result.json"}) {
    EXPECT_TRUE(fs::exists(folder_ / "demo" / name)) << name;
  }
  std::ifstream stream(folder_ / "demo/result.json");
  const nlohmann::json record = nlohmann::json::parse(stream);
  EXPECT_LT(record["scores"][1]["bad_pixels"]["2.0"].get<double>(), 0.3);
  EXPECT_EQ(record["device"]["id"], "cpu");
  EXPECT_EQ(record["options"]["first_iterations"], 6);
  EXPECT_EQ(record["options"]["filter"], "device");
  EXPECT_EQ(record["filter_used"], "exact") << "the CPU has no texture units";
  for (const auto& entry : fs::directory_iterator(folder_ / "demo")) {
    EXPECT_EQ(entry.path().string().find(".writing"), std::string::npos) << entry.path();
  }
}

TEST_F(Command, DemoShowsPanoramas) {
  const Outcome outcome =
      run("demo --panorama --size 72 --preset fast --device cpu --json -o " + file("demo"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json record = json_of(outcome);
  EXPECT_EQ(record["views"][0]["model"], "equirectangular");
  EXPECT_EQ(record["views"][1]["width"], 144);
  const nlohmann::json& behind = record["scores"][5];
  EXPECT_EQ(behind["region"], ">90 deg");
  EXPECT_LT(behind["bad_pixels"]["1.0"].get<double>(), 0.1);
}

TEST_F(Command, DemoLooksAround) {
  const Outcome outcome =
      run("demo --surround --size 128 --preset fast --device cpu --json -o " + file("demo"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json record = json_of(outcome);
  ASSERT_EQ(record["views"].size(), 4u);
  for (const nlohmann::json& view : record["views"]) {
    EXPECT_GT(view["accepted"].get<double>(), 0.75) << view["name"];
  }
  EXPECT_EQ(record["scores"][0]["completeness"], 1.0) << "all is seen by one or another";
  const nlohmann::json& seen_by_the_next = record["scores"][1];
  EXPECT_LT(seen_by_the_next["bad_pixels"]["1.0"].get<double>(), 0.1);
}

TEST_F(Command, DepthWritesEveryFormatAndJson) {
  const Outcome outcome =
      run(depth_of("left.png", "right.png") + "--formats tiff,exr,pfm,png --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json record = json_of(outcome);
  EXPECT_EQ(record["views"].size(), 2u);
  const cv::Mat tiff = cv::imread(file("out/distance0.tiff"), cv::IMREAD_UNCHANGED);
  const cv::Mat png = cv::imread(file("out/distance0.png"), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(tiff.type(), CV_32FC1);
  ASSERT_EQ(png.type(), CV_16UC1);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      EXPECT_NEAR(png.at<ushort>(y, x) / 1000.0, static_cast<double>(tiff.at<float>(y, x)), 6e-4);
    }
  }
  for (const char* name : {"out/distance0.exr", "out/distance0.pfm"}) {
    EXPECT_TRUE(fs::exists(folder_ / name)) << name;
  }
}

TEST_F(Command, DepthRecordsMasks) {
  cv::imwrite(file("mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  const Outcome outcome =
      run(depth_of("left.png", "right.png") + "--json --mask " + file("mask.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json record = json_of(outcome);
  EXPECT_EQ(record["input"].value("masks", nlohmann::json()),
            nlohmann::json::array({file("mask.png")}));
}

TEST_F(Command, DepthScoresTexturedPixels) {
  for (const char* name : {"left.png", "right.png"}) {
    cv::Mat image = cv::imread(file(name));
    image.rowRange(0, 48).setTo(100);
    cv::imwrite(file(name), image);
  }
  const Outcome outcome = run(depth_of("left.png", "right.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(" % of textured pixels, "), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find(" % of those accepted), left-right"), std::string::npos);
  std::ifstream stream(folder_ / "out/result.json");
  const nlohmann::json view = nlohmann::json::parse(stream)["views"][0];
  const cv::Mat cost = cv::imread(file("out/cost0.tiff"), cv::IMREAD_UNCHANGED);
  // Patches of 9x9 reach four rows into the blank half.
  const cv::Mat textured = cost.rowRange(44, 96);
  const int planes = cv::countNonZero(textured < 2);
  EXPECT_EQ(view["textured_pixels"], planes);
  EXPECT_GT(planes, 2000);
  EXPECT_NEAR(view["cost_below_0.2_textured"], cv::countNonZero(textured < 0.2f) / double(planes),
              1e-9);
  EXPECT_LT(view["cost_below_0.2"], view["cost_below_0.2_textured"]) << "the wall has no low cost";
  const cv::Mat reasons = cv::imread(file("out/reasons0.png"), cv::IMREAD_UNCHANGED);
  const cv::Mat accepted = reasons.rowRange(44, 96) == 0;
  EXPECT_NEAR(view["cost_below_0.2_textured_accepted"],
              cv::countNonZero((textured < 0.2f) & accepted) / double(cv::countNonZero(accepted)),
              1e-9);
  EXPECT_LT(cv::countNonZero(accepted), planes) << "else the two shares are the same";
}

TEST_F(Command, SharesOfNoPixelAreUnknown) {
  for (const char* name : {"left.png", "right.png"}) {
    cv::Mat faint = cv::imread(file(name));
    faint.convertTo(faint, CV_8U, 0.01, 100);
    cv::imwrite(file(name), faint);
  }
  alter("right.png", 60);
  const Outcome outcome = run(depth_of("left.png", "right.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(" % (- of textured pixels, - of those accepted)"),
            std::string::npos)
      << outcome.output;
  const nlohmann::json view = nlohmann::json::parse(bytes_of("out/result.json"))["views"][0];
  EXPECT_EQ(view["textured_pixels"], 0);
  for (const char* share : {"cost_below_0.2_textured", "cost_below_0.2_textured_accepted"}) {
    EXPECT_TRUE(view[share].is_null()) << share;
  }
  cv::imwrite(file("none.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  const std::string evaluate = "evaluate " + file("out/distance0.tiff") + " --truth " +
                               file("out/distance0.tiff") + " -c " + file("calib.yaml");
  EXPECT_EQ(run(evaluate).output.find("without ground truth"), std::string::npos);
  EXPECT_NE(run(evaluate + " --far-distance 50 --field-of-view " + file("none.png"))
                .output.find("without ground truth: 0 pixels, - within"),
            std::string::npos);
}

TEST_F(Command, DamagedRecordsBesideMapsAreNamed) {
  ASSERT_EQ(run(depth_of("left.png", "right.png")).exit_code, 0);
  fs::rename(folder_ / "out", folder_ / "result");
  const nlohmann::json whole = nlohmann::json::parse(bytes_of("result/result.json"));
  const std::string evaluate =
      "evaluate " + file("result/distance0.tiff") + " --truth " + file("result/distance0.tiff");
  EXPECT_EQ(run(evaluate).exit_code, 0);
  folder_.write("result/result.json", "{\"views\": [");
  expect_error(evaluate, "result.json beside the map is damaged; match again");
  constexpr std::int64_t beyond_ints = (std::int64_t{1} << 40) + 96;
  for (const nlohmann::json& width : {nlohmann::json(96.5), nlohmann::json(1e30),
                                      nlohmann::json(beyond_ints), nlohmann::json("96")}) {
    nlohmann::json damaged = whole;
    damaged["views"][0]["width"] = width;
    folder_.write("result/result.json", damaged.dump());
    expect_error(evaluate, "result.json is damaged or of another version; give --calibration");
  }
  nlohmann::json damaged = whole;
  damaged["input"]["white_level"] = 1e300;
  folder_.write("result/result.json", damaged.dump());
  expect_error(evaluate + " --image " + file("left.png"),
               "has the white level 1e+300, which no camera has; give --white-level.");
  const cv::Mat left = cv::imread(file("left.png"));
  cv::Mat deep;
  left.convertTo(deep, CV_16U, 16);
  cv::imwrite(file("deep.png"), deep);
  const Outcome given = run(evaluate + " --white-level 4095 --image " + file("deep.png"));
  EXPECT_EQ(given.exit_code, 0) << given.output;
}

/// The pair of calib.yaml, taken by its first camera alone in two places.
class MovingCamera : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    write_first_camera();
  }
  std::string depth_at(const std::string& poses, const std::string& output) {
    folder_.write("poses.txt", poses);
    return "depth " + file("left.png") + " " + file("right.png") + " -c " + file("mono.yaml") +
           " --poses " + file("poses.txt") + " -o " + file(output) + quick + "--max-theta 90 ";
  }
  cv::Mat distance_in(const std::string& output) const {
    return cv::imread(file(output + "/distance0.tiff"), cv::IMREAD_UNCHANGED);
  }
};

TEST_F(MovingCamera, WithKnownPosesIsARig) {
  ASSERT_EQ(run(depth_of("left.png", "right.png") + "--max-theta 90").exit_code, 0);
  const Outcome moved = run(depth_at("0 0 0 0 0 0 0 1\n1 0.1 0 0 0 0 0 1\n", "moved"));
  ASSERT_EQ(moved.exit_code, 0) << moved.output;
  ASSERT_FALSE(distance_in("out").empty());
  EXPECT_TRUE(same_bits(distance_in("moved"), distance_in("out")));
  const nlohmann::json record = nlohmann::json::parse(bytes_of("moved/result.json"));
  EXPECT_EQ(record["input"]["poses"], file("poses.txt"));

  // A quarter turn about z, far from the world's origin.
  const Outcome far =
      run(depth_at("0 500000 -7e6 3 0 0 0.70710678118654752 0.70710678118654752\n"
                   "1 500000 -6999999.9 3 0 0 0.70710678118654752 0.70710678118654752\n",
                   "far"));
  ASSERT_EQ(far.exit_code, 0) << far.output;
  cv::Mat apart;
  cv::absdiff(distance_in("far"), distance_in("out"), apart);
  EXPECT_GT(cv::countNonZero(apart < 0.005 * distance_in("out")),
            0.97 * cv::countNonZero(distance_in("out") > 0));
}

TEST_F(MovingCamera, ImagesOfOneTimeAreNamedByTheirCameras) {
  const std::string time = "1403636579.763555";
  for (const char* folder : {"a", "b"}) fs::create_directory(file(folder));
  fs::copy_file(file("left.png"), file("a/" + time + ".png"));
  fs::copy_file(file("right.png"), file("b/" + time + ".png"));
  folder_.write("poses.txt", time + " 0 0 0 0 0 0 1\n");
  const Outcome outcome =
      run("depth " + file("a/" + time + ".png") + " " + file("b/" + time + ".png") + " -c " +
          file("calib.yaml") + " --views 0,1 --poses " + file("poses.txt") + " -o " + file("out") +
          quick + "--max-theta 90 ");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json record = nlohmann::json::parse(bytes_of("out/result.json"));
  EXPECT_EQ(record["views"][0]["name"], time + "/cam0");
  EXPECT_EQ(record["views"][1]["name"], time + "/cam1");
}

TEST_F(MovingCamera, NeedsAPoseForEachImage) {
  const std::string first = "0 0 0 0 0 0 0 1\n";
  expect_error(depth_at(first, "out"), "has 1 poses for 2 frames without time stamps");
  expect_error(depth_at(first + "1 0 0 0 0 0 0 1\n", "out"), "baseline");
  fs::copy_file(file("left.png"), file("1403636579763555.png"));
  fs::copy_file(file("right.png"), file("1403636579963555.png"));
  std::string timed = depth_at("1403636579.763555 0 0 0 0 0 0 1\n", "out");
  timed.replace(timed.find("left.png"), 8, "1403636579763555.png");
  timed.replace(timed.find("right.png"), 9, "1403636579963555.png");
  expect_error(timed, "no pose within 0.01 s of the frame 1403636579963555");
}

/// As accurate as the data set says its odometry is.
TEST_F(MovingCamera, OfARealCarFitsItsPoses) {
  SKIP_WITHOUT_STEREO_SETS();
  const fs::path set = data_folder() / "real/psl_fisheye_left";
  const std::string image = (set / "images/mono_left_1342626147").string();
  const Outcome outcome =
      run("calibration check " + image + "714042.png " + image +
          "794042.png --max-theta 95 --json -c " + (set / "calib.yaml").string() + " --poses " +
          (set / "poses_cam_to_world.txt").string());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_LT(json_of(outcome)["median_pixels"].get<double>(), 0.4);
}

TEST_F(Command, BadImagesAreNamed) {
  folder_.write("empty.png", "");
  folder_.write("garbage.png", "this is no image");
  const std::string whole = bytes_of("left.png");
  folder_.write("cut.png", whole.substr(0, whole.size() / 2));
  cv::imwrite(file("small.png"), cv::Mat(48, 96, CV_8UC1, cv::Scalar(7)));
  expect_error(depth_of("missing.png", "right.png"), "missing.png");
  expect_error(depth_of("left.png", "empty.png"), "empty.png");
  expect_error(depth_of("garbage.png", "right.png"), "garbage.png");
  expect_error(depth_of("left.png", "cut.png"), "truncated");
  // OpenCV prints what it finds in this one.
  cv::imwrite(file("whole.bmp"), cv::imread(file("left.png")));
  folder_.write("cut.bmp", bytes_of("whole.bmp").substr(0, 2000));
  const Outcome outcome = run(depth_of("cut.bmp", "right.png"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.output.find("widestereo: " + file("cut.bmp")), 0u) << outcome.output;
  EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
  expect_error(depth_of("left.png", "small.png"), "96x48");
  expect_error(depth_of("calib.yaml", "right.png"), "calib.yaml");
  expect_error("depth " + file("") + " -c " + file("calib.yaml") + " -o " + file("out"),
               "is a folder; give images");
  expect_error(depth_of("left.png", "right.png") + "--mask " + file("small.png"), "small.png");
  expect_error(depth_of("left.png", "right.png") + "--mask " + file("no.png"), "no.png");
  expect_error(depth_of("left.png", "right.png") + "--mask a.png,b.png,c.png",
               "--mask names 3 images for 2 views");
}

TEST_F(Command, ImagesThatAreGivenTwiceAreRefused) {
  expect_error(depth_of("left.png", "left.png"), "left.png is given twice;");
  fs::create_symlink("left.png", folder_ / "link.png");
  expect_error(depth_of("left.png", "link.png"), "link.png is given twice;");
}

TEST_F(Command, BadCalibrationsAndOptionsAreNamed) {
  folder_.write("bad.yaml", "cam0: {camera_model: ocam}");
  expect_error(depth_of("left.png", "right.png", "bad.yaml"), "ocam");
  expect_error(depth_of("left.png", "right.png", "none.yaml"), "none.yaml");
  expect_error(depth_of("left.png", "right.png") + "--views 0,5", "camera 5");
  expect_error(depth_of("left.png", "right.png") + "--views 0", "--views");
  expect_error(depth_of("left.png", "right.png") + "--views 1,1",
               "--views names camera 1 twice, from one place; name another, or give --poses");
  const std::string plain = "depth " + file("left.png") + " " + file("right.png") + " -c " +
                            file("calib.yaml") + " -o " + file("out") + " --device cpu";
  expect_error(plain + " --min-distance -1", "distance range");
  expect_error(plain + " --min-distance 5 --max-distance 2", "distance range");
  expect_error(plain + " --window-radius 99", "window radius");
  expect_error(plain + "x", "cpux");
  expect_error("depth " + file("left.png") + " " + file("right.png") + " -c " + file("calib.yaml") +
                   " -o " + file("left.png/out") + quick,
               "output folder");
  EXPECT_NE(run("depth " + file("left.png")).exit_code, 0);
  EXPECT_NE(run("depth " + file("left.png") + " --no-such-option").exit_code, 0);
  EXPECT_NE(run(plain + " --preset nonsense").exit_code, 0);
}

/// Refused while the command line is read, naming the option; nothing is written.
class RefusedWords : public Command {
 protected:
  void expect_refusal(const std::string& arguments, const std::string& part) const {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.exit_code, 0) << arguments << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find(part), std::string::npos) << arguments << "\n" << outcome.output;
    EXPECT_LT(outcome.output.size(), 250u) << outcome.output;
    EXPECT_FALSE(fs::exists(folder_ / "out")) << arguments;
  }
  std::string sequence() const {
    return "sequence " + file("data") + " -c " + file("calib.yaml") + " -o " + file("out") + " ";
  }
};

TEST_F(RefusedWords, NumbersAreFinite) {
  for (const char* option :
       {"--max-theta", "--min-distance", "--max-distance", "--png-scale", "--blur", "--max-cost",
        "--min-parallax", "--weight-scale", "--consistency-pixels"}) {
    for (const char* word : {"nan", "-NaN", "inf", "-Infinity", "1e999"}) {
      expect_refusal(depth_of("left.png", "right.png") + option + " " + word,
                     std::string(option) + ": " + word + " is no finite number");
    }
  }
  expect_refusal(depth_of("left.png", "right.png") + "--blur 0.5,nan", "--blur: nan is no finite");
  expect_refusal(sequence() + "--restart-below nan", "--restart-below: nan is no finite number");
  expect_refusal("benchmark --devices cpu --peak-gflops nan", "--peak-gflops: nan");
  expect_refusal("evaluate a.tiff --far-distance nan", "--far-distance: nan");
}

TEST_F(RefusedWords, NoneIsEmpty) {
  for (const char* option : {"--min-distance", "--seed", "--levels", "--level-iterations",
                             "--poses", "--mask", "--device", "--views", "--blur"}) {
    expect_refusal(depth_of("left.png", "right.png") + option + " ''",
                   std::string(option) + ": the value is empty");
  }
  expect_refusal("depth '' " + file("right.png") + " -c x -o " + file("out"),
                 "images: the value is empty");
  expect_refusal("benchmark --devices cpu --sizes 64 -o ''", "--output: the value is empty");
}

TEST_F(RefusedWords, AnOptionOfOneWordIsGivenOnce) {
  expect_refusal(depth_of("left.png", "right.png") + "--preset fast --preset paper",
                 "--preset is given more than once; give it once.");
  expect_refusal(sequence() + "--seed 1 --first 2 --seed 2", "--seed is given more than once");
}

TEST_F(RefusedWords, WholeNumbersAreDecimalDigits) {
  for (const char* word : {"0x10", "1.5", "1e3", "' 1'", "'1 '", "-", "+", "1_0"}) {
    expect_refusal(sequence() + "--first " + word, " is no whole number");
  }
  expect_refusal(sequence() + "--views 0,0x1", "--views: 0x1 is no whole number");
  expect_refusal(sequence() + "--seed 0b1", "--seed: 0b1 is no whole number");
  expect_refusal(sequence() + "--step 000", "--step: 0 is no number above 0");
  for (const char* words : {"--seed -1", "--levels 99999999999", "--views 0,99999999999"}) {
    expect_refusal(sequence() + words, "; it is too large, or negative where it may not be.");
  }
  const Outcome outcome =
      run("demo --size 00064 --seed +010 --preset fast --device cpu --json --no-pictures -o " +
          file("decimal"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(json_of(outcome)["options"]["seed"], 10);
}

TEST_F(RefusedWords, NamesAreListed) {
  const std::string depth = depth_of("left.png", "right.png");
  expect_refusal(depth + " --warp bent", "--warp: bent not in {exact,affine,quadratic}");
  expect_refusal(depth + " --warp 1", "--warp: 1 not in {exact,affine,quadratic}");
  expect_refusal("benchmark --filter none", "--filter: none not in {exact,device}");
  const std::string help = run("sequence --help").output;
  EXPECT_NE(help.find("--warp TEXT:{exact,affine,quadratic}"), std::string::npos) << help;
  EXPECT_NE(help.find("--clouds "), std::string::npos) << help;
}

TEST_F(RefusedWords, TruthIsTrueOrFalse) {
  const std::string depth = "depth none.png too.png -c " + file("calib.yaml") + " -o " +
                            file("out") + " --subpixel-match ";
  expect_refusal(depth + "maybe", "--subpixel-match: maybe is neither true nor false");
  for (const char* word : {"true", "off", "1"}) expect_error(depth + word, "none.png");
}

TEST_F(RefusedWords, LimitsAreShort) {
  expect_refusal(sequence() + "--first -1", "--first: -1 is no number from 0 on");
  expect_refusal(sequence() + "--count -1", "--count: -1 is no number from 0 on");
  expect_refusal(sequence() + "--step 0", "--step: 0 is no number above 0");
  expect_refusal(depth_of("left.png", "right.png") + "--png-scale 0",
                 "--png-scale: 0 is no number above 0");
  for (const char* samples : {"-1", "99999999999999999999"}) {
    expect_refusal(depth_of("left.png", "right.png") + "--max-samples-per-dispatch " + samples,
                   "--max-samples-per-dispatch: Value");
  }
}

TEST_F(Command, LevelsKeepTheFinestOnesNumbers) {
  const auto record_with = [this](const std::string& options) {
    const Outcome outcome =
        run("depth " + file("left.png") + " " + file("right.png") + " -c " + file("calib.yaml") +
            " -o " + file("out") + " --preset fast --device cpu --no-cloud --no-pictures --json" +
            " --min-distance 0.4 --max-distance 8 " + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return json_of(outcome);
  };
  const nlohmann::json by_size = record_with("");
  const nlohmann::json preset = by_size["options"];
  EXPECT_EQ(preset["levels"], 0);
  EXPECT_EQ(by_size["levels_used"], preset["level_iterations"].size()) << "small images";
  const nlohmann::json one = record_with("--levels 1")["options"];
  for (const char* of_levels : {"level_iterations", "level_regressions"}) {
    EXPECT_EQ(one[of_levels], nlohmann::json::array({preset[of_levels].back()})) << of_levels;
  }
  const nlohmann::json record_of_four = record_with("--levels 4 --level-iterations 1,1,1,2");
  EXPECT_EQ(record_of_four["levels_used"], 4);
  const nlohmann::json four = record_of_four["options"];
  EXPECT_EQ(four["level_iterations"], nlohmann::json({1, 1, 1, 2}));
  EXPECT_EQ(four["level_regressions"], preset["level_regressions"]);
}

TEST_F(RefusedWords, OptionsHaveAnEffect) {
  const std::string depth = "depth " + file("left.png") + " " + file("right.png") + " -c " +
                            file("calib.yaml") + " -o " + file("out") + " --device cpu ";
  expect_error(depth + "--preset fast --propagation raster", "belongs to the random search");
  for (const char* option : {"--iterations 3", "--second-iterations 3", "--refinements 3"}) {
    expect_error(depth + option, std::string(option).substr(0, std::string(option).find(' ')));
    expect_error(depth + "--preset fast " + option, "has no effect with the preset fast");
  }
  for (const char* option : {"--levels 2", "--sweep-steps 8", "--vote-radius 3", "--step-pixels 1",
                             "--source-planes false", "--level-iterations 1,1,1"}) {
    expect_error(depth + "--preset paper " + option, "has no effect with the preset paper");
  }
  expect_error(depth + "--png-scale 100", "--png-scale has no effect without --formats png");
  expect_error(depth + "--validation", "--validation has no effect on CPU");
  expect_error(depth + "--pipeline-cache x", "--pipeline-cache has no effect on CPU");
  expect_error(depth + "--max-samples-per-dispatch 1000",
               "--max-samples-per-dispatch has no effect on CPU");
  expect_error(depth + "--filter device", "--filter device has no effect on CPU");
  expect_refusal(depth + "--warm-iterations 3", "--warm-iterations");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  expect_refusal(depth + "--poses-tolerance 0.1", "--poses");
  expect_refusal(sequence() + "--poses p.txt --no-motion", "excludes");
  for (const char* option : {"--poses p.txt", "--no-motion", "--restart-below 0.5",
                             "--warm-iterations 1", "--warm-regressions 1"}) {
    expect_refusal(sequence() + "--no-warm-start " + option, "excludes");
  }
  cv::imwrite(file("map.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  write_map(folder_ / "normals.tiff", cv::Mat(96, 96, CV_32FC3, cv::Scalar(0, 0, -1)));
  const std::string evaluate = "evaluate " + file("map.tiff") + " -c " + file("calib.yaml") +
                               " --truth " + file("map.tiff") + " ";
  expect_error(evaluate + "--normals " + file("normals.tiff"), "--truth-normals");
  expect_refusal(evaluate + "--field-of-view " + file("left.png"), "--far-distance");
  EXPECT_EQ(run(evaluate + "--normals " + file("normals.tiff") + " --truth-normals " +
                file("normals.tiff"))
                .exit_code,
            0);
}

TEST_F(Command, NormalsMustBeUnitVectorsThatFaceTheCamera) {
  cv::imwrite(file("map.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  const std::string evaluate = "evaluate " + file("map.tiff") + " -c " + file("calib.yaml") +
                               " --truth " + file("map.tiff") + " --normals " +
                               file("normals.tiff") + " --truth-normals ";
  const auto write = [this](const std::string& name, const cv::Scalar& normal) {
    write_map(folder_ / name, cv::Mat(96, 96, CV_32FC3, normal));
  };
  write("normals.tiff", {0.6, 0, -0.8});
  const Outcome right = run(evaluate + file("normals.tiff"));
  EXPECT_EQ(right.exit_code, 0) << right.output;
  EXPECT_EQ(right.output.find("degrees off"), std::string::npos) << right.output;
  write("long.tiff", {0.9, 0, -1.2});
  expect_error(evaluate + file("long.tiff"), "long.tiff has no unit vectors at 9216 of 9216");
  // As OpenCV compresses three channels unless told otherwise.
  cv::imwrite(file("lossy.tiff"), cv::Mat(96, 96, CV_32FC3, cv::Scalar(-0.8, 0, 0.6)));
  expect_error(evaluate + file("lossy.tiff"), "IMWRITE_TIFF_COMPRESSION 1");
  write("opposite.tiff", {-0.6, 0, 0.8});
  const Outcome opposite = run(evaluate + file("opposite.tiff"));
  EXPECT_EQ(opposite.exit_code, 0) << opposite.output;
  EXPECT_NE(opposite.output.find("The normals are 180 degrees off"), std::string::npos)
      << opposite.output;
}

TEST_F(Command, BlankImagesAreNamed) {
  cv::Mat dark(96, 96, CV_8UC1);
  cv::randu(dark, 0, 4);
  cv::imwrite(file("dark.png"), dark);
  std::string three = bytes_of("calib.yaml");
  three += "cam2" + three.substr(three.find("cam1:") + 4);
  folder_.write("three.yaml", three);
  const Outcome outcome =
      run("depth " + file("left.png") + " " + file("right.png") + " " + file("dark.png") + " -c " +
          file("three.yaml") + " -o " + file("out") + quick);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("The image of cam2 is blank"), std::string::npos) << outcome.output;
  const std::string which = "The images are taken to be of the first 2 of the 3 cameras";
  EXPECT_EQ(outcome.output.find(which), std::string::npos);
  const std::string pair = depth_of("left.png", "right.png", "three.yaml");
  EXPECT_NE(run(pair).output.find(which), std::string::npos);
  EXPECT_EQ(run(pair + "--views 0,1").output.find(which), std::string::npos);
  EXPECT_EQ(outcome.output.find("cam1 is blank"), std::string::npos) << outcome.output;
  EXPECT_EQ(run(depth_of("left.png", "right.png")).output.find("blank"), std::string::npos);
}

/// A veil of light changes neither correlations nor deviations.
TEST_F(Command, HazyImagesHaveAsMuchTextureAsDarkOnes) {
  cv::imwrite(file("far.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(1e6)));
  const auto textured = [this](double veil) {
    for (const std::string camera : {"left", "right"}) {
      cv::Mat image = cv::imread(file(camera + ".png"));
      image.convertTo(image, CV_8U, 0.1, veil);
      cv::imwrite(file(camera + "_veiled.png"), image);
    }
    const std::string pair = file("left_veiled.png") + " " + file("right_veiled.png");
    const std::string calibration = " --json -c " + file("calib.yaml");
    const nlohmann::json matched =
        json_of(run(depth_of("left_veiled.png", "right_veiled.png") + "--max-gain 20 --json"));
    const nlohmann::json scored =
        json_of(run("evaluate " + file("far.tiff") + " --truth " + file("far.tiff") + " --image " +
                    file("left_veiled.png") + calibration));
    const nlohmann::json warped =
        json_of(run("view-synthesis " + file("far.tiff") + " " + pair + calibration));
    EXPECT_EQ(scored["regions"][5]["region"], "textured");
    EXPECT_GT(warped["above_0.9"].get<double>(), 0.99) << veil;
    return std::array{matched["views"][0]["textured_pixels"].get<double>(),
                      scored["regions"][5]["pixels"].get<double>(),
                      warped["windows"].get<double>()};
  };
  const std::array of_dark = textured(0);
  for (const double veil : {70, 140, 200}) {
    const std::array of_hazy = textured(veil);
    for (std::size_t i = 0; i < of_dark.size(); ++i) {
      EXPECT_GT(of_dark[i], 5000);
      EXPECT_NEAR(of_hazy[i], of_dark[i], 0.02 * of_dark[i]) << veil << " " << i;
    }
  }
}

/// The same images with eight bits, and with these in files of 16.
class FewerBits : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    for (const std::string camera : {"left", "right"}) {
      cv::Mat image = cv::imread(file(camera + ".png"), cv::IMREAD_GRAYSCALE);
      cv::GaussianBlur(image, image, {}, 1);
      cv::imwrite(file(camera + ".png"), image);
      image.convertTo(image, CV_16U);
      cv::imwrite(file(camera + "16.png"), image);
    }
  }
  static constexpr const char* advice = "give --white-level 1023";
};

TEST_F(FewerBits, AreMatchedLikeAllBitsWhereTheWhiteLevelIsGiven) {
  const Outcome dark = run(depth_of("left16.png", "right16.png"));
  EXPECT_EQ(dark.exit_code, 0) << dark.output;
  EXPECT_NE(dark.output.find("left16.png has 16 bits, but no value above "), std::string::npos)
      << dark.output;
  EXPECT_EQ(dark.output.find(advice), dark.output.rfind(advice)) << "said once";
  const auto map = [this] { return cv::imread(file("out/distance0.tiff"), cv::IMREAD_UNCHANGED); };
  const cv::Mat of_dark = map();
  const Outcome given = run(depth_of("left16.png", "right16.png") + "--white-level 255 --json");
  ASSERT_EQ(given.exit_code, 0) << given.output;
  EXPECT_EQ(json_of(given)["input"]["white_level"], 255);
  const cv::Mat of_given = map();
  const Outcome whole = run(depth_of("left.png", "right.png"));
  EXPECT_EQ(whole.output.find(advice), std::string::npos) << whole.output;
  // But for rounding.
  EXPECT_LT(cv::norm(of_given, map(), cv::NORM_L1), 1e-4 * cv::norm(map(), cv::NORM_L1));
  EXPECT_GT(cv::norm(of_dark, map(), cv::NORM_L1), 1e-2 * cv::norm(map(), cv::NORM_L1));
  fs::remove_all(folder_ / "out");
  expect_error(depth_of("left.png", "right.png") + "--white-level 4095", "left.png has no 16 bits");
}

/// They match as well as others.
TEST_F(FewerBits, AreNotCalledBlankNorWithoutTexture) {
  for (const char* image : {"left16.png", "right16.png"}) {
    const cv::Mat of_8_bits = cv::imread(file(image), cv::IMREAD_UNCHANGED);
    cv::imwrite(file(image), 4 * of_8_bits);
  }
  const auto textured = [this](const std::string& left, const std::string& right) {
    const Outcome outcome = run(depth_of(left, right) + "--max-gain 20 --json");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_EQ(outcome.output.find("blank"), std::string::npos) << outcome.output;
    return json_of(outcome)["views"][0]["textured_pixels"].get<double>();
  };
  const double usual = textured("left.png", "right.png");
  ASSERT_GT(usual, 1000);
  EXPECT_GT(textured("left16.png", "right16.png"), 0.4 * usual);
}

TEST_F(FewerBits, AreScoredAsTheyWereMatched) {
  ASSERT_EQ(run(depth_of("left16.png", "right16.png") + "--white-level 255").exit_code, 0);
  cv::imwrite(file("far.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2)));
  const auto textured = [this](const std::string& map, const std::string& image,
                               const std::string& more = "") {
    const nlohmann::json scores =
        json_of(run("evaluate " + file(map) + " --truth " + file("far.tiff") + " -c " +
                    file("calib.yaml") + " --json --image " + file(image) + more));
    EXPECT_EQ(scores["regions"][5]["region"], "textured");
    return scores["regions"][5]["pixels"].get<double>();
  };
  const double of_8_bits = textured("far.tiff", "left.png");
  EXPECT_GT(of_8_bits, 5000);
  EXPECT_LT(textured("far.tiff", "left16.png"), 0.5 * of_8_bits) << "taken for a dark image";
  EXPECT_EQ(textured("far.tiff", "left16.png", " --white-level 255"), of_8_bits);
  EXPECT_EQ(textured("out/distance0.tiff", "left16.png"), of_8_bits) << "by the record";
  EXPECT_EQ(textured("out/distance0.tiff", "left.png"), of_8_bits) << "which is not of 8 bits";
  EXPECT_LT(textured("out/distance0.tiff", "left16.png", " --white-level 65535"), of_8_bits);
}

/// What a lens does not show is as black as nothing in a hazy image.
TEST_F(Command, BlackRimsAreNoContrast) {
  cv::imwrite(file("far.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(1e6)));
  folder_.write("narrow.yaml", bytes_of("calib.yaml") + "  max_theta_deg: 70\n");
  folder_.write("narrow.yaml", replaced(bytes_of("narrow.yaml"), "97.5", "70"));
  const Rig rig = read_calibration(file("narrow.yaml")).rig;
  const auto textured = [&](int rim) {
    for (int i = 0; i < 2; ++i) {
      const std::string camera = i == 0 ? "left" : "right";
      cv::Mat image = cv::imread(file(camera + ".png"), cv::IMREAD_GRAYSCALE), rays;
      image.convertTo(image, CV_8U, 0.1, 140);
      cv::extractChannel(ray_image(rig.views[static_cast<std::size_t>(i)].camera, {}), rays, 3);
      image.setTo(rim, rays == 0);
      cv::imwrite(file(camera + "_rim.png"), image);
    }
    const std::string calibration = " --json -c " + file("narrow.yaml");
    const nlohmann::json scored =
        json_of(run("evaluate " + file("far.tiff") + " --truth " + file("far.tiff") + " --image " +
                    file("left_rim.png") + calibration));
    const nlohmann::json warped =
        json_of(run("view-synthesis " + file("far.tiff ") + file("left_rim.png ") +
                    file("right_rim.png") + calibration));
    return std::array{scored["regions"][5]["pixels"].get<long>(), warped["windows"].get<long>()};
  };
  const std::array hazy = textured(150);
  for (const long count : hazy) EXPECT_GT(count, 1000);
  EXPECT_EQ(textured(0), hazy);
}

TEST_F(FewerBits, AreStretchedByEveryCommand) {
  const cv::Mat image = cv::imread(file("left16.png"), cv::IMREAD_UNCHANGED);
  cv::imwrite(file("left16.png"), image * 2);
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / "data" / camera);
    fs::copy_file(file("left16.png"), folder_ / "data" / camera / "0.png");
  }
  cv::imwrite(file("far.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(1e6)));
  const std::string pair = file("left16.png") + " " + file(copy_of("left16.png")) + " ";
  for (const std::string& command :
       {"sequence " + file("data") + " -o " + file("frames") + quick,
        "reconstruct " + file("data") + " --min-views 1 --count 1 -o " + file("dense") + quick,
        "calibration check " + pair, "calibration refine " + pair + "-o " + file("refined.yaml "),
        "evaluate " + file("far.tiff") + " --truth " + file("far.tiff") + " --image " +
            file("left16.png "),
        "view-synthesis " + file("far.tiff ") + pair}) {
    const std::string arguments = command + "-c " + file("calib.yaml") + " ";
    EXPECT_NE(run(arguments).output.find(advice), std::string::npos) << arguments;
    expect_error(arguments + "--white-level 255", "above the white level 255");
  }
  // Of each image.
  cv::imwrite(file("dim16.png"), image);
  for (const std::string& command :
       {std::string("calibration check "), "view-synthesis " + file("far.tiff ")}) {
    for (const std::string& images :
         {file("left16.png ") + file("dim16.png "), file("dim16.png ") + file("left16.png ")}) {
      expect_error(command + images + "-c " + file("calib.yaml") + " --white-level 255",
                   "left16.png has the value");
    }
  }
}

TEST_F(Command, ACameraThatIsMissingMayBeInTheFolder) {
  const std::string pair =
      "depth " + file("left.png") + " " + file("right.png") + " -o " + file("out") + " -c ";
  folder_.write(
      "left.yaml",
      "image_width: 96\nimage_height: 96\ncamera_matrix: {data: [30, 0, 48, 0, 30, 48, 0, 0, 1]}\n"
      "distortion_model: equidistant\ndistortion_coefficients: {data: [0, 0, 0, 0]}\n"
      "rectification_matrix: {data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}\n"
      "projection_matrix: {data: [30, 0, 48, 0, 0, 30, 48, 0, 0, 0, 1, 0]}\n");
  expect_error(pair + file("left.yaml"), "Give the folder that has the files of all cameras");
  expect_error(pair + file("calib.yaml") + " --views 0,2", "there is no camera 2. Give one image");
}

TEST_F(Command, ACameraThatIsMissingGoesIntoAFileOfTheRig) {
  const auto expect = [&](const std::string& name, const std::string& remedy) {
    expect_error("depth " + file("left.png") + " " + file("right.png") + " -o " + file("out") +
                     " -c " + file(name),
                 " has 1 camera(s); there is no camera 1. " + remedy);
  };
  write_first_camera();
  expect("mono.yaml", "Put the cameras into one Kalibr camchain, cam1 with T_cn_cnm1, or give the");
  folder_.write("camodocal.yaml", R"(%YAML:1.0
---
model_type: MEI
image_width: 96
image_height: 96
mirror_parameters: { xi: 2.2 }
distortion_parameters: { k1: 0.01, k2: 0, p1: 0, p2: 0 }
projection_parameters: { gamma1: 133, gamma2: 133, u0: 47, v0: 48 }
)");
  expect("camodocal.yaml", "Name the cameras' files in one of VINS-Fusion (cam0_calib, cam1_calib");
  folder_.write("orb.yaml", R"(%YAML:1.0
Camera.type: "KannalaBrandt8"
Camera1.fx: 30
Camera1.fy: 30
Camera1.cx: 47
Camera1.cy: 48
Camera1.k1: 0
Camera1.k2: 0
Camera1.k3: 0
Camera1.k4: 0
Camera.width: 96
Camera.height: 96
)");
  expect("orb.yaml", "Put the cameras into one file, as Camera1 and Camera2 with Stereo.T_c1_c2");
  folder_.write("woodscape.json",
                "{\"intrinsic\": {\"model\": \"radial_poly\", \"width\": 96, \"height\": 96, "
                "\"cx_offset\": 0, \"cy_offset\": 0, \"aspect_ratio\": 1, \"k1\": 30, \"k2\": 0, "
                "\"k3\": 0, \"k4\": 0}}");
  expect("woodscape.json", "No rig that can be read has cameras of WoodScape");
  folder_.write("opencv.yaml",
                "image_width: 96\nimage_height: 96\nK: [30, 0, 48, 0, 30, 48, 0, 0, 1]\n"
                "D: [0, 0, 0, 0]\n");
  expect("opencv.yaml", "Put the cameras into one file, as K1, D1, K2, D2, R and T");
}

TEST_F(Command, UnknownWordsAreNamed) {
  const auto expect = [](const std::string& arguments, const std::string& message) {
    const Outcome outcome = run(arguments);
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_EQ(outcome.output, "widestereo: " + message + "\n");
  };
  expect("foo", "foo is no command; `widestereo --help` lists them.");
  expect("foo l.png -o x", "foo is no command; `widestereo --help` lists them.");
  expect("calibration foo x.yaml",
         "foo is no command; `widestereo calibration --help` lists them.");
  expect("--foo", "--foo is no option; `widestereo --help` lists them.");
  const std::string no_option = "--outpt is no option; `widestereo depth --help` lists them.";
  expect("depth l.png r.png -c x.yaml --outpt x", no_option);  // rather than that --output lacks
  expect("depth l.png r.png -c x.yaml -o x --outpt x", no_option);
  expect("demo extra", "extra is a word too many; leave it out.");
  expect("demo --size 2",
         "--size: Value 2 not in range 64 to 4096; `widestereo demo --help` tells more.");
  EXPECT_EQ(run("foo --help").exit_code, 0);
}

/// Nothing is wrong with the folder, so it is not made before all else is found right.
TEST_F(Command, RefusedRequestsLeaveNoFolder) {
  const std::string depth = "depth " + file("left.png") + " " + file("right.png") + " -c " +
                            file("calib.yaml") + " -o " + file("out") + " ";
  cv::imwrite(file("one.png"), cv::Mat(1, 1, CV_8UC3, cv::Scalar::all(7)));
  cv::imwrite(file("none.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  expect_error(depth + "--device cpu --levels 1 --level-iterations 1,2", "level iterations");
  expect_error(depth + "--device cpux", "cpux");
  expect_error("depth " + file("one.png") + " " + file("right.png") + " -c " + file("calib.yaml") +
                   " -o " + file("out") + " --device cpu",
               file("one.png") + " is 1x1 pixels");
  expect_error(depth + "--device cpu --mask " + file("none.png"),
               "The mask " + file("none.png") + " is 0 everywhere");
  cv::Mat faded(96, 96, CV_8UC4, cv::Scalar::all(255));
  cv::imwrite(file("opaque.png"), faded);
  faded(cv::Rect(0, 0, 9, 9)) = cv::Scalar(255, 255, 255, 0);
  cv::imwrite(file("faded.png"), faded);
  expect_error(depth + "--device cpu --mask " + file("faded.png"),
               file("faded.png") + " is transparent in places");
  expect_error("demo --size 64 --device cpu --levels 1 --level-iterations 1,2 -o " + file("out"),
               "level iterations");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Command, BenchmarkFindsOutFirstWhetherItCanWrite) {
  const std::string common = "benchmark --devices none --presets fast --sizes 64 ";
  expect_error(common + "-o " + file("nothere/x.json"), "nothere does not exist");
  expect_error(common + "--plot " + file("nothere/x.svg"), "nothere does not exist");
  fs::create_directory(folder_ / "folder.json");
  expect_error(common + "-o " + file("folder.json"), "folder.json: it is a folder");
  EXPECT_NE(run(common + "-o " + file("x.json")).output.find("There is no device \"none\""),
            std::string::npos);
  EXPECT_FALSE(fs::exists(folder_ / "x.json"));
}

TEST_F(Command, ImagesWithoutOverlapAreRefused) {
  std::string text = bytes_of("calib.yaml");
  // Camera 1 looks backwards through a narrow lens.
  for (const auto& [from, to] :
       {std::pair<std::string, std::string>("[1.0, 0.0, 0.0, -0.1]", "[-1.0, 0.0, 0.0, 0.1]"),
        {"[0.0, 0.0, 1.0, 0.0]\n  - [0.0", "[0.0, 0.0, -1.0, 0.0]\n  - [0.0"},
        {"  max_theta_deg: 97.5\n", "  max_theta_deg: 40\n"}}) {
    text = replaced(text, from, to);
  }
  text += "  max_theta_deg: 40\n";
  folder_.write("apart.yaml", text);
  expect_error(depth_of("left.png", "right.png", "apart.yaml"), "do not overlap");
}

TEST_F(Command, ViewsThatNoOtherOverlapsAreNamed) {
  write_calibration_looking_backwards();
  const Outcome outcome =
      run("depth " + file("left.png") + " " + file("right.png") + " " + file(copy_of("left.png")) +
          " -c " + file("backwards.yaml") + " -o " + file("out") + quick);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("No pixel of cam2 is seen by another view"), std::string::npos)
      << outcome.output;
  EXPECT_EQ(outcome.output.find("No pixel of cam1"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("cam2: 0.0 % accepted, mean cost -, cost"), std::string::npos)
      << outcome.output;
  const nlohmann::json views = nlohmann::json::parse(bytes_of("out/result.json")).at("views");
  EXPECT_TRUE(views[2].at("mean_cost").is_null()) << views[2];
  EXPECT_TRUE(views[1].at("mean_cost").is_number()) << views[1];
}

TEST_F(Command, MoreSourcesThanThereAreIsSaid) {
  const Outcome outcome = run(depth_of("left.png", "right.png") + "--best-sources 2");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("--best-sources 2 is more than the other views, 1; costs"),
            std::string::npos)
      << outcome.output;
  const Outcome fits = run(depth_of("left.png", "right.png") + "--best-sources 1");
  EXPECT_EQ(fits.output.find("--best-sources"), std::string::npos) << fits.output;
}

TEST_F(Command, WithoutAGpuItSaysSoAndUsesTheCpu) {
  const std::string no_driver =
      "VK_ICD_FILENAMES=/nonexistent.json VK_DRIVER_FILES=/nonexistent.json CUDA_VISIBLE_DEVICES=";
  const std::string arguments = "demo --size 64 -o " + file("demo");
  const Outcome strict = run(arguments + " --device vulkan", no_driver);
  EXPECT_EQ(strict.exit_code, 1);
  EXPECT_NE(strict.output.find("No Vulkan device"), std::string::npos) << strict.output;
  const Outcome automatic = run(arguments, no_driver);
  EXPECT_EQ(automatic.exit_code, 0) << automatic.output;
  EXPECT_NE(automatic.output.find("Using the CPU"), std::string::npos) << automatic.output;
}

TEST_F(Command, EvaluateScoresAndRefuses) {
  cv::Mat truth(96, 96, CV_32FC1, cv::Scalar(2.0));
  cv::imwrite(file("truth.tiff"), truth);
  cv::Mat prediction = truth * 1.015;
  cv::imwrite(file("prediction.tiff"), prediction);
  const std::string common = " -c " + file("calib.yaml") + " --truth " + file("truth.tiff");
  const Outcome outcome = run("evaluate " + file("prediction.tiff") + common +
                              " --json --error-map " + file("error.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json record = json_of(outcome);
  const nlohmann::json& scores = record["regions"];
  EXPECT_TRUE(record["sparsification"].empty());
  EXPECT_EQ(scores[0]["bad_relative"]["0.01"], 1.0);
  EXPECT_EQ(scores[0]["bad_relative"]["0.02"], 0.0);
  EXPECT_TRUE(fs::exists(file("error.png")));
  cv::imwrite(file("normals.tiff"), cv::Mat(96, 96, CV_32FC3, cv::Scalar(0, 0, -1)));
  expect_error("evaluate " + file("prediction.tiff") + " -c " + file("calib.yaml") + " --truth " +
                   file("normals.tiff"),
               file("normals.tiff") + " has 3 value(s) a pixel, but a distance map has 1;");
  cv::imwrite(file("confidence.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(0.5)));
  const Outcome curve = run("evaluate " + file("prediction.tiff") + common +
                            " --json --confidence " + file("confidence.tiff"));
  ASSERT_EQ(curve.exit_code, 0) << curve.output;
  const nlohmann::json points = json_of(curve)["sparsification"];
  ASSERT_EQ(points.size(), 10u);
  EXPECT_EQ(points[9]["confidence"], 0.5);
  expect_error(
      "evaluate " + file("prediction.tiff") + common + " --confidence " + file("none.tiff"),
      "none.tiff");
  const std::string evaluate = "evaluate " + file("prediction.tiff") + common;
  expect_error(evaluate + " --confidence " + file("normals.tiff"),
               file("normals.tiff") + " has 3 value(s) a pixel, but a confidence map has 1;");
  cv::imwrite(file("small.png"), cv::Mat(48, 96, CV_8UC1, cv::Scalar(255)));
  for (const char* option : {" --valid ", " --occlusion ", " --image "}) {
    expect_error(evaluate + option + file("small.png"),
                 file("small.png") + " is 96x48 pixels, but ");
  }
  expect_error(evaluate + " --error-map " + file("error.none"), "error.none");
  // The right half has no ground truth.
  truth.colRange(48, 96).setTo(0);
  cv::imwrite(file("half_truth.tiff"), truth);
  cv::imwrite(file("fov.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  const std::string far = "evaluate " + file("prediction.tiff") + " -c " + file("calib.yaml") +
                          " --truth " + file("half_truth.tiff") + " --image " + file("left.png") +
                          " --far-distance ";
  const Outcome near_by = run(far + "2 --json --field-of-view " + file("fov.png"));
  ASSERT_EQ(near_by.exit_code, 0) << near_by.output;
  const nlohmann::json both = json_of(near_by);
  EXPECT_EQ(both["far"]["right"], 1.0);
  EXPECT_GT(both["far"]["pixels"], 1000);
  const auto textured =
      std::find_if(both["regions"].begin(), both["regions"].end(),
                   [](const nlohmann::json& region) { return region["region"] == "textured"; });
  ASSERT_NE(textured, both["regions"].end());
  EXPECT_GT((*textured)["pixels"], 1000) << "noise is texture";
  EXPECT_NE(run(far + "50 --field-of-view " + file("fov.png")).output.find("of 50 m"),
            std::string::npos);
  expect_error(far + "50", "--field-of-view");
  expect_error("evaluate " + file("no.tiff") + common, "no.tiff");
  expect_error("evaluate " + file("left.png") + common, "left.png");
  expect_error("evaluate " + file("prediction.tiff"), "--truth");
  cv::imwrite(file("half.tiff"), prediction(cv::Rect(0, 0, 48, 96)));
  expect_error("evaluate " + file("half.tiff") + common, "48x96 pixels, but ");
  for (const char* source : {"7", "0", "-1"}) {
    expect_error("evaluate " + file("prediction.tiff") + common + " --source " + source,
                 "choose two different ones by --view and --source");
  }
}

TEST_F(Command, CalibrationShowsConvertsAndChecks) {
  Outcome outcome = run("calibration show " + file("calib.yaml") + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json shown = json_of(outcome);
  EXPECT_EQ(shown["views"][0]["model"], "double_sphere");
  EXPECT_NEAR(shown["pairs"][0]["baseline_metres"].get<double>(), 0.1, 1e-12);
  outcome = run("calibration show " + file("calib.yaml"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(" (model), 97.5 (lens)\n"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find(" (model), lens not limited\n"), std::string::npos)
      << outcome.output;
  EXPECT_FALSE(shown.contains("imu"));
  write_calibration_with_imu();
  outcome = run("calibration show " + file("imucam.yaml") + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json imu = json_of(outcome)["imu"];
  EXPECT_EQ(imu["position_in_first_metres"], nlohmann::json({0.05, -0.04, -0.07}));
  EXPECT_NEAR(imu["rotation_degrees"].get<double>(), 120, 1e-9);
  outcome = run("calibration show " + file("imucam.yaml"));
  EXPECT_NE(outcome.output.find("0.0500 -0.0400 -0.0700 m"), std::string::npos) << outcome.output;
  outcome = run("calibration convert " + file("calib.yaml") + " " + file("calib.json"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  outcome =
      run("calibration convert " + file("calib.yaml") + " " + file("half.yaml") + " --scale 0.5");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  const Camera half = read_calibration(file("half.yaml")).rig.views[0].camera;
  EXPECT_EQ(half, resized(read_calibration(file("calib.yaml")).rig.views[0].camera, 48, 48));
  cv::imwrite(file("half.png"), cv::Mat(48, 48, CV_8UC1, cv::Scalar(7)));
  expect_error("calibration check " + file("half.png") + " " + file("half.png ") + " -c " +
                   file("calib.yaml"),
               "is given twice");
  expect_error(depth_of("half.png", "left.png"),
               "`calibration convert --scale` makes a calibration for reduced images, but not of a "
               "COLMAP model");
  expect_error(depth_of("left.png", "right.png") + "--mask " + file("half.png"),
               "half.png is 48x48 pixels, but the images of cam0 have 96x96; give a mask of");
  EXPECT_EQ(run("calibration show " + file("calib.json")).exit_code, 0);
  expect_error("calibration show " + file("left.png"), "left.png");
  cv::imwrite(file("flat.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(7)));
  expect_error("calibration check " + file("flat.png") + " " + file(copy_of("flat.png")) + " -c " +
                   file("calib.yaml"),
               "features match");
  expect_error("calibration check " + file("flat.png") + " " + file("flat.png") + " -c " +
                   file("calib.yaml"),
               "flat.png is given twice; give another image for each view.");
  outcome = run("calibration check " + file("left.png") + " " + file("right.png") + " -c " +
                file("calib.yaml") + " --json");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
}

/// A wide pinhole camera, and another one beside it that is turned a quarter about the axis.
TEST_F(Command, CalibrationsHaveTheFormatOfTheirFilesNames) {
  folder_.write("fisheye.yaml", R"(cam0:
  camera_model: pinhole
  intrinsics: [30, 30, 47, 48]
  distortion_model: equidistant
  distortion_coeffs: [0, 0, 0, 0]
  resolution: [96, 96]
)");
  const auto first_line = [this](const std::string& name) {
    const Outcome outcome = run("calibration convert " + file("fisheye.yaml") + " " + file(name));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    const std::string text = bytes_of(name);
    return text.substr(0, text.find('\n'));
  };
  EXPECT_EQ(first_line("c.yaml"), "cam0:");
  EXPECT_EQ(first_line("c.json"), "{");
  EXPECT_EQ(first_line("C.JSON"), "{");
  EXPECT_EQ(first_line("c.xml"), "<?xml version=\"1.0\"?>");
}

TEST_F(Command, CalibrationShowsFieldsOfViewAndWhereCamerasStand) {
  folder_.write("wide.yaml", R"(cam0:
  camera_model: pinhole
  intrinsics: [50.0, 50.0, 150.0, 50.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [301, 101]
cam1:
  T_cn_cnm1:
  - [0.0, 1.0, 0.0, 0.0]
  - [-1.0, 0.0, 0.0, 0.1]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  camera_model: pinhole
  intrinsics: [50.0, 50.0, 150.0, -20.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [301, 101]
)");
  const Outcome outcome = run("calibration show " + file("wide.yaml") + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json shown = json_of(outcome);
  const nlohmann::json& view = shown["views"][0];
  const auto degrees = [](double tangent) { return 2 * std::atan(tangent) * degrees_per_radian; };
  EXPECT_NEAR(view["horizontal_field_of_view_degrees"], degrees(150 / 50.), 1e-6);
  EXPECT_NEAR(view["vertical_field_of_view_degrees"], degrees(50 / 50.), 1e-6);
  EXPECT_NEAR(view["diagonal_field_of_view_degrees"], degrees(std::hypot(150, 50) / 50), 0.5);
  // Of a sensor that was cut off below the principal point.
  const nlohmann::json& cut = shown["views"][1];
  EXPECT_NEAR(cut["vertical_field_of_view_degrees"],
              (std::atan(120 / 50.) - std::atan(20 / 50.)) * degrees_per_radian, 1e-6);
  EXPECT_GT(cut["horizontal_field_of_view_degrees"], 90);
  const nlohmann::json& pair = shown["pairs"][0];
  EXPECT_NEAR(pair["baseline_metres"], 0.1, 1e-12);
  EXPECT_NEAR(pair["rotation_degrees"], 90, 1e-9);
  EXPECT_NEAR(pair["direction_in_first"][0], 1, 1e-12);
  EXPECT_NEAR(pair["direction_in_first"][1], 0, 1e-12);
}

TEST_F(Command, CalibrationShowAsksAboutWhatIsUnusual) {
  const auto said_of = [this](const std::string& intrinsics) {
    folder_.write("c.yaml", "cam0:\n  camera_model: pinhole\n  intrinsics: [" + intrinsics +
                                "]\n  distortion_model: none\n  distortion_coeffs: []\n"
                                "  resolution: [300, 200]\n");
    const Outcome outcome = run("calibration show " + file("c.yaml"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return outcome.output;
  };
  EXPECT_THAT(said_of("150, 150, 149.5, 99.5"), Not(HasSubstr("?")));
  EXPECT_THAT(said_of("150, 110, 0, 199"), Not(HasSubstr("?")));
  EXPECT_THAT(said_of("300, 150, 149.5, 99.5"), HasSubstr("cam0: fx is 2 times fy; "));
  EXPECT_THAT(said_of("150, 300, 149.5, 99.5"), HasSubstr("cam0: fx is 0.5 times fy; "));
  EXPECT_THAT(said_of("150, 150, 149.5, 200"),
              HasSubstr("the principal point (149.5, 200.0) lies outside the image of 300 x 200"));
  EXPECT_THAT(said_of("1e6, 1e6, 149.5, 99.5"),
              HasSubstr("the field of view is 0.021 degrees at most"));
}

TEST_F(Command, DarkRimsAreLeftOut) {
  std::string text = bytes_of("calib.yaml");
  const std::string limit = "  max_theta_deg: 97.5\n";
  text.erase(text.find(limit), limit.size());
  folder_.write("unlimited.yaml", text);
  cv::Mat circle(96, 96, CV_8UC3, cv::Scalar::all(0));
  cv::circle(circle, {48, 48}, 42, cv::Scalar::all(255), cv::FILLED);
  cv::Mat image = cv::imread(file("left.png"));
  cv::bitwise_and(image, circle, image);
  cv::imwrite(file("rim.png"), image);
  const auto limits_of = [&](const std::string& arguments) {
    fs::remove_all(folder_ / "out");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    std::ifstream file(folder_ / "out/result.json");
    const nlohmann::json views = nlohmann::json::parse(file)["views"];
    return std::pair(views[1]["max_theta_degrees"].get<double>(),
                     outcome.output.find(" is black from ") != std::string::npos);
  };
  const std::string depth = depth_of("rim.png", copy_of("rim.png"), "unlimited.yaml");
  const auto [found, told] = limits_of(depth);
  EXPECT_NEAR(found, 69, 2);  // 42 pixels, by the formula of the double sphere
  EXPECT_TRUE(told);
  EXPECT_EQ(limits_of(depth + " --max-theta 180"), std::pair(180.0, false));
  EXPECT_EQ(limits_of(depth + " --mask " + file("rim.png")), std::pair(180.0, false));
  cv::Mat without_bonnet(96, 96, CV_8UC1, cv::Scalar(255));
  without_bonnet(cv::Rect(36, 80, 24, 16)) = 0;
  cv::imwrite(file("bonnet.png"), without_bonnet);
  EXPECT_EQ(limits_of(depth + " --mask " + file("bonnet.png")), std::pair(found, true));
  EXPECT_EQ(limits_of(depth_of("left.png", "right.png", "unlimited.yaml")),
            std::pair(180.0, false));
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / "rims" / camera);
    cv::imwrite((folder_ / "rims" / camera / "0.png").string(), image);
  }
  alter("rims/cam1/0.png", 48);
  const Outcome outcome = run("sequence " + file("rims") + " -c " + file("unlimited.yaml") +
                              " -o " + file("sequence") + quick);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(" is black from "), std::string::npos) << outcome.output;
}

TEST_F(Command, OptionsMayStandBeforeImages) {
  cv::imwrite(file("mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  const std::string images = file("left.png") + " " + file("right.png");
  const std::string rest = " -c " + file("calib.yaml") + " -o " + file("out") + quick;
  for (const std::string& option :
       {"--mask " + file("mask.png") + " --mask " + file("mask.png"),
        "--mask " + file("mask.png") + "," + file("mask.png"), std::string("--views 0,1"),
        std::string("--blur 0.5,0"), std::string("--formats tiff,pfm")}) {
    const Outcome outcome = run("depth " + option + " " + images + rest);
    EXPECT_EQ(outcome.exit_code, 0) << option << "\n" << outcome.output;
  }
  EXPECT_TRUE(fs::exists(folder_ / "out/distance0.pfm"));
}

TEST_F(Command, ImageOfFinerPixelsIsBlurred) {
  cv::Mat image = cv::imread(file("right.png"));
  cv::resize(image, image, {192, 192});
  cv::imwrite(file("fine.png"), image);
  const std::string text = bytes_of("calib.yaml");
  const std::size_t cam1 = text.find("cam1:");
  const std::string of_fine =
      replaced(text.substr(cam1), "28.9, 28.9, 47.9, 48.0", "57.8, 57.8, 96.3, 96.5");
  folder_.write("fine.yaml", text.substr(0, cam1) + replaced(of_fine, "[96, 96]", "[192, 192]"));
  const auto blur_of_second = [&] {
    std::ifstream file(folder_ / "out/result.json");
    return nlohmann::json::parse(file)["views"][1]["blur_pixels"].get<double>();
  };
  const std::string message = "cam1 has finer pixels than cam0 and is blurred by 0.87 pixels";
  Outcome outcome = run(depth_of("left.png", "fine.png", "fine.yaml"));
  EXPECT_NE(outcome.output.find(message), std::string::npos) << outcome.output;
  EXPECT_NEAR(blur_of_second(), 0.5 * std::sqrt(3), 0.01);
  outcome = run(depth_of("left.png", "fine.png", "fine.yaml") + "--blur 0");
  EXPECT_EQ(outcome.output.find(message), std::string::npos) << outcome.output;
  EXPECT_EQ(blur_of_second(), 0);
}

TEST_F(Command, SharperImageIsBlurred) {
  cv::Mat image = cv::imread(file("left.png"));
  cv::GaussianBlur(image, image, {}, 1);
  cv::imwrite(file("left.png"), image);
  cv::GaussianBlur(image, image, {}, 1.2);
  cv::imwrite(file("blunt.png"), image);
  const auto blurs_of = [&](const std::string& arguments) {
    fs::remove_all(folder_ / "out");
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_EQ(outcome.output.find("sharper than") != std::string::npos,
              arguments.find("blur ") == std::string::npos &&
                  arguments.find("blunt") != std::string::npos)
        << outcome.output;
    std::ifstream file(folder_ / "out/result.json");
    const nlohmann::json views = nlohmann::json::parse(file)["views"];
    return std::pair(views[0]["blur_pixels"].get<double>(), views[1]["blur_pixels"].get<double>());
  };
  const auto [first, second] = blurs_of(depth_of("left.png", "blunt.png"));
  EXPECT_NEAR(first, 1.2, 0.2);
  EXPECT_EQ(second, 0);
  const cv::Mat found = cv::imread(file("out/distance0.tiff"), cv::IMREAD_UNCHANGED);
  // What is matched is what the option would have made of it.
  const std::string value = nlohmann::json(first).dump();
  EXPECT_EQ(blurs_of(depth_of("left.png", "blunt.png") + " --blur " + value + ",0"),
            std::pair(std::stod(value), 0.0));
  EXPECT_TRUE(same_bits(found, cv::imread(file("out/distance0.tiff"), cv::IMREAD_UNCHANGED)));
  EXPECT_EQ(blurs_of(depth_of("left.png", "blunt.png") + " --blur 0"), std::pair(0.0, 0.0));
  EXPECT_FALSE(same_bits(found, cv::imread(file("out/distance0.tiff"), cv::IMREAD_UNCHANGED)));
  EXPECT_EQ(blurs_of(depth_of("left.png", copy_of("left.png"))), std::pair(0.0, 0.0));
  fs::remove_all(folder_ / "out");
  expect_error(depth_of("left.png", "blunt.png") + " --blur 1,2,3", "--blur was given 3 values");
  const Outcome check = run("calibration check " + file("blunt.png") + " " + file("left.png") +
                            " -c " + file("calib.yaml"));
  EXPECT_NE(check.output.find("cam0 is as sharp as cam1 blurred by 1."), std::string::npos)
      << check.output;
}

/// calib.yaml with its second camera turned about the baseline.
std::string turned(const std::string& calibration, double degrees) {
  const double c = std::cos(degrees * radians_per_degree);
  const double s = std::sin(degrees * radians_per_degree);
  return replaced(calibration, "[0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]",
                  formatted("[0.0, %.8f, %.8f, 0.0]\n  - [0.0, %.8f, %.8f, 0.0]", c, -s, s, c));
}

TEST_F(Command, CalibrationIsRefined) {
  folder_.write("turned.yaml", turned(bytes_of("calib.yaml"), 2));
  const std::string pair = file("left.png") + " " + file("right.png") + " ";
  const std::string again = file(copy_of("left.png")) + " " + file(copy_of("right.png")) + " ";
  const std::string refine = "calibration refine " + pair + again + "-c " + file("turned.yaml");
  Outcome outcome = run(refine + " --json -o " + file("refined.json") + " --to basalt");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json json = json_of(outcome);
  EXPECT_EQ(json["frames"], 2);
  EXPECT_GT(json["pairs"][0]["median_pixels_before"].get<double>(), 0.3);
  EXPECT_LT(json["pairs"][0]["median_pixels_after"].get<double>(), 0.02);
  EXPECT_NEAR(json["views"][1]["rotation_degrees"]["change"].get<double>(), 2, 0.05);
  const auto median = [&](const std::string& calibration) {
    return nlohmann::json::parse(
               run("calibration check " + pair + "-c " + file(calibration) + " --json").output)
        .at("median_pixels")
        .get<double>();
  };
  EXPECT_EQ(median("turned.yaml"), json["pairs"][0]["median_pixels_before"]);
  const auto verdict = [&](const std::string& calibration) {
    return run("calibration check " + pair + "-c " + file(calibration)).output;
  };
  EXPECT_NE(verdict("refined.json").find("calibration: good\n"), std::string::npos);
  ASSERT_EQ(run(refine + " -o " + file("limited.yaml") + " --max-theta 60").exit_code, 0);
  const Rig limited = read_calibration(file("limited.yaml")).rig;
  EXPECT_NEAR(limited.views[0].camera.max_theta, 97.5 * radians_per_degree, 1e-9)
      << "as calibrated";
  EXPECT_NEAR(limited.views[1].camera.max_theta, CV_PI, 1e-9) << "likewise";
  EXPECT_EQ(verdict("turned.yaml").find("calibration: good"), std::string::npos);
  folder_.write("off.yaml", turned(bytes_of("calib.yaml"), 4));
  EXPECT_NE(verdict("off.yaml").find("too inaccurate for stereo: calibrate again\n"),
            std::string::npos)
      << verdict("off.yaml");
  for (const char* json_too : {"", " --json"}) {
    const auto ends_with = [&](const std::string& calibration) {
      return run("calibration check " + pair + "-c " + file(calibration) + json_too).exit_code;
    };
    EXPECT_EQ(ends_with("calib.yaml"), 0);
    EXPECT_EQ(ends_with("off.yaml"), 2);
  }
  folder_.write("far_off.yaml", turned(bytes_of("calib.yaml"), 12));
  EXPECT_NE(verdict("far_off.yaml")
                .find("does not fit: are the images of one moment, and of these cameras? "
                      "Then calibrate again\n"),
            std::string::npos)
      << verdict("far_off.yaml");
  EXPECT_NEAR(median("refined.json"), json["pairs"][0]["median_pixels_after"].get<double>(), 1e-6);
  for (const bool intrinsics : {false, true}) {
    outcome =
        run(refine + " --json -o " + file("again.yaml") + (intrinsics ? " --intrinsics" : ""));
    EXPECT_EQ(nlohmann::json::parse(
                  outcome.output)["views"][1]["focal_length_percent"]["deviation"] > 0.0,
              intrinsics);
  }
  const std::string hardly = "The features fit hardly better than before";
  EXPECT_EQ(outcome.output.find(hardly), std::string::npos) << outcome.output;
  outcome =
      run("calibration refine " + pair + "-c " + file("calib.yaml") + " -o " + file("again.yaml"));
  EXPECT_NE(outcome.output.find(hardly), std::string::npos) << outcome.output;
  expect_error(
      "calibration refine " + pair + pair + "-o " + file("no.yaml") + " -c " + file("calib.yaml"),
      "left.png is given twice");
  // Of a second frame that shows nothing no features are added.
  cv::imwrite(file("flat.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(7)));
  const std::string flat = file("flat.png") + " " + file(copy_of("flat.png")) + " ";
  outcome = run("calibration refine " + pair + flat + "-c " + file("turned.yaml") + " --json -o " +
                file("again.yaml"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(2 * json_of(outcome)["pairs"][0]["matches"].get<int>(), json["pairs"][0]["matches"]);
  outcome = run(refine + " --intrinsics -o " + file("refined.yaml"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("cam1  f by "), std::string::npos) << outcome.output;
  expect_error("calibration refine " + pair + file("left.png") + " -o " + file("no.yaml") + " -c " +
                   file("calib.yaml"),
               "3 image(s)");
  expect_error(refine + " -o " + file("no/refined.yaml"), "no/refined.yaml");
  // Said before images are matched, in which there are no features.
  folder_.write("mei.yaml", replaced(bytes_of("calib.yaml"),
                                     "ds\n  intrinsics: [-0.165, 0.59, 28.9, 28.9, 47.9, 48.0]\n"
                                     "  distortion_model: none\n  distortion_coeffs: []",
                                     "omni\n  intrinsics: [1.2, 58, 58, 47.9, 48.0]\n"
                                     "  distortion_model: radtan\n"
                                     "  distortion_coeffs: [0.01, 0, 0, 0]"));
  expect_error("calibration refine " + flat + "-c " + file("mei.yaml") + " --to basalt -o " +
                   file("no.json"),
               "has no form in Basalt's format");
  EXPECT_FALSE(fs::exists(folder_ / "no.json"));
  EXPECT_FALSE(fs::exists(folder_ / "no.yaml"));
}

/// Noise with features.
class TexturedPair : public Command {
 protected:
  /// Writes left.png and right.png: noise that lies `shift` pixels farther to the left in the
  /// second camera.
  void write_images(int shift) const {
    cv::Mat noise(96, 110, CV_8UC1);
    cv::RNG(5).fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(noise, noise, {}, 1);
    cv::imwrite(file("left.png"), noise.colRange(0, 96));
    cv::imwrite(file("right.png"), noise.colRange(shift, shift + 96));
  }
  /// What matches the pair, a sequence of it and a scene of one frame.
  std::vector<std::string> matching_commands() const {
    for (const char* camera : {"cam0", "cam1"}) fs::create_directories(folder_ / camera);
    fs::copy(folder_ / "left.png", folder_ / "cam0" / "1.png");
    fs::copy(folder_ / "right.png", folder_ / "cam1" / "1.png");
    return {"depth " + file("left.png") + " " + file("right.png"),
            "sequence " + folder_.path().string(),
            "reconstruct " + folder_.path().string() + " --count 1"};
  }
  static constexpr const char* doubt =
      "The baseline is 100 m long; calibrations are in metres, is this one?";
  /// What a command prints, which ends well.
  std::string output_of(const std::string& command, const std::string& calibration,
                        const std::string& min_distance) {
    const Outcome outcome = run(command + " -c " + file(calibration) + " -o " +
                                file("out" + std::to_string(outputs_++)) +
                                " --preset fast --device cpu --min-distance " + min_distance);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return outcome.output;
  }

 private:
  int outputs_ = 0;
};

class ShiftedPair : public TexturedPair {
 protected:
  void SetUp() override {
    TexturedPair::SetUp();
    write_images(6);
  }
  std::string calibration(const std::string& what, const std::string& a,
                          const std::string& b) const {
    return "calibration " + what + " " + file(a) + " " + file(b) + " -c " + file("calib.yaml") +
           " ";
  }
};

TEST_F(ShiftedPair, SwappedImagesAreMatchedWithAHint) {
  const auto has_hint = [this](const std::string& images) {
    const Outcome outcome = run("depth " + images + " -c " + file("calib.yaml") + " -o " +
                                file("out") + " --preset fast --device cpu --min-distance 0.3");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return outcome.output.find("Little was accepted: check the order") != std::string::npos;
  };
  EXPECT_TRUE(has_hint(file("right.png") + " " + file("left.png")));
  EXPECT_TRUE(has_hint("--json " + file("right.png") + " " + file("left.png")));
  EXPECT_FALSE(has_hint(file("left.png") + " " + file("right.png")));
}

TEST_F(ShiftedPair, SequencesOfSwappedCamerasGiveAHint) {
  for (const char* camera : {"cam0", "cam1"}) fs::create_directories(folder_ / camera);
  fs::copy(folder_ / "left.png", folder_ / "cam0" / "1.png");
  fs::copy(folder_ / "right.png", folder_ / "cam1" / "1.png");
  const auto has_hint = [this](const std::string& order) {
    const Outcome outcome = run("sequence " + folder_.path().string() + " -c " +
                                file("calib.yaml") + " -o " + file("out" + order) + " --folders " +
                                order + " --preset fast --device cpu --min-distance 0.3");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return outcome.output.find("Little was accepted: check the order") != std::string::npos;
  };
  EXPECT_TRUE(has_hint("cam1,cam0"));
  EXPECT_FALSE(has_hint("cam0,cam1"));
}

TEST_F(ShiftedPair, FeaturesOutOfTheRangeAreReported) {
  for (const std::string& command : matching_commands()) {
    EXPECT_THAT(output_of(command, "calib.yaml", "0.1 --max-distance 50"),
                Not(HasSubstr("features that match lie")));
    EXPECT_THAT(output_of(command, "calib.yaml", "0.1 --max-distance 0.2"),
                ContainsRegex("% of the features that match lie farther than --max-distance 0.2 m "
                              ".99 % of all within 0.[0-9]+ m., and nothing there can be found; "
                              "give a larger one"));
    EXPECT_THAT(output_of(command, "calib.yaml", "2"),
                ContainsRegex("% of the features that match lie nearer than --min-distance 2 m "
                              ".99 % of all beyond 0.[0-9]+ m., and nothing there can be found; "
                              "give a smaller one"));
  }
}

TEST_F(TexturedPair, BaselinesOfOtherUnitsAreDoubted) {
  write_images(0);
  alter("right.png", 60);
  folder_.write("millimetres.yaml", replaced(bytes_of("calib.yaml"), "-0.1]", "-100]"));
  for (const char* json : {"", " --json"}) {
    const auto output_with = [&](const char* calibration) {
      return run("calibration check " + file("left.png") + " " + file("right.png") + " -c " +
                 file(calibration) + json)
          .output;
    };
    EXPECT_THAT(output_with("millimetres.yaml"), HasSubstr(doubt));
    EXPECT_THAT(output_with("calib.yaml"), Not(HasSubstr("metres")));
    EXPECT_THAT(run("calibration show " + file("millimetres.yaml") + json).output,
                HasSubstr(doubt));
    EXPECT_THAT(run("calibration show " + file("calib.yaml") + json).output,
                Not(HasSubstr("is this one?")));
  }
  const auto refined = [&](const char* calibration) {
    return run("calibration refine " + file("left.png") + " " + file("right.png") + " -c " +
               file(calibration) + " -o " + file("refined.yaml"))
        .output;
  };
  EXPECT_THAT(refined("millimetres.yaml"), HasSubstr(doubt));
  EXPECT_THAT(refined("calib.yaml"), Not(HasSubstr(doubt)));
}

/// A larger range would hide what is wrong.
TEST_F(ShiftedPair, FarFeaturesOfOtherUnitsMakeTheUnitDoubtful) {
  folder_.write("millimetres.yaml", replaced(bytes_of("calib.yaml"), "-0.1]", "-100]"));
  const std::vector<std::string> commands = matching_commands();
  for (const std::string& command : commands) {
    const std::string output = output_of(command, "millimetres.yaml", "0.1 --max-distance 200");
    EXPECT_THAT(output, HasSubstr(doubt));
    EXPECT_THAT(output, HasSubstr("give a larger one, or correct the calibration's unit."));
    EXPECT_THAT(output_of(command, "calib.yaml", "0.1"), Not(HasSubstr("calibration's unit")));
  }
  // The way of a camera is no baseline of a rig.
  write_first_camera();
  folder_.write("poses.txt", "0 0 0 0 0 0 0 1\n1 100 0 0 0 0 0 1\n");
  EXPECT_THAT(output_of(commands.front(), "mono.yaml",
                        "0.1 --max-distance 200 --poses " + file("poses.txt")),
              Not(HasSubstr("calibration's unit")));
}

/// Patches are looked for on epipolar curves alone.
TEST_F(TexturedPair, ErrorsOfTheCalibrationAreReported) {
  write_images(0);  // as of what is far away
  alter("right.png", 60);
  folder_.write("turned.yaml", turned(bytes_of("calib.yaml"), 1));
  folder_.write("far_off.yaml", turned(bytes_of("calib.yaml"), 30));
  const std::string off = "lie 0.5[0-9] px off their epipolar curves .median., and would lie 0.0";
  const std::vector<std::string> commands = matching_commands();
  for (const std::string& command : commands) {
    EXPECT_THAT(output_of(command, "calib.yaml", "0.1"), Not(HasSubstr("calibration")));
    EXPECT_THAT(output_of(command, "turned.yaml", "0.1"),
                ContainsRegex(off + ".*; mend it by `widestereo calibration refine`"));
    EXPECT_THAT(output_of(command, "far_off.yaml", "0.1"),
                HasSubstr("The features of the images do not fit the calibration"));
  }
  // One camera in two places, turned as much.
  folder_.write("poses.txt", "0 0 0 0 0 0 0 1\n1 0.1 0 0 0.0087 0 0 1\n");
  write_first_camera();
  EXPECT_THAT(output_of(commands.front(), "mono.yaml", "0.1 --poses " + file("poses.txt")),
              ContainsRegex(off + ".*; get better poses"));
}

/// By pairs that have a baseline, which are named.
TEST_F(TexturedPair, PosesOfManyImagesAreChecked) {
  write_images(0);  // as of what is far away
  alter("right.png", 60);
  write_first_camera();
  std::string images;
  fs::create_directories(folder_ / "cam0");
  for (const std::string name : {"1.png", "2.png", "3.png"}) {
    fs::copy(folder_ / "left.png", folder_ / "cam0" / name);
    alter("cam0/" + name, 20 + name.front());
    images += " " + file("cam0/" + name);
  }
  const std::string first_two = "1 0 0 0 0 0 0 1\n2 0.1 0 0 0 0 0 1\n";
  folder_.write("right.txt", first_two + "3 0.2 0 0 0 0 0 1\n");
  folder_.write("wrong.txt", first_two + "3 0.2 0 0 0.26 0 0 0.97\n");
  for (const std::string& command :
       {"depth" + images, "reconstruct " + folder_.path().string() + " --views 0"}) {
    const auto output_with = [&](const std::string& poses) {
      return output_of(command, "mono.yaml", "0.1 --poses " + file(poses));
    };
    EXPECT_THAT(output_with("right.txt"), Not(HasSubstr("features")));
    EXPECT_THAT(output_with("wrong.txt"),
                ContainsRegex("The features of [^ ]*1[^ ]* and [^ ]*3[^ ]* .1 of 2 pairs are like "
                              "this. do not fit the poses, or the calibration; see "
                              "`widestereo calibration check`"));
  }
}

/// Those that see hardly anything in common tell nothing.
TEST_F(Command, CamerasThatLookAroundFit) {
  const RenderedPair pictures = render_demo_room(surround_rig(160));
  write_kalibr(file("around.yaml"), pictures.rig);
  std::string images;
  for (std::size_t i = 0; i < pictures.views.size(); ++i) {
    const std::string folder = "data/cam" + std::to_string(i);
    fs::create_directories(folder_ / folder);
    write_image(folder_ / folder / "0.png", pictures.views[i].image);
    images += " " + file(folder + "/0.png");
  }
  for (const std::string& command :
       {"depth" + images + " -o " + file("depth"),
        "reconstruct " + file("data") + " --count 1 -o " + file("scene")}) {
    const Outcome outcome =
        run(command + " -c " + file("around.yaml") + " --preset fast --device cpu");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_THAT(outcome.output, Not(HasSubstr("features")));
  }
}

/// As of one camera on both channels.
TEST_F(ShiftedPair, OnePictureIsNoPair) {
  fs::copy(folder_ / "left.png", folder_ / "copy.png");
  const std::string one = "The images of cam0 and cam1 are one picture, pixel by pixel";
  expect_error("depth " + file("left.png") + " " + file("copy.png") + " -c " + file("calib.yaml") +
                   " -o " + file("out") + " --device cpu",
               one);
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  for (const char* command : {"check", "refine"}) {
    const std::string output = std::string(command) == "refine" ? "-o " + file("r.yaml") : "";
    expect_error(calibration(command, "left.png", "copy.png") + output, one);
  }
}

TEST_F(ShiftedPair, SwappedImagesAreNotRefined) {
  const std::string output = "-o " + file("refined.yaml");
  expect_error(calibration("refine", "right.png", "left.png") + output,
               "so that the rig cannot be refined; check that images matched with each other were "
               "taken at the same time, by the calibration's cameras in its order.");
  EXPECT_FALSE(fs::exists(folder_ / "refined.yaml"));
  Outcome outcome = run(calibration("check", "right.png", "left.png"));
  const auto says = [&outcome](const char* text) {
    return outcome.output.find(text) != std::string::npos;
  };
  EXPECT_TRUE(says("% of the features lie behind the cameras\n")) << outcome.output;
  // Their epipolar error is that of the right order.
  EXPECT_TRUE(
      says("calibration: wrong way round: swap the images, or invert the poses, or turn the "
           "baseline round (-T), or turn both images by 180 degrees\n"))
      << outcome.output;
  for (const char* image : {"left.png", "right.png"}) {
    cv::Mat turned;
    cv::rotate(cv::imread(file(image), cv::IMREAD_UNCHANGED), turned, cv::ROTATE_180);
    cv::imwrite(file("turned_" + std::string(image)), turned);
  }
  outcome = run(calibration("check", "turned_left.png", "turned_right.png"));
  EXPECT_TRUE(says("turn both images by 180 degrees")) << outcome.output;
  outcome = run(calibration("check", "left.png", "right.png"));
  EXPECT_NE(outcome.output.find("half below "), std::string::npos) << outcome.output;
  const nlohmann::json right_order =
      nlohmann::json::parse(run(calibration("check", "left.png", "right.png") + "--json").output);
  EXPECT_GT(right_order["distance_p5"], 0.05);
  EXPECT_GT(right_order["distance_p50"], right_order["distance_p5"]);
  EXPECT_GT(right_order["distance_p95"], right_order["distance_p50"]);
  cv::imwrite(file("small.png"), cv::Mat(9, 8, CV_8UC1, cv::Scalar(7)));
  expect_error(calibration("check", "left.png", "small.png"), "small.png is 8x9 pixels");
  outcome = run(calibration("check", "left.png", copy_of("left.png")));
  EXPECT_NE(outcome.output.find("no feature is near enough"), std::string::npos) << outcome.output;
  outcome = run(calibration("check", "left.png", copy_of("left.png")) + "--json");
  EXPECT_TRUE(json_of(outcome)["distance_p5"].is_null()) << outcome.output;
}

/// As libraries and other conventions make them.
TEST_F(Command, MistakenExtrinsicsAreTold) {
  Rig rig = demo_rig(200);
  const Eigen::Vector3d t(-0.2, 0.03, 0.02);
  const auto place = [](Rig& there, const Eigen::Matrix3d& rotation,
                        const Eigen::Vector3d& translation) {
    Eigen::Isometry3d second_from_first = Eigen::Isometry3d::Identity();
    second_from_first.linear() = rotation;
    second_from_first.translation() = translation;
    there.views[1].world_from_camera =
        there.views[0].world_from_camera * second_from_first.inverse();
  };
  const auto render = [&](double degrees, const Eigen::Vector3d& axis) {
    const Eigen::Matrix3d r =
        Eigen::AngleAxisd(degrees * radians_per_degree, axis).toRotationMatrix();
    place(rig, r, t);
    const RenderedPair pair = render_demo_room(rig);
    for (const int i : {0, 1}) write_image(file(std::to_string(i) + ".png"), pair.views[i].image);
    return r;
  };
  const auto verdict = [&](const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
    Rig written = rig;
    place(written, rotation, translation);
    write_kalibr(file("written.yaml"), written);
    return run("calibration check " + file("0.png") + " " + file("1.png") + " -c " +
               file("written.yaml"))
        .output;
  };
  const Eigen::Matrix3d r = render(15, Eigen::Vector3d(1, 2, -2) / 3);
  const Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, -1).asDiagonal();
  const std::string wrong = "calibration: wrong way round: ";
  EXPECT_THAT(verdict(r, t), HasSubstr("calibration: good\n"));
  EXPECT_THAT(verdict(r.transpose(), t), HasSubstr(wrong + "transpose R\n"));
  EXPECT_THAT(verdict(r, -(r.transpose() * t)),
              HasSubstr(wrong + "take -R T for T, which is where the camera is\n"));
  EXPECT_THAT(verdict(flip * r * flip, flip * t),
              HasSubstr(wrong + "turn the y and z axes of R and T round, which are OpenGL's\n"));
  // Of small rotations the error is small, too.
  const Eigen::Matrix3d little = render(1.2, Eigen::Vector3d::UnitX());
  const std::string told = verdict(little.transpose(), t);
  EXPECT_THAT(told, ContainsRegex("median [12][.]"));
  EXPECT_THAT(told, HasSubstr(wrong + "transpose R\n"));
}

TEST_F(Command, ViewSynthesisScoresWithoutGroundTruth) {
  cv::imwrite(file("far.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(1e6)));
  cv::imwrite(file("near.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(0.5)));
  const auto synthesis = [&](const std::string& distance, const std::string& more) {
    return "view-synthesis " + file(distance) + " " + file("left.png") + " " + file("right.png") +
           " -c " + file("calib.yaml") + more;
  };
  // Both images are the same: the distance is infinite.
  Outcome outcome = run(synthesis("far.tiff", " --json --picture " + file("warped.png")));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json right = json_of(outcome);
  EXPECT_GT(right["above_0.9"].get<double>(), 0.99);
  EXPECT_GT(right["windows"].get<long>(), 5000);
  EXPECT_EQ(cv::imread(file("warped.png"), cv::IMREAD_UNCHANGED).size(), cv::Size(96, 96));
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 48).setTo(0);
  cv::imwrite(file("half.png"), mask);
  cv::imwrite(file("whole.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  outcome = run(synthesis("far.tiff", " --json --mask " + file("half.png,") + file("whole.png")));
  EXPECT_NEAR(json_of(outcome)["visible"].get<double>(), right["visible"].get<double>(), 0.05)
      << "of what is not masked";
  outcome = run(synthesis("near.tiff", " --json"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::size_t scores = outcome.output.find('{');
  EXPECT_NE(outcome.output.substr(0, scores).find("The images are hardly alike"),
            std::string::npos);
  EXPECT_LT(json_of(outcome)["above_0.9"].get<double>(), 0.1);
  outcome = run(synthesis("far.tiff", ""));
  EXPECT_NE(outcome.output.find("textured windows"), std::string::npos) << outcome.output;
  expect_error(synthesis("none.tiff", ""), "none.tiff");
  cv::imwrite(file("small.tiff"), cv::Mat(9, 8, CV_32FC1, cv::Scalar(1)));
  expect_error(synthesis("small.tiff", ""), "8x9 pixels");
}

TEST_F(Command, BenchmarkStatesWorkAndShareOfTheRoofline) {
  const std::string common = "benchmark --devices cpu --presets fast --sizes 64 --runs 2 -o " +
                             file("speed.json") + " --plot " + file("speed.svg");
  const Outcome outcome = run(common + " --json --peak-gflops 1 --peak-gtexels 1000");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json rows = json_of(outcome);
  std::ifstream stream(folder_ / "speed.json");
  EXPECT_EQ(nlohmann::json::parse(stream), rows);
  ASSERT_EQ(rows.size(), 1u);
  const nlohmann::json& row = rows[0];
  EXPECT_EQ(row["window_radius"], 3);
  EXPECT_EQ(row["filter_used"], "exact");
  EXPECT_LE(row["milliseconds_min"], row["milliseconds"]);
  EXPECT_LE(row["milliseconds"], row["milliseconds_max"]);
  EXPECT_EQ(row["peaks"]["gflops"], 1.0);
  EXPECT_TRUE(row["peaks"]["gbps"].is_null());
  const nlohmann::json& all = row["on_device"];
  const double operations = all["operations"];
  EXPECT_GT(operations, 30 * all["samples"].get<double>());
  EXPECT_EQ(all["texels"].get<double>(), 4 * all["samples"].get<double>());
  EXPECT_NEAR(all["samples"].get<double>(), row["samples_per_pixel"].get<double>() * 64 * 64, 1);
  // At 1 Gflop/s and so many texels, operations take longest in every kernel that has any.
  EXPECT_EQ(all["roofline_bound"], "operations");
  EXPECT_NEAR(all["roofline_milliseconds"].get<double>(), operations / 1e6, operations / 1e12);
  EXPECT_NEAR(all["roofline_share"].get<double>(), all["gflops"].get<double>(), 1e-6);
  EXPECT_EQ(row["kernels"]["search"]["roofline_bound"], "operations");
  EXPECT_EQ(row["kernels"]["regress"]["roofline_bound"], "operations");
  EXPECT_TRUE(row["kernels"]["fill"]["roofline_share"].is_null());
  double sum = 0;
  for (const nlohmann::json& kernel : row["kernels"]) sum += kernel["operations"].get<double>();
  EXPECT_NEAR(sum, operations, 1);

  const std::string picture = bytes_of("speed.svg");
  EXPECT_NE(picture.find("cpu  fast  64 x 64"), std::string::npos);
  EXPECT_NE(picture.find("% of operations"), std::string::npos);
  EXPECT_EQ(picture.substr(picture.size() - 7), "</svg>\n");

  const Outcome exact =
      run("benchmark --devices cpu --presets fast --sizes 64 --runs 1 --warp exact --filter exact "
          "--json");
  ASSERT_EQ(exact.exit_code, 0) << exact.output;
  const nlohmann::json exact_row = json_of(exact)[0];
  EXPECT_EQ(exact_row["options"]["warp"], "exact");
  EXPECT_EQ(exact_row["options"]["filter"], "exact");
  EXPECT_GT(exact_row["on_device"]["operations"], 1.3 * operations) << "the warp of each sample";

  const Outcome unknown = run("benchmark --devices cpu --presets fast --sizes 64 --runs 1");
  EXPECT_EQ(unknown.exit_code, 0) << unknown.output;
  EXPECT_EQ(unknown.output.find("% of"), std::string::npos) << unknown.output;
  expect_error("benchmark --sizes 64 --peak-gbps 10", "--devices");
  expect_error("benchmark --devices cpu --sizes 64 --filter device",
               "--filter device has no effect");
  // Nothing is timed, nor a header printed.
  expect_error("benchmark --devices cpu --devices nope --sizes 64", "no device \"nope\"");
  EXPECT_NE(run("benchmark --sizes 64 --plot " + file("speed.png")).exit_code, 0);
}

TEST_F(Command, BenchmarkTimesFramesThatStartFromTheOneBefore) {
  const Outcome outcome =
      run("benchmark --devices cpu --presets fast --sizes 64 --runs 1 --starts cold,warm --json "
          "--plot " +
          file("speed.svg"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json rows = json_of(outcome);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0]["start"], "cold");
  EXPECT_EQ(rows[1]["start"], "warm");
  EXPECT_LT(rows[1]["samples_per_pixel"].get<double>(),
            0.3 * rows[0]["samples_per_pixel"].get<double>());
  EXPECT_TRUE(rows[1]["kernels"].contains("transfer_keep"));
  EXPECT_FALSE(rows[1]["kernels"].contains("upsample"));
  EXPECT_FALSE(rows[0]["kernels"].contains("transfer_keep"));
  EXPECT_NE(bytes_of("speed.svg").find("cpu  fast  warm  64 x 64"), std::string::npos);
  EXPECT_NE(run("benchmark --devices cpu --sizes 64 --starts tepid").exit_code, 0);
}

TEST_F(Command, HelpAndVersion) {
  for (const char* arguments :
       {"--help", "demo --help", "depth --help", "sequence --help", "reconstruct --help",
        "evaluate --help", "view-synthesis --help", "calibration --help", "calibration show --help",
        "calibration check --help", "calibration refine --help", "calibration convert --help",
        "devices --help", "benchmark --help", "--version", "devices", "devices --json"}) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << arguments << outcome.output;
    EXPECT_FALSE(outcome.output.empty());
  }
  EXPECT_NE(run("").exit_code, 0);
}

}  // namespace
}  // namespace widestereo::test
