// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <optional>

#include "widestereo/camera.h"

namespace widestereo {

/// Side, radians, of the square that a pixel's rays fill; none where there are none.
std::optional<double> pixel_angle(const PreparedCamera& camera, const Eigen::Vector2d& pixel);

/// Calls function(pixel) for a grid of so many pixels each way all over an image.
template <typename Function>
void for_each_of_grid(const Camera& camera, int pixels, const Function& function) {
  for (int y = 0; y < pixels; ++y) {
    for (int x = 0; x < pixels; ++x) {
      function(Eigen::Vector2d((x + 0.5) / pixels * camera.width - 0.5,
                               (y + 0.5) / pixels * camera.height - 0.5));
    }
  }
}

/// The median over the image; 0 where there are no rays.
double median_pixel_angle(const Camera& camera);

}  // namespace widestereo
