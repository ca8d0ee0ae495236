// SPDX-License-Identifier: MIT
#include "widestereo/fusion.h"

#include <atomic>
#include <cmath>
#include <list>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "geometry/angle.h"
#include "geometry/distance.h"
#include "io/point_cloud.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr int no_point = -1;
// Others that are looked at however much memory their clouds take.
constexpr std::size_t least_others = 10;

/// The points of one view.
struct ViewCloud {
  PointCloud points;
  cv::Mat index;  ///< CV_32SC1: of each pixel's point, or no_point

  std::size_t bytes() const {
    return points.capacity() * sizeof(CloudPoint) + index.total() * index.elemSize();
  }
};

ViewCloud cloud_of(const View& view, const ViewMaps& maps) {
  require_calibrated_size(maps.distance, view, "The distance map of " + view.name);
  ViewCloud cloud;
  const cv::Mat rays = ray_image(view.camera, view.mask);
  require_cloud_maps(maps.distance, rays, maps.normals, maps.image, maps.confidence,
                     " of " + view.name);
  cloud.points = make_point_cloud(maps.distance, rays, maps.normals, maps.image, maps.confidence,
                                  view.world_from_camera);
  cloud.points.shrink_to_fit();
  cloud.index.create(maps.distance.size(), CV_32SC1);
  int count = 0;
  for (int y = 0; y < cloud.index.rows; ++y) {
    for (int x = 0; x < cloud.index.cols; ++x) {
      const bool has = has_point(maps.distance.at<float>(y, x), rays.at<cv::Vec4f>(y, x));
      cloud.index.at<int>(y, x) = has ? count++ : no_point;
    }
  }
  return cloud;
}

/// The clouds that were used last, as far as the memory allowed for them goes.
class CloudCache {
 public:
  using Cloud = std::shared_ptr<const ViewCloud>;

  CloudCache(const std::vector<View>& views, const MapsOfView& maps, std::size_t bytes)
      : views_(views), maps_(maps), most_bytes_(bytes) {}

  Cloud get(std::size_t view) {
    for (auto entry = entries_.begin(); entry != entries_.end(); ++entry) {
      if (entry->first != view) continue;
      entries_.splice(entries_.begin(), entries_, entry);
      return entries_.front().second;
    }
    Cloud cloud = std::make_shared<const ViewCloud>(cloud_of(views_[view], maps_(view)));
    bytes_ += cloud->bytes();
    entries_.emplace_front(view, cloud);
    while (bytes_ > most_bytes_ && entries_.size() > 1) {
      bytes_ -= entries_.back().second->bytes();
      entries_.pop_back();
    }
    return cloud;
  }

 private:
  const std::vector<View>& views_;
  const MapsOfView& maps_;
  std::size_t most_bytes_;
  std::size_t bytes_ = 0;
  std::list<std::pair<std::size_t, Cloud>> entries_;  // the last used one first
};

/// The mean of what views see of one point.
class Mean {
 public:
  void add(const CloudPoint& point, double distance) {
    const double weight = 1 / (distance * distance);
    weights_ += weight;
    position_ += weight * point.position.cast<double>();
    normal_ += weight * point.normal.cast<double>();
    colour_ += weight * Eigen::Vector3d(point.red, point.green, point.blue);
    confidence_ = std::max(confidence_, point.confidence);
    ++count_;
  }
  int count() const { return count_; }
  CloudPoint point() const {
    const auto level = [this](int i) {
      return static_cast<std::uint8_t>(std::lround(colour_[i] / weights_));
    };
    return {(position_ / weights_).cast<float>(),
            normal_.normalized().cast<float>(),
            level(0),
            level(1),
            level(2),
            confidence_};
  }

 private:
  double weights_ = 0;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d colour_ = Eigen::Vector3d::Zero();
  float confidence_ = 0;
  int count_ = 0;
};

// A point stands for pixels that see it from less far than this times as far as its own, too.
constexpr double as_fine = 1.2;

/// What another view has where a point lies.
enum class Finding { nothing, same_point, point_of_cloud, farther_surface };

/// Whether a pixel is part of a point of the cloud: since an earlier view, or of the present one.
/// Only the former is looked at, so that rows may be taken at once.
enum Membership : std::uint8_t { free_pixel, taken, taken_now };

/// A view beside the one whose pixels are taken.
struct Neighbour {
  std::size_t number;
  const View* view;
  PreparedCamera camera;
  Eigen::Isometry3d camera_from_world;
  CloudCache::Cloud cloud;
};

class Fusion {
 public:
  Fusion(const std::vector<View>& views, const MapsOfView& maps, const FusionOptions& options)
      : views_(views), options_(options), clouds_(views, maps, options.cache_bytes) {
    for (const View& view : views) {
      memberships_.emplace_back(static_cast<std::size_t>(view.camera.width) *
                                static_cast<std::size_t>(view.camera.height));
    }
  }

  void add(std::size_t number, const std::vector<std::size_t>& others) {
    const Neighbour self = neighbour(number);
    std::vector<Neighbour> neighbours;
    std::size_t bytes = self.cloud->bytes();
    for (const std::size_t other : others) {
      if (other == number) continue;
      // The next view shares most of them, and finds them in the other half of the cache.
      if (neighbours.size() >= least_others && bytes > options_.cache_bytes / 2) break;
      neighbours.push_back(neighbour(other));
      bytes += neighbours.back().cloud->bytes();
    }
    const cv::Mat& index = self.cloud->index;
    std::vector<PointCloud> rows(static_cast<std::size_t>(index.rows));
    cv::parallel_for_(cv::Range(0, index.rows), [&](const cv::Range& range) {
      for (int y = range.start; y < range.end; ++y) {
        add_row(y, self, neighbours, rows[static_cast<std::size_t>(y)]);
      }
    });
    for (const PointCloud& row : rows) points_.insert(points_.end(), row.begin(), row.end());
    settle(number);
    for (const Neighbour& other : neighbours) settle(other.number);
  }

  PointCloud take() { return std::move(points_); }

 private:
  Neighbour neighbour(std::size_t number) {
    const View& view = views_[number];
    return {number, &view, PreparedCamera(view.camera), view.world_from_camera.inverse(),
            clouds_.get(number)};
  }

  std::uint8_t& membership(const Neighbour& view, int x, int y) {
    return memberships_[view.number][static_cast<std::size_t>(y) * view.cloud->index.cols + x];
  }

  static bool is_taken(std::uint8_t& membership) {
    return std::atomic_ref(membership).load(std::memory_order_relaxed) == taken;
  }

  static void take_now(std::uint8_t& membership) {
    if (!is_taken(membership)) {
      std::atomic_ref(membership).store(taken_now, std::memory_order_relaxed);
    }
  }

  void settle(std::size_t number) {
    for (std::uint8_t& membership : memberships_[number]) {
      if (membership == taken_now) membership = taken;
    }
  }

  void add_row(int y, const Neighbour& self, const std::vector<Neighbour>& neighbours,
               PointCloud& row) {
    std::vector<std::uint8_t*> joined;
    for (int x = 0; x < self.cloud->index.cols; ++x) {
      const int index = self.cloud->index.at<int>(y, x);
      if (index == no_point || is_taken(membership(self, x, y))) continue;
      const CloudPoint& point = self.cloud->points[static_cast<std::size_t>(index)];
      Mean mean;
      mean.add(point, distance_from(self, point));
      joined.clear();
      int seen_through = 0;
      bool is_known = false;
      for (std::size_t i = 0; i < neighbours.size() && !is_known; ++i) {
        const Finding found = join({x, y}, point, self, neighbours[i], mean, joined);
        if (found == Finding::farther_surface) ++seen_through;
        is_known = found == Finding::point_of_cloud;
      }
      if (is_known || mean.count() < options_.min_views) continue;
      if (options_.min_views > 1 && seen_through > mean.count()) continue;
      row.push_back(mean.point());
      take_now(membership(self, x, y));
      for (std::uint8_t* pixel : joined) take_now(*pixel);
    }
  }

  Finding join(const cv::Point& pixel, const CloudPoint& point, const Neighbour& self,
               const Neighbour& other, Mean& mean, std::vector<std::uint8_t*>& joined) {
    Eigen::Vector2d position;
    const Eigen::Vector3d seen = other.camera_from_world * point.position.cast<double>();
    if (!other.camera.project_into_image(seen, position)) return Finding::nothing;
    const cv::Mat& index = other.cloud->index;
    const int x = static_cast<int>(std::floor(position.x() + 0.5));
    const int y = static_cast<int>(std::floor(position.y() + 0.5));
    const int found = index.at<int>(y, x);
    if (found == no_point) return Finding::nothing;
    const CloudPoint& candidate = other.cloud->points[static_cast<std::size_t>(found)];
    const double difference = distance_towards(point, candidate, other) / seen.norm() - 1;
    if (difference > options_.max_relative) return Finding::farther_surface;
    if (difference < -options_.max_relative) return Finding::nothing;
    const Eigen::Vector3d back = self.camera_from_world * candidate.position.cast<double>();
    if (!self.camera.project(back, position)) return Finding::nothing;
    if ((position - Eigen::Vector2d(pixel.x, pixel.y)).norm() > options_.max_pixels) {
      return Finding::nothing;
    }
    const Eigen::Vector3d a = point.normal.cast<double>(), b = candidate.normal.cast<double>();
    if (degrees_between(a, b) > options_.max_normal_angle) return Finding::nothing;
    const double distance = distance_from(other, candidate);
    mean.add(candidate, distance);
    joined.push_back(&membership(other, x, y));
    return is_taken(*joined.back()) && distance <= as_fine * distance_from(self, point)
               ? Finding::point_of_cloud
               : Finding::same_point;
  }

  /// How far from the view the plane of a point of its is on the ray to another point: pixels that
  /// are half a pixel apart differ on oblique surfaces.
  static double distance_towards(const CloudPoint& other, const CloudPoint& point,
                                 const Neighbour& view) {
    const Eigen::Vector3d centre = view.view->world_from_camera.translation();
    const Eigen::Vector3d from_centre = point.position.cast<double>() - centre;
    const Eigen::Vector3d ray = (other.position.cast<double>() - centre).normalized();
    const Eigen::Vector3d normal = point.normal.cast<double>();
    const double along = normal.dot(ray);
    return along == 0 ? from_centre.norm() : normal.dot(from_centre) / along;
  }

  static double distance_from(const Neighbour& view, const CloudPoint& point) {
    return (view.camera_from_world * point.position.cast<double>()).norm();
  }

  const std::vector<View>& views_;
  const FusionOptions& options_;
  CloudCache clouds_;
  std::vector<std::vector<std::uint8_t>> memberships_;  // of each view, row by row
  PointCloud points_;
};

}  // namespace

PointCloud fuse(const std::vector<View>& views, const std::vector<std::vector<std::size_t>>& others,
                const MapsOfView& maps, const FusionOptions& options,
                const std::function<void(double)>& progress) {
  if (others.size() != views.size()) {
    throw Error("Fusion needs one list of other views for each of the " +
                std::to_string(views.size()) + " views, not " + std::to_string(others.size()) +
                ".");
  }
  for (const std::vector<std::size_t>& list : others) {
    for (const std::size_t other : list) {
      if (other < views.size()) continue;
      throw Error("There is no view " + std::to_string(other) + " among the " +
                  std::to_string(views.size()) + " to be fused; count from 0.");
    }
  }
  if (views.empty()) return {};
  Fusion fusion(views, maps, options);
  for (std::size_t i = 0; i < views.size(); ++i) {
    fusion.add(i, others[i]);
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(views.size()));
  }
  return fusion.take();
}

}  // namespace widestereo
