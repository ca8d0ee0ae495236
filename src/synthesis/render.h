// SPDX-License-Identifier: MIT
#pragma once

#include "synthesis/scene.h"
#include "widestereo/synthesis.h"

namespace widestereo::synthesis {

/// Renders every view of the rig, with occlusion relative to the next view (cyclically).
RenderedPair render(const Scene& scene, const Rig& rig, std::uint32_t seed);

}  // namespace widestereo::synthesis
