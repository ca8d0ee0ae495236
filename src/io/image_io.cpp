// SPDX-License-Identifier: MIT
#include "widestereo/image_io.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <ostream>
#include <span>
#include <system_error>

#include "geometry/validation.h"
#include "io/bgr8.h"
#include "io/exr.h"
#include "io/intensity_range.h"
#include "io/pfm.h"
#include "statistics/percentile.h"
#include "text/file_type.h"
#include "text/lower_case.h"
#include "text/number.h"
#include "widestereo/error.h"
#include "widestereo/files.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t largest_file = 4ull << 30;
constexpr double white_of_16_bits = 65535;
constexpr double least_contrast = 0.25, contrast_outliers = 0.02;

std::vector<uchar> read_bytes(const fs::path& path) {
  const fs::file_type type = type_of(path);
  if (type == fs::file_type::not_found) {
    throw Error("There is no file " + path.string() + "; check the path.");
  }
  if (type != fs::file_type::regular) {
    throw Error(path.string() + " is not a file; give an image file.");
  }
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) {
    throw Error("Cannot read " + path.string() + ": " + error.message() + "; check the disk.");
  }
  if (size > largest_file) {
    throw Error(path.string() + " is larger than 4 GiB; give an image of less.");
  }
  std::vector<uchar> bytes(size);
  std::ifstream file(path, std::ios::binary);
  file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size));
  if (!file && size > 0) {
    throw Error("Cannot read " + path.string() + "; check its permissions.");
  }
  return bytes;
}

bool begins_with(std::span<const uchar> bytes, std::initializer_list<uchar> head) {
  return bytes.size() >= head.size() && std::equal(head.begin(), head.end(), bytes.begin());
}

bool is_png(std::span<const uchar> bytes) { return begins_with(bytes, {0x89, 'P', 'N', 'G'}); }

bool is_jpeg(std::span<const uchar> bytes) { return begins_with(bytes, {0xff, 0xd8, 0xff}); }

/// Big-endian, of 2 or 4 bytes.
std::size_t number_at(std::span<const uchar> bytes, std::size_t position, std::size_t size) {
  std::size_t number = 0;
  for (const uchar byte : bytes.subspan(position, size)) number = number << 8 | byte;
  return number;
}

/// Whether all chunks are there, from the header up to the last one, those that matter undamaged.
bool is_whole_png(std::span<const uchar> bytes) {
  constexpr std::size_t of_header = 13;
  constexpr std::size_t signature = 8, around_data = 12;  // length, type and CRC of a chunk
  for (std::size_t at = signature; at + around_data <= bytes.size();) {
    const std::size_t length = number_at(bytes, at, 4);
    if (length > bytes.size() - at - around_data) return false;
    const auto type_and_data = bytes.subspan(at + 4, length + 4);
    const bool is_header = begins_with(type_and_data, {'I', 'H', 'D', 'R'}) && length == of_header;
    if (at == signature && !is_header) return false;
    const bool is_critical = type_and_data[0] >= 'A' && type_and_data[0] <= 'Z';
    const auto crc = crc32_z(0, type_and_data.data(), type_and_data.size());
    if (is_critical && crc != number_at(bytes, at + 8 + length, 4)) return false;
    if (begins_with(type_and_data, {'I', 'E', 'N', 'D'})) return true;
    at += around_data + length;
  }
  return false;
}

/// Whether the image's own end is there; a preview within a segment has one, too.
bool is_whole_jpeg(std::span<const uchar> bytes) {
  constexpr uchar stuffing = 0, first_restart = 0xd0, start = 0xd8, end = 0xd9, fill = 0xff;
  for (std::size_t at = 2; at + 1 < bytes.size();) {
    const uchar marker = bytes[at + 1];
    if (bytes[at] != 0xff || marker == fill) {
      ++at;  // of compressed data, or before a marker
    } else if (marker == stuffing || (marker >= first_restart && marker <= start)) {
      at += 2;
    } else if (marker == end) {
      return true;
    } else {
      if (at + 4 > bytes.size()) return false;
      at += 2 + number_at(bytes, at + 2, 2);
    }
  }
  return false;
}

/// Decoders fill the missing part of a truncated PNG or JPEG silently. What follows the end is none
/// of it: cameras append data.
bool is_truncated(std::span<const uchar> bytes) {
  if (is_png(bytes)) return !is_whole_png(bytes);
  if (is_jpeg(bytes)) return !is_whole_jpeg(bytes);
  return false;
}

/// PNGs of few bytes may hold more pixels than memory does: of those, which must be whole, the
/// header alone is read.
void require_usable_size(std::span<const uchar> bytes, const fs::path& path) {
  constexpr std::size_t header_at = 16;
  if (!is_png(bytes)) return;
  const std::size_t width = number_at(bytes, header_at, 4);
  const std::size_t height = number_at(bytes, header_at + 4, 4);
  if (std::max(width, height) <= largest_image_side) return;
  throw Error(path.string() + " is " + std::to_string(width) + "x" + std::to_string(height) +
              " pixels; reduce it to sides of at most " + std::to_string(largest_image_side) + ".");
}

/// `kind` and `formats`: what the file should be.
cv::Mat decode(const std::vector<uchar>& bytes, const fs::path& path, const std::string& kind,
               const std::string& formats) {
  if (bytes.empty()) throw Error(path.string() + " is empty; give an image file.");
  if (is_truncated(bytes)) throw Error(path.string() + " is truncated or damaged; copy it again.");
  require_usable_size(bytes, path);
  cv::Mat image;
  try {
    image = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw;
    image.release();
  }
  if (image.empty()) {
    throw Error(path.string() + " is not " + kind + " that can be read (or is truncated); use " +
                formats + ".");
  }
  return image;
}

/// `path`: the file that has them, which messages name.
cv::Mat image_in(const std::vector<uchar>& bytes, const fs::path& path) {
  cv::Mat image = decode(bytes, path, "an image", "PNG, JPEG, TIFF, PGM or BMP");
  require_image(image, path.string());
  return image;
}

/// Empty where the extension names no format that takes it.
std::vector<uchar> encoded(const std::string& extension, const cv::Mat& image,
                           const std::vector<int>& parameters = {}) {
  std::vector<uchar> bytes;
  try {
    if (!cv::imencode(extension, image, bytes, parameters)) bytes.clear();
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw;
    bytes.clear();
  }
  return bytes;
}

/// Formats of 8 bits take images of 16, too, but OpenCV cuts off what is above 255; those without
/// transparency drop it.
bool holds(const std::string& extension, const cv::Mat& image) {
  constexpr int side = 64;
  const cv::Mat part =
      image(cv::Rect(0, 0, std::min(image.cols, side), std::min(image.rows, side)));
  const std::vector<uchar> bytes = encoded(extension, part);
  return !bytes.empty() && cv::imdecode(bytes, cv::IMREAD_UNCHANGED).type() == image.type();
}

[[noreturn]] void refuse_format(const fs::path& path) {
  throw Error("Cannot write " + path.string() +
              ": its extension names no format that holds such an image; use .png.");
}

/// In memory: OpenCV's own writing of files does not notice a full disk.
void encode(const fs::path& path, const cv::Mat& image, const std::vector<int>& parameters = {}) {
  const std::vector<uchar> bytes = encoded(path.extension().string(), image, parameters);
  if (bytes.empty()) refuse_format(path);
  write_file(path, [&](std::ostream& stream) {
    stream.write(reinterpret_cast<const char*>(bytes.data()),
                 static_cast<std::streamsize>(bytes.size()));
  });
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

void require_png_scale(double scale) {
  if (std::isfinite(scale) && scale > 0) return;
  throw Error("The scale of PNG maps is " + text_of(scale) + "; give a number above 0.");
}

}  // namespace

cv::Mat read_image(const fs::path& path) { return image_in(read_bytes(path), path); }

double largest_value(const cv::Mat& image) {
  double largest = 0;
  const int colours = image.empty() ? 0 : std::min(image.channels(), 3);
  for (int channel = 0; channel < colours; ++channel) {
    cv::Mat values;
    cv::extractChannel(image, values, channel);
    double of_channel = 0;
    cv::minMaxLoc(values, nullptr, &of_channel);
    largest = std::max(largest, of_channel);
  }
  return largest;
}

cv::Mat stretched(const cv::Mat& image, int white, const std::string& name) {
  require_pixels(image, name);
  if (white < 1 || white > white_of_16_bits) {
    throw Error(name + " cannot be stretched from the white level " + std::to_string(white) +
                "; give the largest value that its camera has, such as 4095.");
  }
  if (image.depth() != CV_16U) {
    throw Error(name + " has no 16 bits, so that its white is known; leave the white level out.");
  }
  const double brightest = largest_value(image);
  if (brightest > white) {
    throw Error(name + " has the value " + std::to_string(cvRound(brightest)) +
                ", above the white level " + std::to_string(white) + "; give a higher one.");
  }
  cv::Mat result;
  image.convertTo(result, CV_16U, white_of_16_bits / white);
  return result;
}

cv::Mat to_intensity(const cv::Mat& image, const std::string& name) {
  require_image_or_float(image, name);
  const double scale = image.depth() == CV_8U    ? 1 / 255.0
                       : image.depth() == CV_16U ? 1 / white_of_16_bits
                                                 : 1;
  cv::Mat grey = image;
  if (image.channels() == 3) cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
  if (image.channels() == 4) cv::cvtColor(image, grey, cv::COLOR_BGRA2GRAY);
  cv::Mat intensity;
  grey.convertTo(intensity, CV_32F, scale);
  // Integers are in range.
  if (image.depth() == CV_32F && !cv::checkRange(intensity, true, nullptr, 0, 1 + 1e-6)) {
    throw Error(name + " has values outside [0, 1] or not finite; scale it first.");
  }
  return intensity;
}

cv::Mat read_mask(const std::filesystem::path& path) {
  const std::vector<uchar> bytes = read_bytes(path);
  const cv::Mat image = image_in(bytes, path);
  to_intensity(image, path.string());  // refuses what is no image
  // Before conversion to grey, which rounds the darkest colours to 0.
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  if (channels.size() == 4) {
    double least = 0;
    double most = 0;
    cv::minMaxLoc(channels[3], &least, &most);
    if (least != most) {
      throw Error(path.string() +
                  " is transparent in places; save the mask without transparency, 0 where pixels "
                  "are to be ignored.");
    }
  }
  const int most_ignored = is_jpeg(bytes) ? 127 : 0;  // compression changes zeros
  cv::Mat mask = channels[0] > most_ignored;
  for (std::size_t i = 1; i < std::min<std::size_t>(channels.size(), 3); ++i) {
    mask |= channels[i] > most_ignored;
  }
  return mask;
}

std::pair<double, double> intensity_range(const cv::Mat& intensity, double outliers) {
  constexpr std::size_t sample = 100'000;
  require_type(intensity, CV_32FC1, "The image of intensities");
  std::vector<float> values;
  const auto columns = static_cast<std::size_t>(intensity.cols);
  const std::size_t step = intensity.total() / sample + 1;
  for (std::size_t i = 0; i < intensity.total(); i += step) {
    const float value =
        intensity.at<float>(static_cast<int>(i / columns), static_cast<int>(i % columns));
    if (value >= 0) values.push_back(value);
  }
  if (values.empty()) return {0, 0};
  return {static_cast<double>(percentile(values, outliers)),
          static_cast<double>(percentile(values, 1 - outliers))};
}

double contrast_gain(const cv::Mat& intensity, double most) {
  if (most <= 1) return 1;
  const auto [darkest, brightest] = intensity_range(intensity, contrast_outliers);
  const double contrast = brightest - darkest;
  return std::clamp(least_contrast / std::max(contrast, least_contrast / most), 1.0, most);
}

cv::Mat to_grey_levels(const cv::Mat& image, const std::string& name) {
  cv::Mat grey;
  to_intensity(image, name).convertTo(grey, CV_8U, 255);
  return grey;
}

cv::Mat to_stretched_grey_levels(const cv::Mat& image, const std::string& name,
                                 const cv::Mat& field_of_view, std::optional<double> gain) {
  const cv::Mat intensity = to_intensity(image, name);
  require_optional_map(field_of_view, image.size(), CV_8UC1, "The mask of the field of view");
  cv::Mat seen = intensity;
  if (!field_of_view.empty()) {
    seen = intensity.clone();
    seen.setTo(-1, field_of_view == 0);
  }
  const double factor = gain ? *gain : contrast_gain(seen, usual_max_gain);
  // As much is left below the darkest as the range is wide, for outliers.
  const double darkest = factor * intensity_range(seen, contrast_outliers).first;
  const double offset = factor > 1 ? std::max(darkest - least_contrast, 0.0) : 0;
  cv::Mat grey;
  intensity.convertTo(grey, CV_8U, 255 * factor, -255 * offset);
  return grey;
}

cv::Mat read_grey_levels(const std::filesystem::path& path) {
  return to_grey_levels(read_image(path), path.string());
}

cv::Mat read_map(const fs::path& path, double png_scale) {
  require_png_scale(png_scale);
  const std::string extension = extension_of(path);
  if (extension == ".pfm") return read_pfm(path, read_bytes(path));
  if (extension == ".exr") return read_exr(path, read_bytes(path));
  const cv::Mat image = decode(read_bytes(path), path, "a map",
                               "a 32-bit float TIFF or PFM, OpenEXR, or a 16-bit PNG");
  cv::Mat map;
  if (image.type() == CV_16UC1 && extension != ".png") {
    throw Error(path.string() +
                " has 16 bits, which hold distances by the scale of PNGs alone; convert it to a "
                "16-bit PNG, or to a 32-bit float TIFF in metres.");
  }
  if (image.type() == CV_16UC1) {
    image.convertTo(map, CV_32F, 1 / png_scale);
  } else if (image.type() == CV_32FC1 || image.type() == CV_32FC3) {
    map = with_channels_swapped(image);
  } else {
    throw Error(
        path.string() +
        " is not a float map; give a 32-bit float TIFF or PFM, an OpenEXR image, or a 16-bit PNG.");
  }
  return map;
}

void write_map(const fs::path& path, const cv::Mat& map, double png_scale) {
  require_pixels(map, "Cannot write " + path.string() + ": the map");
  require_png_scale(png_scale);
  if (map.dims > 2 || (map.type() != CV_32FC1 && map.type() != CV_32FC3)) {
    throw Error("Cannot write " + path.string() +
                ": a map needs two dimensions and one or three float channels.");
  }
  const std::string extension = extension_of(path);
  if (extension == ".pfm") {
    write_file(path, [&](std::ostream& stream) { write_pfm(stream, map); });
  } else if (extension == ".exr") {
    write_file(path, [&](std::ostream& stream) { write_exr(stream, map); });
  } else if (extension == ".tif" || extension == ".tiff") {
    // By default OpenCV compresses three float channels with loss (LogLuv).
    constexpr int no_compression = 1;
    encode(path, with_channels_swapped(map), {cv::IMWRITE_TIFF_COMPRESSION, no_compression});
  } else if (extension == ".png" && map.channels() == 1) {
    encode(path, to_png16(map, png_scale));
  } else {
    throw Error("Cannot write " + path.string() +
                ": maps are written as .tiff, .exr, .pfm or (one channel) .png.");
  }
}

void write_image(const fs::path& path, const cv::Mat& image) {
  const std::string what = "Cannot write " + path.string() + ": the image";
  require_pixels(image, what);
  require_two_dimensions(image, what);
  if (image.depth() != CV_8U && image.depth() != CV_16U) {
    throw Error(what + " is " + cv::typeToString(image.type()) +
                "; convert it to 8 or 16 bits, or write it as a map.");
  }
  if (!holds(path.extension().string(), image)) refuse_format(path);
  encode(path, image);
}

}  // namespace widestereo
