// SPDX-License-Identifier: MIT
// Cameras and rigs of MultiCol-SLAM (LaFiDa's helmet), whose lenses are OCam's. Format: the
// project's sources.
#pragma once

#include <filesystem>
#include <functional>

#include "calibration/formats.h"

namespace widestereo::calibration {

/// Whether a document is one camera of MultiCol-SLAM, or where all of them are.
bool is_multicol(const Document& document);
/// `load` reads a rig's cameras, InteriorOrientationFisheye0.yaml, ..., which lie beside it. Throws
/// Error naming the file and the key.
Rig read_multicol(const Document& document,
                  const std::function<Document(const std::filesystem::path&)>& load);

}  // namespace widestereo::calibration
