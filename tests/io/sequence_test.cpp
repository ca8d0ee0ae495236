// SPDX-License-Identifier: MIT
#include "widestereo/sequence.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <iomanip>
#include <opencv2/core.hpp>
#include <sstream>
#include <thread>

#include "comma_locale.h"
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
  /// Of those that all cameras have.
  std::vector<std::string> names(const std::vector<SequenceFrame>& frames) const {
    std::vector<std::string> names;
    for (const SequenceFrame& frame : frames) {
      if (is_complete(frame)) names.push_back(frame.name);
    }
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

TEST_F(Sequences, NumbersWithinNamesCountAsNumbers) {
  for (const char* name : {"left_1", "left_10", "left_2", "left_02", "left_9b", "left", "Right_3",
                           "a2b10", "a2b9", "a10b1", "a99999999999999999999999"}) {
    add("cam0/" + std::string(name) + ".png");
    add("cam1/" + std::string(name) + ".png");
  }
  const auto frames = read_sequence(folder_.path(), {0, 1});
  EXPECT_EQ(names(frames), (std::vector<std::string>{"Right_3", "a2b9", "a2b10", "a10b1",
                                                     "a99999999999999999999999", "left", "left_1",
                                                     "left_02", "left_2", "left_9b", "left_10"}));
  EXPECT_EQ(frames[10].images[1], folder_ / "cam1/left_10.png");
}

TEST_F(Sequences, TimesInNamesMayHaveFractionsOfAnyLength) {
  for (const char* name : {"b-1305031102.5", "a-1305031103", "b-1305031102.25"}) {
    add("cam0/" + std::string(name) + ".png");
  }
  EXPECT_EQ(names(read_sequence(folder_.path(), {0})),
            (std::vector<std::string>{"b-1305031102.25", "b-1305031102.5", "a-1305031103"}));
}

TEST_F(Sequences, EurocListsAreMatchedByTime) {
  const std::string header = "#timestamp [ns],filename\r\n";
  add("mav0/cam0/data.csv", header + "1403636579763555584,a.png\r\n1403636579813555456,b.png\r\n");
  add("mav0/cam1/data.csv", header + "1403636579813555456, d.png\n1403636579763555584,c.png\n");
  for (const char* image :
       {"cam0/data/a.png", "cam0/data/b.png", "cam1/data/c.png", "cam1/data/d.png"}) {
    add("mav0/" + std::string(image));
  }
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

TEST_F(Sequences, FoldersOfCamerasMayHaveAnyNames) {
  add("left/images/7.png");
  add("right/data/7.png");
  add("image_03/data_rgb/7.png");
  const auto frames =
      read_sequence({folder_ / "image_03/data_rgb", folder_ / "left/images", folder_ / "right"});
  ASSERT_EQ(names(frames), std::vector<std::string>{"7"});
  EXPECT_EQ(frames[0].images,
            (std::vector<fs::path>{folder_ / "image_03/data_rgb/7.png",
                                   folder_ / "left/images/7.png", folder_ / "right/data/7.png"}));
  EXPECT_THAT(error_of([&] {
                read_sequence({folder_ / "left/images", folder_ / "up"});
              }),
              HasSubstr("up"));
  EXPECT_THAT(error(), HasSubstr("name the folders"));
  EXPECT_THAT(error({}), HasSubstr("at least one"));
}

TEST_F(Sequences, ListsAreInNanosecondsHoweverFewDigitsTheyHave) {
  add("mav0/cam0/data.csv", "50000000,a.png\n");
  add("mav0/cam0/data/a.png");
  const auto frames = read_sequence(folder_.path(), {0});
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].nanoseconds, 50000000);
}

TEST(TimeInName, IsInTheUnitOfItsDigits) {
  EXPECT_EQ(time_in_name("1403636579763555584"), 1403636579763555584);
  EXPECT_EQ(time_in_name("mono_left_1342626147554042"), 1342626147554042000) << "V-Charge";
  EXPECT_EQ(time_in_name("1418381798086398"), 1418381798086398000) << "RobotCar";
  EXPECT_EQ(time_in_name("1418381798086"), 1418381798086000000);
  EXPECT_EQ(time_in_name("1305031102.175304"), 1305031102175304000) << "TUM RGB-D";
  EXPECT_EQ(time_in_name("rgb-1305031102.1753041234"), 1305031102175304123);
  EXPECT_EQ(time_in_name("1305031102"), 1305031102000000000);
  EXPECT_EQ(time_in_name("left.1403636579763555584"), 1403636579763555584);
  EXPECT_EQ(time_in_name("left.1305031102.25"), 1305031102250000000);
}

TEST(TimeInName, IsNoOtherNumber) {
  for (const char* name :
       {"", "left", "7", "0000000010", "0000000000000000010", "20261121225338",
        "12345678901234567890", "1305031102_left", "9999999999999999999", ".5"}) {
    EXPECT_EQ(time_in_name(name), std::nullopt) << name;
  }
}

TEST(TimeInName, IsInSecondsOfAnyClockWhereAskedFor) {
  EXPECT_EQ(time_in_name("7.25", true), 7'250'000'000);
  EXPECT_EQ(time_in_name("left_100.000000001", true), 100'000'000'001);
  EXPECT_EQ(time_in_name("0.5", true), 500'000'000);
  EXPECT_EQ(time_in_name("1305031102.25", true), 1305031102250000000);
  for (const char* name : {"7", "left", "7.", ".5", "7.5_left"}) {
    EXPECT_EQ(time_in_name(name, true), std::nullopt) << name;
  }
}

TEST(EndInSeconds, HoldsForDecimalsAlone) {
  EXPECT_TRUE(end_in_seconds({"7.5", "7.25", "8.0"}));
  EXPECT_TRUE(end_in_seconds({"left_100.000000000", "left_100.100000000"}));
  EXPECT_FALSE(end_in_seconds({"1.8", "1.9", "1.10"})) << "parts of a series";
  EXPECT_FALSE(end_in_seconds({"7.5", "8"}));
  EXPECT_FALSE(end_in_seconds({"7.5"}));
  EXPECT_FALSE(end_in_seconds({"1305031102.25", "1305031102.5"})) << "says so by itself";
}

TEST_F(Sequences, TimesOfClocksThatStartAtZeroHaveFractions) {
  for (const char* name : {"7.0", "7.25", "7.5", "7.75", "8.0"}) {
    add("cam0/" + std::string(name) + ".png");
    add("cam1/right_" + std::string(name) + ".png");
  }
  for (const double tolerance : {0.0, 0.01}) {
    const auto frames = read_sequence(folder_.path(), {0, 1}, false, tolerance);
    EXPECT_EQ(names(frames), (std::vector<std::string>{"7.0", "7.25", "7.5", "7.75", "8.0"}));
    EXPECT_EQ(frames[1].nanoseconds, 7'250'000'000);
    EXPECT_EQ(frames[1].images[1], folder_ / "cam1/right_7.25.png");
  }
}

TEST_F(Sequences, StraysAmongTimesAreLeftOut) {
  for (const char* name : {"7.25", "7.5", "preview"}) add("cam0/" + std::string(name) + ".png");
  for (const char* name : {"7.25", "7.5"}) add("cam1/" + std::string(name) + ".png");
  const auto frames = read_sequence(folder_.path(), {0, 1}, true);
  EXPECT_EQ(names(frames), (std::vector<std::string>{"7.25", "7.5"}));
}

TEST_F(Sequences, WhatIsMissingIsNamed) {
  EXPECT_THAT(error_of([&] { read_sequence(folder_ / "none", {0, 1}); }), HasSubstr("none"));
  add("cam0/0.png");
  add("cam0/1.png");
  EXPECT_THAT(error(), HasSubstr("cam1"));
  fs::create_directories(folder_ / "cam1");
  EXPECT_THAT(error(), HasSubstr("no images"));
  add("cam1/2.png");
  EXPECT_THAT(error(), HasSubstr("No frame has images of all cameras"));
  EXPECT_THAT(error_of([&] {
                read_sequence(folder_.path(), {0, 1}, true);
              }),
              HasSubstr("No frame has images of all cameras"));
  add("cam1/1.png");
  EXPECT_THAT(error(), HasSubstr("frame 0 has no image in " + (folder_ / "cam1").string()));
  EXPECT_EQ(names(read_sequence(folder_.path(), {0, 1}, true)), std::vector<std::string>{"1"});
  add("cam0/1.jpg");
  EXPECT_THAT(error({0}), HasSubstr("two images"));
  add("mav0/cam2/data.csv", "#\n12,\n");
  EXPECT_THAT(error({2}), HasSubstr("line 2"));
  add("mav0/cam2/data.csv", "");
  EXPECT_THAT(error({2}), HasSubstr("lists no images"));
}

/// Names that say the camera, too.
TEST_F(Sequences, NumbersInNamesTellFramesWhereNamesDiffer) {
  for (const char* number : {"08", "09", "10"}) {
    add("cam0/left2_" + std::string(number) + "_a.png");
    add("cam1/cam1-" + std::string(number) + ".jpg");
  }
  const auto frames = read_sequence(folder_.path(), {0, 1});
  EXPECT_EQ(names(frames), (std::vector<std::string>{"left2_08_a", "left2_09_a", "left2_10_a"}));
  EXPECT_EQ(frames[2].images[1], folder_ / "cam1/cam1-10.jpg");
  add("cam1/cam1-11.jpg");
  EXPECT_THAT(error(), HasSubstr("The frame 11 has no image in " + (folder_ / "cam0").string()));
  add("cam1/other.jpg");
  EXPECT_THAT(error(), HasSubstr("must have equal names, or numbers in them, or equal times."));
  add("cam2/view5_10.png");
  EXPECT_EQ(names(read_sequence(folder_.path(), {0, 2}, true)),
            std::vector<std::string>{"left2_10_a"});
  for (const char* second : {"1500000000", "1500000001"}) {
    add("cam3/left_" + std::string(second) + ".25.png");
    add("cam4/right_" + std::string(second) + ".25.png");
  }
  EXPECT_EQ(read_sequence(folder_.path(), {3, 4})[1].nanoseconds, 1'500'000'001'250'000'000);
}

TEST_F(Sequences, NumbersAreEqualHoweverManyZerosTheyBeginWith) {
  for (const char* number : {"0", "8", "9", "10"}) add("cam0/left_" + std::string(number) + ".png");
  for (const char* number : {"00", "08", "09", "10"}) {
    add("cam1/right_" + std::string(number) + ".png");
  }
  const auto frames = read_sequence(folder_.path(), {0, 1});
  EXPECT_EQ(names(frames), (std::vector<std::string>{"left_0", "left_8", "left_9", "left_10"}));
  EXPECT_EQ(frames[1].images[1], folder_ / "cam1/right_08.png");
  // Of one camera they are two.
  for (const char* number : {"7", "07"}) {
    add("cam2/left_" + std::string(number) + ".png");
    add("cam3/right_" + std::string(number) + ".png");
  }
  EXPECT_EQ(read_sequence(folder_.path(), {2, 3}).size(), 2u);
}

/// As of two drivers that do not know of each other.
TEST_F(Sequences, ImagesNearInTimeMakeAFrameIfAskedFor) {
  add("mav0/cam0/data.csv", "1000000,a.png\n2000000,b.png\n3000000,c.png\n");
  add("mav0/cam1/data.csv", "1001500,x.png\n2001500,y.png\n2999000,z.png\n2998000,early.png\n");
  for (const char* image : {"cam0/data/a", "cam0/data/b", "cam0/data/c", "cam1/data/x",
                            "cam1/data/y", "cam1/data/z", "cam1/data/early"}) {
    add("mav0/" + std::string(image) + ".png");
  }
  EXPECT_THAT(error(),
              HasSubstr("(they are 1e-06 s apart or more: a time tolerance allows that)."));
  const auto read = [&](double tolerance, bool skip) {
    return read_sequence(folder_.path(), {0, 1}, skip, tolerance);
  };
  EXPECT_THAT(error_of([&] { read(2e-6, false); }), HasSubstr("The frame 2998000 has no image in"));
  const auto frames = read(2e-6, true);
  EXPECT_EQ(names(frames), (std::vector<std::string>{"a", "b", "c"}));
  for (const double tolerance : {2e-6, 3e-6}) {  // of z alone, and of early, too
    std::vector<std::string> of_second;
    for (const SequenceFrame& frame : read(tolerance, true)) {
      if (is_complete(frame)) of_second.push_back(frame.images[1].stem().string());
    }
    EXPECT_EQ(of_second, (std::vector<std::string>{"x", "y", "z"})) << "the nearest of each";
  }
  EXPECT_EQ(frames[0].nanoseconds, 1'000'000);
  EXPECT_EQ(names(read(1.2e-6, true)), std::vector<std::string>{"c"});
}

TEST_F(Sequences, ListedFilesThatAreMissingMakeFramesIncomplete) {
  add("mav0/cam0/data.csv", "100,a.png\n200,b.png\n300,c.png\n");
  add("mav0/cam1/data.csv", "100,a.png\n200,b.png\n300,c.png\n");
  for (const char* image : {"cam0/data/a.png", "cam0/data/b.png", "cam1/data/b.png"}) {
    add("mav0/" + std::string(image));
  }
  EXPECT_EQ(names(read_sequence(folder_.path(), {0, 1}, true)), std::vector<std::string>{"b"});
  // Before hours of matching, not after them.
  EXPECT_THAT(error(), HasSubstr("The frame 300 has no image " +
                                 (folder_ / "mav0/cam0/data/c.png").string()));
}

TEST_F(Sequences, IncompleteFramesKeepTheirPlaceAmongTheOthers) {
  for (const char* image : {"cam0/0.png", "cam1/0.png", "cam1/1.png", "cam0/2.png", "cam1/2.png"}) {
    add(image);
  }
  const auto frames = read_sequence(folder_.path(), {0, 1}, true);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(names(frames), (std::vector<std::string>{"0", "2"}));
  EXPECT_EQ(frames[1].name, "1");
  EXPECT_EQ(frames[1].images, (std::vector<fs::path>{"", folder_ / "cam1/1.png"}));
}

TEST_F(Sequences, StraysAreNoFramesWhereFramesHaveTimes) {
  for (const char* time : {"1403715273262142976", "1403715273312143104"}) {
    for (const char* camera : {"cam0/", "cam1/"}) add(camera + std::string(time) + ".png");
  }
  add("cam0/1403715273362142976.png");
  add("cam1/thumbnail.png");
  const auto frames = read_sequence(folder_.path(), {0, 1}, true);
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(names(frames).size(), 2u);
  for (const SequenceFrame& frame : frames) EXPECT_TRUE(frame.nanoseconds) << frame.name;
}

TEST_F(Sequences, EachCameraHasAFolderOfItsOwn) {
  add("cam0/1.png");
  fs::create_directory_symlink("cam0", folder_ / "cam1");
  EXPECT_THAT(error(), HasSubstr("in the same folder, " + (folder_ / "cam0").string()));
  EXPECT_THAT(error({0, 0}), HasSubstr("the same folder"));
  EXPECT_THAT(error_of([&] {
                read_sequence({folder_ / "cam0", folder_ / "cam0/"});
              }),
              HasSubstr("give each camera its own"));
}

/// So many that the last entry, in any order, is hardly the image.
TEST_F(Sequences, LinksToNothingAreNoImages) {
  add("cam0/1.png");
  for (int i = 0; i < 50; ++i) {
    const std::string number = std::to_string(i);
    fs::create_symlink("nothing", folder_ / ("cam0/" + number + (i % 2 == 0 ? "x.png" : ".txt")));
  }
  EXPECT_EQ(error({0}), "");
  EXPECT_EQ(names(read_sequence(folder_.path(), {0})), std::vector<std::string>{"1"});
}

TEST_F(Sequences, FilesOfAttributesAreNoImages) {
  add("cam0/1.png");
  add("cam0/._1.png", "attributes of macOS");
  EXPECT_EQ(names(read_sequence(folder_.path(), {0})), std::vector<std::string>{"1"});
}

TEST_F(Sequences, ListsMayBeginWithAByteOrderMark) {
  add("mav0/cam0/data.csv",
      "\xef\xbb\xbf"
      "100,a.png\n");
  add("mav0/cam0/data/a.png");
  EXPECT_EQ(names(read_sequence(folder_.path(), {0})), std::vector<std::string>{"a"});
}

TEST_F(Sequences, FramesOfOneNameAreRefused) {
  for (const char* image : {"000001.png", "a/1.png", "b/1.png"}) {
    add("mav0/cam0/data/" + std::string(image));
  }
  add("mav0/cam0/data.csv", "200,000001.png\n300,000001.png\n");
  EXPECT_THAT(error({0}), HasSubstr("Two frames have the name 000001, those of "));
  add("mav0/cam0/data.csv", "1000,a/1.png\n2000,b/1.png\n");
  EXPECT_THAT(error({0}), HasSubstr("mav0/cam0/data/b/1.png; give the images names that differ"));
  add("mav0/cam0/data.csv", "#\n1000,a.png\n1000,b.png\n");
  EXPECT_THAT(error({0}), HasSubstr("data.csv has the time 1000 in line 2 and in line 3"));
  for (const char* name : {"..png", "...png"}) {
    add("cam1/" + std::string(name));
    EXPECT_THAT(error({1}), HasSubstr(std::string("cam1/") + name + " gives its frame no usable"));
    fs::remove(folder_ / "cam1" / name);
  }
}

TEST_F(Sequences, ListsThatCannotBeReadOnAreNoShorterOnes) {
  add("mav0/cam0/data/a.png");
  fs::create_symlink("/proc/self/mem", folder_ / "mav0/cam0/data.csv");  // an I/O error
  EXPECT_THAT(error({0}), HasSubstr("Cannot read " + folder_.path().string()));
  EXPECT_THAT(error({0}), HasSubstr("data.csv: Input/output error; check the path and perm"));
}

TEST_F(Sequences, UnreadableFoldersAreNamed) {
  if (geteuid() == 0) GTEST_SKIP() << "permissions do not hold for root";
  add("mav0/cam0/data/1.png");
  fs::permissions(folder_ / "mav0/cam0", fs::perms::none);
  const std::string message = error({0});
  fs::permissions(folder_ / "mav0/cam0", fs::perms::owner_all);
  EXPECT_THAT(message, HasSubstr("mav0/cam0/data.csv: Permission denied; check the permissions"));
  fs::permissions(folder_ / "mav0/cam0/data", fs::perms::none);
  EXPECT_THAT(error({0}), HasSubstr("Cannot read the folder"));
  fs::permissions(folder_ / "mav0/cam0/data", fs::perms::owner_all);
}

class Trajectories : public Sequences {
 protected:
  std::string error_of_text(const std::string& text) const {
    folder_.write("poses.txt", text);
    return error_of([&] { read_trajectory(folder_ / "poses.txt"); });
  }
};

TEST_F(Trajectories, AreReadInTheirOrder) {
  folder_.write("poses.txt",
                "# timestamp tx ty tz qx qy qz qw\n2.5 1 2 3 0 0 0.70710678 0.70710678\r\n"
                "\n 1.5 0 0 0 0 0 0 1\n");
  const auto [poses, body] = read_trajectory(folder_ / "poses.txt");
  EXPECT_EQ(body, Body::camera);
  ASSERT_EQ(poses.size(), 2u);
  EXPECT_EQ(poses[0].seconds, 2.5);
  EXPECT_EQ(poses[1].seconds, 1.5);
  const Eigen::Vector3d moved = poses[0].world_from_body * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((moved - Eigen::Vector3d(1, 3, 3)).norm(), 1e-6) << "a quarter turn about z";
}

TEST_F(Trajectories, RotationsStayRotationsHoweverFewDigitsTheyHave) {
  folder_.write("poses.txt", "1.5 0 0 0 0 0 0.71 0.71\n");
  const Eigen::Isometry3d pose = read_trajectory(folder_ / "poses.txt").poses[0].world_from_body;
  EXPECT_NEAR((pose * Eigen::Vector3d(0, 0, 1)).norm(), 1, 1e-12);
  EXPECT_NEAR((pose * Eigen::Vector3d(1, 0, 0)).norm(), 1, 1e-12);
}

TEST_F(Trajectories, MayBeginWithAByteOrderMark) {
  const std::string line = "2.5 1 2 3 0 0 0 1\n";
  for (const std::string& text : {line, "# timestamp tx ty tz qx qy qz qw\n" + line}) {
    folder_.write("poses.txt", "\xef\xbb\xbf" + text);
    ASSERT_EQ(read_trajectory(folder_ / "poses.txt").poses.size(), 1u);
    EXPECT_EQ(read_trajectory(folder_ / "poses.txt").poses[0].seconds, 2.5);
  }
}

/// The ground truth of EuRoC and of TUM VI: columns of velocities and biases, or none.
TEST_F(Trajectories, GroundTruthOfTheImuGivesPosesOfTheCamera) {
  const Eigen::Isometry3d camera_from_imu =
      Eigen::Translation3d(0.05, -0.047, -0.068) *
      Eigen::AngleAxisd(1.7, Eigen::Vector3d(1, -2, 0.5).normalized());
  std::ostringstream tum, euroc, tumvi;
  for (std::ostringstream* text : {&tum, &euroc, &tumvi}) *text << std::setprecision(17);
  euroc << "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], q_RS_y [], "
           "q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1]\n";
  tumvi << "#timestamp [ns], p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w [], q_RS_x [], "
           "q_RS_y [], q_RS_z []\r\n";
  for (int k = 0; k < 4; ++k) {
    const Eigen::Isometry3d camera = Eigen::Translation3d(k - 1.5, 0.3 * k * k, 2 - 0.7 * k) *
                                     Eigen::AngleAxisd(0.9 * k, Eigen::Vector3d(0.6, 0, -0.8));
    const auto time = std::to_string(1403636579 + k) + ".763555584";
    const auto nanoseconds = std::to_string(1403636579 + k) + "763555584";
    const auto append = [](std::ostream& text, const Eigen::Isometry3d& pose, char by,
                           bool w_last) {
      const Eigen::Vector3d p = pose.translation();
      const Eigen::Quaterniond q(pose.linear());
      text << by << p.x() << by << p.y() << by << p.z();
      if (!w_last) text << by << q.w();
      text << by << q.x() << by << q.y() << by << q.z();
      if (w_last) text << by << q.w();
    };
    append(tum << time, camera, ' ', true);
    append(euroc << nanoseconds, camera * camera_from_imu, ',', false);
    append(tumvi << nanoseconds, camera * camera_from_imu, ',', false);
    tum << "\n";
    euroc << ", 0.1, nan, -3e-4\n";
    tumvi << "\r\n";
  }
  folder_.write("tum.txt", tum.str());
  const auto expected = read_trajectory(folder_ / "tum.txt").poses;
  ASSERT_EQ(expected.size(), 4u);
  for (const std::string& text : {euroc.str(), tumvi.str()}) {
    const Trajectory imu = read_trajectory(folder_.write("data.csv", text));
    EXPECT_EQ(imu.body, Body::imu);
    const auto poses = poses_of_camera(imu.poses, camera_from_imu, 0);
    ASSERT_EQ(poses.size(), 4u);
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(poses[k].seconds, expected[k].seconds, 3e-7);
      EXPECT_LT((poses[k].world_from_body.matrix() - expected[k].world_from_body.matrix()).norm(),
                1e-9);
    }
  }
}

TEST_F(Trajectories, DoNotDependOnTheLocale) {
  folder_.write("poses.txt", "+1.5 -1.25e-1 .5 2. 0 0 0 1\n");
  const auto expect = [&] {
    ASSERT_EQ(error_of([&] { read_trajectory(folder_ / "poses.txt"); }), "");
    const StampedPose pose = read_trajectory(folder_ / "poses.txt").poses.front();
    EXPECT_EQ(pose.seconds, 1.5);
    EXPECT_EQ(pose.world_from_body.translation(), Eigen::Vector3d(-0.125, 0.5, 2));
  };
  expect();
  {
    const CommaStreams streams;
    expect();
  }
  const CommaNumbers numbers;
  if (!numbers.installed()) GTEST_SKIP() << "no locale with a decimal comma is installed";
  expect();
}

TEST_F(Trajectories, MayBeAPipe) {
  const std::string pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(pipe) << "1.5 0 0 2 0 0 0 1\n"; });
  const std::string error = error_of(
      [&] { EXPECT_EQ(read_trajectory(pipe).poses.at(0).world_from_body.translation().z(), 2); });
  writer.join();
  EXPECT_EQ(error, "");
}

TEST_F(Trajectories, ThatCannotBeReadOnAreNoShorterOnes) {
  EXPECT_EQ(error_of([] { read_trajectory("/proc/self/mem"); }),
            "Cannot read /proc/self/mem: Input/output error; check the path and permissions.");
}

TEST_F(Trajectories, BrokenLinesAreNamed) {
  EXPECT_THAT(error_of([&] { read_trajectory(folder_ / "none.txt"); }), HasSubstr("none.txt"));
  EXPECT_THAT(error_of_text("# nothing\n"), HasSubstr("no poses"));
  EXPECT_THAT(error_of_text(""), HasSubstr("poses.txt; give a TUM trajectory"));
  EXPECT_THAT(error_of([&] { read_trajectory(folder_.path()); }),
              HasSubstr(folder_.path().string() + " are a folder; give the file in it."));
  EXPECT_THAT(error_of_text("#\n1 2 3 4 0 0 0\n"), HasSubstr("line 2 has 7 value(s)"));
  EXPECT_THAT(error_of_text("1 2 3 4 0 0 0 1 5\n"), HasSubstr("line 1"));
  for (const char* no_number : {"nan", "inf", "1e999", "+-5", "+", "0x10", "5m"}) {
    EXPECT_THAT(error_of_text("1 2 " + std::string(no_number) + " 4 0 0 0 1\n"),
                HasSubstr("finite"));
  }
  EXPECT_THAT(error_of_text("1 2 3,4 4 0 0 0 1\n"), HasSubstr("line 1"));
  for (const char* quaternion : {"1 1 0 1", "0 0 0.67 0.67", "0 0 0.74 0.74"}) {
    EXPECT_THAT(error_of_text("1 2 3 4 " + std::string(quaternion) + "\n"),
                HasSubstr("quaternion"));
  }
  EXPECT_EQ(error_of_text("# timestamp tx ty tz qx qy qz qw\n1 2 3 4 0 0 0 1\n"), "");
  EXPECT_THAT(error_of_text("# timestamp tx ty tz qw qx qy qz\n1 2 3 4 1 0 0 0\n"),
              HasSubstr("poses.txt names the quaternion's w first; write qx qy qz qw."));
  for (const char* comments : {"# timestamp tx ty tz qw qx qy qz\n# exported by a program\n",
                               "# timestamp,tx,ty,tz,qw,qx,qy,qz\n"}) {
    EXPECT_THAT(error_of_text(comments + std::string("1 2 3 4 1 0 0 0\n")),
                HasSubstr("write qx qy qz qw."));
  }
  EXPECT_EQ(error_of_text("# this is how we now have what we saw\n1 2 3 4 0 0 0 1\n"), "");
}

TEST_F(Trajectories, MayNameTheirColumnsWithoutASign) {
  EXPECT_EQ(error_of_text("timestamp tx ty tz qx qy qz qw\n1 2 3 4 0 0 0 1\n"), "");
  EXPECT_EQ(error_of_text("nanoseconds, px,py,pz,qw,qx,qy,qz\n1,2,3,4,1,0,0,0\n"), "");
  EXPECT_THAT(error_of_text("timestamp tx ty tz qw qx qy qz\n1 2 3 4 1 0 0 0\n"),
              HasSubstr("write qx qy qz qw."));
  EXPECT_THAT(error_of_text("t,x,y,z,qx,qy,qz,qw\n1,2,3,4,0,0,0,1\n"),
              HasSubstr("write qw,qx,qy,qz"));
  EXPECT_THAT(error_of_text("nan nan nan nan 0 0 0 1\n1 2 3 4 0 0 0 1\n"), HasSubstr("line 1"));
  EXPECT_THAT(error_of_text("1 2 3 4 0 0 0 1\ntimestamp tx ty tz qx qy qz qw\n"),
              HasSubstr("line 2"));
}

TEST_F(Trajectories, OfDevicesAreRefused) {
  EXPECT_EQ(error_of([] { read_trajectory("/dev/zero"); }),
            "/dev/zero is a device; give a file or a pipe.");
}

TEST_F(Trajectories, BrokenLinesOfGroundTruthAreNamed) {
  const std::string header = "#timestamp [ns], p_x, p_y, p_z, q_RS_w [], q_x, q_y, q_RS_z []\n";
  const std::string whole = header + "1403636579763555584,1,2,3,0.5,0.5,-0.5,0.5,9\r\n";
  const auto expect = [&](const std::string& text, const std::string& part) {
    EXPECT_THAT(error_of_text(text), HasSubstr(part));
    EXPECT_THAT(error_of_text(text), HasSubstr((folder_ / "poses.txt").string()));
  };
  EXPECT_EQ(error_of_text(whole), "");
  EXPECT_EQ(error_of_text("5 , 1,2,3,1,0,0,0\n"), "");
  expect(header, "no poses");
  expect(header + "\r\n \r\n", "no poses");
  expect(whole + "1403636579768555520,1,2,3,0.5,0.5,-0.5,0.5\n",
         "line 3 has 8 value(s) instead of 9");
  expect(whole + "14036365", "line 3 has 1 value(s) instead of 9");
  expect("1,2,3,4,1,0,0\n", "line 1 has 7 value(s) instead of 8; a pose is \"nanoseconds,px");
  expect("1,2,3,4,1,0,0,\n", "line 1 has 7 value(s)");
  expect("1,2,,4,1,0,0,0\n", "line 1 is no \"nanoseconds,px,py,pz,qw,qx,qy,qz\" of finite");
  expect("1,2,nan,4,1,0,0,0\n", "finite");
  expect("1,2,3,4 m,1,0,0,0\n", "finite");
  expect(whole + "1 2 3 4 0 0 0 1\n", "line 3 has 1 value(s) instead of 9");
  expect("1,2,3,4,0,0,0,0\n", "line 1 has a quaternion of length 0");
  expect("1,2,3,4,1,1,0,0\n", "quaternion of length 1.4");
  expect("1,2,3,4,0,0,0,1e-9\n",
         "line 1 has a quaternion of length 1e-09 instead of 1; a pose is \"nanoseconds,px");
  expect("#t,x,y,z,q_x [],q_y [],q_z [],q_w []\n1,2,3,4,0,0,0,1\n", "write qw,qx,qy,qz");
  expect("1403636579.76,2,3,4,1,0,0,0\n", "the time 1403636579.76, which is no whole number");
  expect("1.4e18,2,3,4,1,0,0,0\n", "nanoseconds");
  expect("99999999999999999999,2,3,4,1,0,0,0\n", "nanoseconds");
}

TEST_F(Trajectories, BelongToFramesByTimeOrOrder) {
  std::vector<StampedPose> trajectory(3);
  for (int i = 0; i < 3; ++i) {
    trajectory[i].seconds = 10 + 0.1 * i;
    trajectory[i].world_from_body.translation().x() = i;
  }
  std::vector<SequenceFrame> frames(3);
  std::vector<StampedPose> timeless = trajectory;
  timeless[1].seconds = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, {0}, timeless, 0.01, "p"); }),
              HasSubstr("p: pose 2 has no finite time"));
  EXPECT_EQ(poses_of_frames(frames, {0, 2}, trajectory, 0.01, "p")[1].translation().x(), 2);
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, {3}, trajectory, 0.01, "p"); }),
              HasSubstr("The sequence has no frame number 3 among its 3"));
  frames.pop_back();
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, {0}, trajectory, 0.01, "p"); }),
              HasSubstr("3 poses for 2 frames"));
  frames[0].nanoseconds = 10'204'000'000;
  frames[1].nanoseconds = 10'098'000'000;
  const auto poses = poses_of_frames(frames, {0, 1}, trajectory, 0.01, "p");
  EXPECT_EQ(poses[0].translation().x(), 2) << "after the last pose";
  EXPECT_NEAR(poses[1].translation().x(), 0.98, 1e-6);
  frames[1].nanoseconds = 10'104'000'000;
  EXPECT_NEAR(poses_of_frames(frames, {1}, trajectory, 0.01, "p")[0].translation().x(), 1.04, 1e-6);
  frames[1].name = "late";
  frames[1].nanoseconds = 10'150'000'000;
  EXPECT_THAT(error_of([&] {
                poses_of_frames(frames, {0, 1}, trajectory, 0.01, "p");
              }),
              HasSubstr("frame late"));
  EXPECT_EQ(frames_with_poses(frames, {0, 1}, trajectory, 0.01), std::vector<std::size_t>{0});
  EXPECT_EQ(frames_with_poses(frames, {0, 1}, trajectory, 0.06), (std::vector<std::size_t>{0, 1}));
  std::vector<SequenceFrame> one_untimed = frames;
  one_untimed.push_back({.name = "stray", .images = {}, .nanoseconds = std::nullopt});
  EXPECT_EQ(frames_with_poses(one_untimed, {1, 2}, trajectory, 0.01),
            (std::vector<std::size_t>{1, 2}));
  trajectory.push_back({.seconds = 11, .world_from_body = Eigen::Isometry3d::Identity()});
  EXPECT_THAT(error_of([&] { poses_of_frames(one_untimed, {0}, trajectory, 0.01, "p"); }),
              HasSubstr("4 poses for 3 frames without time stamps (the first is stray)"));
  trajectory.pop_back();
  EXPECT_EQ(poses_of_frames(frames, {0}, trajectory, 0.01, "p").size(), 1u) << "it is not chosen";
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, {0}, {}, 0.01, "p"); }),
              HasSubstr("no poses in p"));
}

TEST_F(Trajectories, EqualTimesAreEqualWithoutTolerance) {
  std::vector<SequenceFrame> frames(1);
  for (std::int64_t i = 0; i < 20; ++i) {
    const std::int64_t fraction = 763'555'584 + 7'654'321 * i;
    frames[0].nanoseconds = 1'403'636'579'000'000'000 + fraction;
    const std::vector<StampedPose> trajectory = {
        {.seconds = std::stod("1403636579." + std::to_string(fraction)),
         .world_from_body = Eigen::Isometry3d::Identity()}};
    EXPECT_EQ(poses_of_frames(frames, {0}, trajectory, 0, "p").size(), 1u);
    EXPECT_EQ(frames_with_poses(frames, {0}, trajectory, 0), std::vector<std::size_t>{0});
    frames[0].nanoseconds = *frames[0].nanoseconds + 10'000;
    EXPECT_THROW(poses_of_frames(frames, {0}, trajectory, 0, "p"), Error);
    EXPECT_EQ(frames_with_poses(frames, {0}, trajectory, 0), std::vector<std::size_t>{});
  }
}

/// A body on a helix, whose camera takes images between its poses.
TEST_F(Trajectories, ArePosesBetweenOthersWhereTheBodyMoves) {
  const auto truth = [](double seconds) {
    const double angle = 2 * seconds;
    return Eigen::AngleAxisd(angle, Eigen::Vector3d(0.6, 0, 0.8)) *
           Eigen::Translation3d(1.5, 0.1 * angle, 0);
  };
  std::vector<StampedPose> trajectory;
  for (int i = 0; i <= 120; ++i) {
    const double seconds = 1'500'000'000 + i / 120.0;
    trajectory.push_back({.seconds = seconds, .world_from_body = truth(i / 120.0)});
  }
  std::vector<SequenceFrame> frames(12);
  std::vector<std::size_t> all(frames.size());
  for (std::size_t k = 0; k < frames.size(); ++k) {
    all[k] = k;
    frames[k].nanoseconds = 1'500'000'000'000'000'000 + static_cast<std::int64_t>(k) * 83'000'000;
  }
  const auto poses = poses_of_frames(frames, all, trajectory, 0.01, "p");
  double largest = 0, largest_of_nearest = 0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const double seconds = 0.083 * static_cast<double>(k);
    const Eigen::Isometry3d expected(truth(seconds));
    const Eigen::Isometry3d nearest(truth(std::round(seconds * 120) / 120));
    largest = std::max(largest, (poses[k].matrix() - expected.matrix()).norm());
    largest_of_nearest =
        std::max(largest_of_nearest, (nearest.matrix() - expected.matrix()).norm());
    EXPECT_TRUE(poses[k].linear().isUnitary(1e-12));
  }
  EXPECT_LT(largest, 2e-4);
  EXPECT_GT(largest_of_nearest, 1e-2);
}

TEST_F(Trajectories, MayHaveNanosecondsBetweenBlanks) {
  folder_.write("poses.txt", "1403636579763555584.000000 1 2 3 0 0 0 1\n");
  EXPECT_NEAR(read_trajectory(folder_ / "poses.txt").poses[0].seconds, 1403636579.763555584, 3e-7);
}

TEST_F(Trajectories, TwoPosesOfOneTimeMustBeTheSame) {
  const std::vector<SequenceFrame> frames = {{"2", {}, 2'000'000'000}};
  const auto error_with = [&](const std::string& line) {
    folder_.write("poses.txt", "# poses\n1.5 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n" + line + "\n");
    return error_of([&] {
      poses_of_frames(frames, {0}, read_trajectory(folder_ / "poses.txt").poses, 0.01, "p");
    });
  };
  EXPECT_EQ(error_with("2 1 0 0 0 0 0 1"), "");
  EXPECT_EQ(error_with("1.5 1 0 0 0 0 0 1"),
            "p has two poses of the time 1.5, in line 2 and in line 4; leave one.");
  std::vector<StampedPose> of_no_file(2);
  of_no_file[1].world_from_body.translation().x() = 1;
  EXPECT_EQ(error_of([&] { poses_of_frames(frames, {0}, of_no_file, 5, "p"); }),
            "p has two poses of the time 0; leave one.");
}

TEST_F(Trajectories, BelongToFramesByOrderOnlyWhereSortedByTime) {
  std::vector<StampedPose> trajectory(3);
  for (int i = 0; i < 3; ++i) {
    trajectory[i].seconds = 1 + i;
    trajectory[i].world_from_body.translation().x() = i;
  }
  std::swap(trajectory[1], trajectory[2]);
  std::vector<SequenceFrame> frames(3);
  EXPECT_THAT(error_of([&] { poses_of_frames(frames, {0}, trajectory, 0.01, "p"); }),
              HasSubstr("p: pose 3 is earlier than the one before it"));
  for (int i = 0; i < 3; ++i) frames[i].nanoseconds = 1'000'000'000LL * (1 + i);
  const auto poses = poses_of_frames(frames, {0, 1, 2}, trajectory, 0.01, "p");
  for (int i = 0; i < 3; ++i) EXPECT_EQ(poses[i].translation().x(), i);
  for (StampedPose& pose : trajectory) pose.seconds = 0;  // as where nobody knew the times
  EXPECT_EQ(poses_of_frames(std::vector<SequenceFrame>(3), {1}, trajectory, 0.01, "p")[0]
                .translation()
                .x(),
            2);
}

}  // namespace
}  // namespace widestereo::test
