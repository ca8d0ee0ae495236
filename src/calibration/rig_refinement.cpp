// SPDX-License-Identifier: MIT
#include "widestereo/rig_refinement.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "calibration/match_rays.h"
#include "geometry/angle.h"
#include "statistics/percentile.h"
#include "statistics/robust.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/options.h"
#include "widestereo/view_selection.h"

namespace widestereo {
namespace {

constexpr int most_steps = 50;
constexpr double last_step = 1e-4;       // of the deviations below
constexpr double smallest_scale = 0.05;  // pixels: features are not located better

/// Standard deviations of a calibration.
constexpr double rotation_deviation = 0.5 / degrees_per_radian;
constexpr double direction_deviation = 2 / degrees_per_radian;
constexpr double focal_deviation = 0.002;  // a factor that all cameras share fits as well
constexpr double centre_deviation = 1;     // pixels
constexpr double largest_change = 5;       // deviations: what matches of other views would fit

/// Where views that see the same are told from those that do not.
constexpr double least_shared = 0.02;  // of the points that the view with fewer sees

/// Unknowns of a view: its turn (radians, common frame), the shift of its centre across the line
/// from view 0's (in units of that distance), the logarithm of its focal lengths, its principal
/// point.
constexpr Eigen::Index turn = 0, shift = 3, focal = 5, centre = 6, unknowns_per_view = 8;

using ViewUnknowns = Eigen::Matrix<double, unknowns_per_view, 1>;

/// The epipolar error of a match (pixels) and its derivatives by the unknowns of both views.
struct Residual {
  double error;
  std::array<std::size_t, 2> views;
  std::array<ViewUnknowns, 2> by;
};

struct SeenRay {
  Eigen::Vector3d direction;             ///< common frame, unit length
  Eigen::Matrix<double, 3, 2> by_pixel;  ///< its derivative
  Eigen::Vector2d from_centre;           ///< of the pixel from the principal point
};

bool see(const View& view, const PreparedCamera& camera, const Eigen::Vector2d& pixel,
         SeenRay& seen) {
  Eigen::Vector3d ray;
  Eigen::Vector2d again;
  Eigen::Matrix<double, 2, 3> pixel_by_ray;
  if (is_masked(view, pixel) || !camera.unproject(pixel, ray) ||
      !camera.project(ray, again, pixel_by_ray)) {
    return false;
  }
  const Eigen::Matrix3d& rotation = view.world_from_camera.linear();
  seen.direction = rotation * ray;
  // No pixel moves when a ray is lengthened, so that the pseudo-inverse stays on the unit sphere.
  seen.by_pixel =
      rotation * pixel_by_ray.transpose() * (pixel_by_ray * pixel_by_ray.transpose()).inverse();
  seen.from_centre = pixel - Eigen::Vector2d(view.camera.cx, view.camera.cy);
  return seen.by_pixel.allFinite();
}

/// Two unit vectors across a direction and each other.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& direction) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = direction.unitOrthogonal();
  basis.col(1) = direction.normalized().cross(basis.col(0));
  return basis;
}

class Refinement {
 public:
  Refinement(const Rig& rig, const std::vector<ViewMatches>& pairs, bool intrinsics)
      : calibrated_(rig), rig_(rig), pairs_(pairs) {
    for (const ViewMatches& pair : pairs) counts_.emplace_back(pair.matches.size(), true);
    ViewUnknowns deviations;
    deviations << Eigen::Vector3d::Constant(rotation_deviation),
        Eigen::Vector2d::Constant(direction_deviation), focal_deviation,
        Eigen::Vector2d::Constant(centre_deviation);
    deviations_ = deviations.replicate(static_cast<Eigen::Index>(rig.views.size()), 1);
    refined_ = Eigen::VectorXd::Ones(unknowns());
    refined_.head<focal>().setZero();  // view 0's pose
    for (std::size_t view = 0; !intrinsics && view < rig.views.size(); ++view) {
      refined_.segment<unknowns_per_view - focal>(place(view) + focal).setZero();
    }
  }

  const Rig& rig() const { return rig_; }

  void solve() {
    step_to_minimum();
    // Only where the rig is nearly right do distances tell which matches are false.
    for (int round = 0; round < 2; ++round) {
      leave_out_unlikely_matches();
      step_to_minimum();
    }
  }

  std::vector<ViewRefinement> report() {
    linearise();
    const Eigen::MatrixXd covariance = information_.inverse();
    std::vector<ViewRefinement> report;
    for (std::size_t view = 0; view < rig_.views.size(); ++view) {
      const ViewUnknowns changed = change(view);
      const auto value = [&](Eigen::Index first, Eigen::Index count, double unit) {
        const Eigen::Index at = place(view) + first;
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(
            covariance.block(at, at, count, count), Eigen::EigenvaluesOnly);
        return RefinedValue{unit * changed.segment(first, count).norm(),
                            unit * refined_(at) * std::sqrt(solver.eigenvalues().maxCoeff())};
      };
      report.push_back({value(turn, 3, degrees_per_radian), value(shift, 2, degrees_per_radian),
                        value(focal, 1, 100), value(centre, 2, 1)});
    }
    return report;
  }

 private:
  /// Gauss and Newton's steps.
  void step_to_minimum() {
    for (int step = 0; step < most_steps; ++step) {
      linearise();
      const Eigen::VectorXd update = -information_.ldlt().solve(gradient_);
      if (!update.allFinite()) return;
      for (std::size_t view = 0; view < rig_.views.size(); ++view) {
        move(view, update.segment<unknowns_per_view>(place(view)));
      }
      if (update.cwiseQuotient(deviations_).cwiseAbs().maxCoeff() < last_step) return;
    }
  }

  /// Matches whose rays do not meet before both cameras, or do at a small part of the distance of
  /// most. False ones that happen to lie near their epipolar curves do so: the parallax that they
  /// pretend to have turns the baseline, against which the others of a far scene are powerless.
  void leave_out_unlikely_matches() {
    constexpr double least_parallax = 0.005;  // radians, which noise does not make
    constexpr double least_share = 0.1;
    std::vector<PreparedCamera> cameras;
    for (const View& view : rig_.views) cameras.emplace_back(view.camera);
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      const ViewMatches& pair = pairs_[i];
      const View& first = rig_.views[pair.first];
      const View& second = rig_.views[pair.second];
      const Eigen::Vector3d between =
          second.world_from_camera.translation() - first.world_from_camera.translation();
      std::vector<double> distances;  // from the nearer camera
      std::vector<double> seen;       // those of matches with rays
      for (const PixelMatch& match : pair.matches) {
        SeenRay a;
        SeenRay b;
        double& distance = distances.emplace_back(between.norm() / least_parallax);
        if (!see(first, cameras[pair.first], match.first, a) ||
            !see(second, cameras[pair.second], match.second, b)) {
          continue;
        }
        if (a.direction.cross(b.direction).norm() > least_parallax) {
          distance = std::min(triangulated_distance(a.direction, b.direction, between),
                              triangulated_distance(b.direction, a.direction, -between));
        }
        seen.push_back(distance);
      }
      const double least = least_share * percentile(seen, 0.5);
      counts_[i].clear();
      for (const double distance : distances) counts_[i].push_back(distance > std::max(least, 0.0));
    }
  }

  Eigen::Index unknowns() const { return place(rig_.views.size()); }
  static Eigen::Index place(std::size_t view) {
    return static_cast<Eigen::Index>(view) * unknowns_per_view;
  }

  /// From view 0's centre to the view's; of view 0, which has none, any.
  static Eigen::Vector3d arm(const Rig& rig, std::size_t view) {
    if (view == 0) return Eigen::Vector3d::UnitX();
    return rig.views[view].world_from_camera.translation() -
           rig.views[0].world_from_camera.translation();
  }

  /// How far the unknowns of a view are from the calibration.
  ViewUnknowns change(std::size_t index) const {
    const View& now = rig_.views[index];
    const View& before = calibrated_.views[index];
    const Eigen::AngleAxisd turned(now.world_from_camera.linear() *
                                   before.world_from_camera.linear().transpose());
    ViewUnknowns change;
    change << turned.angle() * turned.axis(),
        across(arm(rig_, index)).transpose() *
            (arm(rig_, index).normalized() - arm(calibrated_, index).normalized()),
        std::log(now.camera.fx / before.camera.fx), now.camera.cx - before.camera.cx,
        now.camera.cy - before.camera.cy;
    return change;
  }

  void move(std::size_t index, const ViewUnknowns& update) {
    View& view = rig_.views[index];
    if (index > 0) {
      Eigen::Isometry3d& pose = view.world_from_camera;
      const Eigen::Vector3d turned = update.segment<3>(turn);
      pose.linear() = Eigen::AngleAxisd(turned.norm(), turned.stableNormalized()) * pose.linear();
      const Eigen::Vector3d before = arm(rig_, index);
      const Eigen::Vector3d direction =
          before.normalized() + across(before) * update.segment<2>(shift);
      pose.translation() =
          rig_.views[0].world_from_camera.translation() + before.norm() * direction.normalized();
    }
    const double scale = std::exp(update(focal));
    Camera& camera = view.camera;
    for (double* scaled : {&camera.fx, &camera.fy, &camera.skew, &camera.shear}) *scaled *= scale;
    camera.cx += update(centre);
    camera.cy += update(centre + 1);
  }

  std::vector<Residual> residuals() const {
    std::vector<PreparedCamera> cameras;
    for (const View& view : rig_.views) cameras.emplace_back(view.camera);
    std::vector<Residual> residuals;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      for (std::size_t k = 0; k < pairs_[i].matches.size(); ++k) {
        Residual residual;
        if (counts_[i][k] && linearise(pairs_[i], pairs_[i].matches[k], cameras, residual)) {
          residuals.push_back(residual);
        }
      }
    }
    return residuals;
  }

  /// The volume that both rays and the baseline span is 0 where they lie in a plane.
  bool linearise(const ViewMatches& pair, const PixelMatch& match,
                 const std::vector<PreparedCamera>& cameras, Residual& residual) const {
    const View& first = rig_.views[pair.first];
    const View& second = rig_.views[pair.second];
    SeenRay a;
    SeenRay b;
    if (!see(first, cameras[pair.first], match.first, a) ||
        !see(second, cameras[pair.second], match.second, b)) {
      return false;
    }
    const Eigen::Vector3d between =
        second.world_from_camera.translation() - first.world_from_camera.translation();
    const Eigen::Vector3d baseline = between.normalized();
    const Eigen::Vector3d normal = a.direction.cross(b.direction);
    const Eigen::Vector3d by_a = b.direction.cross(baseline);
    const Eigen::Vector3d by_b = baseline.cross(a.direction);
    const Eigen::Vector2d by_first_pixel = a.by_pixel.transpose() * by_a;
    const Eigen::Vector2d by_second_pixel = b.by_pixel.transpose() * by_b;
    const double slope = std::sqrt(by_first_pixel.squaredNorm() + by_second_pixel.squaredNorm());
    if (!(slope > 1e-9)) return false;  // at both epipoles every plane holds both rays
    residual.error = baseline.dot(normal) / slope;
    // The slope changes, too: where parallax is no larger than noise, it decides where the error is
    // least. With intrinsics it hardly does.
    const Eigen::Vector3d u = a.by_pixel * by_first_pixel / slope;
    const Eigen::Vector3d w = b.by_pixel * by_second_pixel / slope;
    const Eigen::Vector3d slope_by_baseline = u.cross(b.direction) + a.direction.cross(w);
    const Eigen::Vector3d slope_by_first_turn =
        a.direction.cross(w.cross(baseline)) + u.cross(by_a);
    const Eigen::Vector3d slope_by_second_turn =
        b.direction.cross(baseline.cross(u)) + w.cross(by_b);
    const auto by_unknowns = [&](std::size_t view, const SeenRay& ray,
                                 const Eigen::Vector3d& by_turn, const Eigen::Vector2d& by_pixel,
                                 const Eigen::Vector3d& by_centre) {
      const Eigen::Vector3d from_view_0 = arm(rig_, view);
      ViewUnknowns by;
      // A pixel stays where it is: the larger its image, the nearer to the axis its ray.
      by << by_turn, from_view_0.norm() * across(from_view_0).transpose() * by_centre,
          -by_pixel.dot(ray.from_centre), -by_pixel;
      return ViewUnknowns(by.cwiseProduct(refined_.segment<unknowns_per_view>(place(view))) /
                          slope);
    };
    const Eigen::Vector3d by_baseline = normal - residual.error * slope_by_baseline;
    const Eigen::Vector3d by_second_centre =
        (by_baseline - by_baseline.dot(baseline) * baseline) / between.norm();
    residual.views = {pair.first, pair.second};
    residual.by = {
        by_unknowns(pair.first, a, a.direction.cross(by_a) - residual.error * slope_by_first_turn,
                    by_first_pixel, -by_second_centre),
        by_unknowns(pair.second, b, b.direction.cross(by_b) - residual.error * slope_by_second_turn,
                    by_second_pixel, by_second_centre)};
    return true;
  }

  void linearise() {
    const std::vector<Residual> all = residuals();
    std::vector<double> sizes;
    for (const Residual& residual : all) sizes.push_back(std::abs(residual.error));
    const double scale = std::max(deviations_per_median * percentile(sizes, 0.5), smallest_scale);
    const Eigen::VectorXd precision = deviations_.cwiseAbs2().cwiseInverse();
    information_ = precision.asDiagonal();
    gradient_.resize(unknowns());
    for (std::size_t view = 0; view < rig_.views.size(); ++view) {
      gradient_.segment<unknowns_per_view>(place(view)) = change(view);
    }
    gradient_ = gradient_.cwiseProduct(precision);
    for (const Residual& residual : all) {
      // Large where a match is false.
      const double doubt = doubt_of(residual.error, scale);
      const double weight = 1 / (doubt * doubt * scale * scale);
      for (const int i : {0, 1}) {
        const Eigen::Index row = place(residual.views[i]);
        gradient_.segment<unknowns_per_view>(row) += weight * residual.error * residual.by[i];
        for (const int j : {0, 1}) {
          information_.block<unknowns_per_view, unknowns_per_view>(row, place(residual.views[j])) +=
              weight * residual.by[i] * residual.by[j].transpose();
        }
      }
    }
  }

  const Rig& calibrated_;
  Rig rig_;
  const std::vector<ViewMatches>& pairs_;
  std::vector<std::vector<bool>> counts_;  ///< which of each pair's matches
  Eigen::VectorXd deviations_;             ///< of the calibration
  Eigen::VectorXd refined_;                ///< 1: the unknown is refined; 0: it stays
  Eigen::MatrixXd information_;            ///< inverse covariance
  Eigen::VectorXd gradient_;
};

/// Nothing of pairs that are left out.
std::vector<EpipolarReport> check(const Rig& rig, const std::vector<ViewMatches>& pairs,
                                  const std::vector<std::string>& left_out) {
  std::vector<EpipolarReport> reports(pairs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!left_out[i].empty()) continue;
    const ViewMatches& pair = pairs[i];
    reports[i] = check_epipolar(rig.views[pair.first], rig.views[pair.second], pair.matches);
  }
  return reports;
}

constexpr const char* remedy =
    "; check that images matched with each other were taken at the same time, by the calibration's "
    "cameras in its order.";

[[noreturn]] void fail(const std::string& finding) {
  throw Error(finding + ", so that the rig cannot be refined" + remedy);
}

/// What is wrong with matches that a refined rig fits best; empty where nothing is.
std::string fault_of(const EpipolarReport& after, const View& first, const View& second) {
  const std::string pair = first.name + " and " + second.name;
  if (!(after.below_5_pixels > 0.5)) {
    return "The features matched between " + pair + " contradict each other";
  }
  if (lie_behind(after)) {
    return "Most features matched between " + pair + " lie behind the cameras";
  }
  return "";
}

/// Few unknowns can be made to fit matches of views that are not those of the calibration.
void require_credible(const RigRefinement& refined, const std::vector<ViewMatches>& pairs) {
  const std::vector<View>& views = refined.rig.views;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!refined.left_out[i].empty()) continue;
    const std::string fault =
        fault_of(refined.after[i], views[pairs[i].first], views[pairs[i].second]);
    if (!fault.empty()) fail(fault);
  }
  const auto require_small = [](double change, double deviation, const std::string& what) {
    const double limit = largest_change * deviation * degrees_per_radian;
    if (change <= limit) return;
    fail("The matched features turn " + what +
         formatted(" by %.1f degrees, more than the %.1f that are believed", change, limit));
  };
  for (std::size_t i = 0; i < refined.views.size(); ++i) {
    const std::string& name = refined.rig.views[i].name;
    require_small(refined.views[i].rotation.change, rotation_deviation, name);
    require_small(refined.views[i].direction.change, direction_deviation,
                  "the direction to " + name);
  }
}

/// Why a pair tells nothing of the rig, by itself: false matches must not count against the others.
/// Empty where it does.
std::string why_left_out(const Rig& rig, const ViewMatches& pair, bool intrinsics) {
  const Rig alone{.views = {rig.views[pair.first], rig.views[pair.second]}};
  const std::vector<ViewMatches> matches = {{0, 1, pair.matches}};
  const auto report = [&pair](const Rig& two) {
    return check_epipolar(two.views[0], two.views[1], pair.matches);
  };
  try {
    (void)report(alone);  // are there enough?
    Refinement refinement(alone, matches, intrinsics);
    refinement.solve();
    const std::string fault = fault_of(report(refinement.rig()), alone.views[0], alone.views[1]);
    return fault.empty() ? "" : fault + remedy;
  } catch (const Error& error) {
    return error.what();
  }
}

/// `left_out` says why pairs do not count.
void require_connected(const Rig& rig, const std::vector<ViewMatches>& pairs,
                       const std::vector<std::string>& left_out) {
  std::vector<bool> reached(rig.views.size());
  reached[0] = true;
  for (std::size_t round = 1; round < rig.views.size(); ++round) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const ViewMatches& pair = pairs[i];
      if (!left_out[i].empty() || reached[pair.first] == reached[pair.second]) continue;
      reached[pair.first] = reached[pair.second] = true;
    }
  }
  const auto missing =
      static_cast<std::size_t>(std::find(reached.begin(), reached.end(), false) - reached.begin());
  if (missing == rig.views.size()) return;
  const std::string finding = "No matches connect " + rig.views[missing].name + " with " +
                              rig.views[0].name + ", so that the rig cannot be refined";
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (left_out[i].empty() || (pairs[i].first != missing && pairs[i].second != missing)) continue;
    throw Error(finding + ": " + left_out[i]);
  }
  throw Error(finding + "; refine views that share no field of view in calibrations of their own.");
}

}  // namespace

bool share_field_of_view(const View& first, const View& second, const Options& options) {
  std::array<int, 2> seen = {0, 0};
  int shared = 0;
  for (const ObservedPoint& point :
       assumed_points({first, second}, options.min_distance, options.max_distance)) {
    for (const std::size_t observer : point.observers) ++seen[observer];
    if (point.observers.size() == 2) ++shared;
  }
  return shared > least_shared * std::min(seen[0], seen[1]);
}

RigRefinement refine_rig(const Rig& rig, const std::vector<ViewMatches>& pairs, bool intrinsics) {
  validate(rig, "The rig to be refined");
  if (pairs.empty()) throw Error("A rig cannot be refined without matches between its views.");
  for (const ViewMatches& pair : pairs) {
    if (pair.first < rig.views.size() && pair.second < rig.views.size() &&
        pair.first != pair.second) {
      continue;
    }
    throw Error("Matches between views " + std::to_string(pair.first) + " and " +
                std::to_string(pair.second) + " cannot refine a rig of " +
                std::to_string(rig.views.size()) + " views; name two of them, counted from 0.");
  }
  RigRefinement result;
  result.left_out.resize(pairs.size());
  std::vector<ViewMatches> used = pairs;
  for (std::size_t i = 0; rig.views.size() > 2 && i < pairs.size(); ++i) {
    result.left_out[i] = why_left_out(rig, pairs[i], intrinsics);
    if (!result.left_out[i].empty()) used[i].matches.clear();
  }
  require_connected(rig, pairs, result.left_out);
  result.before = check(rig, pairs, result.left_out);
  Refinement refinement(rig, used, intrinsics);
  refinement.solve();
  result.rig = refinement.rig();
  result.views = refinement.report();
  result.after = check(result.rig, pairs, result.left_out);
  require_credible(result, pairs);
  return result;
}

}  // namespace widestereo
