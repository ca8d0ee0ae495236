// SPDX-License-Identifier: MIT
#include "io/pfm.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>

#include "text/number.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr long largest_side = 65536;

/// The next word of the header; leaves `position` after the one white-space character that ends it.
std::string next_word(const std::vector<uchar>& bytes, std::size_t& position) {
  const auto is_space = [](uchar c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; };
  while (position < bytes.size() && is_space(bytes[position])) ++position;
  std::string word;
  while (position < bytes.size() && !is_space(bytes[position]) && word.size() < 64) {
    word += static_cast<char>(bytes[position++]);
  }
  ++position;
  return word;
}

/// Likewise, NaN if it is none.
double next_number(const std::vector<uchar>& bytes, std::size_t& position) {
  return number_of(next_word(bytes, position)).value_or(std::nan(""));
}

}  // namespace

cv::Mat read_pfm(const std::filesystem::path& path, const std::vector<uchar>& bytes) {
  std::size_t position = 0;
  const std::string kind = next_word(bytes, position);
  const double width = next_number(bytes, position);
  const double height = next_number(bytes, position);
  const double scale = next_number(bytes, position);
  const bool good_size = width >= 1 && height >= 1 && width <= largest_side &&
                         height <= largest_side && width == std::floor(width) &&
                         height == std::floor(height);
  if ((kind != "Pf" && kind != "PF") || !good_size || !std::isfinite(scale) || scale == 0) {
    throw Error(path.string() + " has no valid PFM header; write it again.");
  }
  const int channels = kind == "PF" ? 3 : 1;
  const auto rows = static_cast<std::size_t>(height);
  const std::size_t row_bytes = static_cast<std::size_t>(width) * channels * sizeof(float);
  const std::size_t map_bytes = row_bytes * rows;
  // The one character after the scale is two where lines end in CR LF.
  const bool is_crlf =
      position < bytes.size() && bytes[position - 1] == '\r' && bytes[position] == '\n';
  if (is_crlf) ++position;
  if (bytes.size() < position + map_bytes) {
    throw Error(path.string() + " is truncated; copy it again.");
  }
  if (bytes.size() > position + map_bytes) {
    throw Error(path.string() + " has " + std::to_string(bytes.size() - position - map_bytes) +
                " bytes more than its header says; write it again.");
  }
  cv::Mat map(static_cast<int>(height), static_cast<int>(width), CV_MAKETYPE(CV_32F, channels));
  for (std::size_t i = 0; i < rows; ++i) {
    uchar* row = map.ptr(static_cast<int>(rows - 1 - i));
    std::memcpy(row, bytes.data() + position + i * row_bytes, row_bytes);
    if (scale > 0) {  // big-endian
      for (std::size_t j = 0; j < row_bytes; j += 4) std::reverse(row + j, row + j + 4);
    }
  }
  return map;
}

void write_pfm(std::ostream& stream, const cv::Mat& map) {
  stream << (map.channels() == 3 ? "PF" : "Pf") << "\n"
         << text_of(map.cols) << " " << text_of(map.rows) << "\n-1.0\n";
  const auto row_bytes = static_cast<std::streamsize>(map.cols * map.elemSize());
  for (int y = map.rows - 1; y >= 0; --y) {
    stream.write(reinterpret_cast<const char*>(map.ptr(y)), row_bytes);
  }
}

}  // namespace widestereo
