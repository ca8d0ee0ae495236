// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace widestereo {

/// The skew-symmetric matrix that takes the cross product with v: cross_matrix(v) * w = v x w.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

}  // namespace widestereo
