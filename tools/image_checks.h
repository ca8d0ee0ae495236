// SPDX-License-Identifier: MIT
// What is looked at in images before they are matched.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/epipolar.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"
#include "widestereo/sfm_model.h"

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

/// Two views that are matched with each other, and the features of their images that match.
struct MatchedViews {
  widestereo::View first, second;
  std::vector<widestereo::PixelMatch> matches;
  widestereo::DistanceRange range;  ///< in which distances are looked for
};

/// View 0 with each of the others that sees, within the range of distances and from another place,
/// what it does; of two views always both.
std::vector<MatchedViews> match_with_first(const widestereo::Rig& rig,
                                           const std::vector<cv::Mat>& images,
                                           const widestereo::Options& options);
/// Says, on standard error, where many features of all pairs lie outside the range of distances,
/// which the pixels there cannot tell: they match something else. `unit`: of lengths;
/// `is_unit_doubtful`: the calibration may have another one.
void report_features_out_of_range(const std::vector<MatchedViews>& pairs, const std::string& unit,
                                  bool is_unit_doubtful);
