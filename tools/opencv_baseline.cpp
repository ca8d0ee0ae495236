// SPDX-License-Identifier: MIT
// What widestereo is compared with: rectification of both fisheye images to longitude and latitude
// about the baseline, then OpenCV's semi-global matching, mapped back to the first fisheye image.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "rig_settings.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;

namespace {

constexpr double pi = std::numbers::pi;

// The best of the settings tried on the sets of docs/accuracy.md. Nothing is rejected but by the
// left-right check, because empty pixels count as bad.
constexpr double scale_of_fisheye = 1.25;  ///< samples for each of the fisheye's, across its field
constexpr int block_side = 5;              ///< pixels
constexpr int small_step_penalty = 12;     ///< for each pixel of the block: P1
constexpr int large_step_penalty = 96;     ///< for each pixel of the block: P2
constexpr int left_right_difference = 2;   ///< pixels
constexpr int gradient_limit = 63;         ///< preFilterCap: higher is robust to exposure
constexpr int uniqueness = 0;              ///< percent
constexpr int speckle_size = 0;            ///< pixels; 0: keeps small regions

struct Arguments {
  std::vector<std::string> images;
  std::string output;
  RigSettings rig;
  double min_distance = 0.5, max_distance = 100;
};

/// Rows are half planes through both camera centres (epipolar planes), at equal steps of longitude;
/// columns are angles from the baseline, equal steps, falling, so that a point lies farther left in
/// the second image. Angles are measured from the direction towards the second centre in both.
class EpipolarSphere {
 public:
  EpipolarSphere(const ws::View& reference, const ws::View& source, double pixels_per_radian)
      : scale_(pixels_per_radian) {
    const Eigen::Isometry3d motion = ws::source_from_reference(source, reference);
    const Eigen::Vector3d centre = motion.inverse().translation();
    baseline_ = centre.norm();
    // The cut of longitude lies behind the first camera, or above it where that looks along the
    // baseline.
    const Eigen::Vector3d axis = centre / baseline_;
    Eigen::Vector3d front = Eigen::Vector3d::UnitZ() - axis.z() * axis;
    if (front.norm() < 0.1) front = Eigen::Vector3d::UnitY() - axis.y() * axis;
    front.normalize();
    reference_from_sphere_.col(0) = axis;
    reference_from_sphere_.col(1) = front;
    reference_from_sphere_.col(2) = axis.cross(front);
    source_from_sphere_ = motion.linear() * reference_from_sphere_;
    columns_ = static_cast<int>(std::ceil(pi * scale_));
    rows_ = static_cast<int>(std::ceil(2 * (pi + overlap) * scale_));
  }

  double scale() const { return scale_; }
  double baseline() const { return baseline_; }

  /// Angle from the baseline and longitude of a ray of the first camera.
  Eigen::Vector2d angles(const Eigen::Vector3d& ray) const {
    const Eigen::Vector3d r = reference_from_sphere_.transpose() * ray;
    return {std::atan2(r.tail<2>().norm(), r.x()), std::atan2(r.z(), r.y())};
  }
  Eigen::Vector2d pixel(const Eigen::Vector2d& angles) const {
    return {(pi - angles.x()) * scale_ - 0.5, (angles.y() + pi + overlap) * scale_ - 0.5};
  }
  /// The image resampled; black where the camera does not see.
  cv::Mat rectify(const cv::Mat& image, const ws::View& view, bool is_source) const {
    const Eigen::Matrix3d& camera_from_sphere =
        is_source ? source_from_sphere_ : reference_from_sphere_;
    const ws::PreparedCamera camera(view.camera);
    cv::Mat map(rows_, columns_, CV_32FC2);
    cv::parallel_for_(cv::Range(0, rows_), [&](const cv::Range& range) {
      for (int y = range.start; y < range.end; ++y) {
        const double longitude = (y + 0.5) / scale_ - pi - overlap;
        for (int x = 0; x < columns_; ++x) {
          const double angle = pi - (x + 0.5) / scale_;
          const Eigen::Vector3d ray(std::cos(angle), std::sin(angle) * std::cos(longitude),
                                    std::sin(angle) * std::sin(longitude));
          Eigen::Vector2d pixel;
          const bool seen = camera.project(camera_from_sphere * ray, pixel);
          map.at<cv::Vec2f>(y, x) =
              seen ? cv::Vec2f(pixel.cast<float>().x(), pixel.cast<float>().y())
                   : cv::Vec2f(-9, -9);
        }
      }
    });
    cv::Mat rectified;
    cv::remap(image, rectified, map, {}, cv::INTER_CUBIC);
    return rectified;
  }

 private:
  /// Longitudes beyond the cut, repeated on both sides, so that matching sees past it.
  static constexpr double overlap = 0.1;
  double scale_ = 0, baseline_ = 0;
  int columns_ = 0, rows_ = 0;
  Eigen::Matrix3d reference_from_sphere_, source_from_sphere_;  ///< column 0: the baseline
};

/// 8-bit grey levels, black where the view's mask excludes.
cv::Mat grey_levels(const std::string& file, const ws::View& view) {
  const cv::Mat image = ws::read_image(file);
  ws::require_calibrated_size(image, view, file);
  cv::Mat grey = ws::to_grey_levels(image, file);
  if (!view.mask.empty()) grey.setTo(0, view.mask == 0);
  return grey;
}

/// Disparity in pixels, negative where there is none.
cv::Mat match(const cv::Mat& reference, const cv::Mat& source, int disparities) {
  // The matcher leaves as many columns at the left without a result as there are disparities.
  cv::Mat left;
  cv::Mat right;
  cv::copyMakeBorder(reference, left, 0, 0, disparities, 0, cv::BORDER_CONSTANT);
  cv::copyMakeBorder(source, right, 0, 0, disparities, 0, cv::BORDER_CONSTANT);
  constexpr int area = block_side * block_side;
  cv::Mat fixed_point;
  cv::StereoSGBM::create(0, disparities, block_side, small_step_penalty * area,
                         large_step_penalty * area, left_right_difference, gradient_limit,
                         uniqueness, speckle_size, 0, cv::StereoSGBM::MODE_HH)
      ->compute(left, right, fixed_point);
  cv::Mat disparity;
  fixed_point.colRange(disparities, fixed_point.cols)
      .convertTo(disparity, CV_32F, 1 / static_cast<double>(cv::StereoMatcher::DISP_SCALE));
  return disparity;
}

/// Bilinear where the four values around agree to a pixel, else the nearest; negative: none.
double sample(const cv::Mat& disparity, const Eigen::Vector2d& pixel) {
  const double x = std::clamp(pixel.x(), 0.0, disparity.cols - 1.001);
  const double y = std::clamp(pixel.y(), 0.0, disparity.rows - 1.001);
  const int x0 = static_cast<int>(x);
  const int y0 = static_cast<int>(y);
  const cv::Mat around = disparity(cv::Rect(x0, y0, 2, 2));
  double least = 0;
  double most = 0;
  cv::minMaxLoc(around, &least, &most);
  const double fx = x - x0;
  const double fy = y - y0;
  const auto at = [&](int row, int column) {
    return static_cast<double>(around.at<float>(row, column));
  };
  if (least < 0 || most - least > 1) return at(fy >= 0.5, fx >= 0.5);
  return (1 - fy) * ((1 - fx) * at(0, 0) + fx * at(0, 1)) +
         fy * ((1 - fx) * at(1, 0) + fx * at(1, 1));
}

/// Distance along each ray of the first camera, 0 = none.
cv::Mat distance_map(const cv::Mat& disparity, const EpipolarSphere& sphere,
                     const ws::View& reference, double max_distance) {
  const cv::Mat rays = ws::ray_image(reference.camera, reference.mask);
  cv::Mat distance = cv::Mat::zeros(rays.size(), CV_32FC1);
  for (int y = 0; y < rays.rows; ++y) {
    for (int x = 0; x < rays.cols; ++x) {
      const cv::Vec4f& r = rays.at<cv::Vec4f>(y, x);
      if (r[3] == 0) continue;
      const Eigen::Vector2d angles =
          sphere.angles(Eigen::Vector3f(r[0], r[1], r[2]).cast<double>());
      const double found = sample(disparity, sphere.pixel(angles));
      if (found < 0) continue;
      // Sine rule in the triangle of both centres and the point.
      const double parallax = found / sphere.scale();
      const double opposite = std::sin(angles.x() + parallax);
      if (opposite <= 0) continue;
      distance.at<float>(y, x) = static_cast<float>(std::min(
          sphere.baseline() * opposite / std::max(std::sin(parallax), 1e-9), max_distance));
    }
  }
  return distance;
}

/// Mean over the middle row.
double pixels_per_radian(const ws::Camera& camera) {
  const cv::Mat rays = ws::ray_image(camera, {}).row(camera.height / 2);
  double first = pi;
  double last = -pi;
  int pixels = 0;
  for (int x = 0; x < rays.cols; ++x) {
    const cv::Vec4d r = rays.at<cv::Vec4f>(0, x);
    if (r[3] == 0) continue;
    const double angle = std::atan2(r[0], r[2]);
    first = std::min(first, angle);
    last = std::max(last, angle);
    ++pixels;
  }
  if (last <= first) throw ws::Error("The first camera sees nothing in the middle of its image.");
  return (pixels - 1) / (last - first);
}

void run(const Arguments& a) {
  const ws::Rig rig = a.rig.rig_for_images(2, ws::read_image(a.images[0]).size());
  const ws::View& reference = rig.views[0];
  const ws::View& source = rig.views[1];
  ws::prepare_output_folder(a.output);
  const EpipolarSphere sphere(reference, source,
                              scale_of_fisheye * pixels_per_radian(reference.camera));
  const double ratio = std::min(sphere.baseline() / a.min_distance, 1.0);
  const int disparities = (static_cast<int>(std::asin(ratio) * sphere.scale()) / 16 + 1) * 16;
  const cv::Mat left = sphere.rectify(grey_levels(a.images[0], reference), reference, false);
  const cv::Mat right = sphere.rectify(grey_levels(a.images[1], source), source, true);
  const cv::Mat disparity = match(left, right, disparities);
  ws::write_map(std::filesystem::path(a.output) / "distance0.tiff",
                distance_map(disparity, sphere, reference, a.max_distance));
  std::cout << "rectified to " << left.cols << "x" << left.rows << " pixels, " << disparities
            << " disparities\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"opencv_baseline: longitude-latitude rectification and OpenCV's StereoSGBM"};
  Arguments a;
  app.add_option("images", a.images, "LEFT RIGHT")->required()->expected(2);
  a.rig.add_to(app);
  app.add_option("-o,--output", a.output, "Folder for distance0.tiff")->required();
  app.add_option("--min-distance", a.min_distance, "Metres; sets the range of disparities")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--max-distance", a.max_distance, "Metres; farther points are put there")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  try {
    app.parse(argc, argv);
    run(a);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << "opencv_baseline: " << error.what() << "\n";
    return 1;
  }
  return 0;
}
