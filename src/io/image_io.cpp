// SPDX-License-Identifier: MIT
#include "widestereo/image_io.h"

#include <array>
#include <cmath>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <ostream>
#include <system_error>

#include "io/pfm.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t largest_file = 4ull << 30;

std::vector<uchar> read_bytes(const fs::path& path) {
  std::error_code error;
  const auto status = fs::status(path, error);
  if (!fs::exists(status)) throw Error("There is no file " + path.string() + "; check the path.");
  if (!fs::is_regular_file(status)) {
    throw Error(path.string() + " is not a file; give an image file.");
  }
  const std::uintmax_t size = fs::file_size(path, error);
  if (error || size > largest_file) {
    throw Error("Cannot read " + path.string() + ": it is larger than 4 GiB or not readable.");
  }
  std::vector<uchar> bytes(size);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file && size > 0) {
    throw Error("Cannot read " + path.string() + "; check its permissions.");
  }
  return bytes;
}

bool ends_with(const std::vector<uchar>& bytes, const std::vector<uchar>& tail) {
  return bytes.size() >= tail.size() && std::equal(tail.rbegin(), tail.rend(), bytes.rbegin());
}

/// Decoders fill the missing part of a truncated PNG or JPEG silently, so look for the end marker.
bool is_truncated(const std::vector<uchar>& bytes) {
  const auto begins_with = [&](std::initializer_list<uchar> head) {
    return bytes.size() >= head.size() && std::equal(head.begin(), head.end(), bytes.begin());
  };
  if (begins_with({0x89, 'P', 'N', 'G'})) {
    return !ends_with(bytes, {'I', 'E', 'N', 'D', 0xae, 0x42, 0x60, 0x82});
  }
  if (begins_with({0xff, 0xd8, 0xff})) {
    // Cameras may append data; the marker must merely be there.
    const std::array<uchar, 2> end = {0xff, 0xd9};
    return std::search(bytes.begin(), bytes.end(), end.begin(), end.end()) == bytes.end();
  }
  return false;
}

cv::Mat decode(const fs::path& path) {
  const std::vector<uchar> bytes = read_bytes(path);
  if (bytes.empty()) throw Error(path.string() + " is empty; give an image file.");
  if (is_truncated(bytes)) throw Error(path.string() + " is truncated; copy it again.");
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception&) {
    image.release();
  }
  if (image.empty()) {
    throw Error(path.string() +
                " is not an image that can be read (or is truncated); use PNG, JPEG, "
                "TIFF, PGM or BMP.");
  }
  return image;
}

/// In memory: OpenCV's own writing of files does not notice a full disk.
void encode(const fs::path& path, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  std::vector<uchar> bytes;
  bool encoded = false;
  try {
    encoded = cv::imencode(path.extension().string(), image, bytes, parameters);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw;
  }
  if (!encoded) {
    throw Error("Cannot write " + path.string() +
                ": its extension names no format that holds such an image; use .png.");
  }
  write_file(path, [&](std::ostream& stream) {
    stream.write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
  });
}

std::string extension_of(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

/// OpenCV keeps channels in B G R order, maps are x y z.
cv::Mat with_channels_swapped(const cv::Mat& map) {
  if (map.channels() != 3) return map;
  cv::Mat swapped;
  cv::cvtColor(map, swapped, cv::COLOR_BGR2RGB);
  return swapped;
}

cv::Mat to_png16(const cv::Mat& map, double scale) {
  cv::Mat result(map.size(), CV_16UC1);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const double value = std::round(static_cast<double>(map.at<float>(y, x)) * scale);
      const bool representable = value >= 1 && value <= 65535;  // false for NaN
      result.at<ushort>(y, x) = representable ? static_cast<ushort>(value) : ushort{0};
    }
  }
  return result;
}

}  // namespace

cv::Mat read_image(const fs::path& path) {
  cv::Mat image = decode(path);
  const bool depth_known = image.depth() == CV_8U || image.depth() == CV_16U;
  if (!depth_known || (image.channels() != 1 && image.channels() != 3 && image.channels() != 4)) {
    throw Error(path.string() + " is not an 8- or 16-bit grey or colour image; convert it first.");
  }
  return image;
}

cv::Mat to_intensity(const cv::Mat& image, const std::string& name) {
  if (image.empty()) throw Error(name + " is empty; give an image.");
  double scale = 1;
  if (image.depth() == CV_8U) {
    scale = 1 / 255.0;
  } else if (image.depth() == CV_16U) {
    scale = 1 / 65535.0;
  } else if (image.depth() != CV_32F) {
    throw Error(name + " has an unsupported type; use 8 or 16 bit, or float in [0, 1].");
  }
  cv::Mat grey;
  if (image.channels() == 1) {
    grey = image;
  } else if (image.channels() == 3) {
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  } else if (image.channels() == 4) {
    cv::cvtColor(image, grey, cv::COLOR_BGRA2GRAY);
  } else {
    throw Error(name + " has " + std::to_string(image.channels()) +
                " channels; use a grey, BGR or BGRA image.");
  }
  cv::Mat intensity;
  grey.convertTo(intensity, CV_32F, scale);
  if (!cv::checkRange(intensity, true, nullptr, 0, 1 + 1e-6)) {
    throw Error(name + " has values outside [0, 1] or not finite; scale it first.");
  }
  return intensity;
}

cv::Mat to_grey_levels(const cv::Mat& image, const std::string& name) {
  cv::Mat grey;
  to_intensity(image, name).convertTo(grey, CV_8U, 255);
  return grey;
}

cv::Mat read_grey_levels(const std::filesystem::path& path) {
  return to_grey_levels(read_image(path), path.string());
}

cv::Mat read_map(const fs::path& path, double png_scale) {
  const std::string extension = extension_of(path);
  if (extension == ".pfm") return read_pfm(path, read_bytes(path));
  const cv::Mat image = decode(path);
  cv::Mat map;
  if (image.type() == CV_16UC1) {
    image.convertTo(map, CV_32F, 1 / png_scale);
  } else if (image.type() == CV_32FC1 || image.type() == CV_32FC3) {
    map = with_channels_swapped(image);
  } else {
    throw Error(path.string() +
                " is not a float map; give a 32-bit float TIFF or PFM, or a 16-bit PNG.");
  }
  return map;
}

void write_map(const fs::path& path, const cv::Mat& map, double png_scale) {
  if (map.type() != CV_32FC1 && map.type() != CV_32FC3) {
    throw Error("Cannot write " + path.string() + ": a map needs one or three float channels.");
  }
  const std::string extension = extension_of(path);
  if (extension == ".pfm") {
    write_file(path, [&](std::ostream& stream) { write_pfm(stream, map); });
  } else if (extension == ".tif" || extension == ".tiff") {
    // By default OpenCV compresses three float channels with loss (LogLuv).
    constexpr int no_compression = 1;
    encode(path, with_channels_swapped(map), {cv::IMWRITE_TIFF_COMPRESSION, no_compression});
  } else if (extension == ".png" && map.channels() == 1) {
    encode(path, to_png16(map, png_scale));
  } else {
    throw Error("Cannot write " + path.string() +
                ": maps are written as .tiff, .pfm or (one channel) .png.");
  }
}

void write_image(const fs::path& path, const cv::Mat& image) { encode(path, image); }

}  // namespace widestereo
