// SPDX-License-Identifier: MIT
#include "widestereo/sfm_model.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>
#include <unordered_map>
#include <unordered_set>

#include "calibration/colmap_files.h"
#include "calibration/nerfstudio.h"
#include "geometry/validation.h"
#include "statistics/percentile.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

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

/// How many components `name` has where it is the end of `path`, else 0.
std::size_t shared_end(const fs::path& path, const fs::path& name) {
  const std::vector<fs::path> whole(path.begin(), path.end());
  const std::vector<fs::path> end(name.begin(), name.end());
  const bool is_end =
      end.size() <= whole.size() && std::equal(end.rbegin(), end.rend(), whole.rbegin());
  return is_end ? end.size() : 0;
}

/// An image's path in a model without its root, and without the ".." that lead out of the folder of
/// images: what is named so lies within any folder.
std::string name_of(const fs::path& path) {
  fs::path name;
  for (const fs::path& component : path.lexically_normal().relative_path()) {
    if (component != "..") name /= component;
  }
  return name.generic_string();
}

fs::path whole_path(const fs::path& file) {
  if (file.empty()) throw Error("An image's path is empty; give one.");
  return fs::absolute(file).lexically_normal();
}

/// What is left of an image's file without its name in the model.
fs::path folder_of_images(const fs::path& file, const fs::path& name) {
  fs::path folder = whole_path(file);
  for (std::size_t i = shared_end(folder, name); i > 0; --i) {
    folder = folder.parent_path();
  }
  return folder;
}

/// Of the camera that took it, world frame.
Eigen::Vector3d centre_of(const ColmapImage& image) {
  return image.camera_from_world.inverse().translation();
}

bool is_colmap_folder(const fs::path& path) {
  return !colmap_file(path, "cameras").empty() && !colmap_file(path, "images").empty();
}

void require_colmap(const fs::path& path) {
  if (is_colmap_folder(path)) return;
  throw Error(path.string() +
              " is no COLMAP model; give a folder with cameras and images, .bin or .txt, or a "
              "transforms.json.");
}

[[noreturn]] void refuse_two(const fs::path& file, const std::string& things,
                             std::uint64_t number) {
  throw Error(file.string() + " has two " + things + " of the number " + std::to_string(number) +
              "; export the model again (colmap model_converter).");
}

std::map<std::uint64_t, ColmapCamera> cameras_of(const fs::path& file) {
  std::map<std::uint64_t, ColmapCamera> cameras;
  calibration::each_colmap_camera(file, [&](const ColmapCamera& camera) {
    const bool is_new = cameras.emplace(camera.number, camera).second;
    if (!is_new) refuse_two(file, "cameras", camera.number);
  });
  return cameras;
}

std::vector<ColmapImage> images_of(const fs::path& file) {
  std::vector<ColmapImage> images;
  std::unordered_set<std::uint64_t> numbers;
  calibration::each_colmap_image(file, [&](ColmapImage image) {
    if (!numbers.insert(image.number).second) refuse_two(file, "images", image.number);
    images.push_back(std::move(image));
  });
  return images;
}

}  // namespace

bool is_sfm_model(const fs::path& path) {
  return is_colmap_folder(path) || calibration::is_transforms_file(path);
}

class SfmModel::Implementation {
 public:
  explicit Implementation(const fs::path& path) : path_(path) {
    if (calibration::is_transforms_file(path)) {
      cameras_file_ = images_file_ = path;
      calibration::Transforms transforms = calibration::read_transforms(path);
      cameras_ = std::move(transforms.cameras);
      images_ = std::move(transforms.images);
    } else {
      require_colmap(path);
      cameras_file_ = colmap_file(path, "cameras");
      images_file_ = colmap_file(path, "images");
      cameras_ = cameras_of(cameras_file_);
      images_ = images_of(images_file_);
    }
    if (images_.empty()) {
      throw Error(images_file_.string() +
                  " has no image; give a model in which images are registered.");
    }
    name_images();
    points_ = points_of(images_);
  }

  bool has_points() const { return !points_.positions.empty(); }

  const ViewSelection& selection() const { return points_.selection; }

  const std::vector<std::string>& names() const { return names_; }

  void leave_out(const std::vector<std::size_t>& images) {
    std::vector<bool> is_left(images_.size(), true);
    for (const std::size_t number : images) {
      image_at(number);
      is_left[number] = false;
    }
    const auto left = std::ranges::count(is_left, true);
    if (left == 0) throw Error("No image of " + path_.string() + " would be left; keep one.");
    std::vector<ColmapImage> kept;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < images_.size(); ++i) {
      if (!is_left[i]) continue;
      kept.push_back(images_[i]);
      names.push_back(names_[i]);
    }
    // What may throw comes before any change.
    points_ = points_of(kept);
    images_ = std::move(kept);
    names_ = std::move(names);
  }

  fs::path file_of(std::size_t number, const fs::path& folder) const {
    return folder / image_at(number).name;
  }

  std::size_t image_of(const fs::path& file) const {
    const fs::path path = whole_path(file);
    std::size_t longest = 0, found = 0;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const std::size_t components = shared_end(path, names_[i]);
      if (components <= longest) continue;
      longest = components;
      found = i;
    }
    if (longest > 0) return found;
    throw Error(images_file_.string() + " has no image whose name is the end of " + file.string() +
                " among its " + std::to_string(names_.size()) + " (the first is " + names_.front() +
                "); give images that it has, in their folder.");
  }

  /// All, from the nearest to that image on, which comes first.
  std::vector<std::size_t> images_from(std::size_t number) const {
    const Eigen::Vector3d centre = centre_of(image_at(number));
    std::vector<double> distances;
    for (const ColmapImage& image : images_)
      distances.push_back((centre_of(image) - centre).norm());
    distances[number] = -1;  // others may have the same centre
    std::vector<std::size_t> sorted(images_.size());
    std::iota(sorted.begin(), sorted.end(), 0);
    std::ranges::stable_sort(sorted, {}, [&](std::size_t image) { return distances[image]; });
    return sorted;
  }

  View view(std::size_t number) const {
    const ColmapImage& image = image_at(number);
    const auto camera = cameras_.find(image.camera);
    if (camera == cameras_.end()) {
      throw Error(cameras_file_.string() + " has no camera " + std::to_string(image.camera) +
                  ", which took " + image.name + "; give the complete model.");
    }
    View view;
    view.name = names_[number];
    view.camera = camera_of(camera->second, cameras_file_.string());
    view.world_from_camera = image.camera_from_world.inverse();
    if (!image.mask.empty()) {
      view.mask = read_mask(image.mask);
      require_mask_size(view.mask, view, image.mask.string());
    }
    require_valid(view, path_.string());
    return view;
  }

  CalibratedImages calibrated(const std::vector<std::size_t>& images) const {
    CalibratedImages calibrated;
    calibrated.in_metres = false;
    for (const std::size_t number : images) calibrated.rig.views.push_back(view(number));
    validate(calibrated.rig, path_.string());
    calibrated.distances = distances(images);
    return calibrated;
  }

  std::optional<DistanceRange> distances(const std::vector<std::size_t>& images) const {
    std::vector<double> values;
    for (const std::size_t number : images) {
      const ColmapImage& image = image_at(number);
      for (const std::uint64_t observed : image.points) {
        const auto point = points_.positions.find(observed);
        if (point == points_.positions.end()) continue;
        const double distance = (image.camera_from_world * point->second).norm();
        if (std::isfinite(distance)) values.push_back(distance);
      }
    }
    if (values.size() < fewest_points) return std::nullopt;
    return DistanceRange{.nearest = (1 - margin) * percentile(values, outliers),
                         .farthest = (1 + margin) * percentile(values, 1 - outliers)};
  }

 private:
  struct Points {
    std::unordered_map<std::uint64_t, Eigen::Vector3d> positions;
    ViewSelection selection{{}, {}};
  };

  const ColmapImage& image_at(std::size_t number) const {
    require_number(number, images_.size(), "image", path_.string());
    return images_[number];
  }

  void name_images() {
    std::map<std::string, ColmapImage> named;
    for (ColmapImage& image : std::exchange(images_, {})) {
      const std::string name = name_of(image.name);
      if (name == "." || !fs::path(name).has_filename()) {
        throw Error(images_file_.string() + " has an image \"" + image.name +
                    "\", which is no file's path; correct it.");
      }
      const auto [other, is_new] = named.try_emplace(name, std::move(image));
      if (!is_new) {
        throw Error(images_file_.string() + " has two images whose name is " + name + ": " +
                    other->second.name + " and " + image.name + "; rename or remove one.");
      }
    }
    for (auto& [name, image] : named) {
      names_.push_back(name);
      images_.push_back(std::move(image));
    }
  }

  /// Those that the images observe.
  Points points_of(const std::vector<ColmapImage>& images) const {
    std::vector<Eigen::Vector3d> centres;
    for (const ColmapImage& image : images) {
      centres.push_back(centre_of(image));
    }
    std::vector<ObservedPoint> points;
    Points all;
    const fs::path file = colmap_file(path_, "points3D");
    if (!file.empty()) {
      std::unordered_map<std::uint64_t, std::vector<std::size_t>> observers;
      for (std::size_t i = 0; i < images.size(); ++i) {
        for (const std::uint64_t number : images[i].points) observers[number].push_back(i);
      }
      calibration::each_colmap_point(
          file, [&](std::uint64_t number, const Eigen::Vector3d& position) {
            const auto observed = observers.find(number);
            if (observed == observers.end()) return;
            if (!position.allFinite()) return;
            const bool is_new = all.positions.emplace(number, position).second;
            if (!is_new) refuse_two(file, "points", number);
            points.push_back({position, std::move(observed->second)});
          });
    }
    all.selection = ViewSelection(std::move(centres), std::move(points));
    return all;
  }

  fs::path path_, cameras_file_, images_file_;
  std::map<std::uint64_t, ColmapCamera> cameras_;
  std::vector<ColmapImage> images_;  // in the order of names_, by their paths
  std::vector<std::string> names_;
  Points points_;
};

SfmModel::SfmModel(const fs::path& path)
    : implementation_(std::make_unique<Implementation>(path)) {}
SfmModel::~SfmModel() = default;
SfmModel::SfmModel(SfmModel&&) noexcept = default;
SfmModel& SfmModel::operator=(SfmModel&&) noexcept = default;

const std::vector<std::string>& SfmModel::names() const { return implementation_->names(); }

void SfmModel::leave_out(const std::vector<std::size_t>& images) {
  implementation_->leave_out(images);
}

fs::path SfmModel::file_of(std::size_t image, const fs::path& folder) const {
  return implementation_->file_of(image, folder);
}

std::size_t SfmModel::image_of(const fs::path& file) const {
  return implementation_->image_of(file);
}

View SfmModel::view(std::size_t image) const { return implementation_->view(image); }

CalibratedImages SfmModel::calibrated(const std::vector<std::size_t>& images) const {
  return implementation_->calibrated(images);
}

std::optional<DistanceRange> SfmModel::distances(const std::vector<std::size_t>& images) const {
  return implementation_->distances(images);
}

bool SfmModel::has_points() const { return implementation_->has_points(); }

const ViewSelection& SfmModel::selection() const { return implementation_->selection(); }

CalibratedImages SfmModel::calibrated_files(const std::vector<fs::path>& files) const {
  std::vector<std::size_t> images;
  for (const fs::path& file : files) images.push_back(image_of(file));
  return calibrated(images);
}

std::vector<fs::path> SfmModel::source_files(const fs::path& file, std::size_t count) const {
  const std::size_t image = image_of(file);
  return files_beside(file, image, selection().sources(image, count));
}

std::vector<fs::path> SfmModel::source_files(const fs::path& file, std::size_t count,
                                             const DistanceRange& range) const {
  constexpr std::size_t most = 64;  // images of which assumed_points() lists all that see a point
  std::vector<std::size_t> nearest = implementation_->images_from(image_of(file));
  nearest.resize(std::min(nearest.size(), most));
  std::vector<View> views;
  std::vector<Eigen::Vector3d> centres;
  for (const std::size_t image : nearest) {
    views.push_back(view(image));
    centres.push_back(views.back().world_from_camera.translation());
  }
  const ViewSelection seen(std::move(centres),
                           assumed_points(views, range.nearest, range.farthest));
  std::vector<std::size_t> sources;
  for (const std::size_t source : seen.sources(0, count)) sources.push_back(nearest[source]);
  return files_beside(file, nearest.front(), sources);
}

std::vector<fs::path> SfmModel::files_beside(const fs::path& file, std::size_t image,
                                             const std::vector<std::size_t>& others) const {
  const fs::path folder = folder_of_images(file, names()[image]);
  std::vector<fs::path> files;
  for (const std::size_t other : others) files.push_back(file_of(other, folder));
  return files;
}

}  // namespace widestereo
