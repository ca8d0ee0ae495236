// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "comma_locale.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "temporary_folder.h"
#include "widestereo/calibration.h"
#include "widestereo/sfm_model.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

const char* const cameras_text = R"(# Camera list with one line of data per camera:
#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]
1 OPENCV_FISHEYE 640 480 200 201 320.5 240.25 0.01 -0.002 0.0003 -0.00004
7 SIMPLE_RADIAL 1000 800 900 500 400 -0.1
)";

// The second image observes nothing, the third is the last line of the file.
const char* const images_text = R"(# Image list with two lines of data per image:
3 0.9961946980917455 0.08715574274765817 0 0 0.5 -0.25 2 1 left/a b.png
10 20 5 30 40 -1 50 60 6
4 1 0 0 0 0 0 0 7 left/b.png

9 1 0 0 0 -1 0 0 1 b.png)";

/// A number's bytes in this order, as COLMAP writes them.
template <class T>
std::string bytes(T value) {
  std::string text(sizeof value, '\0');
  std::memcpy(text.data(), &value, sizeof value);
  return text;
}

template <class... T>
std::string doubles(T... values) {
  return (bytes(static_cast<double>(values)) + ...);
}

std::string name(const std::string& text) { return text + '\0'; }

const std::uint64_t none = ~std::uint64_t{0};

/// The same as the texts.
std::string cameras_binary() {
  return bytes(std::uint64_t{2}) + bytes(std::uint32_t{1}) + bytes(5) + bytes(std::uint64_t{640}) +
         bytes(std::uint64_t{480}) +
         doubles(200, 201, 320.5, 240.25, 0.01, -0.002, 0.0003, -0.00004) +
         bytes(std::uint32_t{7}) + bytes(2) + bytes(std::uint64_t{1000}) +
         bytes(std::uint64_t{800}) + doubles(900, 500, 400, -0.1);
}

std::string images_binary() {
  return bytes(std::uint64_t{3}) + bytes(std::uint32_t{3}) +
         doubles(0.9961946980917455, 0.08715574274765817, 0, 0, 0.5, -0.25, 2) +
         bytes(std::uint32_t{1}) + name("left/a b.png") + bytes(std::uint64_t{3}) +
         doubles(10, 20) + bytes(std::uint64_t{5}) + doubles(30, 40) + bytes(none) +
         doubles(50, 60) + bytes(std::uint64_t{6}) + bytes(std::uint32_t{4}) +
         doubles(1, 0, 0, 0, 0, 0, 0) + bytes(std::uint32_t{7}) + name("left/b.png") +
         bytes(std::uint64_t{0}) + bytes(std::uint32_t{9}) + doubles(1, 0, 0, 0, -1, 0, 0) +
         bytes(std::uint32_t{1}) + name("b.png") + bytes(std::uint64_t{0});
}

class Colmap : public ::testing::Test {
 protected:
  void write_text(const std::string& cameras = cameras_text,
                  const std::string& images = images_text) {
    folder_.write("cameras.txt", cameras);
    folder_.write("images.txt", images);
  }
  void write_binary(const std::string& cameras = cameras_binary(),
                    const std::string& images = images_binary()) {
    folder_.write("cameras.bin", cameras);
    folder_.write("images.bin", images);
  }
  CalibratedImages read(const std::vector<fs::path>& files = {"/data/left/a b.png",
                                                              "/data/left/b.png"}) {
    return SfmModel(folder_.path()).calibrated_files(files);
  }
  std::string error(const std::vector<fs::path>& files = {"/data/left/a b.png",
                                                          "/data/left/b.png"}) {
    return test::error_of([&] { read(files); });
  }
  /// The camera of a line of cameras.txt: model, size and parameters.
  Camera camera(const std::string& line) {
    write_text("1 " + line + "\n", images_text);
    return read({"left/a b.png"}).rig.views.front().camera;
  }

  TemporaryFolder folder_;
};

TEST_F(Colmap, ReadsCamerasAndPosesOfTheImagesAskedFor) {
  write_text();
  const Rig rig = read().rig;
  ASSERT_EQ(rig.views.size(), 2u);
  EXPECT_EQ(rig.views[0].name, "left/a b.png");
  const Camera& fisheye = rig.views[0].camera;
  EXPECT_EQ(fisheye.model, CameraModel::kannala_brandt);
  EXPECT_EQ(fisheye.width, 640);
  EXPECT_EQ(fisheye.height, 480);
  EXPECT_DOUBLE_EQ(fisheye.k4, -0.00004);
  const Camera& radial = rig.views[1].camera;
  EXPECT_EQ(radial.model, CameraModel::pinhole_radtan);
  EXPECT_DOUBLE_EQ(radial.fx, 900);
  EXPECT_DOUBLE_EQ(radial.fy, 900);
  EXPECT_DOUBLE_EQ(radial.k1, -0.1);
  EXPECT_TRUE(rig.views[1].world_from_camera.isApprox(Eigen::Isometry3d::Identity()));
}

// COLMAP counts pixels from the image's corner, OpenCV from the first pixel's centre.
TEST_F(Colmap, ProjectsWorldPointsLikeOpenCv) {
  write_text();
  const View view = read().rig.views.front();
  const cv::Matx33d k(200, 0, 320, 0, 201, 239.75, 0, 0, 1);
  // 10 degrees about x, and then the translation.
  const cv::Vec3d rotation(10 * radians_per_degree, 0, 0), translation(0.5, -0.25, 2);
  const std::vector<cv::Point3d> points = {{0, 0, 1}, {1, -2, 0.5}, {-3, 1, 2}, {4, 4, 1}};
  std::vector<cv::Point2d> expected;
  cv::fisheye::projectPoints(points, expected, rotation, translation, k,
                             cv::Vec4d(0.01, -0.002, 0.0003, -0.00004));
  for (std::size_t i = 0; i < points.size(); ++i) {
    Eigen::Vector2d pixel;
    const Eigen::Vector3d point(points[i].x, points[i].y, points[i].z);
    ASSERT_TRUE(project(view.camera, view.world_from_camera.inverse() * point, pixel));
    EXPECT_NEAR(pixel.x(), expected[i].x, 1e-6);
    EXPECT_NEAR(pixel.y(), expected[i].y, 1e-6);
  }
}

TEST_F(Colmap, ReadsTextInAnyLocale) {
  write_text();
  const test::CommaStreams streams;
  ASSERT_EQ(error({"left/b.png"}), "");
  const View view = read({"left/b.png"}).rig.views[0];
  EXPECT_EQ(view.camera.fx, 900);
  EXPECT_EQ(view.camera.k1, -0.1);
}

TEST_F(Colmap, TextsMayBeginWithAByteOrderMark) {
  folder_.write("cameras.txt", "\xef\xbb\xbf" + std::string(cameras_text));
  folder_.write("images.txt", images_text);
  EXPECT_EQ(SfmModel(folder_.path()).names().size(), 3u);
}

TEST_F(Colmap, ReadsBinaryFilesAsText) {
  write_text();
  const Rig text = read().rig;
  write_binary();
  const Rig binary = read().rig;
  ASSERT_EQ(binary.views.size(), text.views.size());
  for (std::size_t i = 0; i < text.views.size(); ++i) {
    EXPECT_EQ(binary.views[i].name, text.views[i].name);
    EXPECT_EQ(binary.views[i].camera.model, text.views[i].camera.model);
    EXPECT_EQ(binary.views[i].camera.cx, text.views[i].camera.cx);
    EXPECT_EQ(binary.views[i].camera.k1, text.views[i].camera.k1);
    EXPECT_TRUE(binary.views[i].world_from_camera.isApprox(text.views[i].world_from_camera));
  }
}

TEST_F(Colmap, TakesTheLongestNameThatEndsThePath) {
  write_text();
  EXPECT_EQ(read({"left/b.png"}).rig.views.front().name, "left/b.png");
  EXPECT_EQ(read({"right/b.png"}).rig.views.front().name, "b.png");
  EXPECT_EQ(read({"left/../right/b.png"}).rig.views.front().name, "b.png");
}

TEST_F(Colmap, ConvertsEveryModelWithAnEquivalent) {
  EXPECT_EQ(camera("PINHOLE 8 8 2 3 4 4").fy, 3);
  EXPECT_EQ(camera("SIMPLE_PINHOLE 8 8 2 4 4.5").cy, 4);
  EXPECT_EQ(camera("RADIAL 8 8 2 4 4 0.1 0.2").k2, 0.2);
  EXPECT_EQ(camera("OPENCV 8 8 2 3 4 4 0.1 0.2 0.3 0.4").p2, 0.4);
  EXPECT_EQ(camera("FULL_OPENCV 8 8 2 3 4 4 0.1 0.2 0.3 0.4 0.5 0 0 0").k3, 0.5);
  const Camera rational = camera("FULL_OPENCV 8 8 2 3 4 4 0.1 0.2 0.3 0.4 0.5 0.6 0.7 0.8");
  EXPECT_EQ(rational.model, CameraModel::pinhole_rational);
  EXPECT_EQ(rational.p1, 0.3);
  EXPECT_EQ(rational.k3, 0.5);
  EXPECT_EQ(rational.k6, 0.8);
  EXPECT_EQ(camera("FOV 8 8 2 3 4 4 0.9").omega, 0.9);
  EXPECT_EQ(camera("FOV 8 8 2 3 4 4 -0.9").omega, 0.9) << "its sign means nothing";
  EXPECT_EQ(camera("SIMPLE_RADIAL_FISHEYE 8 8 2 4 4 0.1").k1, 0.1);
  EXPECT_EQ(camera("RADIAL_FISHEYE 8 8 2 4 4 0.1 0.2").k2, 0.2);
  EXPECT_EQ(camera("THIN_PRISM_FISHEYE 8 8 2 3 4 4 0.1 0.2 0 0 0.3 0.4 0 0").k4, 0.4);
  const Camera eth3d = camera("THIN_PRISM_FISHEYE 8 8 2 3 4 4 0.1 0.2 .01 .02 0.3 0.4 .03 .04");
  EXPECT_EQ(eth3d.model, CameraModel::thin_prism_fisheye);
  EXPECT_EQ(eth3d.p2, 0.02);
  EXPECT_EQ(eth3d.k4, 0.4);
  EXPECT_EQ(eth3d.s1, 0.03);
  EXPECT_EQ(eth3d.s3, 0.04);
  const Camera aria =
      camera("RAD_TAN_THIN_PRISM_FISHEYE 8 8 2 3 4 4 .1 .2 .3 .4 .5 .6 .01 .02 .03 .04 .05 .06");
  EXPECT_EQ(aria.model, CameraModel::rad_tan_thin_prism_fisheye);
  EXPECT_EQ(aria.k6, 0.6);
  EXPECT_EQ(aria.p2, 0.01);
  EXPECT_EQ(aria.p1, 0.02);
  EXPECT_EQ(aria.s2, 0.04);
  EXPECT_EQ(aria.s4, 0.06);
  // What has no coefficients but those of a simpler model is one.
  EXPECT_EQ(camera("FULL_OPENCV 8 8 2 3 4 4 0.1 0.2 0.3 0.4 0.5 0 0 0").model,
            CameraModel::pinhole_radtan);
  EXPECT_EQ(camera("THIN_PRISM_FISHEYE 8 8 2 3 4 4 0.1 0.2 0 0 0.3 0.4 0 0").model,
            CameraModel::kannala_brandt);
  EXPECT_EQ(camera("RAD_TAN_THIN_PRISM_FISHEYE 8 8 2 3 4 4 .1 .2 .3 .4 0 0 0 0 0 0 0 0").model,
            CameraModel::kannala_brandt);
  EXPECT_EQ(camera("SIMPLE_FISHEYE 8 8 2 4 4").model, CameraModel::kannala_brandt);
  EXPECT_EQ(camera("FISHEYE 8 8 2 3 4 4").fy, 3);
  EXPECT_EQ(camera("EUCM 8 8 2 3 4 4 0.6 1.1").beta, 1.1);
  EXPECT_EQ(camera("EQUIRECTANGULAR 8 4 8 4"), whole_sphere(8, 4));
}

// u = 2 f x / (z + sqrt(z^2 - 4 k rho^2)) + cx, as COLMAP projects.
TEST_F(Colmap, DivisionIsTheExtendedUnifiedModel) {
  const Camera c = camera("DIVISION 640 480 200 201 320 240 -0.3");
  for (const Eigen::Vector3d& point :
       {Eigen::Vector3d(0.1, -0.2, 1), Eigen::Vector3d(2, 1, 0.5), Eigen::Vector3d(-1, 3, -0.4)}) {
    const double denominator =
        0.5 * (point.z() + std::sqrt(point.z() * point.z() + 1.2 * point.head<2>().squaredNorm()));
    Eigen::Vector2d pixel;
    ASSERT_TRUE(project(c, point, pixel));
    EXPECT_NEAR(pixel.x(), 200 * point.x() / denominator + 319.5, 1e-9);
    EXPECT_NEAR(pixel.y(), 201 * point.y() / denominator + 239.5, 1e-9);
  }
  EXPECT_EQ(camera("SIMPLE_DIVISION 8 8 2 4 4 0").model, CameraModel::pinhole);
  EXPECT_EQ(camera("SIMPLE_DIVISION 8 8 2 4 4 0").alpha, 0);
  const std::string message = test::error_of([&] { camera("DIVISION 8 8 2 3 4 4 0.1"); });
  EXPECT_NE(message.find("cameras.txt: DIVISION: "), std::string::npos) << message;
  EXPECT_NE(message.find("0.1"), std::string::npos) << message;
}

TEST_F(Colmap, RangeCoversTheDistancesOfObservedPoints) {
  // Camera 4 is at the origin. It observes 101 points at distances 1 to 2, and camera 9 another
  // one, which does not count.
  std::string observations, points = "1000 500 0 0 0 0 0 0.5 9 0\n";
  for (int i = 0; i <= 100; ++i) {
    observations += "1 2 " + std::to_string(i) + " ";
    const double z = 1 + i / 100.0;
    points += std::to_string(i) + " 0 " + std::to_string(0.6 * z) + " " + std::to_string(0.8 * z) +
              " 9 9 9 0.5 4 " + std::to_string(i) + "\n";
  }
  write_text(cameras_text,
             "4 1 0 0 0 0 0 0 7 b.png\n" + observations + "\n9 1 0 0 0 -1 0 0 1 a.png\n7 8 1000\n");
  EXPECT_FALSE(read({"b.png"}).distances);  // no file of points
  folder_.write("points3D.txt", points);
  const auto range = read({"b.png"}).distances;
  ASSERT_TRUE(range);
  EXPECT_NEAR(range->nearest, 0.75 * 1.01, 1e-6);
  EXPECT_NEAR(range->farthest, 1.25 * 1.99, 1e-6);
  EXPECT_FALSE(read({"a.png"}).distances);  // one point
}

TEST_F(Colmap, NamesAreOfFilesWithinAFolder) {
  const auto names = [this](const std::string& path) {
    write_text(cameras_text, "4 1 0 0 0 0 0 0 7 " + path + "\n\n9 1 0 0 0 -1 0 0 1 a.png\n");
    return SfmModel(folder_.path()).names();
  };
  EXPECT_EQ(names("./right//b.png"), (std::vector<std::string>{"a.png", "right/b.png"}));
  EXPECT_EQ(names("/data/b.png"), (std::vector<std::string>{"a.png", "data/b.png"}));
  for (const char* path : {".", "..", "/", "b/.."}) {
    const std::string message = test::error_of([&] { names(path); });
    EXPECT_NE(message.find("images.txt has an image \"" + std::string(path) + "\", which is no"),
              std::string::npos)
        << path << " " << message;
  }
}

TEST_F(Colmap, SourcesWithoutPointsAreThoseNearbyThatLookTheSameWay) {
  const std::string pose = " 1 0 0 0 ";
  // a.png looks along z from the origin, far.png along the same way from beside it, back.png from
  // nearer the other way; "away" is too far off to see anything of the range.
  write_text("1 OPENCV_FISHEYE 640 480 300 300 320 240 0 0 0 0\n",
             "1" + pose + "0 0 0 1 left/a.png\n\n2 0 0 1 0 0.1 0 0 1 left/back.png\n\n3" + pose +
                 "-0.4 0 0 1 right/far.png\n\n4" + pose + "-900 0 0 1 right/away.png\n\n");
  const SfmModel model(folder_.path());
  ASSERT_FALSE(model.has_points());
  using Files = std::vector<fs::path>;
  EXPECT_EQ(model.source_files("/data/left/a.png", 2, {.nearest = 2, .farthest = 4}),
            Files{"/data/right/far.png"});
  EXPECT_EQ(model.source_files("/data/left/a.png", 2), Files{});
}

TEST_F(Colmap, SourcesWithoutPointsAreNearHoweverManyImagesThereAre) {
  std::string images = "1 1 0 0 0 0 0 0 1 a.png\n\n2 1 0 0 0 -0.4 0 0 1 z.png\n\n";
  for (int i = 0; i < 70; ++i) {
    images += std::to_string(10 + i) + " 1 0 0 0 " + std::to_string(-2 - 0.01 * i) + " 0 0 1 m" +
              std::to_string(i) + ".png\n\n";
  }
  write_text("1 OPENCV_FISHEYE 640 480 300 300 320 240 0 0 0 0\n", images);
  EXPECT_EQ(SfmModel(folder_.path()).source_files("/data/a.png", 1, {.nearest = 2, .farthest = 6}),
            std::vector<fs::path>{"/data/z.png"});
}

/// Points 10 in front of the camera of left/a.png. Of the others, "near" is 0.03 beside it, "far"
/// 0.9 and "few" too; "none" sees other points.
TEST_F(Colmap, SourcesAreThoseThatSeeManyPointsFromOtherDirections) {
  std::string points, all, few;
  for (int i = 0; i < 60; ++i) {
    points += std::to_string(i) + " 0 0 10 9 9 9 0.5 1 1\n";
    (i < 10 ? few : all) += "1 2 " + std::to_string(i) + " ";
  }
  all += few;
  const std::string pose = " 1 0 0 0 ";
  write_text(cameras_text, "1" + pose + "0 0 0 1 left/a.png\n" + all +  //
                               "\n2" + pose + "-0.9 0 0 1 left/few.png\n" + few + "\n3" + pose +
                               "-0.03 0 0 1 left/near.png\n" + all + "\n4" + pose +
                               "0.9 0 0 1 right/far.png\n" + all + "\n5" + pose +
                               "0.9 0 0 1 right/none.png\n1 2 99\n");
  folder_.write("points3D.txt", points + "99 0 0 5 9 9 9 0.5 1 1\n");
  using Files = std::vector<fs::path>;
  const SfmModel model(folder_.path());
  EXPECT_EQ(model.source_files("/data/left/a.png", 2),
            (Files{"/data/right/far.png", "/data/left/few.png"}));
  EXPECT_EQ(model.source_files("/data/left/a.png", 9),
            (Files{"/data/right/far.png", "/data/left/few.png", "/data/left/near.png"}));
  EXPECT_EQ(model.source_files("/data/right/none.png", 9), Files{});
  EXPECT_NE(test::error_of([&] { model.source_files("b.png", 1); }).find("b.png"),
            std::string::npos);
  EXPECT_EQ(test::error_of([&] { model.source_files("", 1); }),
            "An image's path is empty; give one.");
}

/// Images of one set of points each, 10 in front of them, 0.9 apart; out of the order of names.
TEST_F(Colmap, GroupsAreOfImagesThatSeeTheSame) {
  std::string images, points;
  const auto add = [&](const std::string& name, double x, int first_point) {
    static int number = 0;
    images += std::to_string(++number) + " 1 0 0 0 " + std::to_string(-x) + " 0 0 1 " + name + "\n";
    for (int i = first_point; i < first_point + 30; ++i) images += "1 2 " + std::to_string(i) + " ";
    images += "\n";
  };
  for (int i = 0; i < 90; ++i) points += std::to_string(i) + " 0 0 10 9 9 9 0.5 1 1\n";
  add("f", 1.8, 30);
  add("a", 0, 0);
  add("b", 0, 30);
  add("c", 0.9, 0);
  add("d", 0.9, 30);
  add("e", 1.8, 0);
  add("g", -0.9, 30);
  add("h", 0, 60);
  write_text(cameras_text, images);
  folder_.write("points3D.txt", points);
  const SfmModel model(folder_.path());
  EXPECT_EQ(model.names(), (std::vector<std::string>{"a", "b", "c", "d", "e", "f", "g", "h"}));
  using Groups = std::vector<std::vector<std::size_t>>;
  // b has d and g at 5.1 degrees, f at 10.2; d has f at 5.1 and g at 10.3. g, which is left, is
  // joined by those that were matched before.
  EXPECT_EQ(model.selection().groups(3), (Groups{{0, 2, 4}, {1, 3, 5}, {6, 1, 3}, {7}}));
  // e has no other image left; f has g at 15.4 degrees, worth more than half of d at 5.1.
  EXPECT_EQ(model.selection().groups(2), (Groups{{0, 2}, {1, 3}, {4, 2}, {5, 6}, {7}}));
  EXPECT_EQ(model.selection().groups(8), (Groups{{0, 2, 4}, {1, 3, 5, 6}, {7}}));
  fs::remove(folder_.path() / "points3D.txt");
  EXPECT_EQ(SfmModel(folder_.path()).selection().groups(3).size(), 8U);
}

TEST_F(Colmap, WhatIsLeftOutIsForgotten) {
  write_binary();
  std::string points = bytes(std::uint64_t{2});
  for (const std::uint64_t number : {5, 6}) {
    points += bytes(number) + doubles(1, 2, 30) + "rgb" + doubles(0.5) + bytes(std::uint64_t{0});
  }
  folder_.write("points3D.bin", points);
  SfmModel model(folder_.path());
  ASSERT_EQ(model.names(), (std::vector<std::string>{"b.png", "left/a b.png", "left/b.png"}));
  ASSERT_TRUE(model.has_points());
  model.leave_out({0});
  EXPECT_EQ(model.names(), (std::vector<std::string>{"left/a b.png", "left/b.png"}));
  EXPECT_EQ(model.file_of(1, "/data"), fs::path("/data/left/b.png"));
  EXPECT_EQ(model.calibrated({0}).rig.views[0].camera.model, CameraModel::kannala_brandt);
  EXPECT_TRUE(model.has_points());
  EXPECT_THROW(model.leave_out({2}), Error);
  folder_.write("points3D.bin", points.substr(0, points.size() - 1));
  EXPECT_THROW(model.leave_out({0}), Error);
  EXPECT_EQ(model.names(), (std::vector<std::string>{"left/a b.png", "left/b.png"}));
  EXPECT_TRUE(model.has_points()) << "as before";
  folder_.write("points3D.bin", points);
  model.leave_out({0});
  EXPECT_EQ(model.names(), std::vector<std::string>{"left/b.png"});
  EXPECT_FALSE(model.has_points()) << "which none of those left observes";
  EXPECT_THROW(model.leave_out({0}), Error);
}

TEST_F(Colmap, ReadsBinaryPoints) {
  write_binary(
      cameras_binary(), bytes(std::uint64_t{1}) + bytes(std::uint32_t{4}) +
                            doubles(1, 0, 0, 0, 0, 0, 0) + bytes(std::uint32_t{7}) + name("b.png") +
                            bytes(std::uint64_t{20}) + [] {
                              std::string all;
                              for (std::uint64_t i = 0; i < 20; ++i) {
                                all += doubles(1, 2) + bytes(i);
                              }
                              return all;
                            }());
  std::string points = bytes(std::uint64_t{20});
  for (std::uint64_t i = 0; i < 20; ++i) {
    // With a track of i images.
    points += bytes(i) + doubles(0, 0, 4) + std::string(3, '\7') + doubles(0.5) + bytes(i) +
              std::string(8 * i, '\1');
  }
  folder_.write("points3D.bin", points);
  const auto range = read({"b.png"}).distances;
  ASSERT_TRUE(range);
  EXPECT_DOUBLE_EQ(range->nearest, 3);
  EXPECT_DOUBLE_EQ(range->farthest, 5);
  folder_.write("points3D.bin", points.substr(0, points.size() - 1));
  EXPECT_NE(error({"b.png"}).find("points3D.bin ends too early"), std::string::npos);
  // A track of so many images that its bytes are none in 64 bits.
  const std::string last_track = bytes(std::uint64_t{19}) + std::string(8 * 19, '\1');
  folder_.write("points3D.bin", points.substr(0, points.size() - last_track.size()) +
                                    bytes(std::uint64_t{1} << 61));
  EXPECT_NE(error({"b.png"}).find("points3D.bin ends too early"), std::string::npos);
}

TEST_F(Colmap, PointsWithoutAFinitePositionTellNothing) {
  std::string images = bytes(std::uint64_t{2}), points = bytes(std::uint64_t{11});
  for (const std::uint32_t i : {1u, 2u}) {
    images += bytes(i) + doubles(1, 0, 0, 0, -0.9 * (i - 1.0), 0, 0) + bytes(std::uint32_t{7}) +
              name(i == 1 ? "a.png" : "b.png") + bytes(std::uint64_t{11});
    for (std::uint64_t p = 0; p < 11; ++p) images += doubles(1, 2) + bytes(p);
  }
  for (std::uint64_t p = 0; p < 11; ++p) {
    points += bytes(p) + doubles(p == 4 ? std::nan("") : 0.1 * static_cast<double>(p), 0, 10) +
              std::string(3, '\7') + doubles(0.5) + bytes(std::uint64_t{0});
  }
  write_binary(cameras_binary(), images);
  folder_.write("points3D.bin", points);
  EXPECT_EQ(SfmModel(folder_.path()).source_files("/data/a.png", 1),
            std::vector<fs::path>{"/data/b.png"});
}

TEST_F(Colmap, FilesThatCannotBeReadOnAreNoShorterOnes) {
  write_text();
  fs::remove(folder_ / "images.txt");
  fs::create_symlink("/proc/self/mem", folder_ / "images.txt");  // an I/O error
  EXPECT_NE(error().find("images.txt: Input/output error"), std::string::npos) << error();
}

TEST_F(Colmap, BinaryFilesEndWithTheirLastEntry) {
  const std::string more = " goes on after as many entries as it says it has";
  write_binary(cameras_binary() + "x");
  EXPECT_NE(error().find("cameras.bin" + more), std::string::npos) << error();
  // One image less than there are.
  write_binary(cameras_binary(), bytes(std::uint64_t{2}) + images_binary().substr(8));
  EXPECT_NE(error().find("images.bin" + more), std::string::npos) << error();
}

TEST_F(Colmap, EveryTruncatedBinaryFileIsAnError) {
  const std::string cameras = cameras_binary(), images = images_binary();
  for (std::size_t size = 0; size < cameras.size(); ++size) {
    write_binary(cameras.substr(0, size), images);
    EXPECT_NE(error().find("cameras.bin ends too early"), std::string::npos) << size;
  }
  for (std::size_t size = 0; size < images.size(); ++size) {
    write_binary(cameras, images.substr(0, size));
    EXPECT_NE(error().find("images.bin ends too early"), std::string::npos) << size;
  }
}

/// Whatever is in the files, nothing but Error comes out, if anything.
TEST_F(Colmap, DamagedBinaryFilesAreReadOrRefused) {
  const std::string cameras = cameras_binary(), images = images_binary();
  int refused = 0;
  const auto damage = [](std::string text, std::size_t i, char value) {
    text[i] = value;
    return text;
  };
  for (const char value : {'\0', '\x7f', '\xff'}) {
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      write_binary(damage(cameras, i, value), images);
      refused += !error().empty();
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      write_binary(cameras, damage(images, i, value));
      refused += !error().empty();
    }
  }
  EXPECT_GT(refused, 300);
}

TEST_F(Colmap, BadTextNamesFileAndLine) {
  write_text("1 OPENCV_FISHEYE 640 480 200 201 320.5\n");
  EXPECT_NE(error().find("cameras.txt line 1 lacks parameters"), std::string::npos) << error();
  write_text("# comment\n1 OCAM 640 480 200\n");
  EXPECT_NE(error().find("cameras.txt line 2 has the unknown camera model \"OCAM\""),
            std::string::npos)
      << error();
  write_text(cameras_text, "3 1 0 0 0 0 0 1\n\n");
  EXPECT_NE(error().find("images.txt line 1 lacks"), std::string::npos) << error();
  write_text(cameras_text, "3 1 1 0 0 0 0 1 1 left/a b.png\n\n");
  EXPECT_NE(error().find("images.txt line 1 has a quaternion of length 1.414"), std::string::npos)
      << error();
  EXPECT_NE(error().find("instead of 1; a pose is \"qw qx qy qz tx ty tz\"."), std::string::npos)
      << error();
  write_text(cameras_text, "3 1 0 0 0 0 0 1 1 left/a b.png\n1 2 nan\n");
  EXPECT_NE(error().find("images.txt line 2 lacks"), std::string::npos) << error();
}

TEST_F(Colmap, SurplusParametersAreErrors) {
  write_text("1 OPENCV_FISHEYE 640 480 200 201 320.5 240.25 0.01 -0.002 0.0003 -0.00004 0.5\n");
  EXPECT_NE(error().find("cameras.txt line 1 has more parameters than its camera model"),
            std::string::npos)
      << error();
  write_text("1 SIMPLE_PINHOLE 640 480 200 320 240 \t\r\n7 PINHOLE 640 480 200 201 320 240\n");
  EXPECT_EQ(error(), "");
}

TEST_F(Colmap, NumbersAreThereOnce) {
  write_text(cameras_text + std::string("7 SIMPLE_RADIAL 1000 800 950 500 400 -0.1\n"));
  EXPECT_NE(error().find("cameras.txt has two cameras of the number 7"), std::string::npos)
      << error();
  write_text(cameras_text, images_text + std::string("\n\n4 1 0 0 0 0 0 0 7 left/c.png\n\n"));
  EXPECT_NE(error().find("images.txt has two images of the number 4"), std::string::npos)
      << error();
  write_text(cameras_text, "4 1 0 0 0 0 0 0 7 left/b.png\n1 2 8\n");
  folder_.write("points3D.txt", "8 0 0 5 9 9 9 0.5 4 0\n8 0 0 6 9 9 9 0.5 4 0\n");
  EXPECT_NE(error().find("points3D.txt has two points of the number 8"), std::string::npos)
      << error();
}

TEST_F(Colmap, SizesMustBeWholeNumbersOfPixels) {
  for (const std::string size : {"1919.9 1080", "1920 0", "1920 -1e300", "1e300 1080"}) {
    const std::string message =
        test::error_of([&] { camera("SIMPLE_PINHOLE " + size + " 900 960 540"); });
    EXPECT_NE(message.find("cameras.txt: A camera's size is "), std::string::npos) << message;
  }
  EXPECT_NE(test::error_of([&] { camera("EQUIRECTANGULAR -1e300 4 8 4"); }), "");
}

TEST_F(Colmap, NumbersOfNoImageAreErrors) {
  write_text();
  const SfmModel model(folder_.path());
  const std::string expected = folder_.path().string() + " has no image number 3 among its 3";
  for (const std::string& message : {test::error_of([&] {
                                       model.calibrated({0, 3});
                                     }),
                                     test::error_of([&] { model.distances({3}); })}) {
    EXPECT_NE(message.find(expected), std::string::npos) << message;
  }
  EXPECT_NE(test::error_of([&] { model.selection().sources(3, 1); }).find("no view number 3"),
            std::string::npos);
}

TEST_F(Colmap, MissingPartsAreErrors) {
  EXPECT_NE(error().find("is no COLMAP model"), std::string::npos);
  EXPECT_FALSE(is_sfm_model(folder_.path()));
  EXPECT_FALSE(is_sfm_model(folder_.path() / "none"));
  write_text();
  EXPECT_TRUE(is_sfm_model(folder_.path()));
  EXPECT_NE(error({"left/c.png"})
                .find("has no image whose name is the end of left/c.png among "
                      "its 3 (the first is b.png)"),
            std::string::npos)
      << error({"left/c.png"});
  EXPECT_NE(error({"b.png", "b.png"}).find("have the same centre"), std::string::npos);
  for (const char* no_images : {"", "# Image list\n"}) {
    write_text(cameras_text, no_images);
    EXPECT_NE(error().find("images.txt has no image; give a model in which images are registered."),
              std::string::npos)
        << error();
  }
  write_text("7 SIMPLE_RADIAL 1000 800 900 500 400 -0.1\n");
  EXPECT_NE(error().find("cameras.txt has no camera 1, which took left/a b.png"), std::string::npos)
      << error();
  EXPECT_NE(test::error_of([&] { read_calibration(folder_.path()); }).find("is a COLMAP model"),
            std::string::npos);
}

}  // namespace
}  // namespace widestereo
