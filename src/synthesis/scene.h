// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "synthesis/texture.h"

namespace widestereo::synthesis {

/// A ray from `origin` along the unit vector `direction`, world frame.
struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
};

struct Hit {
  double distance = 0;     ///< metres along the ray, > 0
  Eigen::Vector3d normal;  ///< unit, facing the ray's origin, world frame
  int surface = 0;         ///< index into the scene
};

/// A painted surface with a closed-form intersection.
class Surface {
 public:
  explicit Surface(const Paint& paint) : paint_(paint) {}
  virtual ~Surface() = default;
  /// Nearest intersection beyond a hair's breadth; `normal` may point to either side.
  virtual bool intersect(const Ray& ray, double& distance, Eigen::Vector3d& normal) const = 0;
  const Paint& paint() const { return paint_; }

 private:
  Paint paint_;
};

/// {X : normal . X = offset}, infinite.
std::unique_ptr<Surface> make_plane(const Paint& paint, const Eigen::Vector3d& normal,
                                    double offset);
/// A box of the given full size, seen from outside or inside.
std::unique_ptr<Surface> make_box(const Paint& paint, const Eigen::Isometry3d& pose,
                                  const Eigen::Vector3d& size);
std::unique_ptr<Surface> make_sphere(const Paint& paint, const Eigen::Vector3d& centre,
                                     double radius);
/// An upright (along y) open cylinder between two heights.
std::unique_ptr<Surface> make_cylinder(const Paint& paint, const Eigen::Vector3d& centre,
                                       double radius, double height);

struct Scene {
  std::vector<std::unique_ptr<Surface>> surfaces;
  Eigen::Vector3d light = {0, -1, 0};  ///< a lamp, world frame
  double ambient = 0.5;                ///< share of light that does not depend on the lamp

  std::optional<Hit> cast(const Ray& ray) const;
  /// Colour in [0, 1] (red, green, blue) of a hit; independent of the viewer.
  Eigen::Vector3d shade(const Ray& ray, const Hit& hit, double footprint, std::uint32_t seed) const;
};

}  // namespace widestereo::synthesis
