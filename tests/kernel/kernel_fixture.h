// SPDX-License-Identifier: MIT
// Two views with random smooth images, ready for calling the kernels of the CPU back end one by
// one.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "cpu/kernels.h"
#include "geometry/angle.h"
#include "schedule/schedule.h"
#include "widestereo/rig.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {

inline Eigen::Vector3d to_eigen(const kernel::vec3& v) {
  return Eigen::Vector3f(v.x, v.y, v.z).cast<double>();
}
inline kernel::vec3 to_kernel(const cv::Vec4f& v) { return {v[0], v[1], v[2]}; }
inline kernel::vec3 to_kernel(const Eigen::Vector3d& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

/// TUM-VI-like double-sphere camera of `size` x `size` pixels that sees `max_theta` radians off
/// axis.
inline Camera fisheye_camera(int size, double max_theta = 1.7) {
  Camera camera;
  camera.model = CameraModel::double_sphere;
  camera.width = camera.height = size;
  camera.fx = camera.fy = 0.309 * size;
  camera.cx = 0.498 * size;
  camera.cy = 0.502 * size;
  camera.xi = -0.17;
  camera.alpha = 0.59;
  camera.max_theta = max_theta;
  return camera;
}

inline Rig fisheye_rig(int size, double max_theta = 1.7) {
  Rig rig;
  rig.views.resize(2);
  for (int i = 0; i < 2; ++i) {
    rig.views[i].name = "cam" + std::to_string(i);
    rig.views[i].camera = fisheye_camera(size, max_theta);
  }
  rig.views[1].world_from_camera =
      Eigen::Translation3d(0.1, 0.004, -0.01) *
      Eigen::AngleAxisd(0.05, Eigen::Vector3d(1, 0.3, -0.2).normalized());
  return rig;
}

/// The same with images that are wider, or narrower, than high.
inline Rig fisheye_rig(cv::Size size) {
  Rig rig = fisheye_rig(size.width);
  for (View& view : rig.views) {
    view.camera.height = size.height;
    view.camera.cy += 0.5 * (size.height - size.width);
  }
  return rig;
}

/// The first camera of such a rig, and sources like the second one, in these shares of its
/// baseline.
inline Rig rig_of_baselines(int size, const std::vector<double>& shares) {
  Rig rig = fisheye_rig(size);
  const View source = rig.views[1];
  rig.views.pop_back();
  for (const double share : shares) {
    View& view = rig.views.emplace_back(source);
    view.name = "cam" + std::to_string(rig.views.size() - 1);
    view.world_from_camera.translation() *= share;
  }
  return rig;
}

/// Pixels that the source sees the point at `ray` / w move per unit of w.
inline double pixels_per_inverse_distance(const View& source, const View& reference,
                                          const Eigen::Vector3d& ray, double w) {
  const Eigen::Isometry3d motion = source_from_reference(source, reference);
  constexpr double step = 1e-4;
  Eigen::Vector2d nearer;
  Eigen::Vector2d farther;
  EXPECT_TRUE(project(source.camera, motion * (ray / (w + step)), nearer));
  EXPECT_TRUE(project(source.camera, motion * (ray / (w - step)), farther));
  return (nearer - farther).norm() / (2 * step);
}

/// A preset's options for distances of 0.2 to 100 m.
inline Options wide_range(const std::string& preset = "paper") {
  Options options = Options::preset_named(preset);
  options.min_distance = 0.2;
  options.max_distance = 100;
  return options;
}

/// Smooth noise in [0.1, 0.9] with features of a few pixels.
inline cv::Mat smooth_noise(cv::Size size, int seed) {
  cv::RNG random(seed);
  cv::Mat noise(size, CV_32FC1);
  random.fill(noise, cv::RNG::UNIFORM, 0.0, 1.0);
  cv::GaussianBlur(noise, noise, {}, 1.5);
  cv::normalize(noise, noise, 0.1, 0.9, cv::NORM_MINMAX);
  return noise;
}

/// A gradient of brightness, `along_x` and `along_y` a pixel from 0.2 on, with Gaussian noise.
inline cv::Mat gradient(cv::Size size, double along_x, double along_y, double noise, int seed) {
  cv::Mat image(size, CV_32FC1);
  cv::RNG(seed).fill(image, cv::RNG::NORMAL, 0.2, noise);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      image.at<float>(y, x) += static_cast<float>(along_x * x + along_y * y);
    }
  }
  return image;
}

inline std::vector<cv::Size> sizes_of(const std::vector<View>& views) {
  std::vector<cv::Size> sizes;
  for (const View& view : views) sizes.emplace_back(view.camera.width, view.camera.height);
  return sizes;
}

/// Leaves of a schedule what comes up to its first dispatch of a kernel.
inline void keep_first(Schedule& schedule, Kernel last) {
  const auto is_last = [last](const Dispatch& dispatch) { return dispatch.kernel == last; };
  const auto end = std::ranges::find_if(schedule.dispatches, is_last);
  schedule.dispatches.erase(std::next(end), schedule.dispatches.end());
}

class KernelFixture {
 public:
  KernelFixture(Rig rig, const Options& options)
      : rig_(std::move(rig)), schedule_(make_schedule(rig_, options)), views_(rig_.views.size()) {
    cv::Size largest;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      const View& view = rig_.views[i];
      const cv::Size size(view.camera.width, view.camera.height);
      views_[i].set_size(size, schedule_.constants);
      views_[i].rays = ray_image(view.camera, view.mask);
      cv::Mat image = smooth_noise(size, static_cast<int>(i) + 1);
      cv::Mat usable;
      cv::extractChannel(views_[i].rays, usable, 3);
      image.setTo(MASKED_INTENSITY, usable == 0);
      image.copyTo(views_[i].image());
      for (auto* map : {&views_[i].hypotheses, &views_[i].checks, &views_[i].priors}) {
        map->setTo(cv::Scalar::all(0));
      }
      largest = {std::max(largest.width, size.width), std::max(largest.height, size.height)};
    }
    nearest_.create(largest);
    winner_.create(largest);
    pass_ = schedule_.dispatches.front().pass;
    interpolate();
    pass_.candidates = 0;
  }

  kernel::cpu::Context context() {
    return {schedule_.parameters, pass_, schedule_.constants, views_.data(), nearest_, winner_};
  }
  kernel::PassParameters& pass() { return pass_; }
  Schedule& schedule() { return schedule_; }
  const Rig& rig() const { return rig_; }
  kernel::cpu::ViewMemory& view(int i) { return views_[i]; }
  /// A pixel's unit ray.
  Eigen::Vector3d ray(int view, kernel::ivec2 pixel) const {
    const cv::Vec4f& r = views_[view].rays(pixel.y, pixel.x);
    return {r[0], r[1], r[2]};
  }

  /// Makes the images' texels, as the schedule begins; after every change of an image.
  void interpolate() {
    const kernel::PassParameters& pass = schedule_.dispatches.front().pass;
    for (int i = 0; i < static_cast<int>(views_.size()); ++i) {
      const kernel::cpu::Context context{
          schedule_.parameters, pass, schedule_.constants, views_.data(), nearest_, winner_, i};
      const cv::Size size = view(i).rays.size();
      for (int y = 0; y < size.height; ++y) {
        for (int x = 0; x < size.width; ++x) kernel::cpu::interpolate_pixel(context, {x, y});
      }
    }
  }

  /// Takes a rendered pair's images, the source's `exposure` times as bright; masked pixels stay
  /// so.
  void show(const RenderedPair& pair, double exposure = 1) {
    for (std::size_t i = 0; i < pair.views.size(); ++i) {
      cv::Mat grey;
      cv::cvtColor(pair.views[i].image, grey, cv::COLOR_BGR2GRAY);
      grey.convertTo(grey, CV_32FC1, (i == 0 ? 1 : exposure) / 255);
      cv::Mat image = views_[i].image();
      grey.copyTo(image, image >= 0);
    }
    interpolate();
  }

  /// A plane of the first view's frame in that of another one.
  kernel::vec3 plane_in(int view, const kernel::vec3& m) const {
    return view == 0 ? m : kernel::cpu::plane_in_source(schedule_.parameters.pairs[view], m);
  }
  /// Lets all views hold it.
  void hold_in_all_views(const kernel::vec3& m) {
    for (int i = 0; i < static_cast<int>(views_.size()); ++i) {
      const kernel::vec3 here = plane_in(i, m);
      view(i).hypotheses.setTo(cv::Scalar(here.x, here.y, here.z, 0.1));
    }
  }

  /// Makes `view` the reference and every other view a source.
  void set_reference(int view) {
    pass_.reference = view;
    pass_.first_view = 0;
  }

 private:
  Rig rig_;
  Schedule schedule_;
  std::vector<kernel::cpu::ViewMemory> views_;
  cv::Mat_<int> nearest_, winner_;
  kernel::PassParameters pass_{};
};

}  // namespace widestereo::test
