// SPDX-License-Identifier: MIT
#include "widestereo/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "error_of.h"
#include "temporary_folder.h"

namespace widestereo::test {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

/// Files are only listed, so they may be empty.
class Sequences : public ::testing::Test {
 protected:
  void add(const std::string& path, const std::string& text = "") const {
    fs::create_directories((folder_ / path).parent_path());
    folder_.write(path, text);
  }
  std::string error(const std::vector<int>& cameras = {0, 1}) const {
    return error_of([&] { read_sequence(folder_.path(), cameras); });
  }
  std::vector<std::string> names(const std::vector<SequenceFrame>& frames) const {
    std::vector<std::string> names;
    for (const SequenceFrame& frame : frames) names.push_back(frame.name);
    return names;
  }
  TemporaryFolder folder_;
};

TEST_F(Sequences, FoldersAreMatchedByNameInNumericalOrder) {
  for (const char* name : {"10", "9", "100", "left"}) {
    add("cam0/" + std::string(name) + ".png");
    add("cam1/" + std::string(name) + ".jpg");
  }
  add("cam0/notes.txt");
  const auto frames = read_sequence(folder_.path(), {1, 0});
  EXPECT_EQ(names(frames), (std::vector<std::string>{"9", "10", "100", "left"}));
  EXPECT_EQ(frames[0].images[0], folder_ / "cam1/9.jpg");
  EXPECT_EQ(frames[0].images[1], folder_ / "cam0/9.png");
  EXPECT_FALSE(frames[0].nanoseconds.has_value());
}

TEST_F(Sequences, EurocListsAreMatchedByTime) {
  const std::string header = "#timestamp [ns],filename\r\n";
  add("mav0/cam0/data.csv", header + "1403636579763555584,a.png\r\n1403636579813555456,b.png\r\n");
  add("mav0/cam1/data.csv", header + "1403636579813555456, d.png\n1403636579763555584,c.png\n");
  const auto frames = read_sequence(folder_.path(), {0, 1});
  ASSERT_EQ(names(frames), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(frames[1].images[1], folder_ / "mav0/cam1/data/d.png");
  EXPECT_EQ(frames[1].nanoseconds, 1403636579813555456);
}

TEST_F(Sequences, EurocFoldersWithoutListsAreMatchedByName) {
  add("cam0/data/1403636579763555584.png");
  add("cam1/data/1403636579763555584.png");
  const auto frames = read_sequence(folder_.path(), {0, 1});
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].nanoseconds, 1403636579763555584);
}

TEST_F(Sequences, WhatIsMissingIsNamed) {
  EXPECT_THAT(error_of([&] { read_sequence(folder_ / "none", {0, 1}); }), HasSubstr("none"));
  add("cam0/0.png");
  add("cam0/1.png");
  EXPECT_THAT(error(), HasSubstr("cam1"));
  fs::create_directories(folder_ / "cam1");
  EXPECT_THAT(error(), HasSubstr("no images"));
  add("cam1/2.png");
  EXPECT_THAT(error(), HasSubstr("frame 0 has no image of cam1"));
  EXPECT_THAT(error_of([&] {
                read_sequence(folder_.path(), {0, 1}, true);
              }),
              HasSubstr("No frame"));
  add("cam1/1.png");
  EXPECT_EQ(names(read_sequence(folder_.path(), {0, 1}, true)), std::vector<std::string>{"1"});
  add("cam0/1.jpg");
  EXPECT_THAT(error({0}), HasSubstr("two images"));
  add("mav0/cam2/data.csv", "#\n12,\n");
  EXPECT_THAT(error({2}), HasSubstr("line 2"));
  add("mav0/cam2/data.csv", "");
  EXPECT_THAT(error({2}), HasSubstr("lists no images"));
}

class Trajectories : public Sequences {
 protected:
  std::string error_of_text(const std::string& text) const {
    folder_.write("poses.txt", text);
    return error_of([&] { read_trajectory(folder_ / "poses.txt"); });
  }
};

TEST_F(Trajectories, AreReadInOrderOfTime) {
  folder_.write("poses.txt",
                "# timestamp tx ty tz qx qy qz qw\n2.5 1 2 3 0 0 0.70710678 0.70710678\r\n"
                "\n 1.5 0 0 0 0 0 0 1\n");
  const auto poses = read_trajectory(folder_ / "poses.txt");
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].seconds, 1.5);
  const Eigen::Vector3d moved = poses[1].world_from_rig * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((moved - Eigen::Vector3d(1, 3, 3)).norm(), 1e-6) << "a quarter turn about z";
}

TEST_F(Trajectories, BrokenLinesAreNamed) {
  EXPECT_THAT(error_of([&] { read_trajectory(folder_ / "none.txt"); }), HasSubstr("none.txt"));
  EXPECT_THAT(error_of_text("# nothing\n"), HasSubstr("no poses"));
  EXPECT_THAT(error_of_text("#\n1 2 3 4 0 0 0\n"), HasSubstr("line 2 has 7 numbers"));
  EXPECT_THAT(error_of_text("1 2 3 4 0 0 0 1 5\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of_text("1 2 nan 4 0 0 0 1\n"), HasSubstr("finite"));
  EXPECT_THAT(error_of_text("1 2 3,4 4 0 0 0 1\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of_text("1 2 3 4 1 1 0 1\n"), HasSubstr("quaternion"));
}

TEST_F(Trajectories, BelongToFramesByTimeOrOrder) {
  std::vector<StampedPose> trajectory(3);
  for (int i = 0; i < 3; ++i) {
    trajectory[i].seconds = 10 + 0.1 * i;
    trajectory[i].world_from_rig.translation().x() = i;
  }
  std::vector<SequenceFrame> frames(3);
  EXPECT_EQ(poses_of_frames(frames, trajectory, 0.01, "p")[2].translation().x(), 2);
  frames.pop_back();
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, trajectory, 0.01, "p"); }),
              HasSubstr("3 poses for 2 frames"));
  frames[0].nanoseconds = 10'204'000'000;
  frames[1].nanoseconds = 10'098'000'000;
  const auto poses = poses_of_frames(frames, trajectory, 0.01, "p");
  EXPECT_EQ(poses[0].translation().x(), 2);
  EXPECT_EQ(poses[1].translation().x(), 1);
  frames[1].name = "late";
  frames[1].nanoseconds = 10'150'000'000;
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, trajectory, 0.01, "p"); }),
              HasSubstr("frame late"));
}

}  // namespace
}  // namespace widestereo::test
