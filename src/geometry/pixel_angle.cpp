// SPDX-License-Identifier: MIT
#include "geometry/pixel_angle.h"

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "statistics/percentile.h"

namespace widestereo {

std::optional<double> pixel_angle(const PreparedCamera& camera, const Eigen::Vector2d& pixel) {
  Eigen::Vector3d left;
  Eigen::Vector3d right;
  Eigen::Vector3d above;
  Eigen::Vector3d below;
  if (!camera.unproject(pixel - Eigen::Vector2d(0.5, 0), left) ||
      !camera.unproject(pixel + Eigen::Vector2d(0.5, 0), right) ||
      !camera.unproject(pixel - Eigen::Vector2d(0, 0.5), above) ||
      !camera.unproject(pixel + Eigen::Vector2d(0, 0.5), below)) {
    return std::nullopt;
  }
  return std::sqrt((right - left).cross(below - above).norm());
}

double median_pixel_angle(const Camera& camera) {
  constexpr int pixels = 24;
  const PreparedCamera prepared(camera);
  std::vector<double> angles;
  for_each_of_grid(camera, pixels, [&](const Eigen::Vector2d& pixel) {
    if (const auto angle = pixel_angle(prepared, pixel)) angles.push_back(*angle);
  });
  return percentile(angles, 0.5);
}

}  // namespace widestereo
