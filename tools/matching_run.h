// SPDX-License-Identifier: MIT
// Runs a match for the command line: opens the device, shows progress, reports the devices passed
// over.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "folder_lock.h"
#include "match_settings.h"
#include "widestereo/epipolar.h"
#include "widestereo/matcher.h"
#include "widestereo/sfm_model.h"

struct MatchingRun {
  widestereo::Options options;
  widestereo::DeviceInfo device;
  widestereo::StereoResult result;
  std::shared_ptr<const FolderLock> lock = nullptr;  ///< of the folder that it is written to
};

/// The settings with the range of distances of a reconstruction's points where none is given:
/// presets have one in metres. `calibration` names the file.
MatchSettings with_range(MatchSettings settings, const widestereo::CalibratedImages& images,
                         const std::string& calibration);

/// Throws Error where the device has no texture units that filter intensities.
void require_device_filter(const widestereo::DeviceInfo& device);

/// Opens the device and reports, on standard error, those passed over. Throws Error where a given
/// option has no effect on it.
widestereo::Device open_device(const MatchSettings& settings);

/// Throws Error when validation was asked for and reported anything.
void require_no_validation_messages(const widestereo::Device& device);

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

/// Says, on standard error, which views see nothing that another one does.
void report_views_without_overlap(const widestereo::Rig& rig,
                                  const widestereo::StereoResult& result);

/// Says, on standard error, where costs cannot be means over as many sources as asked for.
void report_few_sources(const widestereo::Options& options, std::size_t views);

/// Throws Error also when validation was asked for and reported anything. Once nothing else can be
/// wrong with the request, and before the work, the output folder is prepared and locked.
MatchingRun match_images(const MatchSettings& settings, const widestereo::Rig& rig,
                         const std::vector<cv::Mat>& images, const std::string& output);
