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

// What an image with a map already must promise more than one without, to be matched again.
constexpr double worth_another_match = 2;

/// What the model knows of a point.
struct Point {
  Eigen::Vector3d position;
  std::vector<std::size_t> observers;  // in ascending order, each once
};

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

std::map<std::uint64_t, ColmapCamera> cameras_of(const fs::path& file) {
  std::map<std::uint64_t, ColmapCamera> cameras;
  calibration::each_colmap_camera(
      file, [&](const ColmapCamera& camera) { cameras.emplace(camera.number, camera); });
  return cameras;
}

std::vector<ColmapImage> images_of(const fs::path& file) {
  std::vector<ColmapImage> images;
  calibration::each_colmap_image(file,
                                 [&](ColmapImage image) { images.push_back(std::move(image)); });
  std::stable_sort(images.begin(), images.end(),
                   [](const ColmapImage& a, const ColmapImage& b) { return a.name < b.name; });
  return images;
}

}  // namespace

bool is_colmap_model(const fs::path& path) {
  return !colmap_file(path, "cameras").empty() && !colmap_file(path, "images").empty();
}

class ColmapModel::Implementation {
 public:
  explicit Implementation(const fs::path& folder) : folder_(folder) {
    require_model(folder);
    cameras_file_ = colmap_file(folder, "cameras");
    images_file_ = colmap_file(folder, "images");
    cameras_ = cameras_of(cameras_file_);
    images_ = images_of(images_file_);
    for (const ColmapImage& image : images_) names_.push_back(image.name);
    read_points();
  }

  const std::vector<std::string>& names() const { return names_; }

  std::size_t image_of(const fs::path& file) const {
    const fs::path path = whole_path(file);
    std::size_t longest = 0, found = 0;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const std::size_t components = shared_end(path, fs::path(names_[i]).lexically_normal());
      if (components <= longest) continue;
      longest = components;
      found = i;
    }
    if (longest > 0) return found;
    throw Error(images_file_.string() + " has no image whose name is the end of " + file.string() +
                " among its " + std::to_string(names_.size()) +
                (names_.empty() ? "" : " (the first is " + names_.front() + ")") +
                "; give images that COLMAP has registered, in their folder.");
  }

  CalibratedImages calibrated(const std::vector<std::size_t>& images) const {
    CalibratedImages calibrated;
    calibrated.in_metres = false;
    for (const std::size_t number : images) {
      const ColmapImage& image = images_.at(number);
      const auto camera = cameras_.find(image.camera);
      if (camera == cameras_.end()) {
        throw Error(cameras_file_.string() + " has no camera " + std::to_string(image.camera) +
                    ", which took " + image.name + "; is the model complete?");
      }
      View& view = calibrated.rig.views.emplace_back();
      view.name = image.name;
      view.camera = camera_of(camera->second, cameras_file_.string());
      view.world_from_camera = image.camera_from_world.inverse();
    }
    validate(calibrated.rig, folder_.string());
    calibrated.distances = distances(images);
    return calibrated;
  }

  std::optional<DistanceRange> distances(const std::vector<std::size_t>& images) const {
    std::vector<double> values;
    for (const std::size_t number : images) {
      const ColmapImage& image = images_.at(number);
      for (const std::uint64_t observed : image.points) {
        const auto point = points_.find(observed);
        if (point == points_.end()) continue;
        const double distance = (image.camera_from_world * point->second.position).norm();
        if (std::isfinite(distance)) values.push_back(distance);
      }
    }
    if (values.size() < fewest_points) return std::nullopt;
    return DistanceRange{.nearest = (1 - margin) * percentile(values, outliers),
                         .farthest = (1 + margin) * percentile(values, 1 - outliers)};
  }

  std::vector<std::size_t> sources(std::size_t image, std::size_t count) const {
    std::vector<std::pair<double, std::size_t>> ranked;
    for (const auto& [other, worth] : worth_of_others(image)) ranked.emplace_back(-worth, other);
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> sources;
    for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
      sources.push_back(ranked[i].second);
    }
    return sources;
  }

  std::vector<std::vector<std::size_t>> groups(std::size_t size) const {
    std::vector<std::vector<std::size_t>> groups;
    std::vector<bool> in_a_group(images_.size());
    for (std::size_t first = 0; first < images_.size(); ++first) {
      if (in_a_group[first]) continue;
      std::vector<std::size_t> group = {first};
      Worths worths = worth_of_others(first);
      while (group.size() < size && !worths.empty()) {
        group.push_back(next_member(worths, in_a_group));
        worths = least_of(worths, worth_of_others(group.back()));
      }
      for (const std::size_t image : group) in_a_group[image] = true;
      groups.push_back(std::move(group));
    }
    return groups;
  }

 private:
  /// What matching with other images promises; those that promise nothing are missing.
  using Worths = std::map<std::size_t, double>;

  void read_points() {
    const fs::path file = colmap_file(folder_, "points3D");
    if (file.empty()) return;
    for (std::size_t i = 0; i < images_.size(); ++i) {
      for (const std::uint64_t number : images_[i].points) {
        std::vector<std::size_t>& observers = points_[number].observers;
        if (observers.empty() || observers.back() != i) observers.push_back(i);
      }
    }
    std::unordered_map<std::uint64_t, Point> known;
    calibration::each_colmap_point(
        file, [&](std::uint64_t number, const Eigen::Vector3d& position) {
          const auto point = points_.find(number);
          if (point == points_.end()) return;
          known.emplace(number, Point{position, std::move(point->second.observers)});
        });
    points_ = std::move(known);
  }

  Worths worth_of_others(std::size_t number) const {
    Worths worths;
    const ColmapImage& image = images_.at(number);
    const Eigen::Vector3d centre = centre_of(image);
    const std::unordered_set<std::uint64_t> observed(image.points.begin(), image.points.end());
    for (const std::uint64_t seen : observed) {
      const auto point = points_.find(seen);
      if (point == points_.end()) continue;
      const Eigen::Vector3d& position = point->second.position;
      for (const std::size_t other : point->second.observers) {
        if (other == number) continue;
        const Eigen::Vector3d from_other = position - centre_of(images_[other]);
        worths[other] += worth_of_angle(degrees_between(position - centre, from_other));
      }
    }
    std::erase_if(worths, [](const auto& worth) { return !(worth.second > 0); });
    return worths;
  }

  /// What images promise to the member that they promise least.
  static Worths least_of(const Worths& a, const Worths& b) {
    Worths least;
    for (const auto& [image, worth] : a) {
      const auto other = b.find(image);
      if (other != b.end()) least.emplace(image, std::min(worth, other->second));
    }
    return least;
  }

  static std::size_t next_member(const Worths& worths, const std::vector<bool>& in_a_group) {
    const auto worth = [&](const Worths::value_type& image) {
      return in_a_group[image.first] ? image.second / worth_another_match : image.second;
    };
    return std::max_element(worths.begin(), worths.end(),
                            [&](const auto& a, const auto& b) { return worth(a) < worth(b); })
        ->first;
  }

  fs::path folder_, cameras_file_, images_file_;
  std::map<std::uint64_t, ColmapCamera> cameras_;
  std::vector<ColmapImage> images_;  // in the order of names
  std::vector<std::string> names_;
  std::unordered_map<std::uint64_t, Point> points_;
};

ColmapModel::ColmapModel(const fs::path& folder)
    : implementation_(std::make_unique<Implementation>(folder)) {}
ColmapModel::~ColmapModel() = default;
ColmapModel::ColmapModel(ColmapModel&&) noexcept = default;
ColmapModel& ColmapModel::operator=(ColmapModel&&) noexcept = default;

const std::vector<std::string>& ColmapModel::names() const { return implementation_->names(); }

std::size_t ColmapModel::image_of(const fs::path& file) const {
  return implementation_->image_of(file);
}

CalibratedImages ColmapModel::calibrated(const std::vector<std::size_t>& images) const {
  return implementation_->calibrated(images);
}

std::optional<DistanceRange> ColmapModel::distances(const std::vector<std::size_t>& images) const {
  return implementation_->distances(images);
}

std::vector<std::size_t> ColmapModel::sources(std::size_t image, std::size_t count) const {
  return implementation_->sources(image, count);
}

std::vector<std::vector<std::size_t>> ColmapModel::groups(std::size_t size) const {
  return implementation_->groups(size);
}

CalibratedImages read_colmap(const fs::path& folder, const std::vector<fs::path>& files) {
  const ColmapModel model(folder);
  std::vector<std::size_t> images;
  for (const fs::path& file : files) images.push_back(model.image_of(file));
  return model.calibrated(images);
}

std::vector<fs::path> colmap_sources(const fs::path& folder, const fs::path& file,
                                     std::size_t count) {
  const ColmapModel model(folder);
  const std::size_t image = model.image_of(file);
  const fs::path images = folder_of_images(file, model.names()[image]);
  std::vector<fs::path> sources;
  for (const std::size_t source : model.sources(image, count)) {
    sources.push_back(images / model.names()[source]);
  }
  return sources;
}

}  // namespace widestereo
