// SPDX-License-Identifier: MIT
// Images that are matched smaller than they are.
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "command_fixture.h"
#include "same_bits.h"

namespace widestereo::test {
namespace {

class ImageSize : public Command {
 protected:
  /// An image of 96 x 96 pixels at half the size.
  void reduce(const std::string& from, const std::string& to) const {
    cv::Mat image = cv::imread(file(from), cv::IMREAD_UNCHANGED);
    cv::resize(image, image, {48, 48}, 0, 0, cv::INTER_AREA);
    cv::imwrite(file(to), image);
  }
  cv::Mat map(const std::string& name) const {
    return cv::imread(file(name), cv::IMREAD_UNCHANGED);
  }
};

/// calib.yaml for images of half the size.
std::string halved(std::string calibration) {
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = calibration.find(from, at)) != std::string::npos;) {
      calibration.replace(at, from.size(), to);
      at += to.size();
    }
  };
  std::ostringstream centre;
  centre << std::setprecision(17) << 0.5 * (47.9 + 0.5) - 0.5;
  replace("28.9, 28.9, 47.9, 48.0", "14.45, 14.45, " + centre.str() + ", 23.75");
  replace("[96, 96]", "[48, 48]");
  return calibration;
}

TEST_F(ImageSize, IsThatOfImagesReducedBefore) {
  folder_.write("small.yaml", halved(bytes_of("calib.yaml")));
  reduce("left.png", "small_left.png");
  reduce("right.png", "small_right.png");
  const Outcome small = run(depth_of("small_left.png", "small_right.png", "small.yaml"));
  ASSERT_EQ(small.exit_code, 0) << small.output;
  const cv::Mat expected = map("out/distance0.tiff").clone();
  ASSERT_GT(cv::countNonZero(expected), 1000);
  const Outcome reduced = run(depth_of("left.png", "right.png") + "--max-image-size 48");
  ASSERT_EQ(reduced.exit_code, 0) << reduced.output;
  const cv::Mat distance = map("out/distance0.tiff");
  ASSERT_EQ(distance.size(), cv::Size(48, 48));
  EXPECT_TRUE(same_bits(distance, expected));
  const nlohmann::json view = nlohmann::json::parse(bytes_of("out/result.json"))["views"][1];
  EXPECT_EQ(view["width"], 48);
  EXPECT_EQ(view["intrinsics"]["fx"], 14.45);
  EXPECT_EQ(view["intrinsics"]["xi"], -0.165);
  EXPECT_FALSE(view["intrinsics"].contains("k1"));
  EXPECT_EQ(view["world_from_camera"][3], 0.1);

  const std::string synthesis = "view-synthesis " + file("out/distance0.tiff") + " " +
                                file("left.png") + " " + file("right.png") + " -c " +
                                file("calib.yaml");
  const Outcome scored = run(synthesis + " --max-image-size 48");
  EXPECT_EQ(scored.exit_code, 0) << scored.output;
  const Outcome unlike = run(synthesis);
  EXPECT_EQ(unlike.exit_code, 1);
  EXPECT_NE(unlike.output.find("is 48x48 pixels"), std::string::npos) << unlike.output;
  EXPECT_NE(unlike.output.find("give the --max-image-size"), std::string::npos) << unlike.output;
}

TEST_F(ImageSize, OfSmallerImagesStays) {
  reduce("left.png", "small_left.png");
  expect_error(depth_of("small_left.png", "right.png") + "--max-image-size 48",
               "small_left.png is 48x48 pixels, but the calibration of cam0 is for 96x96");
  ASSERT_EQ(run(depth_of("left.png", "right.png")).exit_code, 0);
  const std::string before = bytes_of("out/distance0.tiff");
  ASSERT_EQ(run(depth_of("left.png", "right.png") + "--max-image-size 96").exit_code, 0);
  EXPECT_TRUE(bytes_of("out/distance0.tiff") == before);
}

TEST_F(ImageSize, HoldsForMasksToo) {
  cv::Mat mask(96, 96, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(30, 40, 9, 20)).setTo(0);
  cv::imwrite(file("mask.png"), mask);
  ASSERT_EQ(
      run(depth_of("left.png", "right.png") + "--max-image-size 48 --mask " + file("mask.png"))
          .exit_code,
      0);
  const cv::Mat no_ray = map("out/reasons0.png") & 1;
  EXPECT_EQ(cv::countNonZero(no_ray(cv::Rect(15, 20, 5, 10))), 50);
  EXPECT_EQ(no_ray.at<ushort>(25, 14), 0);
  EXPECT_EQ(no_ray.at<ushort>(25, 20), 0);
}

TEST_F(ImageSize, HoldsForSequencesAndScenes) {
  for (const char* camera : {"cam0", "cam1"}) {
    fs::create_directories(folder_ / "data" / camera);
    for (const char* frame : {"1.png", "2.png"}) {
      fs::copy_file(file(camera == std::string("cam0") ? "left.png" : "right.png"),
                    folder_ / "data" / camera / frame);
    }
  }
  const std::string sequence =
      "sequence " + file("data") + " -c " + file("calib.yaml") + " -o " + file("frames") + quick;
  Outcome outcome = run(sequence + "--no-motion --max-image-size 48");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(map("frames/2/distance1.tiff").size(), cv::Size(48, 48));
  outcome = run(sequence + "--no-motion --max-image-size 40");
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_NE(outcome.output.find("made with other settings"), std::string::npos) << outcome.output;

  folder_.write("poses.txt", "1 0 0 0 0 0 0 1\n2 0 0.05 0 0 0 0 1\n");
  outcome =
      run("reconstruct " + file("data") + " -c " + file("calib.yaml") + " -o " + file("scene") +
          quick + "--min-views 1 --max-image-size 48 --poses " + file("poses.txt"));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(map("scene/2/cam1/distance0.tiff").size(), cv::Size(48, 48));
  EXPECT_TRUE(fs::exists(folder_ / "scene/cloud.ply"));
}

}  // namespace
}  // namespace widestereo::test
