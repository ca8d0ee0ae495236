// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/evaluation.h"
#include "widestereo/rig.h"

namespace widestereo {

/// A rendered view of an analytic scene with its exact ground truth.
struct RenderedView {
  cv::Mat image;  ///< CV_8UC3, BGR, black outside the field of view
  /// Exact at pixel centres. Occlusion is relative to the next view; of the last one, to the first.
  GroundTruth truth;
};

/// The views of one analytic scene.
struct RenderedPair {
  Rig rig;
  std::vector<RenderedView> views;  ///< as many as rig.views
};

/// Sides of the images of demo_rig() and surround_rig() that commands offer, pixels.
inline constexpr int least_demo_size = 64, largest_demo_size = 4096;

/// The cameras of `widestereo demo`: two double spheres of 195 degrees with a 0.1 m baseline.
/// `size` is the side of the square images in pixels; the field of view does not depend on it.
Rig demo_rig(int size);

/// Four cameras of 220 degrees on a circle of 0.2 m radius that look outwards, each by 90 degrees
/// to the right of the one before, so that all but what is very near is seen by two of them or
/// more.
Rig surround_rig(int size);

/// What the demo's cameras see: a textured room with slanted and curved surfaces and occlusions,
/// which reach beyond 90 degrees off axis.
RenderedPair render_demo(int size, std::uint32_t seed = 1);

/// The same seen after the rig has moved to `world_from_rig` (metres; the demo is the identity).
/// The rig returned is the calibration, which does not move.
RenderedPair render_demo_from(const Eigen::Isometry3d& world_from_rig, int size,
                              std::uint32_t seed = 1);

/// The same room seen by another rig, anywhere between its walls: 5.4 m wide (x), 2.5 m high (y)
/// and 5.6 m long (z), the demo's first camera at the origin.
RenderedPair render_demo_room(const Rig& rig, std::uint32_t seed = 1);

/// Nearest and farthest distance (metres) that suit the demo scene.
std::pair<double, double> demo_distance_range();

/// One textured slanted plane filling both views, for tests: {X : normal . X = offset} in the world
/// frame (metres), seen by the rig's views, with a smooth random texture.
RenderedPair render_plane(const Rig& rig, const Eigen::Vector3d& normal, double offset,
                          std::uint32_t seed = 1);

}  // namespace widestereo
