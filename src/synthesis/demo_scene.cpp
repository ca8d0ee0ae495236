// SPDX-License-Identifier: MIT

#include "geometry/angle.h"
#include "synthesis/render.h"

namespace widestereo {
namespace {

using Eigen::Vector3d;
using synthesis::Paint;
using synthesis::Scene;
using Pattern = synthesis::Paint::Pattern;

Paint paint(const Vector3d& colour, const Vector3d& second, Pattern pattern, double scale,
            double contrast = 1) {
  return {colour, second, pattern, scale, contrast};
}

Eigen::Isometry3d pose(const Vector3d& position, double yaw, double pitch = 0, double roll = 0) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.translate(position);
  result.rotate(Eigen::AngleAxisd(yaw * radians_per_degree, Vector3d::UnitY()) *
                Eigen::AngleAxisd(pitch * radians_per_degree, Vector3d::UnitX()) *
                Eigen::AngleAxisd(roll * radians_per_degree, Vector3d::UnitZ()));
  return result;
}

/// A furnished room around the rig; y points down, the floor is at y = 1.1.
Scene furnished_room() {
  Scene scene;
  scene.light = {0.6, -1.1, 0.9};
  scene.ambient = 0.55;
  auto& s = scene.surfaces;
  const Paint plaster = paint({0.80, 0.72, 0.58}, {0.62, 0.56, 0.50}, Pattern::noise, 0.22, 0.9);
  const Paint brick = paint({0.66, 0.34, 0.26}, {0.50, 0.28, 0.24}, Pattern::checker, 0.23, 1.0);
  const Paint boards = paint({0.58, 0.40, 0.24}, {0.40, 0.27, 0.16}, Pattern::planks, 0.16, 1.1);
  const Paint ceiling = paint({0.75, 0.77, 0.80}, {0.62, 0.66, 0.72}, Pattern::noise, 0.35, 0.7);
  const Paint blue_wall = paint({0.35, 0.50, 0.62}, {0.26, 0.36, 0.50}, Pattern::noise, 0.25, 1.0);
  s.push_back(make_plane(boards, {0, 1, 0}, 1.1));
  s.push_back(make_plane(ceiling, {0, -1, 0}, 1.4));
  s.push_back(make_plane(plaster, {0, 0, 1}, 3.4));
  s.push_back(make_plane(blue_wall, {-1, 0, 0}, 2.6));
  s.push_back(make_plane(brick, {1, 0, 0}, 2.8));
  s.push_back(make_plane(plaster, {0, 0, -1}, 2.2));

  const Paint table = paint({0.75, 0.55, 0.30}, {0.55, 0.36, 0.20}, Pattern::noise, 0.15);
  const Paint red = paint({0.75, 0.25, 0.20}, {0.85, 0.75, 0.55}, Pattern::checker, 0.09);
  const Paint green = paint({0.30, 0.58, 0.32}, {0.18, 0.36, 0.26}, Pattern::noise, 0.10);
  const Paint white = paint({0.90, 0.88, 0.82}, {0.30, 0.32, 0.42}, Pattern::checker, 0.12);
  const Paint violet = paint({0.55, 0.35, 0.62}, {0.80, 0.62, 0.40}, Pattern::noise, 0.12, 1.2);
  s.push_back(make_box(table, pose({0.1, 0.75, 1.6}, 20), {1.4, 0.08, 0.8}));
  s.push_back(make_box(red, pose({-0.25, 0.52, 1.55}, 35), {0.36, 0.36, 0.36}));
  s.push_back(make_sphere(green, {0.55, 0.45, 1.45}, 0.24));
  s.push_back(make_cylinder(white, {-1.5, -0.1, 1.9}, 0.28, 2.4));
  s.push_back(make_cylinder(violet, {1.7, 0.3, 0.9}, 0.22, 1.6));
  s.push_back(make_box(white, pose({1.25, -0.55, 2.3}, -30, 25, 10), {0.9, 0.6, 0.05}));
  s.push_back(make_box(violet, pose({-1.7, 0.55, 0.2}, 15), {0.6, 1.1, 0.5}));
  s.push_back(make_box(red, pose({0.1, -1.0, 0.9}, 40, -20, 15), {0.5, 0.12, 0.5}));
  s.push_back(make_box(table, pose({1.6, 0.7, -0.4}, -25), {0.7, 0.8, 0.5}));
  s.push_back(make_sphere(red, {-0.9, -0.45, 0.75}, 0.18));
  return scene;
}

}  // namespace

Rig demo_rig(int size) {
  Rig rig;
  for (int i = 0; i < 2; ++i) {
    View& view = rig.views.emplace_back();
    view.name = "cam" + std::to_string(i);
    Camera& camera = view.camera;
    camera.model = CameraModel::double_sphere;
    camera.width = camera.height = size;
    camera.fx = camera.fy = (i == 0 ? 0.3010 : 0.3004) * size;
    camera.cx = (i == 0 ? 0.4990 : 0.4975) * size;
    camera.cy = (i == 0 ? 0.5005 : 0.5012) * size;
    camera.xi = i == 0 ? -0.165 : -0.168;
    camera.alpha = i == 0 ? 0.590 : 0.592;
    camera.max_theta = 97.5 * radians_per_degree;
  }
  rig.views[1].world_from_camera = pose({0.1, 0.002, -0.001}, -0.4, 2.2, 0.3);
  return rig;
}

Rig surround_rig(int size) {
  const Rig demo = demo_rig(size);
  Rig rig;
  constexpr int cameras = 4;
  const auto on_circle = [](int i) {
    return Eigen::Isometry3d(
        Eigen::AngleAxisd(i * (360 / cameras) * radians_per_degree, Eigen::Vector3d::UnitY()) *
        Eigen::Translation3d(0, 0, 0.2));
  };
  for (int i = 0; i < cameras; ++i) {
    View& view = rig.views.emplace_back(demo.views[static_cast<std::size_t>(i % 2)]);
    view.name = "cam" + std::to_string(i);
    view.world_from_camera = on_circle(0).inverse() * on_circle(i);
    // The same lenses with the whole of their wider field of view in the image.
    view.camera.max_theta = 110 * radians_per_degree;
    for (double* focal_length : {&view.camera.fx, &view.camera.fy}) *focal_length *= 0.73;
  }
  return rig;
}

std::pair<double, double> demo_distance_range() { return {0.4, 8}; }

RenderedPair render_demo(int size, std::uint32_t seed) {
  return render_demo_from(Eigen::Isometry3d::Identity(), size, seed);
}

RenderedPair render_demo_from(const Eigen::Isometry3d& world_from_rig, int size,
                              std::uint32_t seed) {
  const Rig rig = demo_rig(size);
  Rig moved = rig;
  for (View& view : moved.views) view.world_from_camera = world_from_rig * view.world_from_camera;
  RenderedPair pair = render_demo_room(moved, seed);
  pair.rig = rig;
  return pair;
}

RenderedPair render_demo_room(const Rig& rig, std::uint32_t seed) {
  return synthesis::render(furnished_room(), rig, seed);
}

RenderedPair render_plane(const Rig& rig, const Eigen::Vector3d& normal, double offset,
                          std::uint32_t seed) {
  Scene scene;
  scene.ambient = 1;
  scene.surfaces.push_back(make_plane(
      paint({0.8, 0.8, 0.8}, {0.4, 0.4, 0.4}, Pattern::noise, 0.3, 1.2), normal, offset));
  return synthesis::render(scene, rig, seed);
}

}  // namespace widestereo
