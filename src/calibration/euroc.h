// SPDX-License-Identifier: MIT
// sensor.yaml of EuRoC's data sets: one file a camera. Format: Burri et al., "The EuRoC micro
// aerial vehicle datasets", 2016.
#pragma once

#include <filesystem>
#include <vector>

#include "calibration/formats.h"

namespace widestereo::calibration {

/// cam0/sensor.yaml, cam1/sensor.yaml, ... of a folder or of its mav0; empty where there is none.
/// Throws Error where one is missing in between.
std::vector<std::filesystem::path> euroc_files(const std::filesystem::path& folder);

/// A rig of one file for each camera, in their order. Throws Error naming the file and the key.
Rig read_euroc(const std::vector<Document>& documents);

}  // namespace widestereo::calibration
