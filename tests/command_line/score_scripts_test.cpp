// SPDX-License-Identifier: MIT
// The scripts that match and score data sets, with a stand-in for what matches.
#include "command_fixture.h"
#include "widestereo/image_io.h"

namespace widestereo::test {
namespace {

class ScoreScripts : public Command {
 protected:
  /// `matching`: what to do where a map is asked for, with the folder for results in $2; scoring
  /// is the command's own.
  void write_stand_in(const std::string& matching) const {
    folder_.write("stand_in",
                  "#!/usr/bin/env bash\nset -euo pipefail\n"
                  "if [[ $1 == evaluate ]]; then exec " +
                      shell_word(WIDESTEREO_COMMAND) +
                      " \"$@\"; fi\n"
                      "cd \"$(dirname \"$0\")\"\n"
                      "echo \"$*\" >> calls\n"
                      "while [[ $1 != -o ]]; do shift; done\n" +
                      matching);
    fs::permissions(folder_ / "stand_in", fs::perms::owner_all);
  }
  Outcome run_script(const std::string& name, const std::string& arguments) const {
    return run_program(shell_word(std::string(WIDESTEREO_SOURCE_DIR) + "/tools/" + name), arguments,
                       "WIDESTEREO=" + shell_word(file("stand_in")));
  }
  void write_distances(const std::string& name, double metres) const {
    cv::imwrite(file(name), cv::Mat(96, 96, CV_32FC1, cv::Scalar(metres)));
  }
};

TEST_F(ScoreScripts, AblationTakesSetsThatLackNormals) {
  for (const std::string set : {"bare", "full"}) {
    fs::create_directories(folder_ / set);
    fs::copy_file(file("calib.yaml"), file(set + "/calib.yaml"));
    write_distances(set + "/depth0.tiff", 2);
  }
  for (const std::string camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / ("bare/" + camera));
    fs::copy_file(file("left.png"), file("bare/" + camera + "/000.png"));
    fs::copy_file(file("left.png"), file("full/" + camera + ".png"));
  }
  cv::imwrite(file("bare/mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  write_map(file("normals.tiff"), cv::Mat(96, 96, CV_32FC3, cv::Scalar(0, 0, -1)));
  fs::copy_file(file("normals.tiff"), file("full/normal0.tiff"));
  write_distances("map.tiff", 2.1);
  write_stand_in(
      "mkdir -p \"$2\"; cp map.tiff \"$2/distance0.tiff\"\n"
      "cp normals.tiff \"$2/normals0.tiff\"\n"
      "echo 'CPU: 1.50 s, 7 million patch samples (preset fast)'\n");
  std::string sets;
  for (const char* set : {"bare", "full"}) sets += " '" + file(set) + " 0.5 9'";
  const Outcome outcome = run_script("ablation", file("out") + " fast" + sets);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("| change | bare | full | million samples | seconds |"),
            std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find(
                "| none | 100.0 / 0.0 / – | 100.0 / 0.0 / 0.0° | 7 | 1.50 |\n| no plane "),
            std::string::npos)
      << outcome.output;
  const std::string calls = bytes_of("calls");
  EXPECT_NE(calls.find("bare/cam1/000.png"), std::string::npos);
  EXPECT_NE(calls.find("--mask " + file("bare/mask.png")), std::string::npos);
  EXPECT_NE(calls.find("--no-pictures --far-preference 0\n"), std::string::npos);
  fs::remove(file("full/depth0.tiff"));
  const Outcome unknown = run_script("ablation", file("out") + " fast" + sets);
  EXPECT_EQ(unknown.exit_code, 1);
  EXPECT_NE(unknown.output.find("full has no depth0.tiff"), std::string::npos) << unknown.output;
}

/// Of three frames with 7 of 1600 pixels wrong, which are 0.4375 %.
class ScoreScriptsOfFrames : public ScoreScripts {
 protected:
  void SetUp() override {
    ScoreScripts::SetUp();
    for (const char* folder : {"set/depth0", "set/valid0", "set/occ0_cam1"}) {
      fs::create_directories(folder_ / folder);
    }
    fs::copy_file(file("calib.yaml"), file("set/calib.yaml"));
    cv::Mat valid(96, 96, CV_8UC1, cv::Scalar(0));
    valid(cv::Rect(28, 28, 40, 40)).setTo(255);
    for (const std::string frame : {"000000", "000001", "000002"}) {
      write_distances("set/depth0/" + frame + ".tiff", 2);
      cv::imwrite(file("set/valid0/" + frame + ".png"), valid);
      cv::imwrite(file("set/occ0_cam1/" + frame + ".png"), valid);
    }
    cv::Mat map(96, 96, CV_32FC1, cv::Scalar(2));
    map(cv::Rect(40, 40, 7, 1)).setTo(0.5);
    cv::imwrite(file("map.tiff"), map);
  }
};

TEST_F(ScoreScriptsOfFrames, MeansOfSequencesAreOfFiguresThatAreNotRounded) {
  write_stand_in(
      "for frame in 000000 000001 000002; do\n"
      "  mkdir -p \"$2/$frame\"; cp map.tiff \"$2/$frame/distance0.tiff\"\n"
      "  echo \"$frame: warm, motion estimated, 1.50 s, 90.0 % accepted\"\ndone\n");
  const Outcome outcome = run_script("score_sequence", file("out") + " " + file("set") + " 0.5 9");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("| 000002 | warm | 1.50 | 0.4 / 0.4 |\n"
                                "| mean of all but the first | | 1.50 | 0.44 / 0.44 |\n"),
            std::string::npos)
      << outcome.output;
}

TEST_F(ScoreScriptsOfFrames, MeansOfReconstructionsAreOfFiguresThatAreNotRounded) {
  write_stand_in(
      "for frame in 000000 000001 000002; do\n"
      "  mkdir -p \"$2/$frame/cam0\"; cp map.tiff \"$2/$frame/cam0/distance0.tiff\"\n"
      "done\necho '6 images, 92.8 % accepted on average; 1234 points in cloud.ply'\n");
  const Outcome outcome =
      run_script("score_reconstruction", file("out") + " " + file("set") + " 0.5 9");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("| 6 | 0.4 / 0.4 / 0.44 | 100.0 | 92.8 | 1234 |\n"),
            std::string::npos)
      << outcome.output;
}

}  // namespace
}  // namespace widestereo::test
