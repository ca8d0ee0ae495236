// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>

namespace widestereo::test {

/// The unit vector at angle theta from the optical axis, radians; azimuth from the x to the y axis.
inline Eigen::Vector3d direction(double theta, double azimuth) {
  return {std::sin(theta) * std::cos(azimuth), std::sin(theta) * std::sin(azimuth),
          std::cos(theta)};
}

}  // namespace widestereo::test
