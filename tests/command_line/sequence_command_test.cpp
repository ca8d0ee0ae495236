// SPDX-License-Identifier: MIT
// `widestereo sequence` as a user meets it: layouts, resuming, scene cuts, messages.
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <chrono>
#include <future>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <thread>

#include "command_fixture.h"
#include "replaced.h"
#include "widestereo/calibration.h"
#include "widestereo/image_io.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

/// Three frames of noise that moves to the left, 4 pixels apart in the two cameras.
class SequenceCommand : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    for (int k = 0; k < 3; ++k) add_frame(k, "00" + std::to_string(k), 3);
  }

  void add_frame(int k, const std::string& name, int seed, double blur = 1.2) const {
    cv::Mat noise(96, 130, CV_8UC1);
    cv::RNG(seed).fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(noise, noise, {}, blur);
    for (int camera = 0; camera < 2; ++camera) {
      const fs::path folder = folder_ / ("data/cam" + std::to_string(camera));
      fs::create_directories(folder);
      cv::imwrite((folder / (name + ".png")).string(),
                  noise(cv::Rect(2 * k + 4 * camera, 0, 96, 96)));
    }
  }

  std::string cold_sequence(const std::string& output, const std::string& data = "data") const {
    return "sequence " + file(data) + " -c " + file("calib.yaml") + " -o " + file(output) + quick;
  }
  std::string sequence(const std::string& output = "out", const std::string& data = "data") const {
    return cold_sequence(output, data) + "--warm-iterations 1 ";
  }
  nlohmann::json record(const std::string& output = "out") const {
    return nlohmann::json::parse(bytes_of(folder_ / output / "sequence.json"));
  }
  void expect_same_results(const std::string& a, const std::string& b) const {
    for (const char* frame : {"000", "001", "002"}) {
      for (const auto& entry : fs::directory_iterator(folder_ / a / frame)) {
        if (entry.path().extension() == ".json") continue;
        EXPECT_TRUE(bytes_of(entry.path()) ==
                    bytes_of(folder_ / b / frame / entry.path().filename()))
            << entry.path();
      }
    }
  }
};

TEST_F(SequenceCommand, ToleranceOfTimesNeedsTimes) {
  expect_error(sequence() + "--time-tolerance 0.01", "--time-tolerance has no effect on ");
}

TEST_F(SequenceCommand, BlursTheSharperCameraOfAllFrames) {
  for (int k = 0; k < 3; ++k) {
    const std::string name = "00" + std::to_string(k);
    add_frame(k, name, 3, 0.8);
    const std::string blunt = file("data/cam1/" + name + ".png");
    cv::Mat image = cv::imread(blunt, cv::IMREAD_UNCHANGED);
    cv::GaussianBlur(image, image, {}, 1.2);
    cv::imwrite(blunt, image);
  }
  Outcome outcome = run(sequence() + "--count 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("cam0 is sharper than cam1"), std::string::npos) << outcome.output;
  const nlohmann::json blurs = record()["settings"]["blurs"];
  EXPECT_NEAR(blurs[0].get<double>(), 1.2, 0.2);
  EXPECT_EQ(blurs[1], 0);
  // Resumed with the same blur, which the first frame alone decides.
  outcome = run(sequence());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(record()["settings"]["blurs"], blurs);
  ASSERT_EQ(run(sequence("whole")).exit_code, 0);
  expect_same_results("out", "whole");
}

TEST_F(SequenceCommand, StartsEachFrameFromTheOneBefore) {
  const Outcome outcome = run(sequence() + "--restart-below 0");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("(3 of 3)"), std::string::npos) << outcome.output;
  const nlohmann::json frames = record()["frames"];
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0]["start"], "cold");
  EXPECT_EQ(frames[1]["start"], "warm");
  EXPECT_EQ(frames[2]["name"], "002");
  EXPECT_TRUE(fs::exists(folder_ / "out/001/distance1.tiff"));
  EXPECT_FALSE(fs::exists(folder_ / "out/001/cloud0.ply")) << "not unless asked for";
  EXPECT_FALSE(fs::exists(folder_ / "out/001/planes0.tiff")) << "kept for the last frame only";
  EXPECT_TRUE(fs::exists(folder_ / "out/002/planes0.tiff"));
}

/// As with two lenses back to back, of which each sees little of what the other one does.
TEST_F(SequenceCommand, LittleOverlapIsNoBadFrame) {
  cv::Mat left = cv::Mat::zeros(96, 96, CV_8UC1);
  cv::Mat right = left.clone();
  left.rowRange(0, 52).setTo(255);
  right.rowRange(40, 96).setTo(255);
  cv::imwrite(file("left_mask.png"), left);
  cv::imwrite(file("right_mask.png"), right);
  const Outcome outcome =
      run("sequence " + file("data") + " -c " + file("calib.yaml") + " -o " + file("out") +
          " --preset fast --device cpu --min-distance 0.4 --max-distance 8 --mask " +
          file("left_mask.png") + "," + file("right_mask.png"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("images from more places would give it one"), std::string::npos)
      << outcome.output;
  EXPECT_EQ(outcome.output.find("Little was accepted"), std::string::npos) << outcome.output;
  const nlohmann::json frames = record()["frames"];
  EXPECT_LT(frames[0]["accepted"], 0.15);
  EXPECT_LT(frames[0]["overlap"], 0.3);
  EXPECT_EQ(frames[1]["start"], "warm");
  EXPECT_EQ(frames[2]["start"], "warm");
}

TEST_F(SequenceCommand, CloudsSayWhichFrameTheyAreIn) {
  ASSERT_EQ(run(sequence() + "--clouds --count 1").exit_code, 0);
  const auto result = nlohmann::json::parse(bytes_of("out/000/result.json"));
  EXPECT_NE(result["conventions"]["world"].get<std::string>().find("input.frame.pose"),
            std::string::npos);
}

TEST_F(SequenceCommand, ResumesWithTheSameBits) {
  const std::string options = "--restart-below 0 ";
  ASSERT_EQ(run(sequence("whole") + options).exit_code, 0);
  ASSERT_EQ(run(sequence("parts") + options + "--count 2").exit_code, 0);
  fs::create_directories(folder_ / "parts/.unfinished");
  const Outcome rest = run(sequence("parts") + options + "--json");
  ASSERT_EQ(rest.exit_code, 0) << rest.output;
  EXPECT_EQ(json_of(rest)["frames"].size(), 3u);
  EXPECT_FALSE(fs::exists(folder_ / "parts/.unfinished"));
  expect_same_results("whole", "parts");
  const Outcome again = run(sequence("parts") + options);
  EXPECT_EQ(again.exit_code, 0);
  EXPECT_EQ(again.output.find("of 3)"), std::string::npos) << "nothing is left to do";
  fs::remove_all(folder_ / "parts/001");
  ASSERT_EQ(run(sequence("parts") + options).exit_code, 0) << "a lost frame is matched again";
  EXPECT_TRUE(fs::exists(folder_ / "parts/001/result.json"));
}

/// The record of many frames is not written for each of them.
TEST_F(SequenceCommand, ResumesFromTheLastFrameInTheRecord) {
  const std::string options = "--restart-below 0 ";
  ASSERT_EQ(run(sequence("whole") + options).exit_code, 0);
  ASSERT_EQ(run(sequence() + options + "--count 2").exit_code, 0);
  fs::copy(folder_ / "whole/002", folder_ / "out/002");
  const Outcome rest = run(sequence() + options);
  ASSERT_EQ(rest.exit_code, 0) << rest.output;
  expect_same_results("whole", "out");
  EXPECT_FALSE(fs::exists(folder_ / "out/001/planes0.tiff"));
}

TEST_F(SequenceCommand, ResumesWithAnotherNumberOfThreads) {
  ASSERT_EQ(run(sequence() + "--count 1").exit_code, 0);
  const std::string first = bytes_of("out/000/result.json");
  const Outcome outcome = run(sequence() + "--count 2", "taskset -c 0 env");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(bytes_of("out/000/result.json") == first);
}

TEST_F(SequenceCommand, ImagesMayBeInFoldersOfAnyName) {
  ASSERT_EQ(run(sequence("standard")).exit_code, 0);
  fs::create_directories(folder_ / "data/right");
  fs::rename(folder_ / "data/cam0", folder_ / "data/left");
  fs::rename(folder_ / "data/cam1", folder_ / "data/right/rgb");
  const Outcome outcome = run(sequence("other") + "--folders left,right/rgb");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  expect_same_results("standard", "other");
}

TEST_F(SequenceCommand, OtherFoldersAreOtherSettings) {
  fs::copy(folder_ / "data/cam1", folder_ / "data/third");
  ASSERT_EQ(run(sequence() + "--folders cam0,cam1").exit_code, 0);
  const Outcome outcome = run(sequence() + "--folders cam0,third");
  EXPECT_NE(outcome.exit_code, 0);
  EXPECT_NE(outcome.output.find("folders"), std::string::npos) << outcome.output;
}

TEST_F(SequenceCommand, ReplacedImagesAreMatchedAgain) {
  ASSERT_EQ(run(sequence()).exit_code, 0);
  const std::string first = bytes_of(folder_ / "out/000/result.json");
  const std::string second = bytes_of(folder_ / "out/001/distance0.tiff");
  const fs::path image = folder_ / "data/cam0/001.png";
  cv::Mat changed = cv::imread(image.string(), cv::IMREAD_UNCHANGED);
  cv::flip(changed, changed, 1);
  cv::imwrite(image.string(), changed);
  const Outcome outcome = run(sequence());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(bytes_of(folder_ / "out/000/result.json") == first);
  EXPECT_FALSE(bytes_of(folder_ / "out/001/distance0.tiff") == second);
  EXPECT_NE(outcome.output.find("(3 of 3)"), std::string::npos) << outcome.output;
}

/// Where it is replaced before it is read, or the second run finds nothing to do, as it should.
TEST_F(SequenceCommand, ImagesReplacedWhileTheyAreMatchedAreMatchedAgain) {
  const fs::path image = folder_ / "data/cam0/001.png";
  cv::Mat changed = cv::imread(image.string(), cv::IMREAD_UNCHANGED);
  cv::flip(changed, changed, 1);
  cv::imwrite(file("changed.png"), changed);
  std::future<Outcome> earlier = std::async(std::launch::async, [this] { return run(sequence()); });
  const auto runs = [&earlier] {
    return earlier.wait_for(std::chrono::milliseconds(1)) == std::future_status::timeout;
  };
  while (runs() && !fs::exists(folder_ / "out/000")) {
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  fs::rename(folder_ / "changed.png", image);
  ASSERT_EQ(earlier.get().exit_code, 0);
  ASSERT_EQ(run(sequence()).exit_code, 0);
  ASSERT_EQ(run(sequence("fresh")).exit_code, 0);
  expect_same_results("out", "fresh");
}

TEST_F(SequenceCommand, OtherSettingsNeedAnotherFolderOrOverwriting) {
  ASSERT_EQ(run(sequence() + "--count 1").exit_code, 0);
  const Outcome other = run(sequence() + "--seed 5");
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.output.find("options/seed is 1 there and 5 now"), std::string::npos)
      << other.output;
  EXPECT_NE(other.output.find("--overwrite"), std::string::npos);
  EXPECT_EQ(record()["frames"].size(), 1u);
  ASSERT_EQ(run(sequence() + "--seed 5 --overwrite --count 2").exit_code, 0);
  EXPECT_EQ(record()["frames"].size(), 2u);
  // One card has the same name for both.
  nlohmann::json of_another = record();
  of_another["settings"]["device"]["back_end"] = "vulkan";
  folder_.write("out/sequence.json", of_another.dump());
  const Outcome resumed = run(sequence() + "--seed 5");
  EXPECT_EQ(resumed.exit_code, 1);
  EXPECT_NE(resumed.output.find("device/back_end is \"vulkan\" there and \"cpu\" now"),
            std::string::npos)
      << resumed.output;
  EXPECT_EQ(record()["settings"]["options"]["seed"], 5);
  folder_.write("out/sequence.json", "{\"frames\": [{\"name\": \"../data\"}], \"settings\": {}}");
  EXPECT_EQ(run(sequence() + "--overwrite").exit_code, 1);
  EXPECT_TRUE(fs::exists(folder_ / "data/cam0/000.png"));
}

TEST_F(SequenceCommand, OverwritingBeginsWithTheFirstNewFrame) {
  ASSERT_EQ(run(sequence() + "--count 2").exit_code, 0);
  const std::string before = bytes_of(folder_ / "out/sequence.json");
  EXPECT_EQ(run(sequence() + "--overwrite --levels 4").exit_code, 1);
  EXPECT_TRUE(bytes_of(folder_ / "out/sequence.json") == before);
  EXPECT_TRUE(fs::exists(folder_ / "out/001/distance0.tiff"));
  // Of a run that was killed while it removed a frame.
  fs::create_directories(folder_ / "out/.removed/maps");
  ASSERT_EQ(run(sequence() + "--overwrite --seed 5 --count 1").exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "out/001"));
  EXPECT_FALSE(fs::exists(folder_ / "out/.removed"));
}

TEST_F(SequenceCommand, TwoRunsNeedTwoFolders) {
  fs::create_directories(folder_ / "out");
  const int other = open((folder_ / "out").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(other, LOCK_EX | LOCK_NB), 0);
  expect_error(sequence() + "--count 1", "Another run is writing to");
  EXPECT_TRUE(fs::is_empty(folder_ / "out"));
  close(other);
  EXPECT_EQ(run(sequence() + "--count 1").exit_code, 0);
}

TEST_F(SequenceCommand, FoldersOfOthersAreLeftAlone) {
  const std::string depth = "depth " + file("data/cam0/000.png") + " " + file("data/cam1/000.png") +
                            " -c " + file("calib.yaml") + quick;
  ASSERT_EQ(run(depth + " -o " + file("out/000")).exit_code, 0);
  const auto expect_left_alone = [&] {
    const std::string theirs = bytes_of(folder_ / "out/000/result.json");
    const Outcome outcome = run(sequence());
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("out/000 is there already and is no result of a sequence"),
              std::string::npos)
        << outcome.output;
    EXPECT_TRUE(bytes_of(folder_ / "out/000/result.json") == theirs);
  };
  expect_left_alone();
  folder_.write("out/000/result.json", R"({"input": {"run": 5}})");
  expect_left_alone();
}

TEST_F(SequenceCommand, FramesAreNotOverwrittenByASingleResult) {
  ASSERT_EQ(run(sequence() + "--count 1").exit_code, 0);
  const std::string frame = bytes_of("out/000/result.json");
  const std::string depth = "depth " + file("data/cam0/001.png") + " " + file("data/cam1/001.png") +
                            " -c " + file("calib.yaml") + quick + " -o ";
  for (const char* folder : {"out", "out/000"}) {
    const Outcome outcome = run(depth + file(folder));
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("holds results of a sequence; choose another folder."),
              std::string::npos)
        << outcome.output;
  }
  EXPECT_TRUE(bytes_of("out/000/result.json") == frame);
  EXPECT_FALSE(fs::exists(folder_ / "out/result.json"));
}

TEST_F(SequenceCommand, AFullDiskLeavesNothingUnfinished) {
  const Outcome outcome = run(sequence() + "--count 1", "ulimit -f 20;");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
  EXPECT_FALSE(fs::exists(folder_ / "out/.unfinished"));
}

TEST_F(SequenceCommand, TheFolderOfTheImagesIsNoneForResults) {
  for (const char* command : {"sequence ", "reconstruct "}) {
    const Outcome outcome = run(command + file("data") + " -c " + file("calib.yaml") + " -o " +
                                file("data/../data/") + quick);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("is the folder of the images; choose another one"),
              std::string::npos)
        << outcome.output;
  }
  EXPECT_FALSE(fs::exists(folder_ / "data/000"));
}

TEST_F(SequenceCommand, AFolderHoldsOneKindOfRun) {
  ASSERT_EQ(run(sequence() + "--count 1").exit_code, 0);
  const std::string reconstruct = "reconstruct " + file("data") + " -c " + file("calib.yaml") +
                                  quick + "--min-views 1 --count 1 -o ";
  expect_error(reconstruct + file("out"),
               "out holds a sequence; choose another folder for the reconstruction.");
  expect_error(reconstruct + file("out") + " --overwrite", "out holds a sequence");
  EXPECT_FALSE(fs::exists(folder_ / "out/000/cam0"));
  ASSERT_EQ(run(reconstruct + file("dense")).exit_code, 0);
  expect_error(sequence("dense"), "dense holds a reconstruction; choose another folder");
}

TEST_F(SequenceCommand, DamagedRecordsAreRefusedAndDamagedFramesMatchedAgain) {
  ASSERT_EQ(run(sequence() + "--count 2").exit_code, 0);
  fs::remove(folder_ / "out/001/cost1.tiff");
  ASSERT_EQ(run(sequence() + "--count 2").exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "out/001/cost1.tiff"));
  // What the frame after it started from was kept no longer than that.
  fs::remove(folder_ / "out/000/reasons0.png");
  fs::remove_all(folder_ / "out/001");
  const nlohmann::json whole = record();
  fs::remove(folder_ / "out/sequence.json");
  fs::create_directory(folder_ / "out/sequence.json");
  expect_error(sequence(), "sequence.json is no record of a sequence; remove it");
  fs::remove(folder_ / "out/sequence.json");
  for (const char* key : {"start", "milliseconds", "name"}) {
    nlohmann::json damaged = whole;
    damaged["frames"][0].erase(key);
    folder_.write("out/sequence.json", damaged.dump());
    const Outcome outcome = run(sequence());
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("is no record of a sequence"), std::string::npos)
        << outcome.output;
  }
  for (const char* text : {"{\"frames\": {}, \"settings\": {}}", "[]", "{\"frames\": [1]", "nan",
                           "{\"frames\": [], \"settings\": null}"}) {
    folder_.write("out/sequence.json", text);
    const Outcome outcome = run(sequence());
    EXPECT_EQ(outcome.exit_code, 1) << text;
    EXPECT_NE(outcome.output.find("is no record of a sequence"), std::string::npos)
        << text << "\n"
        << outcome.output;
  }
}

TEST_F(SequenceCommand, MasksAreTheSameFromEveryFolder) {
  cv::imwrite(file("mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  ASSERT_EQ(run(sequence() + "--count 1 --mask " + file("mask.png")).exit_code, 0);
  const Outcome outcome = run(sequence() + "--count 2 --mask " + file("data/../mask.png"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
}

TEST_F(SequenceCommand, LongerListsAreOtherSettings) {
  cv::imwrite(file("mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  ASSERT_EQ(run(sequence() + "--count 1").exit_code, 0);
  for (const auto& [option, message] :
       {std::pair<std::string, std::string>(
            "--mask " + file("mask.png"),
            "masks is [] there and [\"" + file("mask.png") + "\"] now"),
        {"--formats tiff,pfm", "formats is [\"tiff\"] there and [\"tiff\",\"pfm\"] now"}}) {
    const Outcome outcome = run(sequence() + option);
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find(message), std::string::npos) << outcome.output;
  }
}

TEST_F(SequenceCommand, ADatasetIsTheSameByEveryName) {
  ASSERT_EQ(run(sequence() + "--count 1").exit_code, 0);
  for (const char* name : {"data/", "data/.", "data/../data//"}) {
    const Outcome outcome = run(sequence("out", name) + "--count 1");
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  }
}

TEST_F(SequenceCommand, AReplacedMaskIsAnotherSetting) {
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask.colRange(0, 20).setTo(0);
  cv::imwrite(file("mask.png"), mask);
  ASSERT_EQ(run(sequence() + "--count 1 --mask " + file("mask.png")).exit_code, 0);
  cv::flip(mask, mask, 1);  // as many pixels
  cv::imwrite(file("mask.png"), mask);
  const Outcome outcome = run(sequence() + "--count 2 --mask " + file("mask.png"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("views/0/mask"), std::string::npos) << outcome.output;
}

TEST_F(SequenceCommand, ASceneCutIsMatchedAnew) {
  add_frame(0, "001", 8);
  const Outcome outcome = run(sequence() + "--restart-below 1 --count 2 --no-motion");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json frames = record()["frames"];
  EXPECT_EQ(frames[1]["start"], "cold after warm") << frames.dump(1);
  const Outcome alone = run(cold_sequence("alone") + "--no-warm-start --count 2");
  ASSERT_EQ(alone.exit_code, 0) << alone.output;
  EXPECT_GT(frames[1]["patch_samples"], record("alone")["frames"][1]["patch_samples"])
      << "what was in vain counts";
  EXPECT_EQ(bytes_of(folder_ / "out/001/distance0.tiff"),
            bytes_of(folder_ / "alone/001/distance0.tiff"));
}

TEST_F(SequenceCommand, ASceneCutIsNoticedWhereARunWasResumed) {
  add_frame(0, "002", 8);
  const std::string options = "--no-motion --restart-below 0.94 ";
  ASSERT_EQ(run(sequence() + options + "--count 2").exit_code, 0);
  ASSERT_EQ(record()["frames"][1]["start"], "warm") << record()["frames"];
  ASSERT_EQ(run(sequence() + options).exit_code, 0);
  EXPECT_EQ(record()["frames"][2]["start"], "cold after warm") << record()["frames"];
}

TEST_F(SequenceCommand, ViewsWithoutPlanesHaveNoPartInTheMeanCost) {
  write_calibration_looking_backwards();
  fs::copy(folder_ / "data/cam0", folder_ / "data/cam2");
  for (const char* frame : {"000", "001", "002"}) {
    alter("data/cam2/" + std::string(frame) + ".png", 5);
  }
  const std::string sequence = "sequence " + file("data") + " -c " + file("backwards.yaml") +
                               " -o " + file("out") + " --views 0,1,2 --count ";
  for (const char* count : {"1", "2"}) {
    const Outcome outcome = run(sequence + count + quick);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  }
  const nlohmann::json views = nlohmann::json::parse(bytes_of("out/001/result.json")).at("views");
  EXPECT_TRUE(views.at(2).at("mean_cost").is_null()) << views.at(2);
  const double of_others =
      (views.at(0).at("mean_cost").get<double>() + views.at(1).at("mean_cost").get<double>()) / 2;
  EXPECT_NEAR(record()["frames"][1].at("mean_cost").get<double>(), of_others, 1e-9);
}

TEST_F(SequenceCommand, BlackFramesNeitherStartOthersNorHideSceneCuts) {
  const cv::Mat black(96, 96, CV_8UC1, cv::Scalar(0));
  for (const char* image : {"cam0/000.png", "cam1/000.png", "cam1/002.png"}) {
    cv::imwrite(file(std::string("data/") + image), black);
  }
  add_frame(2, "003", 3);
  add_frame(0, "004", 8);
  const std::string options = "--restart-below 1 --no-motion ";
  ASSERT_EQ(run(sequence() + options).exit_code, 0);
  const auto starts = [this](const std::string& output) {
    std::vector<std::string> all;
    const nlohmann::json frames = record(output)["frames"];
    for (const nlohmann::json& frame : frames) all.push_back(frame["start"]);
    return all;
  };
  const std::vector<std::string> expected = {"cold", "cold", "cold after warm", "cold",
                                             "cold after warm"};
  EXPECT_EQ(starts("out"), expected);
  ASSERT_EQ(run(sequence("parts") + options + "--count 3").exit_code, 0);
  ASSERT_EQ(run(sequence("parts") + options).exit_code, 0);
  EXPECT_EQ(starts("parts"), expected) << "resumed after the second one";
}

TEST_F(SequenceCommand, TheFirstFrameThatShowsAnythingTellsWhereTheLensEnds) {
  std::string text = bytes_of("calib.yaml");
  const std::string limit = "  max_theta_deg: 97.5\n";
  folder_.write("calib.yaml", text.erase(text.find(limit), limit.size()));
  for (int k = 0; k < 3; ++k) {
    for (const char* camera : {"cam0", "cam1"}) {
      const std::string path =
          file(std::string("data/") + camera + "/00" + std::to_string(k) + ".png");
      cv::Mat image = cv::imread(path, cv::IMREAD_UNCHANGED);
      cv::Mat outside(image.size(), CV_8UC1, cv::Scalar(255));
      cv::circle(outside, {48, 48}, 40, cv::Scalar(0), cv::FILLED);
      image.setTo(0, outside);
      if (k == 0) image.setTo(0);
      cv::imwrite(path, image);
    }
  }
  const Outcome outcome = run(sequence());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(" is black from "), std::string::npos) << outcome.output;
  const auto result = nlohmann::json::parse(bytes_of(folder_ / "out/001/result.json"));
  EXPECT_LT(result["views"][0]["max_theta_degrees"], 120);
}

TEST_F(SequenceCommand, BlankCamerasAreNamed) {
  for (int k = 0; k < 3; ++k) {
    cv::imwrite(file("data/cam1/00" + std::to_string(k) + ".png"),
                cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  }
  EXPECT_NE(run(sequence() + "--count 1").output.find("The image of cam1 is blank but for noise"),
            std::string::npos);
}

TEST_F(SequenceCommand, FramesThatAreGoneAreRemovedWithTheNextNewOne) {
  ASSERT_EQ(run(sequence() + "--count 2").exit_code, 0);
  for (const char* image : {"data/cam0/001.png", "data/cam1/001.png"}) fs::remove(folder_ / image);
  ASSERT_EQ(run(sequence()).exit_code, 0);
  EXPECT_TRUE(fs::exists(folder_ / "out/002/result.json"));
  EXPECT_FALSE(fs::exists(folder_ / "out/001"));
}

TEST_F(SequenceCommand, ADamagedImageIsDoneWithoutOnceItIsRemoved) {
  const std::string damaged = file("data/cam1/001.png");
  folder_.write("data/cam1/001.png", bytes_of(damaged).substr(0, 500));
  const Outcome failed = run(sequence());
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.output.find(damaged +
                               " is truncated or damaged; copy it again. Or remove it, and give "
                               "--skip-incomplete to do without it."),
            std::string::npos)
      << failed.output;
  EXPECT_EQ(record()["frames"].size(), 1u);
  fs::remove(damaged);
  const Outcome outcome = run(sequence() + "--skip-incomplete");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  ASSERT_EQ(record()["frames"].size(), 2u);
  EXPECT_EQ(record()["frames"][1]["name"], "002");
}

TEST_F(SequenceCommand, AnImageOfAnotherSizeIsDoneWithoutOnceItIsRemoved) {
  const std::string odd = file("data/cam1/001.png");
  cv::Mat noise(48, 96, CV_8UC1);
  cv::randu(noise, 0, 255);
  cv::imwrite(odd, noise);
  const Outcome failed = run(sequence());
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.output.find(odd + " is 96x48 pixels"), std::string::npos) << failed.output;
  EXPECT_NE(failed.output.find("Or remove it, and give --skip-incomplete"), std::string::npos)
      << failed.output;
  // Where the first frame has another size, all may have.
  cv::imwrite(file("data/cam1/000.png"), noise);
  const Outcome first = run(sequence("other"));
  EXPECT_NE(first.output.find("000.png is 96x48 pixels"), std::string::npos) << first.output;
  EXPECT_EQ(first.output.find("Or remove it"), std::string::npos) << first.output;
}

TEST_F(SequenceCommand, ReadsEurocLayoutWithPoses) {
  std::string poses = "# seconds, of the frames that are chosen\n";
  for (int camera = 0; camera < 2; ++camera) {
    const std::string name = "cam" + std::to_string(camera);
    fs::create_directories(folder_ / "euroc/mav0" / name);
    fs::rename(folder_ / "data" / name, folder_ / "euroc/mav0" / name / "data");
    std::string list = "#timestamp [ns],filename\n";
    for (int k = 0; k < 3; ++k) {
      list += "1403636579" + std::to_string(k) + "00000000,00" + std::to_string(k) + ".png\n";
      if (camera == 0 && k > 0)
        poses += "1403636579." + std::to_string(k) + "001 0.0 0 0 0 0 0 1\n";
    }
    folder_.write("euroc/mav0/" + name + "/data.csv", list);
    const std::string x = camera == 0 ? "0" : "0.1";
    folder_.write("euroc/mav0/" + name + "/sensor.yaml",
                  "T_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, " + x +
                      ", 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\nresolution: [96, 96]\n"
                      "camera_model: ds\nintrinsics: [-0.165, 0.59, 28.9, 28.9, 47.9, 48.0]\n" +
                      (camera == 0 ? "max_theta_deg: 97.5\n" : ""));
  }
  folder_.write("poses.txt", poses);
  const std::string options =
      "--poses " + file("poses.txt") + " --first 1 --restart-below 0 --json";
  const Outcome outcome = run(sequence("out", "euroc") + options);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const nlohmann::json frames = json_of(outcome)["frames"];
  ASSERT_EQ(frames.size(), 2u);
  EXPECT_EQ(frames[0]["name"], "001");
  EXPECT_EQ(frames[1]["motion"], "poses");
  const Outcome skipped = run(sequence("skipped", "euroc") + "--poses " + file("poses.txt") +
                              " --restart-below 0 --skip-incomplete");
  ASSERT_EQ(skipped.exit_code, 0) << skipped.output;
  EXPECT_NE(skipped.output.find("1 of 3 frames are left out, as " + file("poses.txt") +
                                " has no pose of their time; the first is 000."),
            std::string::npos)
      << skipped.output;
  EXPECT_FALSE(fs::exists(folder_ / "skipped/000"));
  EXPECT_TRUE(bytes_of(folder_ / "skipped/002/distance0.tiff") ==
              bytes_of(folder_ / "out/002/distance0.tiff"));
  // The data set's own calibration is the same.
  std::string own = sequence("own", "euroc") + options;
  own.replace(own.find(file("calib.yaml")), file("calib.yaml").size(), file("euroc"));
  ASSERT_EQ(run(own).exit_code, 0);
  for (const char* map : {"/001/distance0.tiff", "/002/distance1.tiff"}) {
    EXPECT_TRUE(bytes_of(folder_ / ("own" + std::string(map))) ==
                bytes_of(folder_ / ("out" + std::string(map))))
        << map;
  }
}

/// The same motion as poses of camera 0 (TUM) and as ground truth of the IMU (EuRoC).
class SequencePoses : public SequenceCommand {
 protected:
  void SetUp() override {
    SequenceCommand::SetUp();
    write_calibration_with_imu();
    Eigen::Isometry3d camera_from_imu = Eigen::Isometry3d::Identity();
    camera_from_imu.linear() << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    camera_from_imu.translation() << 0.05, -0.04, -0.07;
    std::ostringstream camera_poses, imu_poses;
    for (std::ostringstream* out : {&camera_poses, &imu_poses}) *out << std::setprecision(17);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Isometry3d camera =
          Eigen::Translation3d(0.03 * k, 0.007 * k * k, 0.1 - 0.01 * k) *
          Eigen::AngleAxisd(0.2 + 0.05 * k, Eigen::Vector3d(1, 2, -2) / 3);
      const Eigen::Isometry3d imu = camera * camera_from_imu;
      const Eigen::Quaterniond q(camera.linear()), r(imu.linear());
      camera_poses << k << ' ' << camera.translation().transpose() << ' ' << q.coeffs().transpose()
                   << "\n";
      imu_poses << k << "000000000";
      for (const double value : {imu.translation().x(), imu.translation().y(),
                                 imu.translation().z(), r.w(), r.x(), r.y(), r.z()}) {
        imu_poses << ',' << value;
      }
      imu_poses << "\r\n";
    }
    folder_.write("camera.txt", camera_poses.str());
    folder_.write("imu.csv", imu_poses.str());
  }

  std::string with(const std::string& poses, const std::string& output,
                   const std::string& calibration = "imucam.yaml") const {
    return "sequence " + file("data") + " -c " + file(calibration) + " -o " + file(output) + quick +
           "--warm-iterations 1 --restart-below 0 --poses " + file(poses) + " ";
  }
};

/// Two frames of the demo's room, between which the rig moves and turns.
class SequenceOfTheDemo : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    for (int k = 0; k < 2; ++k) {
      frames_.push_back(render_demo_from(world_from_rig(k), size));
      for (int view = 0; view < 2; ++view) {
        const fs::path folder = folder_ / ("data/cam" + std::to_string(view));
        fs::create_directories(folder);
        write_image(folder / ("00" + std::to_string(k) + ".png"), frames_[k].views[view].image);
      }
    }
    write_kalibr(file("demo.yaml"), frames_[0].rig);
  }
  static Eigen::Isometry3d world_from_rig(int k) {
    return Eigen::Translation3d(0.1 * k, 0.02 * k, 0.08 * k) *
           Eigen::AngleAxisd(0.3 * k, Eigen::Vector3d::UnitY());
  }
  /// Share of the second frame's pixels that are wrong by more than a tenth, the first one having
  /// started it by this motion of the rig.
  double wrong_after(const Eigen::Isometry3d& first_from_second) {
    std::ostringstream poses;
    const Eigen::Quaterniond q(first_from_second.linear());
    poses << "0 0 0 0 0 0 0 1\n1 " << first_from_second.translation().transpose() << ' '
          << q.coeffs().transpose() << "\n";
    folder_.write("poses.txt", poses.str());
    const Outcome outcome =
        run("sequence " + file("data") + " -c " + file("demo.yaml") + " -o " + file("out") +
            " --preset fast --device cpu --overwrite " +
            "--min-distance 0.5 --max-distance 20 --restart-below 0 --poses " + file("poses.txt"));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_NE(outcome.output.find("warm, motion poses"), std::string::npos) << outcome.output;
    output_ = outcome.output;
    const cv::Mat distance = cv::imread(file("out/001/distance0.tiff"), cv::IMREAD_UNCHANGED);
    const GroundTruth& truth = frames_[1].views[0].truth;
    const cv::Mat counted = (truth.distance > 0) & (truth.occlusion == 255);
    const cv::Mat wrong = cv::abs(distance - truth.distance) > 0.1 * truth.distance;
    return cv::countNonZero(wrong & counted) / double(cv::countNonZero(counted));
  }

  static constexpr int size = 160;
  std::vector<RenderedPair> frames_;
  std::string output_;  ///< of the last run
};

TEST_F(SequenceOfTheDemo, KnownMotionLeadsFromTheFrameBefore) {
  const double right = wrong_after(world_from_rig(1));
  EXPECT_LT(right, 0.1);
  EXPECT_GT(wrong_after(world_from_rig(1).inverse()), 2 * right) << "the way back";
}

TEST_F(SequenceOfTheDemo, PosesThatDoNotFitAreReported) {
  const std::string misfit = "pairs are like this) do not fit --poses";
  wrong_after(world_from_rig(1));
  EXPECT_EQ(output_.find(misfit), std::string::npos) << output_;
  wrong_after(world_from_rig(1).inverse());
  EXPECT_NE(output_.find(misfit), std::string::npos) << output_;
}

TEST_F(SequenceOfTheDemo, ImagesWithoutAMaskEndWhereTheyTurnBlack) {
  Rig rig = frames_[0].rig;
  for (View& view : rig.views) view.camera.max_theta = std::numbers::pi;
  write_kalibr(file("whole.yaml"), rig);
  fs::create_directories(folder_ / "masks/000");
  write_image(folder_ / "masks/000/cam0.png", cv::Mat(size, size, CV_8UC1, cv::Scalar(255)));
  const std::string reconstruct =
      "reconstruct " + file("data") + " -c " + file("whole.yaml") +
      " --count 1 --device cpu --preset fast --min-distance 0.4 --max-distance 8 -o ";
  const auto expect_rims = [](const Outcome& outcome, bool of_first) {
    ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
    EXPECT_EQ(outcome.output.find("000/cam0 is black from") != std::string::npos, of_first)
        << outcome.output;
    EXPECT_NE(outcome.output.find("000/cam1 is black from"), std::string::npos) << outcome.output;
  };
  expect_rims(run(reconstruct + file("all")), true);
  expect_rims(run(reconstruct + file("some") + " --masks " + file("masks")), false);
}

TEST_F(SequencePoses, OfTheImuAreThoseOfTheCamera) {
  for (const std::string options : {"", "--views 1,0 "}) {
    const Outcome camera = run(with("camera.txt", "camera") + "--overwrite " + options);
    ASSERT_EQ(camera.exit_code, 0) << camera.output;
    EXPECT_NE(camera.output.find("warm, motion poses"), std::string::npos) << camera.output;
    const Outcome imu = run(with("imu.csv", "imu") + "--overwrite " + options);
    ASSERT_EQ(imu.exit_code, 0) << imu.output;
    expect_same_results("camera", "imu");
  }
  EXPECT_EQ(record("camera")["settings"]["poses_of"], "camera");
  EXPECT_EQ(record("imu")["settings"]["poses_of"], "imu");
  EXPECT_EQ(record("imu")["settings"]["world_from_imu"][3], 0.05);
  ASSERT_EQ(run(with("imu.csv", "wrong") + "--poses-of camera --views 1,0").exit_code, 0);
  EXPECT_NE(bytes_of(folder_ / "wrong/002/distance0.tiff"),
            bytes_of(folder_ / "imu/002/distance0.tiff"))
      << "the motion matters here";
}

TEST_F(SequencePoses, OfAnImuAreByItsOwnClock) {
  for (int k = 0; k < 3; ++k) {
    for (const std::string camera : {"/cam0/", "/cam1/"}) {
      fs::create_directories(folder_ / ("timed" + camera));
      fs::copy_file(folder_ / ("data" + camera + "00" + std::to_string(k) + ".png"),
                    folder_ / ("timed" + camera + "170000000" + std::to_string(k) + ".png"));
    }
  }
  const auto poses_after = [this](const std::string& name, const std::string& nanoseconds) {
    std::string text = "\n" + bytes_of(folder_ / "imu.csv");
    for (const std::string k : {"0", "1", "2"}) {
      text = replaced(text, "\n" + k + "000000000,", "\n170000000" + k + nanoseconds + ",");
    }
    folder_.write(name, text.substr(1));
  };
  poses_after("same.csv", "000000000");
  poses_after("ahead.csv", "250000000");
  folder_.write("ahead.yaml", replaced(bytes_of(folder_ / "imucam.yaml"), "cam0:\n",
                                       "cam0:\n  timeshift_cam_imu: 0.25\n"));
  const auto match = [this](const std::string& poses, const std::string& output,
                            const std::string& calibration) {
    return run(replaced(with(poses, output, calibration), file("data"), file("timed")));
  };
  const Outcome same = match("same.csv", "same", "imucam.yaml");
  ASSERT_EQ(same.exit_code, 0) << same.output;
  EXPECT_NE(match("ahead.csv", "out", "imucam.yaml").exit_code, 0) << "no pose is near in time";
  const Outcome ahead = match("ahead.csv", "ahead", "ahead.yaml");
  ASSERT_EQ(ahead.exit_code, 0) << ahead.output;
  EXPECT_NE(ahead.output.find("at the times of the images plus 0.250000 s"), std::string::npos)
      << ahead.output;
  for (const std::string map : {"1700000001/distance0.tiff", "1700000002/distance1.tiff"}) {
    EXPECT_TRUE(bytes_of(folder_ / ("same/" + map)) == bytes_of(folder_ / ("ahead/" + map)));
  }
  EXPECT_EQ(record("ahead")["settings"]["imu_time_offset"], 0.25);
}

TEST_F(SequencePoses, FramesWithOtherPosesAreMatchedAgain) {
  ASSERT_EQ(run(with("camera.txt", "out")).exit_code, 0);
  std::string poses = bytes_of(folder_ / "camera.txt");
  const std::string second = bytes_of(folder_ / "out/001/result.json");
  poses.replace(poses.rfind("0.08"), 4, "0.09");
  folder_.write("camera.txt", poses);
  const Outcome outcome = run(with("camera.txt", "out"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(bytes_of(folder_ / "out/001/result.json") == second);
  EXPECT_NE(outcome.output.find("002: "), std::string::npos) << outcome.output;
}

TEST_F(SequencePoses, ThatNoFrameCanBeStartedByAreReported) {
  const std::string hint =
      "2 of 2 frames were matched again by themselves, as little was accepted where they were "
      "started by their poses; check --poses and its unit.";
  const std::string always = replaced(with("camera.txt", "out"), "below 0 ", "below 1 ");
  const Outcome never = run(with("camera.txt", "out"));
  EXPECT_EQ(never.output.find("matched again"), std::string::npos) << never.output;
  folder_.write("camera.txt", "0 0 0 0 0 0 0 1\n1 1000 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n");
  const Outcome outcome = run(always + "--overwrite");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find(hint), std::string::npos) << outcome.output;
}

TEST_F(SequencePoses, AreOfAllFramesAlsoOfThoseLeftOut) {
  fs::remove(folder_ / "data/cam1/001.png");
  const Outcome outcome = run(with("camera.txt", "out") + "--skip-incomplete");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("1 of 3 frames are left out, as a camera lacks them; the first is "
                                "001."),
            std::string::npos)
      << outcome.output;
  ASSERT_EQ(record()["frames"].size(), 2u);
  EXPECT_EQ(record()["frames"][1]["name"], "002");
  EXPECT_NE(record()["frames"][1]["pose"].dump().find("0.06"), std::string::npos);
}

TEST_F(SequencePoses, MakeOneSceneOfAllFrames) {
  const std::string reconstruct = "reconstruct " + file("data") + " -c " + file("calib.yaml") +
                                  " -o " + file("out") + quick + "--min-views 1 ";
  const std::string poses = "--poses " + file("camera.txt");
  expect_error(reconstruct, "calib.yaml is no COLMAP model");
  expect_error("reconstruct " + file("data") + " -c " + file("calib.yaml") + " -o " + file("out") +
                   " --min-distance 9 --max-distance 8 " + poses,
               "The distance range from 9");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const Outcome outcome = run(reconstruct + poses + " --count 2");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto record = [this] {
    return nlohmann::json::parse(bytes_of(folder_ / "out/reconstruction.json"));
  };
  EXPECT_EQ(record()["images"].size(), 4U);
  EXPECT_GT(record()["cloud"]["points"].get<int>(), 100);
  EXPECT_EQ(record()["cloud"]["origin"], (nlohmann::json{0, 0, 0}));
  for (const char* name : {"000/cam0", "000/cam1", "001/cam0", "001/cam1"}) {
    EXPECT_TRUE(fs::exists(folder_ / "out" / name / "distance0.tiff")) << name;
  }
  // More frames, other groups: what is still of the same images is kept.
  ASSERT_EQ(run(reconstruct + poses).exit_code, 0);
  EXPECT_EQ(record()["images"].size(), 6U);
  EXPECT_TRUE(fs::exists(folder_ / "out/002/cam1/distance0.tiff"));
  EXPECT_EQ(run(reconstruct + poses + " --views 0 --overwrite").exit_code, 0);
  EXPECT_EQ(record()["images"].size(), 3U);
  EXPECT_FALSE(fs::exists(folder_ / "out/000/cam1"));
  fs::rename(folder_ / "data/cam0", folder_ / "data/left");
  EXPECT_EQ(run(reconstruct + poses + " --folders left,cam1 --overwrite").exit_code, 0);
  EXPECT_EQ(record()["images"].size(), 6U);
  expect_error(reconstruct + poses + " --folders cam1,left", "folders");
  expect_error(reconstruct + poses + " --views 0,0 --folders left,cam1", "camera 0 twice");
}

TEST_F(SequencePoses, ResultsDoNotGoAmongTheImages) {
  const std::string within = " -c " + file("calib.yaml") + quick + "-o " + file("data/cam1");
  expect_error("reconstruct " + file("data") + within + " --poses " + file("camera.txt"),
               "is the folder of the images");
  expect_error("sequence " + file("data") + within, "is the folder of the images");
}

/// Where poses begin decides no result.
TEST_F(SequencePoses, ResultsOfLaterFramesAreKeptWithoutTheFirst) {
  const std::string reconstruct = "reconstruct " + file("data") + " -c " + file("calib.yaml") +
                                  " -o " + file("out") + quick + "--min-views 1 --sources 1 " +
                                  "--poses " + file("camera.txt");
  ASSERT_EQ(run(reconstruct + " --first 1").exit_code, 0);
  const Outcome all = run(reconstruct);
  ASSERT_EQ(all.exit_code, 0) << all.output;
  EXPECT_NE(all.output.find("Kept as an earlier run matched them"), std::string::npos)
      << all.output;
}

TEST_F(SequenceCommand, SaysWhichFramesAreMatchedAgain) {
  ASSERT_EQ(run(sequence()).exit_code, 0);
  const fs::path changed = folder_ / "data/cam0/001.png";
  fs::last_write_time(changed, fs::last_write_time(changed) + std::chrono::seconds(5));
  const Outcome outcome = run(sequence());
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("2 are matched again, from 001 on"), std::string::npos)
      << outcome.output;
}

TEST_F(SequenceCommand, OneFrameOfARigIsAScene) {
  const std::string reconstruct = "reconstruct " + file("data") + " -c " + file("calib.yaml") +
                                  " -o " + file("out") + quick + "--min-views 1 ";
  expect_error(reconstruct, "--poses, or take one frame (--count 1)");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  const Outcome outcome = run(reconstruct + "--first 1 --count 1");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const auto record = nlohmann::json::parse(bytes_of(folder_ / "out/reconstruction.json"));
  EXPECT_EQ(record["images"].size(), 2U);
  EXPECT_GT(record["cloud"]["points"].get<int>(), 100);
  EXPECT_TRUE(fs::exists(folder_ / "out/001/cam1/distance0.tiff"));
}

TEST_F(SequenceCommand, AllCamerasOfOneFrameAreMatchedWithEachOther) {
  std::string calibration = bytes_of("calib.yaml");
  const std::string last = calibration.substr(calibration.find("cam1:"));
  for (const char* camera : {"cam2", "cam3"}) {
    calibration += camera + last.substr(4);
    fs::create_directories(folder_ / "data" / camera);
    fs::copy_file(folder_ / "data/cam0/000.png", folder_ / "data" / camera / "000.png");
    alter("data/" + std::string(camera) + "/000.png", camera == std::string("cam2") ? 5 : 6);
  }
  folder_.write("four.yaml", calibration);
  const std::string reconstruct = "reconstruct " + file("data") + " -c " + file("four.yaml") +
                                  quick + "--min-views 1 --skip-incomplete --count 1 -o " +
                                  file("out");
  const auto matched_with_last = [this] {
    return nlohmann::json::parse(bytes_of("out/000/cam3/result.json"))["input"]["images"].size();
  };
  const Outcome outcome = run(reconstruct);
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(matched_with_last(), 4u);
  ASSERT_EQ(run(reconstruct + " --sources 2 --overwrite").exit_code, 0);
  EXPECT_EQ(matched_with_last(), 3u);
}

TEST_F(SequencePoses, NeedToBeOfWhatTheCalibrationKnows) {
  expect_error(with("imu.csv", "out", "calib.yaml"), "calib.yaml does not say where that is");
  expect_error(with("camera.txt", "out", "calib.yaml") + "--poses-of imu", "T_cam_imu");
  EXPECT_FALSE(fs::exists(folder_ / "out"));
  EXPECT_NE(run(with("imu.csv", "out") + "--poses-of body").exit_code, 0);
  EXPECT_NE(run(sequence() + "--poses-of imu").output.find("--poses"), std::string::npos);
  ASSERT_EQ(run(with("imu.csv", "out", "calib.yaml") + "--poses-of camera --count 1").exit_code, 0);
  ASSERT_EQ(run(with("imu.csv", "out") + "--poses-of camera --count 1 --overwrite").exit_code, 0);
  const Outcome other = run(with("imu.csv", "out"));
  EXPECT_EQ(other.exit_code, 1);
  EXPECT_NE(other.output.find("poses_of is \"camera\" there and \"imu\" now"), std::string::npos)
      << other.output;
}

TEST_F(SequenceCommand, BadInputIsNamedAndLeavesNothing) {
  const auto expect = [&](const std::string& arguments, const std::string& part) {
    expect_error(arguments, part);
    EXPECT_FALSE(fs::exists(folder_ / "out/sequence.json")) << arguments;
    EXPECT_FALSE(fs::exists(folder_ / "out/000")) << arguments;
  };
  expect(sequence("out", "nowhere"), "nowhere");
  fs::create_directories(folder_ / "empty/cam0");
  expect(sequence("out", "empty"), "no images");
  expect(sequence() + "--first 3", "3 frames");
  expect(sequence() + "--first 000010", "no frame 10 to start from");
  expect(sequence() + "--views 0,2", "cam2");
  expect(sequence() + "--folders cam0,none", "none");
  expect(sequence() + "--views 0,1 --folders cam0", "--folders names 1 folders for 2 cameras");
  expect(sequence() + "--folders cam0", "give one that moves to `reconstruct`, with --poses");
  expect(sequence() + "--views 1", "give one that moves to `reconstruct`, with --poses");
  expect(sequence() + "--poses " + file("none.txt"), "none.txt");
  folder_.write("few.txt", "1 0 0 0 0 0 0 1\n");
  expect(sequence() + "--poses " + file("few.txt"), "1 poses for 3 frames");
  folder_.write("nan.txt", "1 0 0 nan 0 0 0 1\n");
  expect(sequence() + "--poses " + file("nan.txt"), "nan.txt line 1");
  cv::imwrite(file("data/cam1/000.png"), cv::Mat(48, 96, CV_8UC1, cv::Scalar(7)));
  expect(sequence(), "cam1/000.png is 96x48");
  folder_.write("data/cam1/000.png", "garbage");
  expect(sequence(), "cam1/000.png");
  fs::remove(folder_ / "data/cam1/000.png");
  expect(sequence(), "frame 000 has no image in " + file("data/cam1"));
}

TEST_F(SequenceCommand, ABrokenFrameLeavesTheFramesBeforeIt) {
  folder_.write("data/cam1/002.png", "garbage");
  const Outcome outcome = run(sequence() + "--restart-below 0");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("cam1/002.png"), std::string::npos) << outcome.output;
  EXPECT_EQ(record()["frames"].size(), 2u);
  EXPECT_FALSE(fs::exists(folder_ / "out/002"));
  add_frame(2, "002", 3);
  EXPECT_EQ(run(sequence() + "--restart-below 0").exit_code, 0);
  EXPECT_EQ(record()["frames"].size(), 3u);
}

}  // namespace
}  // namespace widestereo::test
