// SPDX-License-Identifier: MIT
#include "synthesis/texture.h"

#include <algorithm>
#include <cmath>

namespace widestereo::synthesis {
namespace {

double lattice_value(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed * 0x9e3779b9u + static_cast<std::uint32_t>(x) * 0x85ebca6bu;
  h = (h ^ (h >> 15)) * 0x2c1b3c6du + static_cast<std::uint32_t>(y) * 0xc2b2ae35u;
  h = (h ^ (h >> 13)) * 0x297a2d39u + static_cast<std::uint32_t>(z) * 0x27d4eb2fu;
  h = (h ^ (h >> 16)) * 0x45d9f3bu;
  h ^= h >> 16;
  return h / 4294967296.0;
}

double smooth(double t) { return t * t * t * (t * (6 * t - 15) + 10); }

double value_noise(const Eigen::Vector3d& p, std::uint32_t seed) {
  const Eigen::Array3d base = p.array().floor();
  const Eigen::Vector3d f = p - base.matrix();
  const Eigen::Vector3i i = base.cast<int>().matrix();
  const double u = smooth(f.x());
  const double v = smooth(f.y());
  const double w = smooth(f.z());
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const int dx = corner & 1;
    const int dy = corner >> 1 & 1;
    const int dz = corner >> 2;
    sum += lattice_value(i.x() + dx, i.y() + dy, i.z() + dz, seed) * (dx ? u : 1 - u) *
           (dy ? v : 1 - v) * (dz ? w : 1 - w);
  }
  return sum;
}

/// 0 where a feature is too small for a footprint, 1 where it is resolved well.
double visibility(double feature, double footprint) {
  return std::clamp(feature / std::max(footprint, 1e-9) / 2 - 0.5, 0.0, 1.0);
}

/// Soft checkerboard in [0, 1], edges as wide as the footprint.
double checker(const Eigen::Vector3d& p, double scale, double footprint) {
  const auto stripe = [&](double x) {
    const double phase = std::abs(std::remainder(x / scale, 2.0));  // 0..1
    const double width = std::max(footprint / scale, 1e-6);
    return std::clamp((phase - 0.5) / width, -1.0, 1.0);
  };
  // The small shift keeps faces of axis-aligned boxes off the pattern's own edges.
  return 0.5 + 0.5 * stripe(p.x() + 0.031) * stripe(p.y() + 0.017) * stripe(p.z() + 0.023);
}

}  // namespace

double octave_noise(const Eigen::Vector3d& point, double scale, double footprint,
                    std::uint32_t seed) {
  double sum = 0;
  double amplitude = 0.5;
  double feature = scale;
  for (std::uint32_t octave = 0; octave < 8 && visibility(feature, footprint) > 0; ++octave) {
    sum += amplitude * visibility(feature, footprint) *
           (value_noise(point / feature, seed + 101 * octave) - 0.5);
    amplitude *= 0.75;
    feature *= 0.5;
  }
  return std::clamp(0.5 + sum, 0.0, 1.0);
}

Eigen::Vector3d paint_at(const Paint& paint, const Eigen::Vector3d& point, double footprint,
                         std::uint32_t seed) {
  double mix = 0;
  Eigen::Vector3d p = point;
  switch (paint.pattern) {
    case Paint::Pattern::noise:
      mix = std::clamp(0.5 + 2.5 * (octave_noise(p, 1.7 * paint.scale, footprint, seed + 7) - 0.5),
                       0.0, 1.0);
      break;
    case Paint::Pattern::checker:
      mix = checker(p, paint.scale, footprint);
      break;
    case Paint::Pattern::planks:
      p.z() *= 0.15;  // grain along z
      mix = octave_noise({std::floor(p.x() / paint.scale), 0.5, 0.5}, 1.3, 0, seed + 3);
      break;
  }
  const double grain =
      1 + paint.contrast * 1.6 * (octave_noise(p, paint.scale, footprint, seed) - 0.5);
  const Eigen::Vector3d colour = (1 - mix) * paint.colour + mix * paint.second;
  return (colour * grain).cwiseMax(0.02).cwiseMin(1.0);
}

}  // namespace widestereo::synthesis
