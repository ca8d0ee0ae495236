// SPDX-License-Identifier: MIT
// What is looked at in images before they are matched.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/epipolar.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"

/// Whether an image shows nothing but noise where the mask, which may be empty, is not 0.
bool is_blank(const cv::Mat& image, const cv::Mat& mask);
/// Which two views have one picture, as a sentence; empty where none have. That of one camera on
/// both channels, or a copy, matches itself at any distance. Blank ones may be alike.
std::string same_pictures(const widestereo::Rig& rig, const std::vector<cv::Mat>& images);
/// Throws Error where there are such views.
void require_different_pictures(const widestereo::Rig& rig, const std::vector<cv::Mat>& images);
/// Says, on standard error, which images are blank: black ones, of a covered lens or a camera that
/// failed.
void report_blank_images(const widestereo::Rig& rig, const std::vector<cv::Mat>& images);

/// The features of a pair's images that match; none of more or fewer views.
std::vector<widestereo::PixelMatch> features_of_pair(const std::vector<cv::Mat>& images);
/// Says, on standard error, where many of a pair's features lie outside the range of distances,
/// which the pixels there cannot tell: they match something else. `unit`: of lengths.
void report_features_out_of_range(const widestereo::Rig& rig,
                                  const std::vector<widestereo::PixelMatch>& matches,
                                  const widestereo::Options& options, const std::string& unit);
