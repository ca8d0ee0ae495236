// SPDX-License-Identifier: MIT
// What every matcher is made of before its back end: schedule, sizes and rays.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "matching/backend.h"
#include "schedule/schedule.h"

namespace widestereo {

struct MatchSetup {
  /// Throws Error when rig or options are invalid or do not suit a device of this kind and type.
  MatchSetup(const Rig& rig, const Options& options, const DeviceInfo& device);
  /// Hands all viewing rays to the back end; returns those of the rig's views, CV_32FC4.
  std::vector<cv::Mat> set_rays(Backend& backend) const;
  /// That is used: Options::filter where the device has it.
  Filter filter() const { return static_cast<Filter>(schedule.constants.filter); }

  Schedule schedule;       ///< of a frame by itself
  Schedule warm_schedule;  ///< of one that starts from the previous one; set_motion() completes it
  std::vector<cv::Size> sizes;  ///< of each view at each level
};

/// Throws Error unless there are planes of a frame before to start from; `remedy` ends the
/// sentence.
void require_planes(bool there_are, const std::string& remedy);

}  // namespace widestereo
