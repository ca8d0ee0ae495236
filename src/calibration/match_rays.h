// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Dense>

#include "widestereo/epipolar.h"
#include "widestereo/rig.h"

namespace widestereo {

/// The rays of a feature that two views see.
class MatchRays {
 public:
  MatchRays(const View& first, const View& second)
      : first_(first),
        second_(second),
        first_camera_(first.camera),
        second_camera_(second.camera) {}

  const PreparedCamera& first_camera() const { return first_camera_; }
  const PreparedCamera& second_camera() const { return second_camera_; }

  /// False where it is masked, or where a camera has no ray.
  bool find(const PixelMatch& match, Eigen::Vector3d& ray_first,
            Eigen::Vector3d& ray_second) const {
    return !is_masked(first_, match.first) && !is_masked(second_, match.second) &&
           first_camera_.unproject(match.first, ray_first) &&
           second_camera_.unproject(match.second, ray_second);
  }

 private:
  const View& first_;
  const View& second_;
  PreparedCamera first_camera_, second_camera_;
};

/// Distance along a ray to the point nearest to it and to another view's ray, from the angles of
/// the triangle; below 0 where that lies behind. `centre`: of the other view, from that of the
/// first.
inline double triangulated_distance(const Eigen::Vector3d& ray, const Eigen::Vector3d& other,
                                    const Eigen::Vector3d& centre) {
  const Eigen::Vector3d normal = ray.cross(other);
  return centre.cross(other).dot(normal) / normal.squaredNorm();
}

}  // namespace widestereo
