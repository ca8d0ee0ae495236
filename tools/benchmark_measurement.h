// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

/// One configuration, everything per depth map, of which a pair gives two, but the kernels'
/// dispatches, which are those of a match.
struct Measurement {
  widestereo::DeviceInfo device;
  std::string preset;
  bool warm = false;  // frames start from the planes of the one before
  int size = 0;
  int window_radius = 0;
  std::string options;                          // every parameter as JSON
  widestereo::Filter filter = {};               // that was used
  double wall = 0, wall_min = 0, wall_max = 0;  // milliseconds, the first a median
  double on_device = 0;                         // milliseconds, of the median run
  std::vector<widestereo::KernelTime> kernels;  // of the median run in which each is timed
  std::size_t device_bytes = 0;

  const char* start() const { return warm ? "warm" : "cold"; }
  double pixels() const { return static_cast<double>(size) * size; }
  /// 0 where the device does not tell its time.
  double per_second(double amount) const { return on_device > 0 ? 1000 * amount / on_device : 0; }
};

/// Matches the pair once to warm up, then `runs` times, in which each kernel is timed; on a GPU
/// once and `runs` times more, in which none is: all times but the kernels' are of these then.
/// `warm`: each time from the planes of the time before, as the next frame of a rig that rests.
Measurement measure(widestereo::Device& device, const widestereo::RenderedPair& pair,
                    const widestereo::Options& options, bool warm, int runs);

widestereo::KernelWork sum_of(const std::vector<widestereo::KernelTime>& kernels);

/// All of it, also kernel by kernel, with the rates reached and shares of the roofline.
nlohmann::ordered_json json_of(const Measurement& measurement);
