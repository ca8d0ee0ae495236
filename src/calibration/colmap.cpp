// SPDX-License-Identifier: MIT
#include "widestereo/colmap.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "calibration/colmap_files.h"
#include "geometry/angle.h"
#include "statistics/percentile.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;
using calibration::colmap_file;
using calibration::ColmapCamera;
using calibration::ColmapImage;

constexpr std::size_t fewest_points = 20;
// As COLMAP's own dense stereo does.
constexpr double outliers = 0.01;
constexpr double margin = 0.25;
// Degrees; Yao et al., MVSNet.
constexpr double best_angle = 5;
constexpr double deviation_below = 1, deviation_above = 10;

using Points = std::unordered_map<std::uint64_t, Eigen::Vector3d>;

/// How many components `name` has where it is the end of `path`, else 0.
std::size_t shared_end(const fs::path& path, const fs::path& name) {
  const std::vector<fs::path> whole(path.begin(), path.end());
  const std::vector<fs::path> end(name.begin(), name.end());
  const bool is_end =
      end.size() <= whole.size() && std::equal(end.rbegin(), end.rend(), whole.rbegin());
  return is_end ? end.size() : 0;
}

fs::path whole_path(const fs::path& file) { return fs::absolute(file).lexically_normal(); }

/// What is left of an image's file without its name in the model.
fs::path folder_of_images(const fs::path& file, const fs::path& name) {
  fs::path folder = whole_path(file);
  for (std::size_t i = shared_end(folder, name.lexically_normal()); i > 0; --i) {
    folder = folder.parent_path();
  }
  return folder;
}

void require_model(const fs::path& folder) {
  if (is_colmap_model(folder)) return;
  throw Error(folder.string() +
              " is no COLMAP model; give a folder with cameras and images, .bin or .txt.");
}

Eigen::Vector3d centre_of(const ColmapImage& image) {
  return image.camera_from_world.inverse().translation();
}

/// How much a point tells that is seen under this angle from two images.
double worth_of_angle(double degrees) {
  const double deviation = degrees < best_angle ? deviation_below : deviation_above;
  const double x = (degrees - best_angle) / deviation;
  return std::exp(-0.5 * x * x);
}

/// The model's image for each file.
std::vector<ColmapImage> images_of_files(const fs::path& folder,
                                         const std::vector<fs::path>& files) {
  std::vector<fs::path> paths;
  for (const fs::path& file : files) paths.push_back(whole_path(file));
  std::vector<ColmapImage> images(files.size());
  std::vector<std::size_t> shared(files.size());
  std::size_t count = 0;
  std::string example;
  const fs::path list = colmap_file(folder, "images");
  calibration::each_colmap_image(list, [&](const ColmapImage& image) {
    if (count++ == 0) example = image.name;
    const fs::path name = fs::path(image.name).lexically_normal();
    for (std::size_t i = 0; i < files.size(); ++i) {
      const std::size_t components = shared_end(paths[i], name);
      if (components <= shared[i]) continue;
      shared[i] = components;
      images[i] = image;
    }
  });
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (shared[i] > 0) continue;
    throw Error(list.string() + " has no image whose name is the end of " + files[i].string() +
                " among its " + std::to_string(count) +
                (count > 0 ? " (the first is " + example + ")" : "") +
                "; give images that COLMAP has registered, in their folder.");
  }
  return images;
}

std::map<std::uint64_t, ColmapCamera> cameras_of(const fs::path& file) {
  std::map<std::uint64_t, ColmapCamera> cameras;
  calibration::each_colmap_camera(
      file, [&](const ColmapCamera& camera) { cameras.emplace(camera.number, camera); });
  return cameras;
}

/// The points that images observe; none where the model has no file of points.
Points points_of(const fs::path& folder, const std::vector<ColmapImage>& images) {
  Points points;
  const fs::path file = colmap_file(folder, "points3D");
  if (file.empty()) return points;
  std::unordered_set<std::uint64_t> observed;
  for (const ColmapImage& image : images) observed.insert(image.points.begin(), image.points.end());
  calibration::each_colmap_point(file, [&](std::uint64_t number, const Eigen::Vector3d& position) {
    if (observed.contains(number)) points.emplace(number, position);
  });
  return points;
}

std::optional<DistanceRange> distances_of(const std::vector<ColmapImage>& images,
                                          const Points& points) {
  std::vector<double> distances;
  for (const ColmapImage& image : images) {
    for (const std::uint64_t number : image.points) {
      const auto point = points.find(number);
      if (point == points.end()) continue;
      const double distance = (image.camera_from_world * point->second).norm();
      if (std::isfinite(distance)) distances.push_back(distance);
    }
  }
  if (distances.size() < fewest_points) return std::nullopt;
  return DistanceRange{.nearest = (1 - margin) * percentile(distances, outliers),
                       .farthest = (1 + margin) * percentile(distances, 1 - outliers)};
}

}  // namespace

bool is_colmap_model(const fs::path& path) {
  return !colmap_file(path, "cameras").empty() && !colmap_file(path, "images").empty();
}

CalibratedImages read_colmap(const fs::path& folder, const std::vector<fs::path>& files) {
  require_model(folder);
  const fs::path cameras_file = colmap_file(folder, "cameras");
  const auto cameras = cameras_of(cameras_file);
  const std::vector<ColmapImage> images = images_of_files(folder, files);
  CalibratedImages calibrated;
  calibrated.in_metres = false;
  for (const ColmapImage& image : images) {
    const auto camera = cameras.find(image.camera);
    if (camera == cameras.end()) {
      throw Error(cameras_file.string() + " has no camera " + std::to_string(image.camera) +
                  ", which took " + image.name + "; is the model complete?");
    }
    View& view = calibrated.rig.views.emplace_back();
    view.name = image.name;
    view.camera = camera_of(camera->second, cameras_file.string());
    view.world_from_camera = image.camera_from_world.inverse();
  }
  validate(calibrated.rig, folder.string());
  calibrated.distances = distances_of(images, points_of(folder, images));
  return calibrated;
}

std::vector<fs::path> colmap_sources(const fs::path& folder, const fs::path& file,
                                     std::size_t count) {
  require_model(folder);
  const std::vector<ColmapImage> reference = images_of_files(folder, {file});
  const ColmapImage& image = reference.front();
  const Points points = points_of(folder, reference);
  const Eigen::Vector3d centre = centre_of(image);
  std::vector<std::pair<double, std::string>> ranked;
  calibration::each_colmap_image(colmap_file(folder, "images"), [&](const ColmapImage& other) {
    if (other.name == image.name) return;
    const Eigen::Vector3d other_centre = centre_of(other);
    double score = 0;
    for (const std::uint64_t number : other.points) {
      const auto point = points.find(number);
      if (point == points.end()) continue;
      score +=
          worth_of_angle(degrees_between(point->second - centre, point->second - other_centre));
    }
    if (score > 0) ranked.emplace_back(-score, other.name);
  });
  std::sort(ranked.begin(), ranked.end());
  const fs::path images = folder_of_images(file, image.name);
  std::vector<fs::path> sources;
  for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
    sources.push_back(images / ranked[i].second);
  }
  return sources;
}

}  // namespace widestereo
