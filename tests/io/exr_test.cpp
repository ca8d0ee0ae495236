// SPDX-License-Identifier: MIT
// OpenEXR maps, as OpenCV and OpenEXR itself write and read them.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "bytes_of.h"
#include "error_of.h"
#include "random_map.h"
#include "same_bits.h"
#include "temporary_folder.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo::test {
namespace {

/// Writes all of the channels with the same values, which a half has, too, as `part` of an image.
void write_part(const std::filesystem::path& path, const cv::Mat_<float>& values,
                const std::vector<const char*>& names, Imf::PixelType type,
                const Imath::Box2i& window, const Imath::Box2i& image) {
  Imf::Header header(image, window);
  Imf::FrameBuffer buffer;
  std::vector<cv::Mat> kept;
  for (const char* name : names) {
    header.channels().insert(name, Imf::Channel(type));
    cv::Mat pixels = values;
    if (type == Imf::HALF) values.convertTo(pixels, CV_16F);
    buffer.insert(name, Imf::Slice::Make(type, kept.emplace_back(pixels).data, window,
                                         pixels.elemSize(), pixels.step[0]));
  }
  Imf::OutputFile file(path.c_str(), header);
  file.setFrameBuffer(buffer);
  file.writePixels(values.rows);
}

/// The same, as all of an image.
void write_channels(const std::filesystem::path& path, const cv::Mat_<float>& values,
                    const std::vector<const char*>& names, Imf::PixelType type, cv::Point origin) {
  const Imath::Box2i window({origin.x, origin.y},
                            {origin.x + values.cols - 1, origin.y + values.rows - 1});
  write_part(path, values, names, type, window, window);
}

const cv::Mat_<float> four = (cv::Mat_<float>(2, 2) << 1.5f, 2.25f, 0, 40);

TEST(Exr, IsWhatOpenCvReadsAndWrites) {
  setenv("OPENCV_IO_ENABLE_OPENEXR", "1", 1);
  const TemporaryFolder folder;
  for (const int type : {CV_32FC1, CV_32FC3}) {
    const cv::Mat map = random_map(type);
    cv::Mat swapped = map.clone();  // its channels are B G R
    for (int i = 0; type == CV_32FC3 && i < static_cast<int>(map.total()); ++i) {
      std::swap(swapped.at<cv::Vec3f>(i / map.cols, i % map.cols)[0],
                swapped.at<cv::Vec3f>(i / map.cols, i % map.cols)[2]);
    }
    write_map(folder / "ours.exr", map);
    EXPECT_TRUE(
        same_bits(cv::imread((folder / "ours.exr").string(), cv::IMREAD_UNCHANGED), swapped));
    cv::imwrite((folder / "theirs.exr").string(), swapped,
                {cv::IMWRITE_EXR_TYPE, cv::IMWRITE_EXR_TYPE_FLOAT});
    EXPECT_TRUE(same_bits(read_map(folder / "theirs.exr"), map));
  }
}

TEST(Exr, MayHaveHalfFloatsAnyOriginAndAnAlpha) {
  const TemporaryFolder folder;
  for (const Imf::PixelType type : {Imf::HALF, Imf::FLOAT}) {
    for (const cv::Point& origin : {cv::Point(0, 0), cv::Point(-7, 30)}) {
      write_channels(folder / "one.exr", four, {"View Layer.Depth.V"}, type, origin);
      EXPECT_TRUE(same_bits(read_map(folder / "one.exr"), four));
      for (const std::vector<const char*>& names :
           {std::vector{"R", "G", "B", "A"}, std::vector{"X", "Y", "Z"}}) {
        write_channels(folder / "three.exr", four, names, type, origin);
        const cv::Mat map = read_map(folder / "three.exr");
        ASSERT_EQ(map.type(), CV_32FC3);
        EXPECT_EQ(map.at<cv::Vec3f>(1, 1), cv::Vec3f(40, 40, 40));
      }
    }
  }
}

/// As renderers crop what is empty around.
TEST(Exr, HoldsAPartOfTheImage) {
  const TemporaryFolder folder;
  const auto read = [&](const Imath::Box2i& image) {
    write_part(folder / "part.exr", four, {"Y"}, Imf::FLOAT, {{3, 1}, {4, 2}}, image);
    return read_map(folder / "part.exr");
  };
  cv::Mat_<float> whole(4, 6, 0.0f);
  four.copyTo(whole(cv::Rect(3, 1, 2, 2)));
  EXPECT_TRUE(same_bits(read({{0, 0}, {5, 3}}), whole));
  EXPECT_TRUE(same_bits(read({{4, 1}, {6, 1}}), cv::Mat_<float>({1, 3}, {2.25f, 0.0f, 0.0f})));
  EXPECT_TRUE(same_bits(read({{0, 5}, {2, 6}}), cv::Mat_<float>(2, 3, 0.0f))) << "nothing";
  EXPECT_NE(error_of([&] {
              read({{0, 0}, {1 << 20, 1 << 20}});
            }).find("too many pixels"),
            std::string::npos);
}

TEST(Exr, OfOtherChannelsOrNoneIsRefused) {
  const TemporaryFolder folder;
  write_channels(folder / "two.exr", four, {"Y", "Z"}, Imf::FLOAT, {0, 0});
  EXPECT_EQ(error_of([&] { read_map(folder / "two.exr"); }),
            (folder / "two.exr").string() +
                " has neither one channel nor R, G and B or X, Y and Z; write the map alone.");
  for (const std::string& bytes : {std::string(), std::string("not an image at all")}) {
    EXPECT_NE(error_of([&] {
                read_map(folder.write("no.exr", bytes));
              }).find("no.exr is truncated, damaged or no OpenEXR image"),
              std::string::npos);
  }
}

TEST(Exr, DamagedAnywhereIsReadOrRefused) {
  const TemporaryFolder folder;
  write_map(folder / "m.exr", random_map(CV_32FC1));
  const std::string whole = bytes_of(folder / "m.exr");
  for (std::size_t at = 0; at < whole.size(); at += at < 400 ? 1 : 37) {
    for (const char flipped : {'\x01', '\x80', '\x7f'}) {
      std::string damaged = whole;
      damaged[at] = static_cast<char>(damaged[at] ^ flipped);
      testing::internal::CaptureStderr();
      try {
        read_map(folder.write("d.exr", damaged));
      } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("d.exr"), std::string::npos) << error.what();
      } catch (const std::bad_alloc&) {
      }
      EXPECT_EQ(testing::internal::GetCapturedStderr(), "") << at;
    }
  }
}

}  // namespace
}  // namespace widestereo::test
