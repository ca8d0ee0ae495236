// SPDX-License-Identifier: MIT
#include "widestereo/image_io.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <csignal>
#include <cstring>
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "bytes_of.h"
#include "comma_locale.h"
#include "error_of.h"
#include "random_map.h"
#include "same_bits.h"
#include "temporary_folder.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/point_cloud.h"

namespace widestereo {
namespace {

using test::bytes_of;
using test::error_of;
using test::random_map;
using test::same_bits;
using test::TemporaryFolder;

TEST(Maps, TiffPfmAndExrKeepEveryBit) {
  const TemporaryFolder folder;
  for (const int type : {CV_32FC1, CV_32FC3}) {
    cv::Mat map = random_map(type);
    map.ptr<float>(3)[5] = INFINITY;
    map.ptr<float>(4)[6] = -1e-30f;
    for (const char* name : {"a.tiff", "a.tif", "a.pfm", "a.exr", "a.EXR"}) {
      write_map(folder / name, map);
      const cv::Mat again = read_map(folder / name);
      EXPECT_TRUE(same_bits(map, again)) << name;
    }
  }
}

TEST(Maps, PfmHeadersDoNotDependOnTheLocale) {
  const TemporaryFolder folder;
  const cv::Mat wide(2, 1234, CV_32FC1, cv::Scalar(2));
  write_map(folder / "before.pfm", wide);
  const test::CommaStreams streams;
  EXPECT_EQ(read_map(folder / "before.pfm").size(), wide.size());
  write_map(folder / "after.pfm", wide);
  EXPECT_EQ(bytes_of(folder / "after.pfm"), bytes_of(folder / "before.pfm"));
}

TEST(Maps, FilesHoldXYZInThisOrder) {
  const TemporaryFolder folder;
  const cv::Mat map(8, 8, CV_32FC3, cv::Scalar(1, 2, 3));
  write_map(folder / "n.tiff", map);
  // OpenCV reads channels as B G R, so the file's first channel comes last.
  const cv::Mat raw = cv::imread((folder / "n.tiff").string(), cv::IMREAD_UNCHANGED);
  EXPECT_EQ(raw.at<cv::Vec3f>(2, 2), cv::Vec3f(3, 2, 1));
  write_map(folder / "n.pfm", map);
  const std::string pfm = bytes_of(folder / "n.pfm");
  float first[3];
  std::memcpy(first, pfm.data() + pfm.size() - sizeof first, sizeof first);
  EXPECT_EQ(first[0], 1);
  EXPECT_EQ(first[2], 3);
}

TEST(Maps, PfmIsBottomRowFirstInBothByteOrders) {
  const TemporaryFolder folder;
  const float values[4] = {1.5f, 2.5f, 3.5f, 4.5f};
  std::string little(reinterpret_cast<const char*>(values), sizeof values);
  std::string big;
  for (int i = 0; i < 4; ++i) {
    for (int j = 3; j >= 0; --j) big += little[4 * i + j];
  }
  for (const auto& [scale, data] :
       {std::pair<std::string, std::string>("-1.0", little), {"1.0", big}}) {
    const cv::Mat map = read_map(folder.write("m.pfm", "Pf\n2 2\n" + scale + "\n" + data));
    EXPECT_EQ(map.at<float>(1, 0), 1.5f);
    EXPECT_EQ(map.at<float>(1, 1), 2.5f);
    EXPECT_EQ(map.at<float>(0, 0), 3.5f);
  }
}

TEST(Maps, PngRoundsAndMarksWhatItCannotHold) {
  const TemporaryFolder folder;
  const cv::Mat map = (cv::Mat_<float>(1, 6) << 1.2345f, 0, -2, NAN, 70, 0.0004f);
  write_map(folder / "d.png", map, 1000);
  const cv::Mat raw = cv::imread((folder / "d.png").string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(raw.type(), CV_16UC1);
  EXPECT_EQ(raw.at<ushort>(0, 0), 1235);  // 1234.5 rounds away from zero
  for (int i = 1; i < 6; ++i) EXPECT_EQ(raw.at<ushort>(0, i), 0) << i;
  EXPECT_FLOAT_EQ(read_map(folder / "d.png", 1000).at<float>(0, 0), 1.235f);
  EXPECT_FLOAT_EQ(read_map(folder / "d.png", 500).at<float>(0, 0), 2.47f);
}

TEST(Maps, ScalesOfPngAreAboveZero) {
  const TemporaryFolder folder;
  const cv::Mat map = cv::Mat::ones(3, 3, CV_32FC1);
  for (const double scale : {0.0, -1000.0, static_cast<double>(NAN)}) {
    EXPECT_NE(error_of([&] { write_map(folder / "m.png", map, scale); }).find("scale of PNG"),
              std::string::npos);
    EXPECT_NE(error_of([&] { read_map(folder / "m.png", scale); }).find("scale of PNG"),
              std::string::npos);
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Maps, UnsupportedOnesAreRefused) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_map(folder / "a.jpg", random_map(CV_32FC1)), Error);
  EXPECT_THROW(write_map(folder / "a.png", random_map(CV_32FC3)), Error);
  EXPECT_THROW(write_map(folder / "a.tiff", random_map(CV_64FC1)), Error);
  for (const char* name : {"deep.tiff", "deep.pgm"}) {
    cv::imwrite((folder / name).string(), cv::Mat(2, 2, CV_16UC1, cv::Scalar(1500)));
    EXPECT_NE(error_of([&] { read_map(folder / name, 1000); }).find("the scale of PNGs alone"),
              std::string::npos)
        << name;
  }
  folder.write("text.tiff", "no map");
  EXPECT_NE(error_of([&] { read_map(folder / "text.tiff"); }).find("is not a map that can be read"),
            std::string::npos);
  write_image(folder / "grey.png", cv::Mat(4, 4, CV_8UC1, cv::Scalar(3)));
  EXPECT_NE(error_of([&] { read_map(folder / "grey.png"); }).find("grey.png"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "a.png"));
  const std::array<int, 3> sizes = {3, 4, 5};
  const cv::Mat volume(3, sizes.data(), CV_32FC1, cv::Scalar(1));
  for (const char* name : {"a.pfm", "a.exr", "a.tiff", "a.png"}) {
    EXPECT_NE(error_of([&] { write_map(folder / name, volume); }).find("two dimensions"),
              std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / name));
  }
}

TEST(Maps, WithoutPixelsAreNotWritten) {
  const TemporaryFolder folder;
  for (const char* name : {"a.pfm", "a.tiff", "a.exr", "a.png", "a.jpg"}) {
    const std::string error = "Cannot write " + (folder / name).string() + ": the ";
    for (const cv::Mat& empty : {cv::Mat(), cv::Mat(0, 0, CV_32FC1)}) {
      EXPECT_EQ(error_of([&] { write_map(folder / name, empty); }),
                error + "map is empty; give one that has pixels.");
      EXPECT_EQ(error_of([&] { write_image(folder / name, empty); }),
                error + "image is empty; give one that has pixels.");
    }
    EXPECT_FALSE(std::filesystem::exists(folder / name));
  }
}

TEST(Images, KeepTheirDepthAndChannels) {
  const TemporaryFolder folder;
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3, CV_8UC4}) {
    cv::Mat image(9, 7, type);
    cv::randu(image, 0, 255);
    write_image(folder / "i.png", image);
    const cv::Mat again = read_image(folder / "i.png");
    ASSERT_EQ(again.type(), type);
    EXPECT_TRUE(same_bits(image, again));
  }
}

TEST(Images, Of16BitsGoToFormatsThatHoldThem) {
  const TemporaryFolder folder;
  for (const int type : {CV_16UC1, CV_16UC3}) {
    const cv::Mat image(70, 90, type, cv::Scalar::all(40'000));
    for (const char* name : {"a.jpg", "a.bmp", "a.JPG", "a.webp"}) {
      const std::string error = error_of([&] { write_image(folder / name, image); });
      EXPECT_NE(error.find(name + std::string(": its extension names no format that holds such")),
                std::string::npos)
          << error;
      EXPECT_FALSE(std::filesystem::exists(folder / name));
    }
    for (const char* name : {"a.png", "a.tiff", type == CV_16UC1 ? "a.pgm" : "a.ppm"}) {
      write_image(folder / name, image);
      EXPECT_TRUE(same_bits(image, read_image(folder / name))) << name;
    }
  }
}

TEST(Images, ThatNoFormatHoldsAreRefused) {
  const TemporaryFolder folder;
  const auto error = [&](const std::string& name, const cv::Mat& image) {
    return error_of([&] { write_image(folder / name, image); });
  };
  for (const char* name : {"a.jpg", "a.bmp"}) {
    EXPECT_NE(error(name, cv::Mat::zeros(9, 7, CV_8UC4)).find("holds such an image"),
              std::string::npos)
        << name << " would drop the alpha";
  }
  for (const int type : {CV_32SC1, CV_32FC1, CV_64FC1}) {
    EXPECT_NE(error("a.tiff", cv::Mat::zeros(9, 7, type)).find("convert it to 8 or 16 bits"),
              std::string::npos);
  }
  const std::array<int, 3> sizes = {3, 4, 5};
  EXPECT_NE(error("a.png", cv::Mat(3, sizes.data(), CV_16UC1)).find("3 dimensions"),
            std::string::npos);
}

TEST(Images, BecomeIntensities) {
  EXPECT_FLOAT_EQ(to_intensity(cv::Mat(1, 1, CV_8UC1, cv::Scalar(51)), "x").at<float>(0), 0.2f);
  EXPECT_FLOAT_EQ(to_intensity(cv::Mat(1, 1, CV_16UC1, cv::Scalar(13107)), "x").at<float>(0), 0.2f);
  // ITU-R BT.601 luma of pure blue.
  EXPECT_NEAR(to_intensity(cv::Mat(1, 1, CV_8UC3, cv::Scalar(255, 0, 0)), "x").at<float>(0), 0.114,
              2e-3);
  EXPECT_NEAR(to_intensity(cv::Mat(1, 1, CV_8UC4, cv::Scalar(255, 0, 0, 0)), "x").at<float>(0),
              0.114, 2e-3);
  EXPECT_NEAR(to_intensity(cv::Mat(1, 1, CV_8UC4, cv::Scalar(255, 255, 255, 0)), "x").at<float>(0),
              1, 1e-6);
  EXPECT_THROW(to_intensity(cv::Mat(), "x"), Error);
  EXPECT_THROW(to_intensity(cv::Mat(1, 1, CV_32SC1, cv::Scalar(3)), "x"), Error);
  EXPECT_THROW(to_intensity(cv::Mat(1, 1, CV_8UC2, cv::Scalar(3)), "x"), Error);
  EXPECT_THROW(to_intensity(cv::Mat(1, 1, CV_32FC1, cv::Scalar(NAN)), "x"), Error);
  EXPECT_THROW(to_intensity(cv::Mat(1, 1, CV_32FC1, cv::Scalar(3)), "x"), Error);
}

TEST(Images, BecomeGreyLevels) {
  const cv::Mat deep = cv::Mat_<std::uint16_t>({1, 3}, {0, 13107, 65535});
  const cv::Mat expected = cv::Mat_<std::uint8_t>({1, 3}, {0, 51, 255});
  EXPECT_TRUE(same_bits(to_grey_levels(deep, "x"), expected));
  EXPECT_EQ(to_grey_levels(cv::Mat(1, 1, CV_8UC3, cv::Scalar(0, 255, 0)), "x").at<uchar>(0), 150);
  const TemporaryFolder folder;
  write_image(folder / "deep.png", deep);
  EXPECT_TRUE(same_bits(read_grey_levels(folder / "deep.png"), expected));
  EXPECT_NE(error_of([] { to_grey_levels({}, "none.png"); }).find("none.png"), std::string::npos);
}

TEST(Images, OfLittleContrastAreStretched) {
  cv::Mat ramp(10, 100, CV_32FC1);
  for (int x = 0; x < ramp.cols; ++x) ramp.col(x) = x / 99.0;
  EXPECT_EQ(contrast_gain(0.3 * ramp, 20), 1);
  EXPECT_NEAR(contrast_gain(0.1 * ramp + 0.5, 20), 0.25 / 0.096, 0.1);
  EXPECT_NEAR(contrast_gain(0.02 * ramp, 20), 0.25 / 0.0192, 0.4);
  EXPECT_EQ(contrast_gain(0.001 * ramp, 20), 20);
  EXPECT_EQ(contrast_gain(0.001 * ramp, 1), 1);
  cv::Mat masked = 0.1 * ramp;
  masked.rowRange(0, 5) = -1;
  EXPECT_NEAR(contrast_gain(masked, 20), 0.25 / 0.096, 0.1);
  cv::Mat of_10_bits;
  ramp.convertTo(of_10_bits, CV_16U, 1023);
  double brightest = 0;
  cv::minMaxLoc(to_stretched_grey_levels(of_10_bits, "x"), nullptr, &brightest);
  EXPECT_NEAR(brightest, 0.25 / 0.96 * 255, 2);
  EXPECT_TRUE(same_bits(to_stretched_grey_levels(ramp, "x"), to_grey_levels(ramp, "x")));
}

TEST(Images, ThatAreHazyAreStretchedWithoutCuttingOffWhatIsBright) {
  cv::Mat ramp(10, 100, CV_32FC1);
  for (int x = 0; x < ramp.cols; ++x) ramp.col(x) = x / 99.0;
  const auto ends = [](const cv::Mat& image, const cv::Mat& field_of_view,
                       std::optional<double> gain) {
    double darkest = 0, brightest = 0;
    cv::minMaxLoc(to_stretched_grey_levels(image, "x", field_of_view, gain).row(0), &darkest,
                  &brightest);
    return std::pair(darkest, brightest);
  };
  const double range = 0.25 / 0.96 * 255;
  for (const double veil : {0.3, 0.5, 0.7, 0.9}) {
    const auto [darkest, brightest] = ends(0.1 * ramp + veil, {}, std::nullopt);
    EXPECT_NEAR(brightest - darkest, range, 2) << veil;
    EXPECT_GT(darkest, 50) << "room for outliers";
  }
  const auto [darkest, brightest] = ends(0.1 * ramp + 0.9, {}, 5);
  EXPECT_NEAR(brightest - darkest, 0.1 * 5 * 255, 2) << "by a gain that is known";
  const cv::Mat bright = 0.1 * ramp + 0.9;
  EXPECT_TRUE(same_bits(to_stretched_grey_levels(bright, "x", {}, 1), to_grey_levels(bright, "x")));
  // A black rim is none of what is seen.
  cv::Mat rim = 0.1 * ramp + 0.9, field_of_view(10, 100, CV_8UC1, cv::Scalar(255));
  rim.rowRange(5, 10) = 0;
  field_of_view.rowRange(5, 10) = 0;
  EXPECT_EQ(ends(rim, field_of_view, std::nullopt), ends(0.1 * ramp + 0.9, {}, std::nullopt));
  EXPECT_NE(error_of([&] {
              to_stretched_grey_levels(ramp, "x", field_of_view.colRange(0, 9));
            }).find("mask of the field of view is 9x10"),
            std::string::npos);
}

TEST(Images, OfFewerBitsAreStretched) {
  const cv::Mat of_12_bits = cv::Mat_<std::uint16_t>({1, 3}, {0, 819, 4095});
  const cv::Mat result = stretched(of_12_bits, 4095, "x");
  const cv::Mat expected = cv::Mat_<std::uint16_t>({1, 3}, {0, 13107, 65535});
  EXPECT_TRUE(same_bits(result, expected));
  EXPECT_EQ(stretched(cv::Mat(2, 2, CV_16UC3, cv::Scalar::all(255)), 255, "x").at<ushort>(1, 5),
            65535);
  EXPECT_EQ(stretched(cv::Mat(2, 2, CV_16UC4, cv::Scalar(0, 4095, 0, 65535)), 4095, "x")
                .at<cv::Vec4w>(1, 1),
            cv::Vec4w(0, 65535, 0, 65535))
      << "an opaque alpha is no brightness";
  EXPECT_NE(error_of([&] {
              stretched(of_12_bits, 1023, "dark.png");
            }).find("dark.png has the value 4095, above the white level 1023"),
            std::string::npos);
  EXPECT_NE(error_of([] { stretched(cv::Mat(2, 2, CV_8UC1), 4095, "x"); }).find("16 bits"),
            std::string::npos);
  EXPECT_NE(error_of([] { stretched({}, 4095, "x"); }).find("x is empty"), std::string::npos);
  for (const int white : {0, -1, 65536}) {
    const cv::Mat black = cv::Mat::zeros(2, 2, CV_16UC1);
    EXPECT_NE(error_of([&] {
                stretched(black, white, "x");
              }).find("the white level " + std::to_string(white) + ";"),
              std::string::npos);
  }
}

TEST(Images, MasksAreAllThatIsAboveZero) {
  const TemporaryFolder folder;
  write_image(folder / "mask.png", cv::Mat_<std::uint16_t>({1, 3}, {0, 1, 65535}));
  const cv::Mat mask = read_mask(folder / "mask.png");
  const cv::Mat expected = cv::Mat_<std::uint8_t>({1, 3}, {0, 255, 255});
  ASSERT_EQ(mask.type(), expected.type());
  EXPECT_TRUE(same_bits(mask, expected));
  // Labels: as grey, the darkest colours are 0.
  const cv::Mat labels = (cv::Mat_<cv::Vec3b>(1, 4) << cv::Vec3b(0, 0, 0), cv::Vec3b(1, 0, 0),
                          cv::Vec3b(0, 1, 0), cv::Vec3b(0, 0, 1));
  write_image(folder / "labels.png", labels);
  const cv::Mat of_labels = read_mask(folder / "labels.png");
  EXPECT_EQ(of_labels.at<std::uint8_t>(0, 0), 0);
  EXPECT_EQ(cv::countNonZero(of_labels), 3);
  // How opaque a pixel is says nothing.
  write_image(folder / "opaque.png", cv::Mat(2, 3, CV_8UC4, cv::Scalar(0, 0, 0, 255)));
  EXPECT_EQ(cv::countNonZero(read_mask(folder / "opaque.png")), 0);
}

TEST(Images, MasksOfJpegsAreCutAtHalf) {
  const TemporaryFolder folder;
  cv::Mat disc = cv::Mat::zeros(64, 64, CV_8UC1);
  cv::circle(disc, {32, 32}, 20, 255, cv::FILLED);
  write_image(folder / "mask.jpg", disc);
  cv::Mat beside;
  cv::dilate(disc, beside, cv::Mat::ones(5, 5, CV_8UC1));
  const cv::Mat ringing = read_image(folder / "mask.jpg");
  ASSERT_GT(cv::countNonZero(ringing & (beside == 0)), 0);
  const cv::Mat mask = read_mask(folder / "mask.jpg");
  EXPECT_EQ(cv::countNonZero(mask & (beside == 0)), 0);
  EXPECT_NEAR(cv::countNonZero(mask), cv::countNonZero(disc), 10);
}

TEST(BadFiles, AreNamed) {
  const TemporaryFolder folder;
  const auto message = [&](const std::filesystem::path& path) {
    const std::string error = error_of([&] { read_image(path); });
    EXPECT_NE(error.find(path.string()), std::string::npos) << error;
    return error;
  };
  message(folder / "missing.png");
  message(folder.path());
  message(folder.write("empty.png", ""));
  message(folder.write("garbage.png", "no image at all"));
  message(folder.write("garbage.jpg", std::string("\xff\xd8\xff garbage")));
  write_map(folder / "float.tiff", random_map(CV_32FC1));
  message(folder / "float.tiff");
}

TEST(BadFiles, EveryTruncationIsNoticed) {
  const TemporaryFolder folder;
  cv::Mat image(40, 50, CV_8UC3);
  cv::randu(image, 0, 255);
  for (const char* name : {"i.png", "i.jpg"}) {
    write_image(folder / name, image);
    const std::string whole = bytes_of(folder / name);
    ASSERT_NO_THROW(read_image(folder / name));
    for (std::size_t size = 0; size < whole.size() - 2; size += whole.size() / 40) {
      EXPECT_THROW(read_image(folder.write(std::string("cut_") + name, whole.substr(0, size))),
                   Error)
          << name << " " << size;
    }
  }
  for (const char* name : {"m.pfm", "m.tiff", "m.exr"}) {
    write_map(folder / name, random_map(CV_32FC1));
    const std::string whole = bytes_of(folder / name);
    for (std::size_t size = 0; size < whole.size() * 9 / 10; size += whole.size() / 40) {
      EXPECT_THROW(read_map(folder.write(std::string("cut_") + name, whole.substr(0, size))), Error)
          << name << " " << size;
    }
  }
}

TEST(BadFiles, PfmMapsAreWholeToTheLastByte) {
  const TemporaryFolder folder;
  write_map(folder / "m.pfm", random_map(CV_32FC1));
  const std::string whole = bytes_of(folder / "m.pfm");
  EXPECT_THROW(read_map(folder.write("cut.pfm", whole.substr(0, whole.size() - 1))), Error);
  EXPECT_NE(error_of([&] {
              read_map(folder.write("more.pfm", whole + "\n"));
            }).find("more.pfm has 1 bytes more than its header says"),
            std::string::npos);
}

TEST(Maps, PfmHeadersMayHaveCrLf) {
  const TemporaryFolder folder;
  const float values[] = {1.5f, 2.5f};
  const std::string data(reinterpret_cast<const char*>(values), sizeof values);
  const std::string header = "Pf\r\n2 1\r\n-1.0\r\n";
  const cv::Mat map = read_map(folder.write("m.pfm", header + data));
  EXPECT_EQ(map.at<float>(0, 0), 1.5f);
  EXPECT_EQ(map.at<float>(0, 1), 2.5f);
  for (const std::string& other : {data + "\r\n", data.substr(1)}) {
    EXPECT_THROW(read_map(folder.write("m.pfm", header + other)), Error);
  }
}

TEST(BadFiles, PfmHeadersAreChecked) {
  const TemporaryFolder folder;
  for (const char* header :
       {"Pf\n-2 2\n-1\n", "Pf\n2000000000 2000000000\n-1\n", "Pf\nnan 2\n-1\n", "Pf\n2 2\n0\n",
        "Pf\n2 2\nnan\n", "P6\n2 2\n-1\n", "Pf\n2.5 2\n-1\n", "Pf\n", ""}) {
    EXPECT_THROW(read_map(folder.write("h.pfm", header + std::string(16, 'x'))), Error) << header;
  }
}

TEST(BadFiles, PreviewsEndsAreNotTheImages) {
  const TemporaryFolder folder;
  cv::Mat image(40, 50, CV_8UC3);
  cv::randu(image, 0, 255);
  write_image(folder / "i.jpg", image);
  const std::string jpeg = bytes_of(folder / "i.jpg");
  const std::string preview = "preview \xff\xd9 preview";
  const auto length = static_cast<char>(2 + preview.size());
  const std::string whole =
      jpeg.substr(0, 2) + "\xff\xe1" + '\0' + length + preview + jpeg.substr(2);
  EXPECT_NO_THROW(read_image(folder.write("whole.jpg", whole)));
  EXPECT_THROW(read_image(folder.write("half.jpg", whole.substr(0, whole.size() / 2))), Error);
  EXPECT_THROW(read_image(folder.write("preview.jpg", whole.substr(0, 40))), Error);
}

TEST(BadFiles, WhatFollowsAnImageIsIgnored) {
  const TemporaryFolder folder;
  const cv::Mat image(9, 7, CV_8UC3, cv::Scalar(10, 20, 30));
  for (const char* name : {"i.png", "i.jpg"}) {
    write_image(folder / name, image);
    const std::string whole = bytes_of(folder / name);
    for (const std::string& more : {std::string(5000, '\0'), std::string("more"), whole}) {
      EXPECT_NO_THROW(EXPECT_EQ(read_image(folder.write(name, whole + more)).size(), image.size()))
          << name;
    }
  }
}

TEST(BadFiles, DamagedChunksOfPngAreNoticed) {
  const TemporaryFolder folder;
  cv::Mat image(20, 30, CV_8UC1);
  cv::randu(image, 0, 255);
  write_image(folder / "i.png", image);
  const std::string whole = bytes_of(folder / "i.png");
  for (std::size_t at = 16; at < whole.size(); at += 7) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 4);
    testing::internal::CaptureStderr();
    const std::string error = error_of([&] { read_image(folder.write("d.png", damaged)); });
    EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << at;
    EXPECT_NE(error.find("damaged"), std::string::npos) << at << " " << error;
  }
}

TEST(BadFiles, PngsWithoutAHeaderAreDamaged) {
  const TemporaryFolder folder;
  write_image(folder / "i.png", cv::Mat::zeros(8, 8, CV_8UC1));
  const std::string whole = bytes_of(folder / "i.png");
  const std::string signature_and_end = whole.substr(0, 8) + whole.substr(whole.size() - 12);
  EXPECT_NE(error_of([&] {
              read_image(folder.write("e.png", signature_and_end));
            }).find("e.png is truncated or damaged"),
            std::string::npos);
}

/// Of one colour: few bytes.
TEST(BadFiles, PngsOfTooManyPixelsAreNotDecoded) {
  const TemporaryFolder folder;
  const auto error = [&](cv::Size size) {
    cv::imwrite((folder / "i.png").string(), cv::Mat::zeros(size, CV_8UC1));
    return error_of([&] { read_image(folder / "i.png"); });
  };
  EXPECT_EQ(error({16384, 1}), "");
  EXPECT_EQ(error({16385, 2}), (folder / "i.png").string() +
                                   " is 16385x2 pixels; reduce it to sides of at most 16384.");
  EXPECT_NE(error({2, 16385}).find("is 2x16385 pixels"), std::string::npos);
}

/// Stands for a full disk: files cannot grow beyond `bytes`.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int) = SIG_DFL;
};

TEST(Writing, NoticesAFullDisk) {
  const TemporaryFolder folder;
  cv::Mat image(64, 64, CV_8UC3);
  cv::randu(image, 0, 255);
  const std::string text(5000, 'x');
  const PointCloud cloud(1000);
  const std::map<std::string, std::function<void(const std::filesystem::path&)>> writers = {
      {"i.png", [&](const auto& path) { write_image(path, image); }},
      {"i.jpg", [&](const auto& path) { write_image(path, image); }},
      {"i.bmp", [&](const auto& path) { write_image(path, image); }},
      {"m.tiff", [&](const auto& path) { write_map(path, random_map(CV_32FC3)); }},
      {"m.pfm", [&](const auto& path) { write_map(path, random_map(CV_32FC3)); }},
      {"m.exr", [&](const auto& path) { write_map(path, random_map(CV_32FC3)); }},
      {"m.png", [&](const auto& path) { write_map(path, random_map(CV_32FC1)); }},
      {"t.txt", [&](const auto& path) { write_text(path, text); }},
      {"c.ply", [&](const auto& path) { write_ply(path, cloud); }}};
  for (const auto& [name, write] : writers) {
    // All but the last byte fits: what is written as files are closed is checked, too.
    write(folder / name);
    const std::uintmax_t size = std::filesystem::file_size(folder / name);
    std::filesystem::remove(folder / name);
    for (const std::uintmax_t limit : {std::uintmax_t{0}, size / 2, size - 1}) {
      testing::internal::CaptureStderr();
      std::string error;
      {
        const FileSizeLimit full(limit);
        error = error_of([&, &write = write, &name = name] { write(folder / name); });
      }
      EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << name;
      EXPECT_NE(error.find(name), std::string::npos) << name << ": " << error;
      EXPECT_NE(error.find("File too large; make room"), std::string::npos)
          << name << ": " << error;
      EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << name << " " << limit;
    }
  }
}

TEST(Writing, KeepsThePermissionsOfWhatItReplaces) {
  const TemporaryFolder folder;
  using std::filesystem::perms;
  const auto mode = [&] { return std::filesystem::status(folder / "result.txt").permissions(); };
  for (const perms before : {perms(0600), perms(0664)}) {
    folder.write("result.txt", "old");
    std::filesystem::permissions(folder / "result.txt", before);
    write_text(folder / "result.txt", "new");
    EXPECT_EQ(mode(), before);
  }
}

TEST(Writing, FollowsSymbolicLinks) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "elsewhere");
  folder.write("elsewhere/target.txt", "old");
  std::filesystem::create_symlink("elsewhere/target.txt", folder / "link.txt");
  std::filesystem::create_symlink(folder / "link.txt", folder / "second.txt");
  write_text(folder / "second.txt", "new");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "second.txt"));
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "link.txt"));
  EXPECT_EQ(bytes_of(folder / "elsewhere/target.txt"), "new");
  std::filesystem::create_symlink("elsewhere/none_yet.txt", folder / "dangling.txt");
  write_text(folder / "dangling.txt", "first");
  EXPECT_TRUE(std::filesystem::is_symlink(folder / "dangling.txt"));
  EXPECT_EQ(bytes_of(folder / "elsewhere/none_yet.txt"), "first");
  std::filesystem::create_symlink("loop.txt", folder / "loop.txt");
  EXPECT_NE(error_of([&] { write_text(folder / "loop.txt", "x"); }).find("loop.txt"),
            std::string::npos);
  std::filesystem::create_symlink("none/file.txt", folder / "lost.txt");
  EXPECT_NE(error_of([&] { write_text(folder / "lost.txt", "x"); }).find("create it"),
            std::string::npos);
}

TEST(Writing, LeavesDevicesAndFifosWhatTheyAre) {
  const TemporaryFolder folder;
  const std::filesystem::path fifo = folder / "fifo.png";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  const int reader = open(fifo.c_str(), O_RDONLY | O_NONBLOCK);
  const cv::Mat image(3, 3, CV_8UC1, cv::Scalar(7));
  write_image(fifo, image);
  std::array<char, 4096> received{};
  EXPECT_GT(read(reader, received.data(), received.size()), 60);
  EXPECT_EQ(std::string(received.data() + 1, 3), "PNG");
  ASSERT_TRUE(std::filesystem::is_fifo(fifo));
  // Through links of /proc, as /dev/stdout is one, open files go on where they are.
  const std::filesystem::path log = folder.write("log.txt", "before ");
  const int open_file = open(log.c_str(), O_WRONLY | O_APPEND);
  write_text("/proc/self/fd/" + std::to_string(open_file), "after");
  close(open_file);
  close(reader);
  EXPECT_EQ(bytes_of(log), "before after");
  std::filesystem::create_symlink("/dev/null", folder / "null");
  write_text(folder / "null", "x");
  EXPECT_TRUE(std::filesystem::is_character_file(folder / "null"));
  std::filesystem::create_symlink("/dev/full", folder / "full");
  EXPECT_NE(error_of([&] { write_text(folder / "full", "x"); }).find("No space left on device"),
            std::string::npos);
  EXPECT_TRUE(std::filesystem::is_character_file(folder / "full"));
  EXPECT_NE(error_of([&] { write_text(folder.path(), "x"); }).find("is a folder"),
            std::string::npos);
}

TEST(Writing, WhatAKilledProcessLeavesIsRemovedOnDemand) {
  const TemporaryFolder folder;
  folder.write("kept.txt", "");
  std::filesystem::path unfinished;
  write_file(folder / "a.txt", [&](std::ostream&) {
    for (const auto& entry : std::filesystem::directory_iterator(folder.path())) {
      if (entry.path().filename() != "kept.txt") unfinished = entry.path();
    }
  });
  folder.write(unfinished.filename(), "");
  remove_unfinished_files(folder.path());
  EXPECT_FALSE(std::filesystem::exists(unfinished));
  EXPECT_TRUE(std::filesystem::exists(folder / "kept.txt"));
  EXPECT_NO_THROW(remove_unfinished_files(folder / "none"));
}

TEST(Writing, NeedsAName) {
  EXPECT_NE(error_of([] { write_text("", "x"); }).find("without a name"), std::string::npos);
  EXPECT_NE(error_of([] { require_writable(""); }).find("without a name"), std::string::npos);
}

TEST(Writing, TakesTheLongestNames) {
  const TemporaryFolder folder;
  const std::string longest = std::string(251, 'n') + ".png";
  write_image(folder / longest, cv::Mat(3, 3, CV_8UC1, cv::Scalar(7)));
  EXPECT_FALSE(read_image(folder / longest).empty());
  const std::string error = error_of([&] { write_text(folder / ("n" + longest), "x"); });
  EXPECT_NE(error.find("File name too long"), std::string::npos) << error;
}

/// A process of another container may have the same ID.
TEST(Writing, LeavesFilesThatOthersAreWriting) {
  const TemporaryFolder folder;
  std::string mine;
  write_file(folder / "a.txt", [&](std::ostream&) {
    mine = std::filesystem::directory_iterator(folder.path())->path().filename().string();
  });
  const std::size_t number = mine.rfind('-') + 1;
  std::vector<std::string> others;
  for (int i = 1; i < 10; ++i) {
    others.push_back(mine.substr(0, number) + std::to_string(std::stoi(mine.substr(number)) + i));
    folder.write(others.back(), "theirs");
  }
  write_text(folder / "b.txt", "b");
  prepare_output_folder(folder.path());
  require_writable(folder / "c.txt");
  EXPECT_EQ(bytes_of(folder / "b.txt"), "b");
  for (const std::string& other : others) EXPECT_EQ(bytes_of(folder / other), "theirs") << other;
}

TEST(Writing, GivesThePermissionsOfAnyNewFile) {
  const TemporaryFolder folder;
  const mode_t before = umask(027);
  write_text(folder / "a.txt", "a");
  umask(before);
  EXPECT_EQ(std::filesystem::status(folder / "a.txt").permissions(),
            static_cast<std::filesystem::perms>(0640));
}

TEST(Writing, LeavesNothingBehindWhenItFails) {
  const TemporaryFolder folder;
  EXPECT_THROW(write_file(folder / "a.txt",
                          [](std::ostream& stream) {
                            stream << "half" << std::flush;
                            throw Error("disk full");
                          }),
               Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
  write_text(folder / "b.txt", "old");
  EXPECT_THROW(write_file(folder / "b.txt", [](std::ostream&) { throw Error("no"); }), Error);
  EXPECT_EQ(bytes_of(folder / "b.txt"), "old");
  write_text(folder / "b.txt", "new");
  EXPECT_EQ(bytes_of(folder / "b.txt"), "new");
  EXPECT_THROW(write_text(folder / "no/such/folder.txt", "x"), Error);
  EXPECT_THROW(write_text(folder / "b.txt/below.txt", "x"), Error);
  EXPECT_THROW(prepare_output_folder(folder / "b.txt/below"), Error);
  EXPECT_NO_THROW(prepare_output_folder(folder / "new/folder"));
  EXPECT_TRUE(std::filesystem::is_empty(folder / "new/folder"));
}

}  // namespace
}  // namespace widestereo
