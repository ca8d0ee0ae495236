// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace widestereo::synthesis {

/// Smooth noise in [0, 1], mean about 0.5: octaves of value noise on a lattice, from `scale` metres
/// downwards. Octaves finer than `footprint` (metres a pixel covers) are faded out, so that images
/// do not alias.
double octave_noise(const Eigen::Vector3d& point, double scale, double footprint,
                    std::uint32_t seed);

/// How a surface is painted; noise is taken at world positions, so that corners need no seams.
struct Paint {
  enum class Pattern { noise, checker, planks };
  Eigen::Vector3d colour = {0.7, 0.7, 0.7};  ///< red, green, blue in [0, 1]
  Eigen::Vector3d second = {0.3, 0.3, 0.3};
  Pattern pattern = Pattern::noise;
  double scale = 0.3;     ///< metres: largest features
  double contrast = 1.0;  ///< of the noise
};

/// Colour in [0, 1] at a world position.
Eigen::Vector3d paint_at(const Paint& paint, const Eigen::Vector3d& point, double footprint,
                         std::uint32_t seed);

}  // namespace widestereo::synthesis
