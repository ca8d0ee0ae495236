// SPDX-License-Identifier: MIT
// How near a match comes to what a device can do.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/device.h"
#include "widestereo/matcher.h"

/// The shortest time in which a device could do counted work.
struct Roofline {
  double milliseconds = 0;  ///< 0 where none of the peaks is known
  std::string bound;        ///< what takes that long: "operations", "texels" or "bytes"

  /// The share that it makes up of a time; none where either is not known.
  std::optional<double> share_of(double time) const;
};

/// Of one kernel: the longest of its operations, texels and bytes, each at its peak.
Roofline roofline(const widestereo::KernelWork& work, const widestereo::DevicePeaks& peaks);

/// Of kernels one after the other: the sum, and the bound that makes up most of it.
Roofline roofline(const std::vector<widestereo::KernelTime>& kernels,
                  const widestereo::DevicePeaks& peaks);

/// Null where a peak is not known.
nlohmann::ordered_json to_json(const widestereo::DevicePeaks& peaks);
