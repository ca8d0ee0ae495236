// SPDX-License-Identifier: MIT
// What the command writes, where it cannot, and what an earlier run has left.
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "command_fixture.h"

namespace widestereo::test {
namespace {

constexpr const char* euroc_sensor = R"(sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [0.0, 0.0, 1.0, 0.1, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0]
resolution: [752, 480]
camera_model: pinhole
intrinsics: [458.5, 457.25, 367.0, 248.0]
distortion_model: radial-tangential
distortion_coefficients: [-0.28, 0.07, 0.0, 0.0]
)";

class Output : public Command {
 protected:
  std::set<std::string> files_in(const std::string& folder) const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_ / folder)) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }
  /// Calibration of two pinhole cameras of this size.
  void write_small_calibration(int width, int height) const {
    std::string text;
    for (const char* camera : {"cam0", "cam1"}) {
      text += std::string(camera) + ":\n";
      if (text.size() > 10) {
        text += "  T_cn_cnm1: [[1, 0, 0, -0.1], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]\n";
      }
      const std::string size = std::to_string(width) + ", " + std::to_string(height);
      text += "  camera_model: pinhole\n  intrinsics: [9, 9, " + std::to_string(width / 2) + ", " +
              std::to_string(height / 2) +
              "]\n  distortion_model: none\n  distortion_coeffs: []\n  resolution: [" + size +
              "]\n";
    }
    folder_.write("small.yaml", text);
  }
};

/// A limit of the size of files stands for a full disk.
TEST_F(Output, FullDiskIsNoticed) {
  cv::imwrite(file("truth.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  const std::string full = "ulimit -f 1;";
  const Outcome map = run("evaluate " + file("truth.tiff") + " -c " + file("calib.yaml") +
                              " --truth " + file("truth.tiff") + " --valid " + file("left.png") +
                              " --error-map " + file("map.png"),
                          full);
  EXPECT_EQ(map.exit_code, 1) << map.output;
  EXPECT_FALSE(fs::exists(file("map.png")));
  for (const char* blocks : {"1", "20", "80", "400"}) {
    const Outcome outcome =
        run(depth_of("left.png", "right.png"), std::string("ulimit -f ") + blocks + ";");
    EXPECT_EQ(outcome.exit_code, blocks == std::string("400") ? 0 : 1) << blocks << outcome.output;
    EXPECT_EQ(fs::exists(file("out/result.json")), outcome.exit_code == 0) << blocks;
    if (outcome.exit_code == 0) continue;
    EXPECT_NE(outcome.output.find("File too large; make room"), std::string::npos)
        << outcome.output;
    EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
  }
}

TEST_F(Output, LostStandardOutputIsAnError) {
  for (const std::string& arguments :
       {"calibration show " + file("calib.yaml") + " --json",
        "calibration show " + file("calib.yaml"), std::string("--help")}) {
    const Outcome outcome = run(arguments + " > /dev/full 2> " + file("errors.txt") + "; exit $?");
    EXPECT_EQ(outcome.exit_code, 1) << arguments;
    const std::string errors = bytes_of("errors.txt");
    EXPECT_NE(errors.find("widestereo: Cannot write to standard output"), std::string::npos)
        << errors;
    EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 1) << errors;
  }
}

TEST_F(Output, GoesThroughLinksAndFifos) {
  const std::string convert = "calibration convert " + file("calib.yaml") + " ";
  fs::create_symlink("/proc/self/fd/1", folder_ / "stdout");  // as /dev/stdout, which is at stake
  Outcome outcome = run(convert + file("stdout") + " --to basalt");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_NE(outcome.output.find("\"value0\""), std::string::npos) << outcome.output;
  run(convert + "/dev/stdout --to basalt 2> /dev/null > " + file("piped.json") + "; true");
  EXPECT_TRUE(nlohmann::json::accept(bytes_of("piped.json"))) << bytes_of("piped.json");
  folder_.write("target.json", "old");
  fs::create_symlink("target.json", folder_ / "link.json");
  outcome = run(convert + file("link.json") + " --to basalt");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_TRUE(fs::is_symlink(folder_ / "link.json"));
  EXPECT_NE(bytes_of("target.json").find("\"value0\""), std::string::npos);
  ASSERT_EQ(mkfifo(file("fifo").c_str(), 0600), 0);
  const int reader = open(file("fifo").c_str(), O_RDONLY | O_NONBLOCK);
  outcome = run(convert + file("fifo") + " --to basalt");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  char first = 0;
  EXPECT_EQ(read(reader, &first, 1), 1);
  EXPECT_EQ(first, '{');
  close(reader);
}

TEST_F(Output, DoesNotReplaceTheCalibrationThatIsRead) {
  const std::string before = bytes_of("calib.yaml");
  fs::create_symlink("calib.yaml", folder_ / "link.yaml");
  const std::string images = file("left.png") + " " + file("right.png");
  for (const char* output : {"calib.yaml", "link.yaml"}) {
    const std::string error = file(output) + " is among the files that are read; choose another";
    expect_error("calibration convert " + file("calib.yaml") + " " + file(output), error);
    expect_error(
        "calibration refine " + images + " -c " + file("calib.yaml") + " -o " + file(output),
        error);
  }
  EXPECT_EQ(bytes_of("calib.yaml"), before);
  // Files that the one given names, and masks.
  fs::create_directories(folder_ / "euroc/cam0");
  folder_.write("euroc/cam0/sensor.yaml", euroc_sensor);
  const std::string sensor = file("euroc/cam0/sensor.yaml");
  expect_error("calibration convert " + file("euroc") + " " + sensor + " --to kalibr",
               sensor + " is among the files that are read;");
  EXPECT_EQ(bytes_of("euroc/cam0/sensor.yaml"), euroc_sensor);
  cv::imwrite(file("mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  expect_error("calibration refine " + images + " -c " + file("calib.yaml") + " --mask " +
                   file("mask.png") + " --to kalibr -o " + file("mask.png"),
               "mask.png is among the files that are read;");
}

TEST_F(Output, PicturesDoNotReplaceWhatIsRead) {
  cv::imwrite(file("distance.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2)));
  const std::string calibration = " -c " + file("calib.yaml");
  const auto expect_refused = [this](const std::string& arguments, const std::string& output) {
    const std::string before = bytes_of(output);
    expect_error(arguments + file(output), file(output) + " is among the files that are read;");
    EXPECT_TRUE(bytes_of(output) == before);
  };
  expect_refused("view-synthesis " + file("distance.tiff") + " " + file("left.png") + " " +
                     file("right.png") + calibration + " --picture ",
                 "right.png");
  cv::imwrite(file("mask.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  expect_refused("view-synthesis " + file("distance.tiff") + " " + file("left.png") + " " +
                     file("right.png") + calibration + " --mask " + file("mask.png") +
                     " --picture ",
                 "mask.png");
  folder_.write("poses.png", "0 0 0 0 0 0 0 1\n");
  expect_refused("view-synthesis " + file("distance.tiff") + " " + file("left.png") + " " +
                     file("right.png") + calibration + " --poses " + file("poses.png") +
                     " --picture ",
                 "poses.png");
  expect_error(
      "benchmark --devices cpu --sizes 64 -o " + file("b.svg") + " --plot " + file("./b.svg"),
      "--output and --plot both name");
  for (const char* output : {"distance.tiff", "left.png"}) {
    expect_refused("evaluate " + file("distance.tiff") + calibration + " --truth " +
                       file("distance.tiff") + " --image " + file("left.png") + " --error-map ",
                   output);
  }
}

TEST_F(Output, DistancePngsOfAnyScaleAreRead) {
  ASSERT_EQ(run(depth_of("left.png", "right.png") + "--formats tiff,png --png-scale 500").exit_code,
            0);
  const auto median = [this](const std::string& distance,
                             const std::string& truth = "out/distance0.tiff") {
    const Outcome outcome = run("evaluate " + file(distance) + " -c " + file("calib.yaml") +
                                " --json --truth " + file(truth));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    return json_of(outcome)["regions"][0]["median_relative"].get<double>();
  };
  EXPECT_LT(median("out/distance0.png --png-scale 500"), 0.01);
  EXPECT_LT(median("out/distance0.tiff --truth-png-scale 500", "out/distance0.png"), 0.01);
  // The record says the scale.
  EXPECT_EQ(nlohmann::json::parse(bytes_of("out/result.json"))["png_scale"], 500);
  EXPECT_LT(median("out/distance0.png"), 0.01);
  EXPECT_LT(median("out/distance0.tiff", "out/distance0.png"), 0.01);
  EXPECT_NEAR(median("out/distance0.png --png-scale 1000"), 0.5, 0.01) << "as given";
  fs::copy_file(file("out/distance0.png"), file("moved.png"));
  EXPECT_GT(median("out/distance0.tiff", "moved.png"), 0.3);
  EXPECT_NEAR(median("moved.png"), 0.5, 0.01);
  fs::copy_file(file("out/distance0.png"), file("out/other.png"));
  EXPECT_NEAR(median("out/other.png"), 0.5, 0.01) << "is not of the record";
  const auto synthesis = [this](const std::string& distance) {
    return run("view-synthesis " + file(distance) + " " + file("left.png") + " " +
               file("right.png") + " -c " + file("calib.yaml") + " --json")
        .output;
  };
  EXPECT_NE(synthesis("moved.png"), synthesis("moved.png --png-scale 500"));
  EXPECT_EQ(synthesis("out/distance0.png"), synthesis("moved.png --png-scale 500"));
}

TEST_F(Output, FilesOfOthersAreNotReplaced) {
  fs::create_directories(folder_ / "out");
  for (const char* name : {"out/cloud0.ply", "out/reasons1.png", "out/result.json"}) {
    folder_.write(name, "mine");
    const Outcome outcome = run(depth_of("left.png", "right.png"));
    EXPECT_EQ(outcome.exit_code, 1);
    EXPECT_NE(outcome.output.find("widestereo: " + file(name) +
                                  " is there already and is not of an earlier run; move it"),
              std::string::npos)
        << outcome.output;
    EXPECT_EQ(bytes_of(name), "mine");
    fs::remove(folder_ / name);
  }
  EXPECT_TRUE(files_in("out").empty());
}

TEST_F(Output, OfARunThatWasKilledAsItMovedTheFilesIsReplaced) {
  ASSERT_EQ(run(depth_of("left.png", "right.png")).exit_code, 0);
  const std::set<std::string> files = files_in("out");
  // Of the new result some files are there, and no record.
  fs::rename(folder_ / "out/result.json", folder_ / "out/.interrupted.json");
  fs::remove(folder_ / "out/distance0.tiff");
  fs::create_directories(folder_ / "out/.unfinished");
  folder_.write("out/.unfinished/result.json", "{}");
  const Outcome outcome = run(depth_of("left.png", "right.png"));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(files_in("out"), files);
}

#ifndef __SANITIZE_ADDRESS__  // which needs more memory than this to begin with
TEST_F(Output, LackOfMemoryIsNamed) {
  cv::imwrite(file("big.png"), cv::Mat(12000, 12000, CV_8UC1, cv::Scalar(0)));
  const std::string big = file("big.png") + " ";
  const std::string other = file(copy_of("big.png")) + " ";
  write_small_calibration(12000, 12000);
  const Outcome outcome =
      run("view-synthesis " + big + big + other + "-c " + file("small.yaml"), "ulimit -v 600000;");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_EQ(outcome.output, "widestereo: Not enough memory; use smaller images.\n");
}
#endif

TEST_F(Output, PicturesAreOfAnySize) {
  for (const cv::Size size : {cv::Size(8, 8), {9, 17}, {6, 64}, {64, 6}, {10, 10}}) {
    cv::Mat image(size, CV_8UC1);
    cv::randu(image, 0, 255);
    cv::imwrite(file("small.png"), image);
    write_small_calibration(size.width, size.height);
    fs::remove_all(folder_ / "out");
    const Outcome outcome = run(depth_of("small.png", copy_of("small.png"), "small.yaml"));
    EXPECT_EQ(outcome.exit_code, 0) << size << "\n" << outcome.output;
    EXPECT_TRUE(fs::exists(folder_ / "out/summary1.png")) << size;
  }
}

TEST_F(Output, PngsMustHoldTheFarthestDistance) {
  const std::string far = " --formats tiff,png --max-distance 66 ";
  const std::string said = "--png-scale 1000, but they reach to 66; give --png-scale 100";
  std::string depth = depth_of("left.png", "right.png");
  depth.erase(depth.find(" --max-distance"));
  expect_error(depth + far, said);
  expect_error("demo --size 64 --device cpu -o " + file("out") + far, said);
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / "frames" / camera);
    fs::copy_file(file("left.png"), folder_ / "frames" / camera / "0.png");
  }
  expect_error("sequence " + file("frames") + " -c " + file("calib.yaml") + " --device cpu -o " +
                   file("out") + far,
               said);
  EXPECT_EQ(run(depth + far + "--png-scale 100").exit_code, 0);
  fs::remove_all(folder_ / "out");
  EXPECT_EQ(run(depth + " --formats png --max-distance 65.535").exit_code, 0);
}

TEST_F(Output, PngsAreNotToBlameForARangeThatIsNone) {
  for (const char* command : {"demo --size 64 --device cpu -o ", "demo --size 64 --panorama -o "}) {
    expect_error(command + file("out") + " --formats png --min-distance -3 --max-distance -2",
                 "The distance range from -3");
  }
}

TEST_F(Output, PngsMustHoldTheNearestDistance) {
  const std::string depth = depth_of("left.png", "right.png") + "--formats png ";  // from 0.4 on
  expect_error(depth + "--png-scale 1",
               "from 0.5 on at --png-scale 1, but they begin at 0.4; give --png-scale 1000, say");
  std::string far = depth;
  far.replace(far.find("--max-distance 8"), 16, "--max-distance 66000");
  expect_error(far + "--png-scale 1", "reach to 66000; leave png out of --formats");
  EXPECT_EQ(run(depth + "--png-scale 2").exit_code, 0);
}

TEST_F(Output, NamesNeedNotBeUtf8) {
  fs::copy_file(file("left.png"), file("l\xe9"
                                       "ft.png"));
  fs::copy_file(file("calib.yaml"), file("calib\xe9.yaml"));
  const Outcome outcome = run(depth_of("l\xe9"
                                       "ft.png",
                                       "right.png", "calib\xe9.yaml") +
                              "--json");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  for (const std::string& text : {outcome.output, bytes_of("out/result.json")}) {
    const std::string image = nlohmann::json::parse(text)["input"]["images"][0];
    EXPECT_NE(image.find("l\xef\xbf\xbd"
                         "ft.png"),
              std::string::npos)
        << image;
  }
  EXPECT_EQ(run("calibration show --json " + file("calib\xe9.yaml")).exit_code, 0);
}

TEST_F(Output, PipelineCacheReplacesNothingElse) {
  if (run("devices").output.find("vulkan:0") == std::string::npos) {
    GTEST_SKIP() << "no Vulkan driver";
  }
  std::string depth = depth_of("left.png", "right.png");
  depth.replace(depth.find("--device cpu"), 12, "--device vulkan --pipeline-cache");
  const auto with_cache = [&](const std::string& cache) {
    std::string arguments = depth;
    return arguments.insert(arguments.find("--pipeline-cache") + 16, " " + cache);
  };
  folder_.write("notes.txt", "mine");
  expect_error(with_cache(file("notes.txt")), "notes.txt is there already");
  EXPECT_EQ(bytes_of("notes.txt"), "mine");
  fs::resize_file(folder_.write("sparse", ""), std::uintmax_t{1} << 31);
  expect_error(with_cache(file("sparse")), "sparse is there already");
  fs::create_symlink("/dev/full", folder_ / "endless");
  expect_error(with_cache(file("endless")), "endless is there already");
  EXPECT_EQ(run(with_cache(file("new.bin"))).exit_code, 0);
  EXPECT_EQ(run(with_cache(file("new.bin"))).exit_code, 0);
}

TEST_F(Output, NothingToScoreIsAnError) {
  cv::imwrite(file("truth.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  cv::imwrite(file("none.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(0.0)));
  cv::imwrite(file("valid.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(0)));
  const std::string evaluate = "evaluate " + file("truth.tiff") + " -c " + file("calib.yaml");
  expect_error(evaluate + " --truth " + file("truth.tiff") + " --valid " + file("valid.png"),
               "no pixel to score in " + file("truth.tiff"));
  expect_error(evaluate + " --json --truth " + file("none.tiff"), "no pixel to score");
  cv::imwrite(file("fov.png"), cv::Mat(96, 96, CV_8UC1, cv::Scalar(255)));
  EXPECT_EQ(run(evaluate + " --truth " + file("none.tiff") + " --far-distance 2 --field-of-view " +
                file("fov.png"))
                .exit_code,
            0)
      << "a sky alone";
  const std::string images =
      " " + file("left.png") + " " + file("right.png") + " -c " + file("calib.yaml");
  expect_error("view-synthesis " + file("none.tiff") + images, "no textured window to score");
}

TEST_F(Output, WhatASetLacksIsNamed) {
  const std::string evaluate =
      "evaluate " + file("map.tiff") + " --set " + folder_.path().string() + " --view 2";
  cv::imwrite(file("map.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  expect_error(evaluate, "has no depth2.tiff; give --truth");
  cv::imwrite(file("depth2.tiff"), cv::Mat(96, 96, CV_32FC1, cv::Scalar(2.0)));
  fs::rename(file("calib.yaml"), file("other.yaml"));
  expect_error(evaluate, "has no calib.yaml; give --calibration");
}

TEST_F(Output, ARecordThatIsAFolderIsNone) {
  fs::create_directories(file("out/result.json"));
  const Outcome outcome = run(depth_of("left.png", "right.png"));
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("widestereo: " + file("out/result.json") + " is there already"),
            std::string::npos)
      << outcome.output;
}

TEST_F(Output, EarlierResultsAreRemoved) {
  ASSERT_EQ(run(depth_of("left.png", "right.png") + "--formats tiff,pfm").exit_code, 0);
  const std::set<std::string> mine = {"cloud.ply", "distance0.txt", "distance7.png", "cloud2.ply"};
  for (const std::string& name : mine) folder_.write("out/" + name, "mine");
  fs::create_directories(folder_ / "out/.unfinished/of a killed run");
  ASSERT_EQ(run(depth_of("right.png", "left.png") + "--no-cloud --no-pictures").exit_code, 0);
  std::set<std::string> expected = mine;
  expected.insert("result.json");
  for (const char* view : {"0", "1"}) {
    for (const char* what : {"distance", "distance_accepted", "normals", "cost", "confidence"}) {
      expected.insert(std::string(what) + view + ".tiff");
    }
    expected.insert(std::string("reasons") + view + ".png");
  }
  EXPECT_EQ(files_in("out"), expected);
}

TEST_F(Output, TwoRunsNeedTwoFolders) {
  fs::create_directories(folder_ / "out");
  const int other = open((folder_ / "out").c_str(), O_RDONLY | O_DIRECTORY);
  ASSERT_EQ(flock(other, LOCK_EX | LOCK_NB), 0);
  folder_.write("out/.writing-1-0", "of the other run");
  expect_error(depth_of("left.png", "right.png"), "Another run is writing to");
  expect_error("demo --size 64 --device cpu -o " + file("out"), "Another run is writing to");
  EXPECT_EQ(files_in("out"), std::set<std::string>{".writing-1-0"});
  close(other);
}

TEST_F(Output, OnlyFilesThatARecordOfOursNamesAreRemoved) {
  fs::create_directories(folder_ / "out");
  folder_.write("out/result.json", R"({"program": "other", "views": [{"files": {"a": "a.txt"}}]})");
  for (const char* name : {"out/a.txt", "out/distance7.png", "b.txt"}) folder_.write(name, "mine");
  ASSERT_EQ(run(depth_of("left.png", "right.png")).exit_code, 1) << "a record of others";
  fs::remove(folder_ / "out/result.json");
  ASSERT_EQ(run(depth_of("left.png", "right.png")).exit_code, 0);
  EXPECT_EQ(bytes_of("out/a.txt"), "mine");
  EXPECT_EQ(bytes_of("out/distance7.png"), "mine");
  auto record = nlohmann::json::parse(bytes_of("out/result.json"));
  record["views"][0]["files"]["b.txt"] = "../b.txt";
  folder_.write("out/result.json", record.dump());
  ASSERT_EQ(run(depth_of("right.png", "left.png") + "--no-cloud").exit_code, 0);
  EXPECT_FALSE(fs::exists(folder_ / "out/cloud0.ply"));
  EXPECT_EQ(bytes_of("b.txt"), "mine");
}

TEST_F(Output, InterruptedRunsLeaveTheEarlierResult) {
  ASSERT_EQ(run(depth_of("left.png", "right.png")).exit_code, 0);
  const std::set<std::string> files = files_in("out");
  const std::string record = bytes_of("out/result.json");
  const Outcome outcome = run(depth_of("right.png", "left.png"), "ulimit -f 100;");
  EXPECT_EQ(outcome.exit_code, 1) << outcome.output;
  EXPECT_EQ(files_in("out"), files);
  EXPECT_TRUE(bytes_of("out/result.json") == record);
}

TEST_F(Output, DistancesMustFitSinglePrecision) {
  std::string depth = depth_of("left.png", "right.png");
  depth.erase(depth.find(" --min-distance"));
  for (const char* range :
       {"--min-distance 1e39 --max-distance 1e40", "--min-distance 1 --max-distance 2e9",
        "--min-distance 1e-7 --max-distance 1"}) {
    expect_error(depth + " " + range, "between 1e-06 and 1000000000.0 m");
  }
}

}  // namespace
}  // namespace widestereo::test
