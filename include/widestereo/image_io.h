// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "widestereo/error.h"

namespace widestereo {

/// Reads an 8- or 16-bit image, grey, BGR or BGRA, depth kept. Throws Error (missing, truncated,
/// damaged, no image, of another type); of a damaged file OpenCV's decoders may write to standard
/// error, too, which cv::utils::logging silences in part.
cv::Mat read_image(const std::filesystem::path& path);

/// Of an image's grey or colour channels, not of its alpha; 0 where it is empty.
double largest_value(const cv::Mat& image);

/// The 16-bit image of a camera with fewer bits, whose values end at `white` (4095 where it has
/// 12), stretched to all of the 16. Throws Error for empty images and those of 8 bits, for values
/// above, and where `white` is not between 1 and 65535; `name` begins the message.
cv::Mat stretched(const cv::Mat& image, int white, const std::string& name);

/// Grey intensities in [0, 1], CV_32FC1, of an 8- or 16-bit (or float in [0, 1]) grey, BGR or BGRA
/// image. Throws Error on other types, empty images and non-finite values; `name` begins the
/// message.
cv::Mat to_intensity(const cv::Mat& image, const std::string& name);

/// By which intensities (CV_32FC1, negative = masked) of little contrast, as of dark or hazy images
/// and of cameras with fewer bits than their files, are multiplied (Options::max_gain), 1 to
/// `most`: what lies between all but the darkest and brightest 2 % then fills a quarter of [0, 1].
double contrast_gain(const cv::Mat& intensity, double most);
/// `most` of the presets `fast` and `quality`.
inline constexpr double usual_max_gain = 20;

/// Intensities as grey levels 0 to 255, CV_8UC1.
cv::Mat to_grey_levels(const cv::Mat& image, const std::string& name);
/// The same of intensities multiplied by `gain`, by default their contrast_gain() within
/// `field_of_view` (empty, or CV_8UC1 of the image's size, 0 = outside). Those of hazy images are
/// lowered first, so that none of their contrast is cut off at white.
cv::Mat to_stretched_grey_levels(const cv::Mat& image, const std::string& name,
                                 const cv::Mat& field_of_view = {},
                                 std::optional<double> gain = std::nullopt);
/// Of a file, as read_image() reads it.
cv::Mat read_grey_levels(const std::filesystem::path& path);

/// Reads a mask, CV_8UC1: 255 where a channel of a file is above 0, 0 = ignore the pixel. Of a
/// JPEG, whose compression makes other numbers of zeros, 255 where one is at least 128. Error as
/// read_image() does.
cv::Mat read_mask(const std::filesystem::path& path);

/// Reads a float map (CV_32FC1 or CV_32FC3, x y z order) from .tiff, .pfm, .exr (one channel, R G B
/// or X Y Z) or .png (16 bit, divided by `png_scale`, which is the PNG units per metre,
/// above 0). Throws Error (missing, truncated, damaged, no such map, 16 bits in no .png, no such
/// scale).
cv::Mat read_map(const std::filesystem::path& path, double png_scale = 1000.0);

/// Writes a CV_32FC1 or CV_32FC3 (x y z) map by extension: .tiff (32-bit float), .pfm, .exr (32-bit
/// float, channel Y or R G B), or .png (16 bit, CV_32FC1 only: round(value * png_scale), 0 where
/// not positive or not representable). Throws Error for empty maps, other types, extensions and
/// scales, and as write_file() does.
void write_map(const std::filesystem::path& path, const cv::Mat& map, double png_scale = 1000.0);

/// Writes an 8- or 16-bit image (PNG, JPEG, ... by extension). Throws Error for empty images, where
/// the extension names no format that holds it, and as write_file() does.
void write_image(const std::filesystem::path& path, const cv::Mat& image);

}  // namespace widestereo
