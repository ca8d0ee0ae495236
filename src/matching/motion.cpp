// SPDX-License-Identifier: MIT
#include "widestereo/motion.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "geometry/cross_matrix.h"
#include "geometry/validation.h"
#include "statistics/percentile.h"
#include "statistics/robust.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

/// Both frames are reduced by these factors in turn and blurred by one pixel then: about twice that
/// displacement (pixels) is bridged.
constexpr std::array<int, 4> scales = {8, 4, 2, 1};
constexpr int most_steps = 12;         // at each scale
constexpr double least_gain = 0.0001;  // of a step: the share of the cost that it saves
constexpr double points_per_view = 3000;
constexpr std::size_t fewest_points = 200;
/// Standard deviation to which every direction of motion must be determined: radians, and metres
/// per metre of the median distance.
constexpr double largest_uncertainty = 0.003;
/// Correlation of the aligned frames: those that have nothing to do with each other stay below.
constexpr double least_likeness = 0.3;

/// A point of the previous frame.
struct Point {
  Eigen::Vector3d position;  ///< rig's frame
  Eigen::Vector2d pixel;     ///< of its own view
};

/// One view at one scale.
struct ScaledView {
  cv::Mat_<float> previous;
  cv::Mat_<cv::Vec3f> now;  ///< intensity and its derivatives by x and y
  cv::Mat_<uchar> usable;   ///< 0: what lies outside the lens has been blurred into the pixel
  int scale = 1;

  Eigen::Vector2d pixel_at(const Eigen::Vector2d& pixel_of_view) const {
    return ((pixel_of_view.array() + 0.5) / scale - 0.5).matrix();
  }
  bool is_usable(const Eigen::Vector2d& at) const {
    return at.x() >= 0 && at.y() >= 0 && at.x() < now.cols - 1 && at.y() < now.rows - 1 &&
           usable(static_cast<int>(at.y() + 0.5), static_cast<int>(at.x() + 0.5)) != 0;
  }
};

struct NormalEquations {
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
  double cost = 0;      ///< mean robust cost per point
  double variance = 0;  ///< of the residuals, robust
  std::size_t points = 0;
};

template <typename Value>
Value bilinear(const cv::Mat_<Value>& image, const Eigen::Vector2d& at) {
  const int x = static_cast<int>(at.x());
  const int y = static_cast<int>(at.y());
  const auto fx = static_cast<float>(at.x() - x);
  const auto fy = static_cast<float>(at.y() - y);
  return (1 - fy) * ((1 - fx) * image(y, x) + fx * image(y, x + 1)) +
         fy * ((1 - fx) * image(y + 1, x) + fx * image(y + 1, x + 1));
}

/// Calls function(view), which must not throw, for all views at once.
template <typename Function>
void for_each_view(std::size_t views, const Function& function) {
  cv::parallel_for_(cv::Range(0, static_cast<int>(views)), [&](const cv::Range& range) {
    for (int i = range.start; i < range.end; ++i) function(static_cast<std::size_t>(i));
  });
}

/// Accepted points on a regular grid, in the rig's frame.
std::vector<Point> accepted_points(const View& view, const ViewResult& matched) {
  std::vector<Point> points;
  const PreparedCamera camera(view.camera);
  const double pixels = static_cast<double>(matched.hypotheses.total());
  const int step = std::max(1, static_cast<int>(std::sqrt(pixels / points_per_view)));
  for (int y = step / 2; y < matched.hypotheses.rows; y += step) {
    for (int x = step / 2; x < matched.hypotheses.cols; x += step) {
      if (matched.reasons.at<std::uint16_t>(y, x) != 0) continue;
      Eigen::Vector3d ray;
      if (!camera.unproject({x, y}, ray)) continue;
      const auto& plane = matched.hypotheses.at<cv::Vec4f>(y, x);
      const double w = Eigen::Vector3f(plane[0], plane[1], plane[2]).cast<double>().dot(ray);
      if (w > 0) points.push_back({view.world_from_camera * (ray / w), {x, y}});
    }
  }
  return points;
}

/// Means of scale x scale pixels; a last, partial row or column is left out.
cv::Mat reduced(const cv::Mat& image, int scale) {
  const cv::Size size(std::max(1, image.cols / scale), std::max(1, image.rows / scale));
  const cv::Rect whole(0, 0, std::min(image.cols, size.width * scale),
                       std::min(image.rows, size.height * scale));
  cv::Mat small;
  cv::resize(image(whole), small, size, 0, 0, cv::INTER_AREA);
  return small;
}

/// `usable`: 255 or 0.
ScaledView scaled(const cv::Mat& previous, const cv::Mat& now, const cv::Mat& usable, int scale) {
  ScaledView view;
  view.scale = scale;
  cv::GaussianBlur(reduced(previous, scale), view.previous, {}, 1);
  cv::Mat smooth;
  cv::Mat dx;
  cv::Mat dy;
  cv::GaussianBlur(reduced(now, scale), smooth, {}, 1);
  cv::Sobel(smooth, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(smooth, dy, CV_32F, 0, 1, 3, 0.125);
  cv::merge(std::vector<cv::Mat>{smooth, dx, dy}, view.now);
  cv::erode(reduced(usable, scale) == 255, view.usable,
            cv::getStructuringElement(cv::MORPH_RECT, {7, 7}), {-1, -1}, 1, cv::BORDER_CONSTANT,
            cv::Scalar(255));
  return view;
}

/// Aligns the points of all views; unknowns: turn and shift of the rig, then gain and offset of
/// each view.
class Alignment {
 public:
  Alignment(const Rig& rig, std::vector<std::vector<Point>> points)
      : rig_(rig),
        points_(std::move(points)),
        rows_(rig.views.size()),
        brightness_(rig.views.size(), {1, 0}) {}

  void refine(const std::vector<ScaledView>& views) {
    NormalEquations equations = linearise(views);
    for (int step = 0; step < most_steps && equations.points >= fewest_points; ++step) {
      const Eigen::VectorXd update = solve(equations);
      if (!update.allFinite()) return;
      const auto before = std::pair(motion_, brightness_);
      apply(update);
      const NormalEquations next = linearise(views);
      if (next.points < fewest_points || next.cost > equations.cost) {
        std::tie(motion_, brightness_) = before;
        return;
      }
      if (next.cost >= equations.cost * (1 - least_gain)) return;
      equations = next;
    }
  }

  /// Whether every direction of motion is determined.
  bool is_determined(const std::vector<ScaledView>& views) {
    const NormalEquations equations = linearise(views);
    if (equations.points < fewest_points || !(likeness() >= least_likeness)) return false;
    const Eigen::Index others = equations.information.rows() - 6;
    Eigen::MatrixXd brightness = equations.information.bottomRightCorner(others, others);
    brightness.diagonal().array() += 1e-9;
    const Eigen::MatrixXd shared = equations.information.topRightCorner(6, others);
    Eigen::Matrix<double, 6, 6> of_motion = equations.information.topLeftCorner<6, 6>() -
                                            shared * brightness.ldlt().solve(shared.transpose());
    Eigen::Matrix<double, 6, 1> units;
    units << 1, 1, 1, Eigen::Vector3d::Constant(median_distance());
    of_motion = units.asDiagonal() * of_motion * units.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> solver(of_motion);
    const double weakest = solver.eigenvalues().minCoeff();
    return equations.variance < weakest * largest_uncertainty * largest_uncertainty;
  }

  const Eigen::Isometry3d& motion() const { return motion_; }

 private:
  /// Unknowns of one view: turn and shift of the rig, its own gain and offset.
  using Unknowns = Eigen::Matrix<double, 8, 1>;

  struct Row {
    double residual;
    Unknowns by;  ///< its derivatives
  };

  struct ViewEquations {
    Eigen::Matrix<double, 8, 8> information = Eigen::Matrix<double, 8, 8>::Zero();
    Unknowns gradient = Unknowns::Zero();
    double cost = 0;
  };

  double median_distance() const {
    std::vector<double> distances;
    for (const std::vector<Point>& of_view : points_) {
      for (const Point& point : of_view) distances.push_back(point.position.norm());
    }
    return percentile(distances, 0.5);
  }

  /// Correlation of what the points looked like and look like, over all views.
  double likeness() const {
    double shared = 0, of_previous = 0, of_now = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      Eigen::Array2Xd seen(2, rows_[i].size());  // previously, and now less the view's offset
      for (std::size_t k = 0; k < rows_[i].size(); ++k) {
        const double previous = -rows_[i][k].by[6];
        seen.col(static_cast<Eigen::Index>(k)) << previous,
            rows_[i][k].residual + brightness_[i][0] * previous;
      }
      if (seen.cols() == 0) continue;
      seen.colwise() -= seen.rowwise().mean().eval();
      shared += (seen.row(0) * seen.row(1)).sum();
      of_previous += seen.row(0).square().sum();
      of_now += seen.row(1).square().sum();
    }
    return shared / std::sqrt(of_previous * of_now);
  }

  /// Fills rows_[i].
  void set_rows(std::size_t i, const ScaledView& view) {
    std::vector<Row>& rows = rows_[i];
    rows.clear();
    const Eigen::Isometry3d camera_from_rig = rig_.views[i].world_from_camera.inverse();
    const PreparedCamera camera(rig_.views[i].camera);
    // Coarse scales must only come near.
    const std::size_t stride = view.scale > 1 ? 2 : 1;
    for (std::size_t k = 0; k < points_[i].size(); k += stride) {
      const Point& point = points_[i][k];
      const Eigen::Vector2d before = view.pixel_at(point.pixel);
      if (!view.is_usable(before)) continue;
      const Eigen::Vector3d moved = motion_ * point.position;
      Eigen::Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian;
      if (!camera.project(camera_from_rig * moved, pixel, jacobian)) continue;
      const Eigen::Vector2d after = view.pixel_at(pixel);
      if (!view.is_usable(after)) continue;
      const cv::Vec3f seen = bilinear(view.now, after);
      const auto intensity = static_cast<double>(bilinear(view.previous, before));
      const Eigen::RowVector3d by_point = Eigen::RowVector2f(seen[1], seen[2]).cast<double>() *
                                          jacobian * camera_from_rig.linear() / view.scale;
      Row& row = rows.emplace_back();
      row.residual =
          static_cast<double>(seen[0]) - brightness_[i][0] * intensity - brightness_[i][1];
      row.by << (-by_point * cross_matrix(moved)).transpose(), by_point.transpose(), -intensity, -1;
    }
  }

  static ViewEquations equations_of(const std::vector<Row>& rows, double deviation) {
    ViewEquations equations;
    for (const Row& row : rows) {
      // Large where something moves by itself or was occluded.
      const double doubt = doubt_of(row.residual, deviation);
      const Unknowns weighted = row.by / (doubt * doubt);
      equations.information.noalias() += weighted * row.by.transpose();
      equations.gradient += row.residual * weighted;
      equations.cost += row.residual * row.residual / doubt;
    }
    return equations;
  }

  NormalEquations linearise(const std::vector<ScaledView>& views) {
    for_each_view(views.size(), [&](std::size_t i) { set_rows(i, views[i]); });
    const Eigen::Index unknowns = 6 + 2 * static_cast<Eigen::Index>(views.size());
    NormalEquations equations;
    equations.information = Eigen::MatrixXd::Zero(unknowns, unknowns);
    equations.gradient = Eigen::VectorXd::Zero(unknowns);
    std::vector<double> sizes;
    for (const std::vector<Row>& rows : rows_) {
      for (const Row& row : rows) sizes.push_back(std::abs(row.residual));
    }
    equations.points = sizes.size();
    if (sizes.empty()) return equations;
    const double deviation = deviations_per_median * percentile(sizes, 0.5) + 1e-4;
    equations.variance = deviation * deviation;
    std::vector<ViewEquations> equations_of_views(views.size());
    for_each_view(views.size(), [&](std::size_t i) {
      equations_of_views[i] = equations_of(rows_[i], deviation);
    });
    for (std::size_t i = 0; i < views.size(); ++i) {
      const ViewEquations& of_view = equations_of_views[i];
      const Eigen::Index place = 6 + 2 * static_cast<Eigen::Index>(i);
      equations.information.topLeftCorner<6, 6>() += of_view.information.topLeftCorner<6, 6>();
      equations.information.block<6, 2>(0, place) = of_view.information.topRightCorner<6, 2>();
      equations.information.block<2, 6>(place, 0) = of_view.information.bottomLeftCorner<2, 6>();
      equations.information.block<2, 2>(place, place) =
          of_view.information.bottomRightCorner<2, 2>();
      equations.gradient.head<6>() += of_view.gradient.head<6>();
      equations.gradient.segment<2>(place) = of_view.gradient.tail<2>();
      equations.cost += of_view.cost;
    }
    equations.cost /= static_cast<double>(equations.points);
    return equations;
  }

  static Eigen::VectorXd solve(const NormalEquations& equations) {
    Eigen::MatrixXd damped = equations.information;
    damped.diagonal() *= 1 + 1e-6;
    // Not of the motion, whose unit of length nothing here knows.
    damped.diagonal().tail(damped.rows() - 6).array() += 1e-9;
    return -damped.ldlt().solve(equations.gradient);
  }

  void apply(const Eigen::VectorXd& update) {
    const Eigen::Vector3d turn = update.head<3>();
    const double angle = turn.norm();
    Eigen::Isometry3d step = Eigen::Isometry3d::Identity();
    if (angle > 0) step.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
    step.translation() = update.segment<3>(3);
    motion_ = step * motion_;
    for (std::size_t i = 0; i < brightness_.size(); ++i) {
      const Eigen::Index place = 6 + 2 * static_cast<Eigen::Index>(i);
      brightness_[i] += update.segment<2>(place);
    }
  }

  const Rig& rig_;
  std::vector<std::vector<Point>> points_;
  std::vector<std::vector<Row>> rows_;  // kept, as memory of this size is slow to get
  Eigen::Isometry3d motion_ = Eigen::Isometry3d::Identity();
  std::vector<Eigen::Vector2d> brightness_;
};

void require_sizes(const Rig& rig, const std::vector<cv::Mat>& previous_images,
                   const std::vector<ViewResult>& previous, const std::vector<cv::Mat>& images) {
  const std::size_t count = rig.views.size();
  if (previous_images.size() != count || previous.size() != count || images.size() != count) {
    throw Error("The rig has " + std::to_string(count) +
                " views; its motion needs that many images of both frames, and results.");
  }
  for (std::size_t i = 0; i < count; ++i) {
    const View& view = rig.views[i];
    require_valid(view, "The rig");
    const cv::Size size(view.camera.width, view.camera.height);
    require_size(previous_images[i], size, "The previous image of " + view.name);
    require_size(images[i], size, "The image of " + view.name);
    require_map(previous[i].hypotheses, size, CV_32FC4,
                "The previous map of planes of " + view.name);
    require_map(previous[i].reasons, size, CV_16UC1, "The previous map of reasons of " + view.name);
  }
}

}  // namespace

std::optional<Eigen::Isometry3d> estimate_motion(const Rig& rig,
                                                 const std::vector<cv::Mat>& previous_images,
                                                 const std::vector<ViewResult>& previous,
                                                 const std::vector<cv::Mat>& images) {
  require_sizes(rig, previous_images, previous, images);
  const std::size_t count = rig.views.size();
  if (count == 0) return std::nullopt;
  // Turns about a place far away are hardly told from shifts.
  const Eigen::Translation3d origin(rig.views.front().world_from_camera.translation());
  Rig about_origin = rig;
  for (View& view : about_origin.views) {
    view.world_from_camera = origin.inverse() * view.world_from_camera;
  }
  std::vector<std::vector<Point>> points(count);
  std::vector<cv::Mat> usable(count);
  std::vector<std::array<cv::Mat, 2>> intensities(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string& name = rig.views[i].name;
    intensities[i] = {to_intensity(previous_images[i], "The previous image of " + name),
                      to_intensity(images[i], "The image of " + name)};
  }
  for_each_view(count, [&](std::size_t i) {
    const cv::Mat& reasons = previous[i].reasons;
    usable[i] = cv::Mat(reasons.size(), CV_8UC1);
    std::transform(
        reasons.begin<std::uint16_t>(), reasons.end<std::uint16_t>(), usable[i].begin<uchar>(),
        [](std::uint16_t all) { return (all & reason_no_ray) == 0 ? uchar{255} : uchar{0}; });
    points[i] = accepted_points(about_origin.views[i], previous[i]);
  });
  Alignment alignment(about_origin, std::move(points));
  std::vector<ScaledView> views(count);
  for (const int scale : scales) {
    for_each_view(count, [&](std::size_t i) {
      views[i] = scaled(intensities[i][0], intensities[i][1], usable[i], scale);
    });
    alignment.refine(views);
  }
  if (!alignment.is_determined(views)) return std::nullopt;
  return origin * alignment.motion() * origin.inverse();
}

}  // namespace widestereo
