// SPDX-License-Identifier: MIT
#include "widestereo/pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>

#include "bytes_of.h"
#include "comma_locale.h"
#include "error_of.h"
#include "same_bits.h"
#include "temporary_folder.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"
#include "widestereo/matcher.h"
#include "widestereo/point_cloud.h"

namespace widestereo {
namespace {

using test::same_bits;

TEST(Pictures, NearIsRedFarIsBlueNothingIsGrey) {
  const cv::Mat distance = (cv::Mat_<float>(1, 3) << 1, 10, 0);
  const cv::Mat picture = distance_picture(distance, {1, 10});
  const cv::Vec3b near = picture.at<cv::Vec3b>(0, 0);
  const cv::Vec3b far = picture.at<cv::Vec3b>(0, 1);
  EXPECT_GT(near[2], near[0] + 50);
  EXPECT_GT(far[0], far[2]);
  const cv::Vec3b none = picture.at<cv::Vec3b>(0, 2);
  EXPECT_EQ(none[0], none[1]);
  EXPECT_EQ(none[1], none[2]);
}

TEST(Pictures, RobustRangeIgnoresOutliersAndHoles) {
  cv::Mat distance(100, 100, CV_32FC1, cv::Scalar(2));
  distance.rowRange(50, 100).setTo(4);
  distance.at<float>(0, 0) = 0.001f;
  distance.at<float>(0, 1) = 0;
  distance.at<float>(0, 2) = -5;
  const ColourRange range = robust_range(distance);
  EXPECT_NEAR(range.nearest, 2, 1e-6);
  EXPECT_NEAR(range.farthest, 4, 1e-6);
  EXPECT_LT(robust_range(cv::Mat::zeros(3, 3, CV_32FC1)).nearest,
            robust_range(cv::Mat::zeros(3, 3, CV_32FC1)).farthest);
}

TEST(Pictures, ASingleDistanceHasARangeToo) {
  const cv::Mat wall(8, 8, CV_32FC1, cv::Scalar(2));
  const ColourRange range = robust_range(wall);
  EXPECT_NEAR(range.nearest, 2, 0.1);
  EXPECT_NEAR(range.farthest, 2, 0.1);
  EXPECT_EQ(test::error_of([&] { distance_picture(wall, range); }), "");
  EXPECT_EQ(test::error_of([&] {
              with_distance_legend(normal_picture({8, 8, CV_32FC3}), range);
            }),
            "");
}

TEST(Pictures, NormalsHaveDocumentedColours) {
  cv::Mat normals(1, 2, CV_32FC3, cv::Scalar(0, 0, 0));
  normals.at<cv::Vec3f>(0, 0) = {0, -1, 0};  // a floor: green
  const cv::Mat picture = normal_picture(normals);
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), cv::Vec3b(128, 255, 128));
  normals.at<cv::Vec3f>(0, 0) = {0, -0.6f, 0};  // as an average of several
  EXPECT_EQ(normal_picture(normals).at<cv::Vec3b>(0, 0), cv::Vec3b(128, 204, 128));
}

TEST(Pictures, WhatIsNoNumberIsGrey) {
  const cv::Vec3b grey(48, 48, 48);
  const cv::Mat distance = (cv::Mat_<float>(1, 3) << INFINITY, NAN, 5);
  const cv::Mat of_distance = distance_picture(distance, {1, 10});
  cv::Mat normals(1, 3, CV_32FC3, cv::Scalar(0, 0, -1));
  normals.at<cv::Vec3f>(0, 0) = {INFINITY, 0, 0};
  normals.at<cv::Vec3f>(0, 1) = {0, NAN, -1};
  const cv::Mat of_normals = normal_picture(normals);
  const cv::Mat of_scalar = scalar_picture((cv::Mat_<float>(1, 3) << NAN, NAN, 0.5), 0, 1);
  for (const cv::Mat& picture : {of_distance, of_normals, of_scalar}) {
    EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), grey);
    EXPECT_EQ(picture.at<cv::Vec3b>(0, 1), grey);
    EXPECT_NE(picture.at<cv::Vec3b>(0, 2), grey);
  }
}

TEST(Pictures, CloudsAreSeenFromTheViewpoint) {
  const auto point = [](float x, float y, float z, std::uint8_t red) {
    return CloudPoint{{x, y, z}, {0, 0, -1}, red, 0, 0, 1};
  };
  // Before, beside and behind a viewer two metres above the origin; the second hides the first.
  const PointCloud cloud = {point(0, -2, 4, 10), point(0, -2, 2, 20), point(1, -2, 2, 30),
                            point(0, -2, -1, 40), point(1e20f, -2, 1e-20f, 50)};
  const Eigen::Isometry3d viewer(Eigen::Translation3d(0, -2, 0));
  const cv::Mat picture = cloud_picture(cloud, viewer, {41, 21});
  EXPECT_EQ(picture.at<cv::Vec3b>(10, 20), cv::Vec3b(0, 0, 20));
  EXPECT_EQ(picture.at<cv::Vec3b>(10, 30), cv::Vec3b(0, 0, 30));
  EXPECT_EQ(picture.at<cv::Vec3b>(9, 29), cv::Vec3b(0, 0, 30)) << "3x3 pixels";
  EXPECT_EQ(picture.at<cv::Vec3b>(10, 25), picture.at<cv::Vec3b>(0, 0)) << "nothing is there";
  EXPECT_EQ(cloud_picture({point(0, -2, 2, 20)},
                          viewer * Eigen::AngleAxisd(3, Eigen::Vector3d::UnitY()), {41, 21})
                .at<cv::Vec3b>(10, 20),
            picture.at<cv::Vec3b>(0, 0))
      << "it looks the other way";
  EXPECT_TRUE(same_bits(cloud_picture({cloud.rbegin(), cloud.rend()}, viewer, {41, 21}), picture))
      << "in any order";
}

TEST(Pictures, PointsThatAreNotFiniteAreLeftOutOfClouds) {
  const Eigen::Isometry3d viewer = Eigen::Isometry3d::Identity();
  const cv::Mat empty = cloud_picture({}, viewer, {41, 21});
  for (const float wrong : {NAN, INFINITY, -INFINITY}) {
    for (int axis = 0; axis < 3; ++axis) {
      CloudPoint point{{0, 0, 2}, {0, 0, -1}, 20, 0, 0, 1};
      point.position[axis] = wrong;
      EXPECT_TRUE(same_bits(cloud_picture({point}, viewer, {41, 21}), empty)) << wrong << axis;
    }
  }
}

/// Floats are 0.5 m apart there.
TEST(Pictures, CloudsAreSeenFromViewpointsBetweenFloats) {
  const PointCloud cloud = {{{5'700'000.5F, 0, 1}, {0, 0, -1}, 20, 0, 0, 1}};
  const Eigen::Isometry3d viewer(Eigen::Translation3d(5'700'000.25, 0, 0));
  // 0.25 m aside at a depth of 1 m, with a focal length of 20 pixels.
  EXPECT_EQ(cloud_picture(cloud, viewer, {40, 21}).at<cv::Vec3b>(10, 24), cv::Vec3b(0, 0, 20));
}

TEST(Pictures, ReasonsCoverTheImage) {
  cv::Mat reasons = cv::Mat::zeros(2, 2, CV_16UC1);
  reasons.at<ushort>(0, 1) = reason_inconsistent | reason_tilt;
  reasons.at<ushort>(1, 0) = reason_inconsistent | reason_filled;
  reasons.at<ushort>(1, 1) = reason_inconsistent;
  const cv::Mat image(2, 2, CV_8UC1, cv::Scalar(77));
  const cv::Mat picture = reason_picture(reasons, image);
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 0), cv::Vec3b(77, 77, 77));
  EXPECT_NE(picture.at<cv::Vec3b>(0, 1), cv::Vec3b(77, 77, 77));
  EXPECT_EQ(picture.at<cv::Vec3b>(0, 1), picture.at<cv::Vec3b>(1, 1)) << "the lowest bit shows";
  EXPECT_NE(picture.at<cv::Vec3b>(1, 0), picture.at<cv::Vec3b>(1, 1)) << "filled shows as filled";
}

TEST(Pictures, LegendsAddAStripBelowAndKeepThePicture) {
  const cv::Mat picture(100, 200, CV_8UC3, cv::Scalar(1, 2, 3));
  for (const cv::Mat& with : {with_distance_legend(picture, {1, 5}),
                              with_scalar_legend(picture, 0, 1), with_reason_legend(picture)}) {
    EXPECT_EQ(with.cols, 200);
    EXPECT_GT(with.rows, 110);
    EXPECT_TRUE(same_bits(with.rowRange(0, 100), picture));
    cv::Scalar mean;
    cv::Scalar spread;
    cv::meanStdDev(with.rowRange(100, with.rows), mean, spread);
    EXPECT_GT(spread[0], 5) << "something must be drawn";
  }
}

TEST(Pictures, LegendsOfAPartOfAPictureShowNothingOfTheRest) {
  cv::Mat picture(300, 200, CV_8UC3);
  cv::RNG(3).fill(picture, cv::RNG::UNIFORM, 0, 256);
  const cv::Mat part = picture.rowRange(0, 100);
  EXPECT_TRUE(same_bits(with_scalar_legend(part, 0, 1), with_scalar_legend(part.clone(), 0, 1)));
}

TEST(Pictures, DistanceLegendNamesTheUnit) {
  const cv::Mat picture(100, 400, CV_8UC3, cv::Scalar(1, 2, 3));
  const cv::Mat metres = with_distance_legend(picture, {1, 5});
  EXPECT_TRUE(same_bits(metres, with_distance_legend(picture, {1, 5}, " m")));
  EXPECT_GT(cv::norm(metres, with_distance_legend(picture, {1, 5}, ""), cv::NORM_INF), 100);
}

TEST(Pictures, LegendsHaveTheColoursOfTheirPictures) {
  const cv::Mat picture(10, 900, CV_8UC3, cv::Scalar::all(255));
  const auto expect_bar = [&](const cv::Mat& with, const cv::Mat& colours) {
    const int line = (with.rows - picture.rows) / 3;
    const cv::Mat bar = with.row(picture.rows + line);
    const int first = line / 2, last = bar.cols - line / 2 - 1;
    for (int i = 1; i + 1 < colours.cols; ++i) {
      const int x = first + i * (last - first) / (colours.cols - 1);
      EXPECT_LT(cv::norm(bar.at<cv::Vec3b>(x), colours.at<cv::Vec3b>(i), cv::NORM_INF), 6) << i;
    }
  };
  cv::Mat distance(1, 17, CV_32FC1), values(1, 17, CV_32FC1);
  for (int i = 0; i < 17; ++i) {
    const float share = static_cast<float>(i) / 16;
    distance.at<float>(i) = 1 / (0.2f + share * 0.8f);
    values.at<float>(i) = -2 + 5 * share;
  }
  expect_bar(with_distance_legend(picture, {1, 5}), distance_picture(distance, {1, 5}));
  expect_bar(with_scalar_legend(picture, -2, 3), scalar_picture(values, -2, 3));
}

TEST(Pictures, TheMiddleOfALegendIsLabelledByWhatIsThere) {
  const cv::Mat picture(10, 128, CV_8UC3, cv::Scalar::all(255));
  const auto label = [&](const cv::Mat& with) {
    const int line = (with.rows - picture.rows) / 3;
    return cv::Mat(with(cv::Range(picture.rows + 2 * line, with.rows), cv::Range(50, 78)));
  };
  // Half-way between inverse distances of 1 and 1/3, and between 0 and 3, is 1.5.
  const cv::Mat of_distances = label(with_distance_legend(picture, {1, 3}, ""));
  EXPECT_TRUE(same_bits(of_distances, label(with_scalar_legend(picture, 0, 3))));
  EXPECT_FALSE(same_bits(of_distances, label(with_distance_legend(picture, {1, 9}, ""))));
}

TEST(Pictures, LegendsOfReasonsHaveTheColoursOfTheirPictures) {
  const cv::Mat with = with_reason_legend(cv::Mat(10, 512, CV_8UC3, cv::Scalar::all(255)));
  for (std::size_t i = 0; i < named_reasons.size(); ++i) {
    const cv::Mat reasons(1, 1, CV_16UC1, cv::Scalar(1 << i));
    const cv::Scalar colour =
        reason_picture(reasons, cv::Mat(1, 1, CV_8UC1, cv::Scalar(0))).at<cv::Vec3b>(0);
    cv::Mat found;
    cv::inRange(with, colour, colour, found);
    EXPECT_GT(cv::countNonZero(found), 36) << named_reasons[i].name;
  }
}

TEST(Pictures, ScalarsGoFromDarkToBright) {
  constexpr int steps = 32;
  cv::Mat map(1, steps, CV_32FC1);
  for (int i = 0; i < steps; ++i) map.at<float>(i) = -2 + 5 * static_cast<float>(i) / (steps - 1);
  const cv::Mat picture = scalar_picture(map, -2, 3);
  const cv::Mat grey = to_grey_levels(picture, "picture");
  EXPECT_LT(grey.at<uchar>(0), 50);
  EXPECT_GT(grey.at<uchar>(steps - 1), 200);
  for (int i = 1; i < steps; ++i) EXPECT_GT(grey.at<uchar>(i), grey.at<uchar>(i - 1)) << i;
  const cv::Mat ends = scalar_picture((cv::Mat_<float>(1, 2) << -9, 9), -2, 3);
  EXPECT_EQ(ends.at<cv::Vec3b>(0), picture.at<cv::Vec3b>(0));
  EXPECT_EQ(ends.at<cv::Vec3b>(1), picture.at<cv::Vec3b>(steps - 1));
}

TEST(Pictures, SheetsAreNoWiderThanTheirPanels) {
  const cv::Mat picture = cv::Mat::ones(64, 64, CV_8UC1);
  EXPECT_TRUE(same_bits(panel_sheet({{"a", picture}, {"b", picture}}, 1'000'000'000),
                        panel_sheet({{"a", picture}, {"b", picture}}, 2)));
}

TEST(Pictures, SheetHoldsAllPanels) {
  const cv::Mat grey(100, 160, CV_8UC1, cv::Scalar(9));
  const cv::Mat deep(200, 320, CV_16UC3, cv::Scalar(257 * 10, 257 * 20, 257 * 30));
  const cv::Mat red(80, 160, CV_8UC4, cv::Scalar(0, 0, 200, 7));
  const cv::Mat sheet = panel_sheet({{"a", grey}, {"b", deep}, {"c", red}}, 2);
  ASSERT_EQ(sheet.type(), CV_8UC3);
  // Where a colour is in the sheet, of which it must fill a rectangle.
  const auto place_of = [&sheet](const cv::Scalar& colour) {
    cv::Mat is_there;
    cv::inRange(sheet, colour, colour, is_there);
    const cv::Rect place = cv::boundingRect(is_there);
    EXPECT_EQ(cv::countNonZero(is_there), place.area()) << colour;
    return place;
  };
  const cv::Rect a = place_of({9, 9, 9}), b = place_of({10, 20, 30}), c = place_of({0, 0, 200});
  EXPECT_EQ(a.size(), grey.size());
  EXPECT_EQ(b.size(), grey.size()) << "as wide as the first";
  EXPECT_EQ(c.size(), red.size());
  EXPECT_GT(b.x, a.br().x);
  EXPECT_EQ(b.y, a.y);
  EXPECT_EQ(c.x, a.x);
  EXPECT_GT(c.y, a.br().y);
  for (const cv::Rect& panel : {a, b, c}) {
    cv::Mat ink;
    const cv::Mat above = sheet(cv::Rect(panel.x, panel.y - a.y, panel.width, a.y));
    cv::inRange(above, cv::Scalar::all(0), cv::Scalar::all(128), ink);
    EXPECT_GT(cv::countNonZero(ink), 5) << "a title";
  }
  EXPECT_THROW(panel_sheet({}, 2), Error);
  EXPECT_THROW(panel_sheet({{"a", grey}}, 0), Error);
}

/// Each reason has a box of its colour, which no name of another one may cover.
TEST(Pictures, LegendsOfReasonsFitNarrowPictures) {
  for (const int cols : {100, 192, 256, 320, 512}) {
    const cv::Mat with = with_reason_legend(cv::Mat(10, cols, CV_8UC3, cv::Scalar::all(255)));
    cv::Mat grey;
    cv::cvtColor(with.rowRange(10, with.rows), grey, cv::COLOR_BGR2GRAY);
    cv::Mat labels, stats, centres;
    const int parts = cv::connectedComponentsWithStats(grey < 255, labels, stats, centres);
    int boxes = 0;
    for (int i = 1; i < parts; ++i) {
      const int width = stats.at<int>(i, cv::CC_STAT_WIDTH);
      const int height = stats.at<int>(i, cv::CC_STAT_HEIGHT);
      boxes +=
          width == height && width >= 6 && stats.at<int>(i, cv::CC_STAT_AREA) == width * height;
    }
    EXPECT_EQ(boxes, static_cast<int>(named_reasons.size())) << cols;
  }
}

/// Groups of columns with ink that lie `apart` or more from each other.
int labels_in(const cv::Mat& strip, int apart) {
  cv::Mat grey, columns;
  cv::cvtColor(strip, grey, cv::COLOR_BGR2GRAY);
  cv::reduce(grey, columns, 0, cv::REDUCE_MIN);
  int count = 0, blank = apart;
  for (int x = 0; x < columns.cols; ++x) {
    if (columns.at<uchar>(x) > 200) {
      ++blank;
      continue;
    }
    if (blank >= apart) ++count;
    blank = 0;
  }
  return count;
}

TEST(Pictures, LabelsOfLegendsDoNotTouch) {
  for (const auto& [cols, expected] :
       {std::pair(64, 3), {128, 3}, {160, 3}, {256, 5}, {512, 5}, {1024, 5}}) {
    const cv::Mat picture(10, cols, CV_8UC3, cv::Scalar::all(255));
    const cv::Mat with = with_distance_legend(picture, {0.552, 12.3}, "m");
    const int line = (with.rows - picture.rows) / 3;
    const cv::Mat below = with.rowRange(picture.rows + line / 2 + line + line / 4 + 1, with.rows);
    EXPECT_EQ(labels_in(below, line / 2), expected) << cols;
  }
}

TEST(Pictures, TitlesOfPanelsDoNotTouch) {
  for (const int cols : {64, 128, 512}) {
    const cv::Mat picture(10, cols, CV_8UC3, cv::Scalar::all(255));
    const auto titles = [&](const std::string& title) {
      const cv::Mat sheet = panel_sheet({{title, picture}, {title, picture}, {title, picture}}, 3);
      EXPECT_GE(sheet.cols, 3 * cols);
      return labels_in(sheet, std::max(5, cols / 64));
    };
    EXPECT_EQ(titles("error:_green_0.5_%,_red_5_%"), 3) << cols;
  }
}

TEST(Pictures, TakeImagesOfAnySize) {
  for (const int cols : {1, 2, 3, 8, 9, 10, 11, 12, 63, 64, 65, 127, 128, 129}) {
    for (const int rows : {1, 2, 9, 70}) {
      const cv::Mat picture(rows, cols, CV_8UC3, cv::Scalar(1, 2, 3));
      for (const cv::Mat& with : {with_distance_legend(picture, {1, 5}),
                                  with_scalar_legend(picture, 0, 1), with_reason_legend(picture)}) {
        EXPECT_EQ(with.cols, std::max(cols, 128));
        EXPECT_TRUE(same_bits(with(cv::Rect({}, picture.size())), picture));
        const cv::Mat sheet = panel_sheet({{"image", picture}, {"legend", with}}, 4);
        EXPECT_GT(sheet.rows, with.rows) << cols << "x" << rows;
      }
      EXPECT_NO_THROW(cloud_picture({}, Eigen::Isometry3d::Identity(), picture.size()));
    }
  }
}

TEST(Pictures, RefuseWrongMaps) {
  using ::testing::HasSubstr;
  const cv::Mat one = cv::Mat::ones(2, 4, CV_32FC1), wide = cv::Mat::ones(2, 4, CV_64FC1);
  const cv::Mat bytes = cv::Mat::ones(2, 4, CV_8UC1), bits = cv::Mat::ones(2, 4, CV_16UC1);
  const auto expect = [](auto make, const char* message) {
    EXPECT_THAT(test::error_of(make), HasSubstr(message));
  };
  expect([&] { robust_range(wide); }, "distance map is CV_64FC1 instead of CV_32FC1");
  expect([&] { robust_range({}); }, "distance map is empty");
  expect([&] { distance_picture(bytes, {1, 2}); }, "distance map is CV_8UC1");
  expect([&] { distance_picture(one, {2, 2}); }, "Colours from 2 to 2 show no distances;");
  expect([&] { distance_picture(one, {-1, 2}); }, "distance -1 on");
  expect([&] { with_distance_legend(cv::Mat(64, 64, CV_8UC3), {0, NAN}); }, "from 0 to nan");
  expect([&] { scalar_picture(one, 1, 0); }, "Colours from 1 to 0 show no values;");
  expect([&] { normal_picture(one); }, "normal map is CV_32FC1");
  expect([&] { scalar_picture(cv::Mat::ones(2, 4, CV_32FC2), 0, 1); }, "is CV_32FC2");
  expect([&] { reason_picture(bytes, bytes); }, "map of reasons is CV_8UC1");
  expect([&] { reason_picture(bits, bytes.colRange(0, 3)); }, "4x2 pixels instead of 3x2");
  expect([&] { reason_picture(bits, one); }, "image is CV_32FC1");
  expect([&] { reason_picture(bits, {}); }, "image is empty");
  expect([&] { with_reason_legend(bytes); }, "picture is CV_8UC1");
  expect([&] { with_scalar_legend({}, 0, 1); }, "picture is empty");
  expect([&] { panel_sheet({{"a", bytes}, {"b", one}}, 2); }, "panel b is CV_32FC1");
  expect([&] { panel_sheet({{"a", {}}}, 2); }, "panel a is empty");
  expect([&] { cloud_picture({}, Eigen::Isometry3d::Identity(), {-4, 48}); }, "-4x48 pixels");
}

TEST(PointCloud, RefusesWrongMaps) {
  using ::testing::HasSubstr;
  const auto make = [](const cv::Mat& distance, const cv::Mat& rays, const cv::Mat& normals,
                       const cv::Mat& image, const cv::Mat& confidence) {
    return test::error_of([&] {
      make_point_cloud(distance, rays, normals, image, confidence, Eigen::Isometry3d::Identity());
    });
  };
  const cv::Mat distance = cv::Mat::ones(2, 4, CV_32FC1), rays = cv::Mat::ones(2, 4, CV_32FC4);
  EXPECT_EQ(make(distance, rays, {}, {}, {}), "");
  EXPECT_THAT(make(distance, {}, {}, {}, {}), HasSubstr("map of rays is empty"));
  EXPECT_THAT(make(distance, distance, {}, {}, {}), HasSubstr("map of rays is CV_32FC1"));
  EXPECT_THAT(make(distance, rays.colRange(0, 3), {}, {}, {}),
              HasSubstr("map of rays is 3x2 pixels instead of 4x2"));
  EXPECT_THAT(make(cv::Mat::ones(2, 4, CV_8UC1), rays, {}, {}, {}),
              HasSubstr("distance map is CV_8UC1"));
  EXPECT_THAT(make(distance, rays, distance, {}, {}), HasSubstr("normal map is CV_32FC1"));
  EXPECT_THAT(make(distance, rays, {}, distance, {}), HasSubstr("image is CV_32FC1"));
  EXPECT_THAT(make(distance, rays, {}, cv::Mat::ones(2, 3, CV_8UC1), {}),
              HasSubstr("image is 3x2"));
  EXPECT_THAT(make(distance, rays, {}, {}, rays), HasSubstr("confidence map is CV_32FC4"));
}

TEST(PointCloud, PixelsWithoutARayHaveNoPoint) {
  const cv::Mat distance = cv::Mat::ones(1, 2, CV_32FC1);
  cv::Mat rays = cv::Mat::zeros(1, 2, CV_32FC4);
  rays.at<cv::Vec4f>(0, 1) = {0, 0, 1, 1};
  const PointCloud cloud =
      make_point_cloud(distance, rays, {}, {}, {}, Eigen::Isometry3d::Identity());
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_EQ(cloud[0].position, Eigen::Vector3f(0, 0, 1));
}

TEST(PointCloud, NormalsThatAreNoneAreZero) {
  const cv::Mat distance = cv::Mat::ones(1, 1, CV_32FC1);
  const cv::Mat rays(1, 1, CV_32FC4, cv::Scalar(0, 0, 1, 1));
  const cv::Mat normals(1, 1, CV_32FC3, cv::Scalar(0, NAN, -1));
  const PointCloud cloud =
      make_point_cloud(distance, rays, normals, {}, {}, Eigen::Isometry3d::Identity());
  EXPECT_EQ(cloud.at(0).normal, Eigen::Vector3f(0, 0, 0));
}

/// Floats are 1/16 m apart there: a camera rounded to one of them would add as much again.
TEST(PointCloud, FarPositionsAreRoundedOnce) {
  const cv::Mat distance(1, 1, CV_32FC1, cv::Scalar(0.04));
  const cv::Mat rays(1, 1, CV_32FC4, cv::Scalar(1, 0, 0, 1));
  const PointCloud cloud = make_point_cloud(
      distance, rays, {}, {}, {}, Eigen::Isometry3d(Eigen::Translation3d(600'000.04, 0, 0)));
  EXPECT_EQ(cloud[0].position.x(), 600'000.0625F);
}

TEST(PointCloud, PlacesPointsInTheWorld) {
  const cv::Mat distance = (cv::Mat_<float>(1, 3) << 2, 0, INFINITY);
  cv::Mat rays(1, 3, CV_32FC4, cv::Scalar(0, 0, 1, 1));
  const cv::Mat normals(1, 3, CV_32FC3, cv::Scalar(0, 0, -1));
  const cv::Mat image(1, 3, CV_8UC3, cv::Scalar(10, 20, 30));
  const cv::Mat confidence(1, 3, CV_32FC1, cv::Scalar(0.25));
  const Eigen::Isometry3d pose =
      Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY());
  const PointCloud cloud = make_point_cloud(distance, rays, normals, image, confidence, pose);
  ASSERT_EQ(cloud.size(), 1u);
  EXPECT_LT((cloud[0].position - Eigen::Vector3f(3, 2, 3)).norm(), 1e-6f);
  EXPECT_LT((cloud[0].normal - Eigen::Vector3f(-1, 0, 0)).norm(), 1e-6f);
  EXPECT_EQ(cloud[0].red, 30);
  EXPECT_EQ(cloud[0].blue, 10);
  EXPECT_EQ(make_point_cloud(distance, rays, {}, {}, {}, pose)[0].confidence, 1);
  EXPECT_THROW(make_point_cloud(distance, rays, cv::Mat(2, 3, CV_32FC3), {}, {}, pose), Error);

  const test::TemporaryFolder folder;
  write_ply(folder / "c.ply", cloud);
  std::ifstream file(folder / "c.ply", std::ios::binary);
  std::string line;
  int header_vertices = -1;
  while (std::getline(file, line) && line != "end_header") {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "element") words >> word >> header_vertices;
  }
  EXPECT_EQ(header_vertices, 1);
  float numbers[6];
  unsigned char colour[3];
  float certainty = 0;
  file.read(reinterpret_cast<char*>(numbers), sizeof numbers);
  file.read(reinterpret_cast<char*>(colour), sizeof colour);
  file.read(reinterpret_cast<char*>(&certainty), sizeof certainty);
  ASSERT_TRUE(file);
  EXPECT_NEAR(numbers[0], 3, 1e-6);
  EXPECT_NEAR(numbers[3], -1, 1e-6);
  EXPECT_EQ(colour[1], 20);
  EXPECT_EQ(certainty, 0.25f);
  EXPECT_EQ(file.peek(), EOF);
}

TEST(PointCloud, FilesDoNotDependOnTheLocale) {
  const test::TemporaryFolder folder;
  const test::CommaStreams streams;
  write_ply(folder / "c.ply", PointCloud(1234));
  const std::string header = test::bytes_of(folder / "c.ply");
  EXPECT_NE(header.find("element vertex 1234\n"), std::string::npos);
}

}  // namespace
}  // namespace widestereo
