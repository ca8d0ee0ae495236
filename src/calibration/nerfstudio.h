// SPDX-License-Identifier: MIT
// transforms.json of nerfstudio and Instant NGP: images with their cameras and poses. Format:
// nerfstudio's documentation, "Data conventions".
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <vector>

#include "calibration/colmap_files.h"

namespace widestereo::calibration {

/// In COLMAP's terms, whose camera models and pixel centres it has; no points.
struct Transforms {
  std::map<std::uint64_t, ColmapCamera> cameras;
  std::vector<ColmapImage> images;
};

/// Whether a path is a JSON file that has frames.
bool is_transforms_file(const std::filesystem::path& path);

/// Throws Error naming the file and the frame.
Transforms read_transforms(const std::filesystem::path& file);

}  // namespace widestereo::calibration
