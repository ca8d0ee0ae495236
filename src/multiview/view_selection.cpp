// SPDX-License-Identifier: MIT
#include "widestereo/view_selection.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "geometry/angle.h"
#include "geometry/validation.h"

namespace widestereo {
namespace {

// Degrees; Yao et al., MVSNet.
constexpr double best_angle = 5;
constexpr double deviation_below = 1, deviation_above = 10;
// What a view with a group must promise more than one without, to be matched again.
constexpr double worth_another_match = 2;
// Of assumed points.
constexpr int grid = 8;
constexpr int distances = 4;

/// How much a point tells that is seen under this angle from two views.
double worth_of_angle(double degrees) {
  const double deviation = degrees < best_angle ? deviation_below : deviation_above;
  const double x = (degrees - best_angle) / deviation;
  return std::exp(-0.5 * x * x);
}

}  // namespace

std::vector<ObservedPoint> assumed_points(const std::vector<View>& views, double nearest,
                                          double farthest) {
  std::vector<ObservedPoint> points;
  for (const View& view : views) {
    for (int i = 0; i < grid * grid; ++i) {
      const Eigen::Vector2d pixel((i % grid + 0.5) * view.camera.width / grid - 0.5,
                                  (i / grid + 0.5) * view.camera.height / grid - 0.5);
      Eigen::Vector3d ray;
      if (!unproject(view.camera, pixel, ray) || is_masked(view, pixel)) continue;
      for (int k = 0; k < distances; ++k) {
        const double distance = nearest * std::pow(farthest / nearest, (k + 0.5) / distances);
        points.push_back({view.world_from_camera * (distance * ray), {}});
      }
    }
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const Eigen::Isometry3d camera_from_world = views[i].world_from_camera.inverse();
    const PreparedCamera camera(views[i].camera);
    for (ObservedPoint& point : points) {
      Eigen::Vector2d pixel;
      const bool seen = camera.project_into_image(camera_from_world * point.position, pixel) &&
                        !is_masked(views[i], pixel);
      if (seen) point.observers.push_back(i);
    }
  }
  return points;
}

class ViewSelection::Implementation {
 public:
  Implementation(std::vector<Eigen::Vector3d> centres, std::vector<ObservedPoint> points)
      : centres_(std::move(centres)), points_(std::move(points)), seen_(centres_.size()) {
    for (std::size_t i = 0; i < points_.size(); ++i) {
      std::vector<std::size_t>& observers = points_[i].observers;
      std::sort(observers.begin(), observers.end());
      observers.erase(std::unique(observers.begin(), observers.end()), observers.end());
      for (const std::size_t observer : observers) {
        require_view(observer);
        seen_[observer].push_back(i);
      }
    }
  }

  std::vector<std::size_t> sources(std::size_t view, std::size_t count) const {
    require_view(view);
    std::vector<std::pair<double, std::size_t>> ranked;
    for (const auto& [other, worth] : worth_of_others(view)) ranked.emplace_back(-worth, other);
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> sources;
    for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
      sources.push_back(ranked[i].second);
    }
    return sources;
  }

  std::vector<std::vector<std::size_t>> groups(std::size_t size) const {
    std::vector<std::vector<std::size_t>> groups;
    std::vector<bool> in_a_group(centres_.size());
    for (std::size_t first = 0; first < centres_.size(); ++first) {
      if (in_a_group[first]) continue;
      std::vector<std::size_t> group = {first};
      Worths worths = worth_of_others(first);
      while (group.size() < size && !worths.empty()) {
        group.push_back(next_member(worths, in_a_group));
        worths = least_of(worths, worth_of_others(group.back()));
      }
      for (const std::size_t view : group) in_a_group[view] = true;
      groups.push_back(std::move(group));
    }
    return groups;
  }

 private:
  void require_view(std::size_t number) const {
    require_number(number, centres_.size(), "view", "The selection");
  }

  /// What matching with other views promises; those that promise nothing are missing.
  using Worths = std::map<std::size_t, double>;

  Worths worth_of_others(std::size_t view) const {
    Worths worths;
    const Eigen::Vector3d& centre = centres_[view];
    for (const std::size_t number : seen_[view]) {
      const ObservedPoint& point = points_[number];
      for (const std::size_t other : point.observers) {
        if (other == view || !has_baseline(centre, centres_[other])) continue;
        worths[other] += worth_of_angle(
            degrees_between(point.position - centre, point.position - centres_[other]));
      }
    }
    std::erase_if(worths, [](const auto& worth) { return !(worth.second > 0); });
    return worths;
  }

  /// What views promise to the member that they promise least.
  static Worths least_of(const Worths& a, const Worths& b) {
    Worths least;
    for (const auto& [view, worth] : a) {
      const auto other = b.find(view);
      if (other != b.end()) least.emplace(view, std::min(worth, other->second));
    }
    return least;
  }

  static std::size_t next_member(const Worths& worths, const std::vector<bool>& in_a_group) {
    const auto worth = [&](const Worths::value_type& view) {
      return in_a_group[view.first] ? view.second / worth_another_match : view.second;
    };
    return std::max_element(worths.begin(), worths.end(),
                            [&](const auto& a, const auto& b) { return worth(a) < worth(b); })
        ->first;
  }

  std::vector<Eigen::Vector3d> centres_;
  std::vector<ObservedPoint> points_;
  std::vector<std::vector<std::size_t>> seen_;  // points, by view
};

ViewSelection::ViewSelection(std::vector<Eigen::Vector3d> centres,
                             std::vector<ObservedPoint> points)
    : implementation_(std::make_unique<Implementation>(std::move(centres), std::move(points))) {}
ViewSelection::~ViewSelection() = default;
ViewSelection::ViewSelection(ViewSelection&&) noexcept = default;
ViewSelection& ViewSelection::operator=(ViewSelection&&) noexcept = default;

std::vector<std::size_t> ViewSelection::sources(std::size_t view, std::size_t count) const {
  return implementation_->sources(view, count);
}

std::vector<std::vector<std::size_t>> ViewSelection::groups(std::size_t size) const {
  return implementation_->groups(size);
}

}  // namespace widestereo
