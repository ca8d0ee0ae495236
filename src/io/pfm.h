// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <iosfwd>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace widestereo {

/// Decodes a portable float map (bottom row first, either byte order); `path` is for messages.
cv::Mat read_pfm(const std::filesystem::path& path, const std::vector<uchar>& bytes);

/// Writes CV_32FC1 or CV_32FC3 as a little-endian portable float map.
void write_pfm(std::ostream& stream, const cv::Mat& map);

}  // namespace widestereo
