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

/// Says, on standard error, which views see nothing that another one does.
void report_views_without_overlap(const widestereo::Rig& rig,
                                  const widestereo::StereoResult& result);

/// Says, on standard error, where costs cannot be means over as many sources as asked for.
void report_few_sources(const widestereo::Options& options, std::size_t views);

/// Throws Error also when validation was asked for and reported anything. Once nothing else can be
/// wrong with the request, and before the work, the output folder is prepared and locked.
MatchingRun match_images(const MatchSettings& settings, const widestereo::Rig& rig,
                         const std::vector<cv::Mat>& images, const std::string& output);
