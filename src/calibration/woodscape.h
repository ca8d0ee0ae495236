// SPDX-License-Identifier: MIT
// Cameras of Valeo's WoodScape data set (JSON, one file each). Format: the data set's calibration
// documentation and projection script.
#pragma once

#include "calibration/formats.h"

namespace widestereo::calibration {

/// Whether a document is a camera of WoodScape.
bool is_woodscape(const Document& document);
/// A rig of one camera, without its pose on the vehicle. Throws Error naming the file and the key.
Rig read_woodscape(const Document& document);

}  // namespace widestereo::calibration
