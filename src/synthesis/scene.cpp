// SPDX-License-Identifier: MIT
#include "synthesis/scene.h"

#include <cmath>
#include <utility>

namespace widestereo::synthesis {
namespace {

constexpr double nearest_hit = 1e-6;

class Plane final : public Surface {
 public:
  Plane(const Paint& paint, const Eigen::Vector3d& normal, double offset)
      : Surface(paint), normal_(normal.normalized()), offset_(offset / normal.norm()) {}
  bool intersect(const Ray& ray, double& distance, Eigen::Vector3d& normal) const override {
    distance = (offset_ - normal_.dot(ray.origin)) / normal_.dot(ray.direction);
    normal = normal_;
    return std::isfinite(distance) && distance > nearest_hit;
  }

 private:
  Eigen::Vector3d normal_;
  double offset_;
};

class Box final : public Surface {
 public:
  Box(const Paint& paint, const Eigen::Isometry3d& pose, const Eigen::Vector3d& size)
      : Surface(paint), pose_(pose), box_from_world_(pose.inverse()), half_(size / 2) {}
  bool intersect(const Ray& ray, double& distance, Eigen::Vector3d& normal) const override {
    const Eigen::Array3d origin = (box_from_world_ * ray.origin).array();
    const Eigen::Array3d direction = (box_from_world_.linear() * ray.direction).array();
    const Eigen::Array3d a = (-half_.array() - origin) / direction;
    const Eigen::Array3d b = (half_.array() - origin) / direction;
    Eigen::Index enter_axis = 0;
    Eigen::Index leave_axis = 0;
    const double enter = a.min(b).maxCoeff(&enter_axis);
    const double leave = a.max(b).minCoeff(&leave_axis);
    if (!(enter <= leave) || leave <= nearest_hit) return false;
    distance = enter > nearest_hit ? enter : leave;
    normal = pose_.linear().col(enter > nearest_hit ? enter_axis : leave_axis);
    return true;
  }

 private:
  Eigen::Isometry3d pose_;
  Eigen::Isometry3d box_from_world_;
  Eigen::Vector3d half_;
};

/// Smaller acceptable root of t^2 - 2 b t + c = 0, or a negative number.
template <class Accept>
double quadratic_hit(double b, double c, Accept accept) {
  const double discriminant = b * b - c;
  if (discriminant < 0) return -1;
  const double root = std::sqrt(discriminant);
  for (const double t : {b - root, b + root}) {
    if (t > nearest_hit && accept(t)) return t;
  }
  return -1;
}

class Sphere final : public Surface {
 public:
  Sphere(const Paint& paint, Eigen::Vector3d centre, double radius)
      : Surface(paint), centre_(std::move(centre)), radius_(radius) {}
  bool intersect(const Ray& ray, double& distance, Eigen::Vector3d& normal) const override {
    const Eigen::Vector3d to_centre = centre_ - ray.origin;
    distance =
        quadratic_hit(to_centre.dot(ray.direction), to_centre.squaredNorm() - radius_ * radius_,
                      [](double) { return true; });
    if (distance < 0) return false;
    normal = (ray.origin + distance * ray.direction - centre_) / radius_;
    return true;
  }

 private:
  Eigen::Vector3d centre_;
  double radius_;
};

class Cylinder final : public Surface {
 public:
  Cylinder(const Paint& paint, Eigen::Vector3d centre, double radius, double height)
      : Surface(paint), centre_(std::move(centre)), radius_(radius), half_height_(height / 2) {}
  bool intersect(const Ray& ray, double& distance, Eigen::Vector3d& normal) const override {
    const Eigen::Vector2d to_centre(centre_.x() - ray.origin.x(), centre_.z() - ray.origin.z());
    const Eigen::Vector2d direction(ray.direction.x(), ray.direction.z());
    const double square = direction.squaredNorm();
    if (square < 1e-12) return false;
    distance = quadratic_hit(
        to_centre.dot(direction) / square, (to_centre.squaredNorm() - radius_ * radius_) / square,
        [&](double t) {
          return std::abs(ray.origin.y() + t * ray.direction.y() - centre_.y()) <= half_height_;
        });
    if (distance < 0) return false;
    normal = (ray.origin + distance * ray.direction - centre_) / radius_;
    normal.y() = 0;
    return true;
  }

 private:
  Eigen::Vector3d centre_;
  double radius_;
  double half_height_;
};

}  // namespace

std::unique_ptr<Surface> make_plane(const Paint& paint, const Eigen::Vector3d& normal,
                                    double offset) {
  return std::make_unique<Plane>(paint, normal, offset);
}
std::unique_ptr<Surface> make_box(const Paint& paint, const Eigen::Isometry3d& pose,
                                  const Eigen::Vector3d& size) {
  return std::make_unique<Box>(paint, pose, size);
}
std::unique_ptr<Surface> make_sphere(const Paint& paint, const Eigen::Vector3d& centre,
                                     double radius) {
  return std::make_unique<Sphere>(paint, centre, radius);
}
std::unique_ptr<Surface> make_cylinder(const Paint& paint, const Eigen::Vector3d& centre,
                                       double radius, double height) {
  return std::make_unique<Cylinder>(paint, centre, radius, height);
}

std::optional<Hit> Scene::cast(const Ray& ray) const {
  std::optional<Hit> nearest;
  for (int i = 0; i < static_cast<int>(surfaces.size()); ++i) {
    Hit hit;
    hit.surface = i;
    if (!surfaces[i]->intersect(ray, hit.distance, hit.normal)) continue;
    if (!nearest || hit.distance < nearest->distance) nearest = hit;
  }
  if (nearest && nearest->normal.dot(ray.direction) > 0) nearest->normal *= -1;
  return nearest;
}

Eigen::Vector3d Scene::shade(const Ray& ray, const Hit& hit, double footprint,
                             std::uint32_t seed) const {
  const Eigen::Vector3d point = ray.origin + hit.distance * ray.direction;
  const Eigen::Vector3d to_light = light - point;
  const double lambert =
      std::max(0.0, hit.normal.dot(to_light.normalized())) / (0.6 + 0.12 * to_light.squaredNorm());
  const auto surface_seed = seed + 1000u * static_cast<std::uint32_t>(hit.surface);
  return paint_at(surfaces[hit.surface]->paint(), point, footprint, surface_seed) *
         std::min(1.0, ambient + (1 - ambient) * lambert);
}

}  // namespace widestereo::synthesis
