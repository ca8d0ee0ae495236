// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "widestereo/rig.h"

namespace widestereo {

/// A point of a scene and the views that see it, by their numbers.
struct ObservedPoint {
  Eigen::Vector3d position;  ///< world frame
  std::vector<std::size_t> observers;
};

/// Points that stand for a scene of which nothing is known but how far it reaches: on a grid of
/// rays of each view, at distances (metres) from `nearest` to `farthest` that grow by equal
/// factors, with all views that they project into. Where there are more than 64 views, the grid is
/// coarser, and points are listed for their own view and 63 more of those that see them, which that
/// view is well matched with. What hides points is not known. Cameras must be valid (validate())
/// and 0 < nearest <= farthest, which is not checked. `progress` is told the share done.
std::vector<ObservedPoint> assumed_points(const std::vector<View>& views, double nearest,
                                          double farthest,
                                          const std::function<void(double)>& progress = {});

/// Tells which of many views to match with each other: those that see the same points, each of
/// which counts by the angle between the two rays to it (most at 5 degrees: Yao et al., MVSNet,
/// ECCV 2018, section 4.1). Views that share a centre are never matched.
class ViewSelection {
 public:
  /// `centres`: of each view's camera, world frame. Views are numbered as they are, from 0; throws
  /// Error where an observer has no such number.
  ViewSelection(std::vector<Eigen::Vector3d> centres, std::vector<ObservedPoint> points);
  ~ViewSelection();
  ViewSelection(ViewSelection&&) noexcept;
  ViewSelection& operator=(ViewSelection&&) noexcept;

  /// At most `count` others, best first; fewer where fewer share points. Throws Error where there
  /// is no such view.
  std::vector<std::size_t> sources(std::size_t view, std::size_t count) const;

  /// Groups of at most `size` views to match with each other, which together hold every view. From
  /// the first view without a group on, the one joins that shares most with the member with which
  /// it shares least; one that has a group already does where it shares twice as much. Views that
  /// share points with no other are groups of one. `progress` is told the share done.
  std::vector<std::vector<std::size_t>> groups(
      std::size_t size, const std::function<void(double)>& progress = {}) const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace widestereo
