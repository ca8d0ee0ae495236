// SPDX-License-Identifier: MIT
// Images of the cameras of a data set by frame, and which of them are of one frame where they have
// neither one name nor one time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace widestereo {

/// Numbers within names count as numbers, so that frame_2 is before frame_10.
struct NumericalOrder {
  bool operator()(const std::string& a, const std::string& b) const;
};

/// Images of one camera by what frames are matched by: names, or nanoseconds where a list gives
/// them.
struct CameraImages {
  std::filesystem::path folder;
  std::map<std::string, std::filesystem::path, NumericalOrder> of_frames;
  bool listed = false;
};

/// Gives images the numbers in their names as keys, those that differ within their folder, as
/// left_07 and right_07 have. Changes nothing where a folder has other names or a list.
void match_by_numbers(std::vector<CameraImages>& cameras);

/// Gives images the key of the first camera's image that is nearest in time, up to `tolerance`
/// (seconds); each to one.
void match_by_times(std::vector<CameraImages>& cameras, double tolerance);

/// The least time (seconds) between an image of the first camera and one of another; none where
/// they have no times.
std::optional<double> least_time_apart(const std::vector<CameraImages>& cameras);

/// Of digits alone, in 64 bits.
std::optional<std::int64_t> whole_number(const std::string& digits);

}  // namespace widestereo
