// SPDX-License-Identifier: MIT
#include "widestereo/fusion.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <list>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "geometry/angle.h"
#include "geometry/distance.h"
#include "geometry/pixel_angle.h"
#include "geometry/validation.h"
#include "io/point_cloud.h"
#include "text/number.h"
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
  cv::Mat usable;
  cv::extractChannel(rays, usable, 3);
  cv::Mat distance = maps.distance.clone();
  distance.setTo(0, usable == 0);
  // What lies so near has, in single precision, the position of the camera itself.
  constexpr double least_share = 1e-6;
  distance.setTo(0, distance <= least_share * view.world_from_camera.translation().norm());
  cloud.points = make_point_cloud(distance, rays, maps.normals, maps.image, maps.confidence,
                                  view.world_from_camera);
  cloud.points.shrink_to_fit();
  cloud.index.create(distance.size(), CV_32SC1);
  int count = 0;
  for (int y = 0; y < cloud.index.rows; ++y) {
    for (int x = 0; x < cloud.index.cols; ++x) {
      const bool has = has_point(distance.at<float>(y, x), rays.at<cv::Vec4f>(y, x));
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
  /// `spacing`: of the pixels of the view that sees it, there.
  void add(const CloudPoint& point, double spacing) {
    const double weight = 1 / (spacing * spacing);
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

// A point stands for pixels that are up to this times as fine as its own, too.
constexpr double as_fine = 1.2;

/// How finely a point is seen: the spacing of the pixels that see it in sixteenths of an octave,
/// modulo 255, so that it fits a byte; 0 where a pixel is part of no point.
using Fineness = std::uint8_t;
constexpr double steps_per_octave = 16;
constexpr long fineness_values = 255;

Fineness fineness_of(double spacing) {
  const long step = std::lround(steps_per_octave * std::log2(spacing)) % fineness_values;
  return static_cast<Fineness>(1 + (step + fineness_values) % fineness_values);
}

/// How many steps coarser `a` is than `b`, which is less than 128 either way.
long steps_coarser(Fineness a, Fineness b) {
  constexpr long half = fineness_values / 2;
  return (a - b + fineness_values + half) % fineness_values - half;
}

/// The spacing nearest to another one.
double spacing_of(Fineness fineness, double near) {
  return near * std::exp2(static_cast<double>(steps_coarser(fineness, fineness_of(near))) /
                          steps_per_octave);
}

/// Of which points of the cloud the pixels of a view are part.
struct Membership {
  std::vector<Fineness> before;  ///< of points that earlier views made, row by row
  std::vector<Fineness> now;     ///< of the present view; looked at by nobody, so that rows may be
                                 ///< taken at once

  void begin(std::size_t pixels) {
    before.resize(pixels);
    now.assign(pixels, 0);
  }
  void settle() {
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] == 0) continue;
      if (before[i] == 0 || steps_coarser(before[i], now[i]) > 0) before[i] = now[i];
    }
    now = {};
  }
};

/// What another view has where a point lies.
enum class Finding { nothing, same_point, point_of_cloud, farther_surface };

/// A pixel that has the same point.
struct Joined {
  Fineness* now;
  Fineness fineness;
  Fineness before;
};

/// A view beside the one whose pixels are taken.
struct Neighbour {
  std::size_t number;
  const View* view;
  PreparedCamera camera;
  Eigen::Isometry3d camera_from_world;
  CloudCache::Cloud cloud;
  double pixel_size;  ///< of pixel_sizes()
};

/// The list without the view itself and without repeats, which would count as further views.
std::vector<std::size_t> distinct_others(const std::vector<std::size_t>& others, std::size_t view,
                                         std::size_t views) {
  std::vector<bool> is_known(views);
  is_known[view] = true;
  std::vector<std::size_t> distinct;
  for (const std::size_t other : others) {
    if (!is_known[other]) distinct.push_back(other);
    is_known[other] = true;
  }
  return distinct;
}

/// The angles of the views' pixels as shares of that of one view; 1 where there are no rays, and so
/// no points.
std::vector<double> pixel_sizes(const std::vector<View>& views) {
  std::vector<double> sizes;
  for (const View& view : views) sizes.push_back(median_pixel_angle(view.camera));
  const double largest = *std::max_element(sizes.begin(), sizes.end());
  for (double& size : sizes) size = size > 0 ? size / largest : 1;
  return sizes;
}

/// `others`: as distinct_others() gives them.
class Fusion {
 public:
  Fusion(const std::vector<View>& views, const std::vector<std::vector<std::size_t>>& others,
         const MapsOfView& maps, const FusionOptions& options)
      : views_(views),
        options_(options),
        clouds_(views, maps, options.cache_bytes),
        pixel_sizes_(pixel_sizes(views)),
        memberships_(views.size()),
        last_use_(views.size()) {
    for (std::size_t i = 0; i < views.size(); ++i) {
      last_use_[i] = std::max(last_use_[i], i);
      // Clouds hold more than the index, and fewer are looked at then.
      std::size_t looked_at = 0, bytes = index_bytes(i);
      for (const std::size_t other : others[i]) {
        if (!is_looked_at(looked_at++, bytes)) break;
        bytes += index_bytes(other);
        last_use_[other] = i;
      }
    }
  }

  void add(std::size_t number, const std::vector<std::size_t>& others) {
    const Neighbour self = neighbour(number);
    std::vector<Neighbour> neighbours;
    std::size_t bytes = self.cloud->bytes();
    for (const std::size_t other : others) {
      if (!is_looked_at(neighbours.size(), bytes)) break;
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
    memberships_[number].settle();
    for (const Neighbour& other : neighbours) memberships_[other.number].settle();
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (last_use_[i] == number) memberships_[i] = {};
    }
  }

  PointCloud take() { return std::move(points_); }

 private:
  std::size_t pixels_of(std::size_t view) const {
    const Camera& camera = views_[view].camera;
    return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  }

  std::size_t index_bytes(std::size_t view) const { return pixels_of(view) * sizeof(int); }

  /// Whether a view's next other is, after so many, whose clouds and its own take so many bytes:
  /// the next view shares most of them, and finds them in the other half of the cache.
  bool is_looked_at(std::size_t others, std::size_t bytes) const {
    return others < least_others || bytes <= options_.cache_bytes / 2;
  }

  Neighbour neighbour(std::size_t number) {
    const View& view = views_[number];
    memberships_[number].begin(pixels_of(number));
    return {number,
            &view,
            PreparedCamera(view.camera),
            view.world_from_camera.inverse(),
            clouds_.get(number),
            pixel_sizes_[number]};
  }

  static std::size_t place_of(const Neighbour& view, int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(view.cloud->index.cols) +
           static_cast<std::size_t>(x);
  }

  Fineness* now(const Neighbour& view, int x, int y) {
    return &memberships_[view.number].now[place_of(view, x, y)];
  }

  /// Several pixels of the present view may join the same one.
  static void mark(Fineness& pixel, Fineness fineness) {
    std::atomic_ref(pixel).store(fineness, std::memory_order_relaxed);
  }

  void add_row(int y, const Neighbour& self, const std::vector<Neighbour>& neighbours,
               PointCloud& row) {
    const std::vector<Fineness>& before = memberships_[self.number].before;
    std::vector<Joined> joined;
    for (int x = 0; x < self.cloud->index.cols; ++x) {
      const int index = self.cloud->index.at<int>(y, x);
      if (index == no_point || before[place_of(self, x, y)] != 0) continue;
      const CloudPoint& point = self.cloud->points[static_cast<std::size_t>(index)];
      const double spacing = spacing_at(self, point);
      Mean mean;
      mean.add(point, spacing);
      joined.clear();
      int seen_through = 0;
      bool is_known = false;
      for (std::size_t i = 0; i < neighbours.size() && !is_known; ++i) {
        const Finding found = join({x, y}, point, self, neighbours[i], mean, joined);
        if (found == Finding::farther_surface) ++seen_through;
        is_known = found == Finding::point_of_cloud;
      }
      if (is_known) {
        // As finely as the point was seen: else coarse ones would stand for ever finer pixels.
        mark(*now(self, x, y), joined.back().before);
        continue;
      }
      if (mean.count() < options_.min_views) continue;
      if (options_.min_views > 1 && seen_through > mean.count()) continue;
      row.push_back(mean.point());
      mark(*now(self, x, y), fineness_of(spacing));
      for (const Joined& pixel : joined) mark(*pixel.now, pixel.fineness);
    }
  }

  Finding join(const cv::Point& pixel, const CloudPoint& point, const Neighbour& self,
               const Neighbour& other, Mean& mean, std::vector<Joined>& joined) {
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
    const double spacing = spacing_at(other, candidate);
    mean.add(candidate, spacing);
    const Fineness before = memberships_[other.number].before[place_of(other, x, y)];
    joined.push_back({now(other, x, y), fineness_of(spacing), before});
    return before != 0 && spacing_of(before, spacing) <= as_fine * spacing_at(self, point)
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

  /// Of the view's pixels where it sees a point, in an unknown unit.
  static double spacing_at(const Neighbour& view, const CloudPoint& point) {
    return view.pixel_size * (view.camera_from_world * point.position.cast<double>()).norm();
  }

  const std::vector<View>& views_;
  const FusionOptions& options_;
  CloudCache clouds_;
  std::vector<double> pixel_sizes_;
  std::vector<Membership> memberships_;  // of each view, from its first use to its last
  std::vector<std::size_t> last_use_;    // of each view: the last one that may look at it
  PointCloud points_;
};

void require_usable(const FusionOptions& options) {
  if (options.min_views < 1) {
    throw Error("Fusion with points of at least " + std::to_string(options.min_views) +
                " views is not possible; give 1 or more.");
  }
  for (const auto& [limit, name] : {std::pair(options.max_relative, "difference of distance"),
                                    std::pair(options.max_pixels, "displacement"),
                                    std::pair(options.max_normal_angle, "angle of normals")}) {
    if (limit >= 0) continue;  // false for NaN
    throw Error("The largest " + std::string(name) + " of fusion is " + text_of(limit) +
                "; give 0 or more.");
  }
}

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
    for (const std::size_t other : list) require_number(other, views.size(), "view", "The fusion");
  }
  require_usable(options);
  for (const View& view : views) require_valid(view, "The fusion");
  if (views.empty()) return {};
  std::vector<std::vector<std::size_t>> distinct;
  for (std::size_t i = 0; i < views.size(); ++i) {
    distinct.push_back(distinct_others(others[i], i, views.size()));
  }
  Fusion fusion(views, distinct, maps, options);
  for (std::size_t i = 0; i < views.size(); ++i) {
    fusion.add(i, distinct[i]);
    if (progress) progress(static_cast<double>(i + 1) / static_cast<double>(views.size()));
  }
  return fusion.take();
}

}  // namespace widestereo
