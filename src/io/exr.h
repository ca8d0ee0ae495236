// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <iosfwd>
#include <opencv2/core/mat.hpp>
#include <vector>

namespace widestereo {

/// Decodes an OpenEXR file of one channel, whatever its name, or of R G B or X Y Z, besides which
/// there may be an A; 16-bit floats become 32-bit ones. `path` is for messages.
cv::Mat read_exr(const std::filesystem::path& path, const std::vector<uchar>& bytes);

/// Writes CV_32FC1 as channel Y, CV_32FC3 as R G B, 32-bit floats compressed without loss.
void write_exr(std::ostream& stream, const cv::Mat& map);

}  // namespace widestereo
