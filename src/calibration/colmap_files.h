// SPDX-License-Identifier: MIT
// What the files of a COLMAP model hold, in either form (.bin or .txt). Formats: COLMAP's
// documentation, "Output Format".
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "calibration/colmap_camera.h"

namespace widestereo::calibration {

struct ColmapImage {
  std::uint64_t number = 0;  ///< COLMAP's
  std::string name;
  Eigen::Isometry3d camera_from_world = Eigen::Isometry3d::Identity();
  std::uint64_t camera = 0;
  std::vector<std::uint64_t> points;  ///< that it observes
  std::filesystem::path mask = {};    ///< file of one; COLMAP's models have none
};

/// The file NAME.bin, else NAME.txt, of a model's folder; empty where there is neither.
std::filesystem::path colmap_file(const std::filesystem::path& folder, const std::string& name);

/// Read one file from beginning to end. Throw Error naming the file and, of text, the line.
void each_colmap_camera(const std::filesystem::path& file,
                        const std::function<void(ColmapCamera)>& visit);
void each_colmap_image(const std::filesystem::path& file,
                       const std::function<void(ColmapImage)>& visit);
void each_colmap_point(
    const std::filesystem::path& file,
    const std::function<void(std::uint64_t number, const Eigen::Vector3d& position)>& visit);

}  // namespace widestereo::calibration
