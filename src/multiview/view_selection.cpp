// SPDX-License-Identifier: MIT
#include "widestereo/view_selection.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <opencv2/core/utility.hpp>
#include <utility>

#include "geometry/angle.h"
#include "geometry/pixel_angle.h"
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
// Work grows with the square of the views that list a point: no more do. Where there are more, they
// share the more points, so that fewer of each view will do.
constexpr std::size_t most_observers = 64;
constexpr int coarse_grid = 4;
// Views that are rated between two reports of progress.
constexpr std::size_t rated_at_once = 32;

/// How much a point tells that is seen under this angle from two views.
double worth_of_angle(double degrees) {
  const double deviation = degrees < best_angle ? deviation_below : deviation_above;
  const double x = (degrees - best_angle) / deviation;
  return std::exp(-0.5 * x * x);
}

/// A view, and what another one sees of points on its rays.
struct Partner {
  std::size_t number;
  double worth;
  std::vector<bool> sees;  ///< by point
};

/// Leaves as many as are listed, in their order: the owner of the points and, evenly, of those not
/// much worse for it than the best. The best alone are often those that all others want, too.
void thin_out(std::vector<Partner>& partners, std::size_t owner) {
  if (partners.size() <= most_observers) return;
  partners[owner].worth = std::numeric_limits<double>::infinity();
  std::sort(partners.begin(), partners.end(), [](const Partner& a, const Partner& b) {
    return std::pair(-a.worth, a.number) < std::pair(-b.worth, b.number);
  });
  const double least = partners[1].worth / worth_another_match;
  std::size_t good = most_observers;
  while (good < partners.size() && partners[good].worth >= least) ++good;
  for (std::size_t i = 1; i < most_observers; ++i) {
    std::swap(partners[i], partners[1 + (i - 1) * (good - 1) / (most_observers - 1)]);
  }
  partners.resize(most_observers);
  std::sort(partners.begin(), partners.end(),
            [](const Partner& a, const Partner& b) { return a.number < b.number; });
}

/// To the points of a view, world frame.
std::vector<Eigen::Vector3d> assumed_rays(const View& view, const PreparedCamera& camera, int side,
                                          double nearest, double farthest) {
  std::vector<Eigen::Vector3d> rays;
  for_each_of_grid(view.camera, side, [&](const Eigen::Vector2d& pixel) {
    Eigen::Vector3d ray;
    if (!camera.unproject(pixel, ray) || is_masked(view, pixel)) return;
    for (int k = 0; k < distances; ++k) {
      const double distance = nearest * std::pow(farthest / nearest, (k + 0.5) / distances);
      rays.push_back(view.world_from_camera.linear() * (distance * ray));
    }
  });
  return rays;
}

}  // namespace

std::vector<ObservedPoint> assumed_points(const std::vector<View>& views, double nearest,
                                          double farthest,
                                          const std::function<void(double)>& progress) {
  const std::size_t count = views.size();
  std::vector<PreparedCamera> cameras;
  std::vector<Eigen::Isometry3d> camera_from_world;
  for (const View& view : views) {
    cameras.emplace_back(view.camera);
    camera_from_world.push_back(view.world_from_camera.inverse());
  }
  const auto partner_for = [&](std::size_t number, const Eigen::Vector3d& centre,
                               const std::vector<Eigen::Vector3d>& rays) {
    const Eigen::Vector3d shift = centre - views[number].world_from_camera.translation();
    Partner partner{number, 0, std::vector<bool>(rays.size())};
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Eigen::Vector3d seen = camera_from_world[number] * (centre + rays[i]);
      Eigen::Vector2d pixel;
      if (!cameras[number].project_into_image(seen, pixel) || is_masked(views[number], pixel)) {
        continue;
      }
      partner.sees[i] = true;
      partner.worth += worth_of_angle(degrees_between(rays[i], rays[i] + shift));
    }
    return partner;
  };
  const int side = count > most_observers ? coarse_grid : grid;
  std::vector<ObservedPoint> points;
  for (std::size_t owner = 0; owner < count; ++owner) {
    const Eigen::Vector3d centre = views[owner].world_from_camera.translation();
    const std::vector<Eigen::Vector3d> rays =
        assumed_rays(views[owner], cameras[owner], side, nearest, farthest);
    std::vector<Partner> partners(count);
    cv::parallel_for_({0, static_cast<int>(count)}, [&](const cv::Range& range) {
      for (int i = range.start; i < range.end; ++i) {
        const auto number = static_cast<std::size_t>(i);
        partners[number] = partner_for(number, centre, rays);
      }
    });
    thin_out(partners, owner);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ObservedPoint& point = points.emplace_back(ObservedPoint{centre + rays[i], {}});
      for (const Partner& other : partners) {
        if (other.sees[i]) point.observers.push_back(other.number);
      }
    }
    if (progress) progress(static_cast<double>(owner + 1) / static_cast<double>(count));
  }
  return points;
}

class ViewSelection::Implementation {
 public:
  Implementation(std::vector<Eigen::Vector3d> centres, std::vector<ObservedPoint> points)
      : centres_(std::move(centres)),
        points_(std::move(points)),
        seen_(centres_.size()),
        is_rated_(centres_.size()),
        worths_(centres_.size()) {
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
    for (const auto& [other, worth] : worths_of(view)) ranked.emplace_back(-worth, other);
    std::sort(ranked.begin(), ranked.end());
    std::vector<std::size_t> sources;
    for (std::size_t i = 0; i < std::min(count, ranked.size()); ++i) {
      sources.push_back(ranked[i].second);
    }
    return sources;
  }

  std::vector<std::vector<std::size_t>> groups(std::size_t size,
                                               const std::function<void(double)>& progress) const {
    rate_all(progress);
    std::vector<std::vector<std::size_t>> groups;
    std::vector<bool> in_a_group(centres_.size());
    for (std::size_t first = 0; first < centres_.size(); ++first) {
      if (in_a_group[first]) continue;
      std::vector<std::size_t> group = {first};
      Worths worths = worths_of(first);
      while (group.size() < size && !worths.empty()) {
        group.push_back(next_member(worths, in_a_group));
        if (group.size() < size) worths = least_of(worths, worths_of(group.back()));
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

  /// What matching with other views promises, in their order; those that promise nothing are
  /// missing.
  using Worths = std::vector<std::pair<std::size_t, double>>;

  /// Found once, when it is first asked for.
  const Worths& worths_of(std::size_t view) const {
    std::call_once(is_rated_[view], [&] { worths_[view] = worth_of_others(view); });
    return worths_[view];
  }

  void rate_all(const std::function<void(double)>& progress) const {
    const std::size_t all = centres_.size();
    for (std::size_t first = 0; first < all; first += rated_at_once) {
      const std::size_t end = std::min(all, first + rated_at_once);
      cv::parallel_for_({static_cast<int>(first), static_cast<int>(end)},
                        [this](const cv::Range& range) {
                          for (int i = range.start; i < range.end; ++i) {
                            worths_of(static_cast<std::size_t>(i));
                          }
                        });
      if (progress) progress(static_cast<double>(end) / static_cast<double>(all));
    }
  }

  Worths worth_of_others(std::size_t view) const {
    std::vector<double> sums(centres_.size());
    const Eigen::Vector3d& centre = centres_[view];
    for (const std::size_t number : seen_[view]) {
      const ObservedPoint& point = points_[number];
      const Eigen::Vector3d ray = point.position - centre;
      for (const std::size_t other : point.observers) {
        sums[other] += worth_of_angle(degrees_between(ray, point.position - centres_[other]));
      }
    }
    Worths worths;
    for (std::size_t other = 0; other < sums.size(); ++other) {
      if (sums[other] > 0 && has_baseline(centre, centres_[other])) {
        worths.emplace_back(other, sums[other]);
      }
    }
    return worths;
  }

  /// What views promise to the member that they promise least.
  static Worths least_of(const Worths& a, const Worths& b) {
    Worths least;
    auto other = b.begin();
    for (const auto& [view, worth] : a) {
      while (other != b.end() && other->first < view) ++other;
      if (other == b.end()) break;
      if (other->first == view) least.emplace_back(view, std::min(worth, other->second));
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
  mutable std::vector<std::once_flag> is_rated_;
  mutable std::vector<Worths> worths_;
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

std::vector<std::vector<std::size_t>> ViewSelection::groups(
    std::size_t size, const std::function<void(double)>& progress) const {
  return implementation_->groups(size, progress);
}

}  // namespace widestereo
