// SPDX-License-Identifier: MIT
#include "io/exr.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>

#include <cstdint>
#include <cstring>
#include <new>
#include <opencv2/core.hpp>
#include <ostream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "widestereo/error.h"

namespace widestereo {
namespace {

using Names = std::vector<std::string>;

// As of OpenCV's images.
constexpr std::int64_t most_pixels = 1 << 30;
constexpr std::int64_t longest_side = 1 << 20;

class Bytes : public Imf::IStream {
 public:
  Bytes(const std::string& name, const std::vector<uchar>& bytes)
      : IStream(name.c_str()), bytes_(bytes) {}

  bool read(char target[], int count) override {
    if (count < 0 || static_cast<std::size_t>(count) > bytes_.size() - position_) {
      throw std::runtime_error("the file ends early");
    }
    std::memcpy(target, bytes_.data() + position_, static_cast<std::size_t>(count));
    position_ += static_cast<std::size_t>(count);
    return position_ < bytes_.size();
  }
  std::uint64_t tellg() override { return position_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("the file ends early");
    position_ = position;
  }

 private:
  const std::vector<uchar>& bytes_;
  std::size_t position_ = 0;
};

class Stream : public Imf::OStream {
 public:
  explicit Stream(std::ostream& stream) : OStream("map"), stream_(stream) {}

  void write(const char source[], int count) override { stream_.write(source, count); }
  std::uint64_t tellp() override { return static_cast<std::uint64_t>(stream_.tellp()); }
  void seekp(std::uint64_t position) override {
    stream_.seekp(static_cast<std::streamoff>(position));
  }

 private:
  std::ostream& stream_;
};

/// Of a file, in the order of a map's channels; empty if they make no map.
Names channels_of_map(const Imf::Header& header) {
  std::set<std::string> there;
  for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel) {
    there.insert(channel.name());
  }
  if (there.size() > 1) there.erase("A");
  if (there.size() == 1) return {*there.begin()};
  for (const Names& names : {Names{"R", "G", "B"}, Names{"X", "Y", "Z"}}) {
    if (there == std::set<std::string>(names.begin(), names.end())) return names;
  }
  return {};
}

/// `origin`: of the pixels' coordinates in the file.
Imf::FrameBuffer frame_buffer(cv::Mat& map, const Names& channels, cv::Point origin) {
  Imf::FrameBuffer buffer;
  const std::size_t pixel = map.elemSize();
  const std::size_t row = map.step[0];
  char* of_zero = map.ptr<char>() - static_cast<std::ptrdiff_t>(pixel) * origin.x -
                  static_cast<std::ptrdiff_t>(row) * origin.y;
  for (std::size_t i = 0; i < channels.size(); ++i) {
    buffer.insert(channels[i].c_str(),
                  Imf::Slice(Imf::FLOAT, of_zero + i * sizeof(float), pixel, row));
  }
  return buffer;
}

bool is_too_large(const Imath::Box2i& window) {
  const std::int64_t width = std::int64_t{window.max.x} - window.min.x + 1;
  const std::int64_t height = std::int64_t{window.max.y} - window.min.y + 1;
  return std::max(width, height) > longest_side || width * height > most_pixels;
}

/// The image, of which a file holds a part (its data) whose first pixel is at `origin`; zero where
/// it holds nothing.
cv::Mat within(const cv::Mat& data, cv::Point origin, const Imath::Box2i& image) {
  const cv::Rect of_data(origin, data.size());
  const cv::Rect of_image(cv::Point(image.min.x, image.min.y),
                          cv::Point(image.max.x + 1, image.max.y + 1));
  if (of_data == of_image) return data;
  cv::Mat map = cv::Mat::zeros(of_image.size(), data.type());
  const cv::Rect common = of_data & of_image;
  if (!common.empty()) data(common - origin).copyTo(map(common - of_image.tl()));
  return map;
}

}  // namespace

cv::Mat read_exr(const std::filesystem::path& path, const std::vector<uchar>& bytes) {
  try {
    Bytes stream(path.string(), bytes);
    Imf::InputFile file(stream);
    const Imath::Box2i& window = file.header().dataWindow();
    const Imath::Box2i& image = file.header().displayWindow();
    const Names channels = channels_of_map(file.header());
    if (channels.empty()) {
      throw Error(path.string() +
                  " has neither one channel nor R, G and B or X, Y and Z; write the map alone.");
    }
    if (is_too_large(window) || is_too_large(image)) {
      throw std::runtime_error("it has too many pixels");
    }
    cv::Mat map(window.max.y - window.min.y + 1, window.max.x - window.min.x + 1,
                CV_MAKETYPE(CV_32F, static_cast<int>(channels.size())));
    file.setFrameBuffer(frame_buffer(map, channels, {window.min.x, window.min.y}));
    file.readPixels(window.min.y, window.max.y);
    return within(map, {window.min.x, window.min.y}, image);
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const cv::Exception&) {
    throw;  // of too little memory
  } catch (const std::exception& error) {
    throw Error(path.string() + " is truncated, damaged or no OpenEXR image (" + error.what() +
                "); copy it again.");
  }
}

void write_exr(std::ostream& stream, const cv::Mat& map) {
  cv::Mat pixels = map;  // a slice has no constant pixels
  const Names channels = map.channels() == 3 ? Names{"R", "G", "B"} : Names{"Y"};
  Imf::Header header(map.cols, map.rows);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (const std::string& channel : channels) {
    header.channels().insert(channel.c_str(), Imf::Channel(Imf::FLOAT));
  }
  std::ostringstream whole;  // it goes back to write where each row lies, which not all files allow
  {
    Stream target(whole);
    Imf::OutputFile file(target, header);
    file.setFrameBuffer(frame_buffer(pixels, channels, {0, 0}));
    file.writePixels(map.rows);
  }
  stream << whole.view();
}

}  // namespace widestereo
