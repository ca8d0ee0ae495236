// SPDX-License-Identifier: MIT
// Runs the command as a user does.
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <utility>

#include "bytes_of.h"
#include "data_folder.h"
#include "temporary_folder.h"

namespace widestereo::test {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code = -1;
  std::string output;  ///< standard output and error
};

/// What was printed as JSON, after sentences on standard error.
inline nlohmann::json json_of(const Outcome& outcome) {
  std::size_t begin = 0;
  while (begin < outcome.output.size() && outcome.output[begin] != '{' &&
         outcome.output[begin] != '[') {
    begin = std::min(outcome.output.find('\n', begin), outcome.output.size() - 1) + 1;
  }
  return nlohmann::json::parse(outcome.output.substr(begin));
}

/// A text as a word of the shell, or part of one.
inline std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

/// Arguments have paths as they are: what they have of folders that tests do not name, which may
/// have spaces, is quoted here.
inline std::string with_quoted_folders(const std::string& arguments) {
  // Either may be within the other one.
  std::array folders = {fs::temp_directory_path().string(), data_folder().string()};
  if (folders[0].size() < folders[1].size()) std::swap(folders[0], folders[1]);
  std::string words;
  for (std::size_t at = 0; at < arguments.size();) {
    const auto folder = std::find_if(folders.begin(), folders.end(), [&](const std::string& path) {
      return !path.empty() && arguments.compare(at, path.size(), path) == 0;
    });
    if (folder == folders.end()) {
      words += arguments[at++];
    } else {
      words += shell_word(*folder);
      at += folder->size();
    }
  }
  return words;
}

/// A program with its arguments, but for folders that they name.
inline Outcome run_program(const std::string& program, const std::string& arguments,
                           const std::string& environment = "") {
  // Leaks of drivers are not the command's.
  const std::string command = environment + " ASAN_OPTIONS=detect_leaks=0 " + program + " " +
                              with_quoted_folders(arguments) + " 2>&1 < /dev/null";
  Outcome outcome;
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer{};
  std::size_t count = 0;
  while ((count = fread(buffer.data(), 1, buffer.size(), pipe)) > 0) {
    outcome.output.append(buffer.data(), count);
  }
  const int status = pclose(pipe);
  if (WIFEXITED(status)) outcome.exit_code = WEXITSTATUS(status);
  return outcome;
}

inline Outcome run(const std::string& arguments, const std::string& environment = "") {
  return run_program(shell_word(WIDESTEREO_COMMAND), arguments, environment);
}

/// A rendered pair with its calibration, and options that make matching quick.
class Command : public ::testing::Test {
 protected:
  static constexpr const char* quick =
      " --preset paper --device cpu --iterations 2 --second-iterations 1 --window-radius 2"
      " --min-distance 0.4 --max-distance 8 ";
  /// Of each camera, as a Kalibr camchain has it.
  static constexpr const char* lens = R"(  camera_model: ds
  intrinsics: [-0.165, 0.59, 28.9, 28.9, 47.9, 48.0]
  distortion_model: none
  distortion_coeffs: []
  resolution: [96, 96]
)";

  void SetUp() override {
    const std::string calibration = "cam0:\n" + std::string(lens) + "  max_theta_deg: 97.5\n" +
                                    R"(cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.1]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
)" + lens;
    folder_.write("calib.yaml", calibration);
    cv::Mat noise(96, 96, CV_8UC3);
    cv::theRNG().state = 3;
    cv::randu(noise, 0, 255);
    cv::imwrite(file("left.png"), noise);
    cv::imwrite(file("right.png"), noise);
    alter("right.png", 60);
  }

  /// Writes mono.yaml: the first camera of calib.yaml alone.
  void write_first_camera() {
    const std::string text = bytes_of("calib.yaml");
    folder_.write("mono.yaml", text.substr(0, text.find("cam1:")));
  }

  /// Writes imucam.yaml: calib.yaml with an IMU at (0.05, -0.04, -0.07) m in the frame of cam0,
  /// turned by 120 degrees.
  void write_calibration_with_imu() {
    std::string text = bytes_of("calib.yaml");
    text.insert(text.find("  camera_model"), R"(  T_cam_imu:
  - [0.0, 0.0, 1.0, 0.05]
  - [1.0, 0.0, 0.0, -0.04]
  - [0.0, 1.0, 0.0, -0.07]
  - [0.0, 0.0, 0.0, 1.0]
)");
    folder_.write("imucam.yaml", text);
  }

  /// Writes backwards.yaml: calib.yaml with narrow lenses and a cam2 that looks the other way.
  void write_calibration_looking_backwards() {
    const std::string narrow = "  max_theta_deg: 40\n";
    const std::string wide = "  max_theta_deg: 97.5\n";
    std::string text = bytes_of("calib.yaml") + narrow;
    text.replace(text.find(wide), wide.size(), narrow);
    text += R"(cam2:
  T_cn_cnm1: [[-1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]
)" + (lens + narrow);
    folder_.write("backwards.yaml", text);
  }

  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  /// Of a file in the folder, or of any by its whole path.
  std::string bytes_of(const std::string& name) const { return test::bytes_of(folder_ / name); }
  /// Changes one byte of an image, on its diagonal: no two cameras give the same picture.
  void alter(const std::string& image, int place) const {
    cv::Mat pixels = cv::imread(file(image), cv::IMREAD_UNCHANGED);
    pixels.ptr(place)[place] ^= 64;
    cv::imwrite(file(image), pixels);
  }
  /// The name of another file with the same picture but for a byte.
  std::string copy_of(const std::string& name) const {
    const std::string copy = "copy_of_" + name;
    fs::copy_file(folder_ / name, folder_ / copy, fs::copy_options::overwrite_existing);
    alter(copy, 4);
    return copy;
  }
  std::string depth_of(const std::string& left, const std::string& right,
                       const std::string& calibration = "calib.yaml") const {
    return "depth " + file(left) + " " + file(right) + " -c " + file(calibration) + " -o " +
           file("out") + quick;
  }
  /// Fails, with a message that has `part`, exit code 1 and no map written.
  void expect_error(const std::string& arguments, const std::string& part) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 1) << arguments << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find(part), std::string::npos) << arguments << "\n" << outcome.output;
    EXPECT_NE(outcome.output.find("widestereo: "), std::string::npos) << outcome.output;
    EXPECT_EQ(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 1) << outcome.output;
    EXPECT_FALSE(fs::exists(folder_ / "out/result.json"));
    EXPECT_FALSE(fs::exists(folder_ / "out/distance0.tiff"));
  }

  TemporaryFolder folder_;
};

}  // namespace widestereo::test
