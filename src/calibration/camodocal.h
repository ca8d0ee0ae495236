// SPDX-License-Identifier: MIT
// Cameras of CamOdoCal (one file each; KITTI-360's fisheyes) and rigs of VINS-Fusion, whose
// configuration names such files and says where the cameras are. Format: the two projects' sources.
#pragma once

#include <filesystem>
#include <functional>

#include "calibration/formats.h"

namespace widestereo::calibration {

/// Whether a document is a VINS-Fusion configuration.
bool is_vins(const Document& document);
/// Its rig. `load` reads the cameras' files, cam0_calib, cam1_calib, ..., which lie beside it
/// unless their paths are absolute. Throws Error naming the file and the key.
Rig read_vins(const Document& document,
              const std::function<Document(const std::filesystem::path&)>& load);

/// Whether a document is a camera of CamOdoCal.
bool is_camodocal(const Document& document);
/// A rig of one camera. Throws Error naming the file and the key.
Rig read_camodocal(const Document& document);

}  // namespace widestereo::calibration
