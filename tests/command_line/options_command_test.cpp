// SPDX-License-Identifier: MIT
// What options of the command line become of.
#include <nlohmann/json.hpp>
#include <vector>

#include "command_fixture.h"

namespace widestereo::test {
namespace {

struct GivenOption {
  const char* option;
  const char* word;
  const char* key;  ///< in the record's options
  nlohmann::json value;
};

/// Of the preset fast. Values differ from its own and from each other's.
const std::vector<GivenOption> options_of_fast = {
    {"--min-distance", "0.45", "min_distance", 0.45},
    {"--max-distance", "9.5", "max_distance", 9.5},
    {"--seed", "7", "seed", 7},
    {"--window-radius", "2", "window_radius", 2},
    {"--warp", "quadratic", "warp", "quadratic"},
    {"--pattern", "dense", "pattern", "dense"},
    {"--weight-scale", "31.5", "weight_scale", 31.5},
    {"--interpolation", "linear", "interpolation", "linear"},
    {"--filter", "exact", "filter", "exact"},
    {"--levels", "2", "levels", 2},
    {"--sweep-steps", "9", "sweep_steps", 9},
    {"--level-iterations", "1,2", "level_iterations", {1, 2}},
    {"--level-regressions", "2,1", "level_regressions", {2, 1}},
    {"--regression-radius", "20", "regression_radius", 20},
    {"--regression-steps", "5", "regression_steps", 5},
    {"--regression-scale", "15.5", "regression_scale", 15.5},
    {"--regression-precision", "0.052", "regression_precision", 0.052},
    {"--subpixel-match", "false", "subpixel_match", false},
    {"--repair-radius", "16", "repair_radius", 16},
    {"--vote-radius", "6", "vote_radius", 6},
    {"--merge-views", "false", "merge_views", false},
    {"--normal-vote", "false", "normal_vote", false},
    {"--far-preference", "0.035", "far_preference", 0.035},
    {"--step-pixels", "0.75", "step_pixels", 0.75},
    {"--step-normal", "0.25", "step_normal", 0.25},
    {"--source-planes", "true", "source_planes", true},
    {"--coarse-planes", "3", "coarse_planes", 3},
    {"--alternate-strips", "false", "alternate_strips", false},
    {"--best-sources", "4", "best_sources", 4},
    {"--max-gain", "2.5", "max_gain", 2.5},
    {"--min-texture", "1.5", "min_texture", 1.5},
    {"--min-visible", "0.7", "min_visible", 0.7},
    {"--consistency-relative", "0.03", "consistency_relative", 0.03},
    {"--consistency-pixels", "1.25", "consistency_pixels", 1.25},
    {"--max-cost", "0.9", "max_cost", 0.9},
    {"--min-parallax", "0.375", "min_parallax", 0.375},
    {"--max-tilt", "80.5", "max_tilt", 80.5},
    {"--min-support", "0.2", "min_support", 0.2},
    {"--min-confidence", "0.6", "min_confidence", 0.6},
    {"--ambiguity-margin", "0.15", "ambiguity_margin", 0.15},
    {"--fill-radius", "8", "fill_radius", 8}};

const std::vector<GivenOption> options_of_paper = {
    {"--sampling", "inverse", "sampling", "inverse"},
    {"--propagation", "raster", "propagation", "raster"},
    {"--iterations", "3", "first_iterations", 3},
    {"--second-iterations", "2", "second_iterations", 2},
    {"--refinements", "1", "refinements", 1}};

class OptionsOfDepth : public Command {
 protected:
  std::string depth(const std::string& preset) const {
    return "depth " + file("left.png") + " " + file("right.png") + " --calibration " +
           file("calib.yaml") + " -o " + file("out") + " --device cpu --no-pictures --preset " +
           preset + " ";
  }
  nlohmann::json options_after(const std::string& arguments) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return nlohmann::json::parse(bytes_of("out/result.json")).at("options");
  }
};

TEST_F(OptionsOfDepth, AreWhatIsRecorded) {
  for (const auto& [preset, list] :
       {std::pair("fast", &options_of_fast), {"paper", &options_of_paper}}) {
    SCOPED_TRACE(preset);
    std::string arguments = depth(preset);
    for (const GivenOption& given : *list) {
      arguments += std::string(given.option) + " " + given.word + " ";
    }
    const nlohmann::json found = options_after(arguments);
    const nlohmann::json before = options_after(
        depth(preset) + (preset == std::string("paper") ? "--iterations 1" : "--sweep-steps 8"));
    for (const GivenOption& given : *list) {
      EXPECT_EQ(found.at(given.key), given.value) << given.option;
      if (given.key != std::string("filter")) {
        EXPECT_NE(before.at(given.key), given.value) << given.option << " changes nothing";
      }
    }
  }
}

TEST_F(OptionsOfDepth, OutOfRangeAreNamed) {
  struct Wrong {
    const char* preset;
    const char* option;
    const char* word;
    const char* message;
  };
  for (const Wrong& wrong : {
           Wrong{"fast", "--window-radius", "16", "window radius is 16"},
           {"fast", "--weight-scale", "-0.5", "weight scale is -0.5"},
           {"fast", "--levels", "9", "levels is 9"},
           {"fast", "--sweep-steps", "0", "sweep steps is 0"},
           {"fast", "--level-iterations", "1,2,1001", "level iterations is 1001"},
           {"fast", "--level-regressions", "1,1,1,1,1,1,1,1,1", "level regressions has 9 numbers"},
           {"fast", "--regression-radius", "1", "regression radius is 1"},
           {"fast", "--regression-steps", "17", "regression steps is 17"},
           {"fast", "--regression-scale", "0.05", "regression scale is 0.05"},
           {"fast", "--regression-precision", "1001", "regression precision is 1001"},
           {"fast", "--repair-radius", "-1", "repair radius is -1"},
           {"fast", "--vote-radius", "65", "vote radius is 65"},
           {"fast", "--far-preference", "1.5", "far preference is 1.5"},
           {"fast", "--step-pixels", "-0.5", "step pixels is -0.5"},
           {"fast", "--step-normal", "2.5", "step normal is 2.5"},
           {"fast", "--coarse-planes", "5", "coarse planes is 5"},
           {"fast", "--best-sources", "9", "best sources is 9"},
           {"fast", "--min-texture", "255.5", "min texture is 255.5"},
           {"fast", "--min-visible", "1.5", "min visible is 1.5"},
           {"fast", "--consistency-relative", "-0.5", "consistency (relative) is -0.5"},
           {"fast", "--consistency-pixels", "1001", "consistency (pixels) is 1001"},
           {"fast", "--max-cost", "2.5", "max cost is 2.5"},
           {"fast", "--min-parallax", "-0.5", "min parallax is -0.5"},
           {"fast", "--max-tilt", "90.5", "max tilt is 90.5"},
           {"fast", "--min-support", "1.5", "min support is 1.5"},
           {"fast", "--ambiguity-margin", "2.5", "ambiguity margin is 2.5"},
           {"fast", "--fill-radius", "10001", "fill radius is 10001"},
           {"paper", "--iterations", "0", "first iterations is 0"},
           {"paper", "--second-iterations", "-1", "second iterations is -1"},
           {"paper", "--refinements", "17", "refinements is 17"},
       }) {
    expect_error(depth(wrong.preset) + wrong.option + " " + wrong.word, wrong.message);
  }
}

TEST_F(Command, SequencesMayHavePictures) {
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / "data" / camera);
    fs::copy_file(file(camera == std::string("cam0") ? "left.png" : "right.png"),
                  folder_ / "data" / camera / "0.png");
  }
  const std::string sequence =
      "sequence " + file("data") + " -c " + file("calib.yaml") + quick + "-o ";
  ASSERT_EQ(run(sequence + file("with") + " --pictures").exit_code, 0);
  ASSERT_EQ(run(sequence + file("without")).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "with/0/summary0.png"));
  EXPECT_FALSE(fs::exists(folder_ / "without/0/summary0.png"));
}

TEST_F(Command, BenchmarkTakesSeveralWindowRadii) {
  const Outcome outcome =
      run("benchmark --devices cpu --presets fast --sizes 64 --runs 1 --window-radii 1,2 --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json rows = json_of(outcome);
  ASSERT_EQ(rows.size(), 2u);
  EXPECT_EQ(rows[0]["window_radius"], 1);
  EXPECT_EQ(rows[1]["window_radius"], 2);
  const Outcome wide = run("benchmark --devices cpu --sizes 64 --window-radii 2,16");
  EXPECT_NE(wide.exit_code, 0);
  EXPECT_NE(wide.output.find("--window-radii: Value 16 not in range 1 to 15"), std::string::npos)
      << wide.output;
}

TEST_F(Command, ReconstructionsJoinPointsAsFarApartAsAskedFor) {
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / "data" / camera);
    fs::copy_file(file(camera == std::string("cam0") ? "left.png" : "right.png"),
                  folder_ / "data" / camera / "0.png");
  }
  const std::string reconstruct = "reconstruct " + file("data") + " --count 1 --min-views 1 -c " +
                                  file("calib.yaml") + " -o " + file("out") + quick;
  const auto cloud_of = [&](const std::string& options) {
    const Outcome outcome = run(reconstruct + options);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return nlohmann::json::parse(bytes_of("out/reconstruction.json")).at("cloud");
  };
  const nlohmann::json as_default = cloud_of("");
  const nlohmann::json wide = cloud_of("--fusion-relative 0.25 --fusion-pixels 3.5");
  EXPECT_EQ(wide["max_relative"], 0.25);
  EXPECT_EQ(wide["max_pixels"], 3.5);
  EXPECT_NE(as_default["max_relative"], 0.25);
  EXPECT_NE(as_default["max_pixels"], 3.5);
  for (const char* option : {"--fusion-relative", "--fusion-pixels"}) {
    const Outcome outcome = run(reconstruct + option + " 0");
    EXPECT_NE(outcome.exit_code, 0);
    EXPECT_NE(outcome.output.find(std::string(option) + ": 0 is no number above 0"),
              std::string::npos)
        << outcome.output;
  }
}

/// A map that is right on its left half.
class EvaluateSets : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    fs::create_directory(folder_ / "set");
    fs::copy_file(file("calib.yaml"), file("set/calib.yaml"));
    const cv::Mat truth(96, 96, CV_32FC1, cv::Scalar(2.0));
    cv::imwrite(file("set/depth0.tiff"), truth);
    cv::Mat prediction = truth.clone();
    prediction.colRange(48, 96) *= 1.5;
    cv::imwrite(file("prediction.tiff"), prediction);
    cv::Mat occlusion(96, 96, CV_8UC1, cv::Scalar(255));
    occlusion.colRange(48, 96).setTo(0);
    cv::imwrite(file("occlusion.png"), occlusion);
  }
  static constexpr double unknown = -1;

  /// Shares of what can be scored that are more than 5 % wrong: of all, and of what is visible.
  std::pair<double, double> wrong_of(const std::string& arguments) const {
    const Outcome outcome = run("evaluate " + file("prediction.tiff") + " --json " + arguments);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    double all = unknown, visible = unknown;
    const nlohmann::json scores = json_of(outcome);
    for (const nlohmann::json& region : scores.at("regions")) {
      if (region["region"] == "all") all = region["bad_relative"]["0.05"];
      if (region["region"] == "non-occluded") visible = region["bad_relative"]["0.05"];
    }
    return {all, visible};
  }
};

TEST_F(EvaluateSets, AreFoundByTheirNames) {
  const std::string set = "--set " + file("set");
  const auto [all, visible] = wrong_of(set);
  EXPECT_GT(all, 0.3);
  EXPECT_LT(all, 0.7);
  EXPECT_EQ(visible, unknown);
  // Half of what counts is occluded, which is told by a file that is named or by the set's.
  EXPECT_EQ(wrong_of(set + " --occlusion " + file("occlusion.png")), std::pair(all, 0.0));
  fs::copy_file(file("occlusion.png"), file("set/occ0.png"));
  EXPECT_EQ(wrong_of(set), std::pair(all, 0.0));
  cv::imwrite(file("set/occ0_1.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  EXPECT_EQ(wrong_of(set), std::pair(all, all)) << "of the pair before that of the view";
  EXPECT_EQ(wrong_of(set + " --occlusion " + file("occlusion.png")), std::pair(all, 0.0));
  cv::imwrite(file("hidden.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  EXPECT_NE(
      run("evaluate " + file("prediction.tiff") + " " + set + " --occlusion " + file("hidden.png"))
          .output.find("No pixel that is scored is visible (255) in " + file("hidden.png")),
      std::string::npos);
  cv::imwrite(file("ones.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(1)));
  expect_error(
      "evaluate " + file("prediction.tiff") + " " + set + " --occlusion " + file("ones.png"),
      "The occlusion map has 1 at pixel (0, 0)");
  // And so is what is valid.
  fs::copy_file(file("occlusion.png"), file("set/valid0.png"));
  EXPECT_EQ(wrong_of(set).first, 0);
  expect_error("evaluate " + file("prediction.tiff") + " --set " + file("none"),
               "There is no folder " + file("none"));
  fs::remove(folder_ / "set/depth0.tiff");
  expect_error("evaluate " + file("prediction.tiff") + " " + set,
               "has no depth0.tiff; give --truth");
}

TEST_F(EvaluateSets, OcclusionWithoutACamerasNumberIsOfThePair) {
  std::string text = bytes_of("calib.yaml");
  const std::string third = text.substr(text.find("cam1:"));
  folder_.write("set/calib.yaml", text + "cam2:" + third.substr(5));
  fs::copy_file(file("occlusion.png"), file("set/occ0.png"));
  const std::string set = "--set " + file("set");
  EXPECT_EQ(wrong_of(set).second, 0);
  EXPECT_EQ(wrong_of(set + " --source 2").second, unknown) << "says nothing of camera 2";
}

TEST_F(EvaluateSets, FilesAreOfTheView) {
  cv::Mat truth(96, 96, CV_32FC1, cv::Scalar(2.0));
  truth.colRange(48, 96).setTo(0);  // nothing was hit
  cv::imwrite(file("set/depth1.tiff"), truth);
  cv::imwrite(file("set/fov0.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  cv::imwrite(file("set/fov1.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  const Outcome outcome = run("evaluate " + file("prediction.tiff") + " --json --far-distance 2" +
                              " --view 1 --source 0 --set " + file("set"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_GT(json_of(outcome)["far"]["pixels"], 1000);
  // By the name of the map, where the set has such a view.
  for (const char* name : {"distance1.tiff", "distance_accepted1.tiff", "distance7.tiff"}) {
    fs::copy_file(file("prediction.tiff"), file(name));
    const std::string said = run("evaluate " + file(name) + " --set " + file("set")).output;
    EXPECT_EQ(said.find("is scored as of view 1, by its name") != std::string::npos,
              std::string(name) != "distance7.tiff")
        << said;
  }
  // By the result's record, whose views may be the cameras in another order.
  const std::string two_views = R"({"views": [
    {"name": "cam1", "files": {"distance.tiff": "distance0.tiff"}},
    {"name": "000001/cam0", "files": {"distance.tiff": "distance1403636579763555584.tiff"}}, 3]})";
  folder_.write("result.json", two_views);
  const auto says = [this](const std::string& arguments, const char* text) {
    const std::string said = run("evaluate " + arguments + " --set " + file("set")).output;
    EXPECT_NE(said.find(text), std::string::npos) << said;
  };
  fs::copy_file(file("prediction.tiff"), file("distance0.tiff"));
  says(file("distance0.tiff"), "is scored as of view 1, by the record beside it");
  EXPECT_EQ(run("evaluate " + file("distance0.tiff") + " --view 0 --set " + file("set"))
                .output.find("is scored"),
            std::string::npos);
  const std::string alone = "evaluate " + file("distance0.tiff") + " --truth " +
                            file("set/depth1.tiff") + " -c " + file("calib.yaml");
  EXPECT_NE(run(alone).output.find("is scored as of view 1, by the record beside it"),
            std::string::npos);
  const std::string timed = file("distance1403636579763555584.tiff");  // as of EuRoC's frames
  fs::copy_file(file("prediction.tiff"), timed);
  EXPECT_EQ(
      run("evaluate " + timed + " --truth " + file("set/depth0.tiff") + " -c " + file("calib.yaml"))
          .output.find("is scored"),
      std::string::npos)
      << "of camera 0 by the record";
  // As OpenCV's samples write them, without a size.
  folder_.write("opencv.yml",
                "K1: [30, 0, 47.5, 0, 30, 47.5, 0, 0, 1]\nD1: [0, 0, 0, 0]\n"
                "K2: [30, 0, 47.5, 0, 30, 47.5, 0, 0, 1]\nD2: [0, 0, 0, 0]\nfisheye: 1\n"
                "R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]\nT: [-0.1, 0, 0]\n");
  says(file("distance0.tiff") + " -c " + file("opencv.yml"),
       "is scored as of view 1, by the record beside it");
  // A camera without ground truth is not scored against another one's.
  folder_.write("result.json", two_views);
  fs::rename(file("set/depth1.tiff"), file("depth1.tiff"));
  expect_error("evaluate " + file("distance0.tiff") + " --view 1 --set " + file("set"),
               "has no depth1.tiff; give --truth");
  says(file("distance0.tiff"), "has no depth1.tiff; give --truth");
  fs::rename(file("depth1.tiff"), file("set/depth1.tiff"));
  for (const char* record :
       {R"({"views": [{"name": "left", "files": ["distance0.tiff"]}, {"name": 7}]})",
        R"({"views": 3})"}) {
    folder_.write("result.json", record);
    says(file("distance1.tiff"), "is scored as of view 1, by its name");
    EXPECT_NE(run(alone).output.find("is scored as of view 0, as the record beside it names no "
                                     "camera of " +
                                     file("calib.yaml")),
              std::string::npos);
  }
  folder_.write("result.json", "[]");
  says(file("distance1.tiff"), "is scored as of view 1, by its name");
  EXPECT_EQ(run(alone).output.find("is scored"), std::string::npos) << "of a frame's number";
}

TEST_F(EvaluateSets, OneCameraIsScoredWithoutDisplacements) {
  write_first_camera();
  const std::string evaluate = "evaluate " + file("prediction.tiff") + " --truth " +
                               file("set/depth0.tiff") + " -c " + file("mono.yaml");
  const Outcome outcome = run(evaluate + " --json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(file("mono.yaml") + " has one camera: displacements in another "
                                                    "image are not measured.\n"),
            std::string::npos)
      << outcome.output;
  const nlohmann::json all = json_of(outcome)["regions"][0];
  EXPECT_GT(all["bad_relative"]["0.05"], 0.3);
  EXPECT_TRUE(all["bad_pixels"]["2.0"].is_null());
  cv::imwrite(file("confidence.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(0.5)));
  expect_error(evaluate + " --confidence " + file("confidence.tiff"),
               "--confidence needs another camera");
  expect_error(evaluate + " --source 0", "choose two different ones by --view and --source");
  folder_.write("result.json", R"({"views": [{"name": "0", "files": ["prediction.tiff"]}, {}]})");
  EXPECT_NE(run(evaluate).output.find("without --calibration they are in those of the record"),
            std::string::npos);
}

}  // namespace
}  // namespace widestereo::test
