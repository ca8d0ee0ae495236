// SPDX-License-Identifier: MIT
// Parts of a match on a back end, run by themselves.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "kernel/kernel_fixture.h"
#include "matching/backend.h"
#include "statistics/percentile.h"

namespace widestereo::test {

/// A back end that schedules with the constants of this one run on.
inline std::unique_ptr<Backend> make_backend(Device::Implementation& device,
                                             const Schedule& schedule) {
  return device.make_backend(sizes_of(schedule.views), schedule.constants);
}

inline void upload(Backend& backend, KernelFixture& match) {
  const std::vector<View>& views = match.schedule().views;
  for (int i = 0; i < static_cast<int>(views.size()); ++i) {
    backend.set_rays(i, ray_image(views[i].camera, views[i].mask));
    if (i < static_cast<int>(match.rig().views.size())) {
      backend.set_intensity(i, match.view(i).image());
    }
  }
}

/// A pair of the preset `paper`, whose sizes are no multiples of a group of threads, with a hole in
/// the first view's mask.
inline KernelFixture pair_to_iterate(CameraModel model, int window_radius = 5,
                                     double weight_scale = 0) {
  Rig rig = fisheye_rig(75);
  rig.views[1].camera = fisheye_camera(61);
  for (View& view : rig.views) {
    view.camera.model = model;
    if (model == CameraModel::kannala_brandt) view.camera.k1 = -0.01;
    if (model == CameraModel::unified) view.camera.xi = 0.9;
  }
  rig.views[0].mask = cv::Mat(75, 75, CV_8U, cv::Scalar(255));
  cv::circle(rig.views[0].mask, {40, 30}, 6, 0, cv::FILLED);
  Options options = Options::preset_named("paper");
  options.min_distance = 0.3;
  options.max_distance = 10;
  options.first_iterations = 1;
  options.window_radius = window_radius;
  options.weight_scale = weight_scale;
  return KernelFixture(std::move(rig), options);
}

/// Runs the first iteration of the first view. The planes that it takes must cost what the CPU's
/// patches cost, but for what texture units round.
inline void expect_costs_of_patches(Device::Implementation& device, KernelFixture& match) {
  Schedule schedule = match.schedule();
  keep_first(schedule, Kernel::transfer_clear);
  schedule.dispatches.pop_back();
  ASSERT_EQ(schedule.dispatches.back().kernel, Kernel::iterate);
  const auto backend = make_backend(device, schedule);
  upload(*backend, match);
  backend->run(schedule, {});
  const cv::Mat_<cv::Vec4f> planes = backend->hypotheses(0).clone();
  const cv::Mat_<cv::Vec4f> checks = backend->checks(0).clone();

  match.pass() = schedule.dispatches.back().pass;
  std::vector<float> differences;
  for (int y = 0; y < planes.rows; ++y) {
    for (int x = 0; x < planes.cols; ++x) {
      const cv::Vec4f& plane = planes(y, x);
      // Where one was taken; its iteration stands there.
      if (checks(y, x)[0] != 1 || match.view(0).rays(y, x)[3] == 0) continue;
      const kernel::vec3 m(plane[0], plane[1], plane[2]);
      const float cost = kernel::cpu::patch_cost(match.context(), {x, y}, m);
      differences.push_back(std::abs(cost - plane[3]));
    }
  }
  ASSERT_GT(differences.size(), 500U);
  EXPECT_LT(percentile(differences, 0.5), 2e-4);
  EXPECT_LT(percentile(differences, 0.99), 4e-3);
  // All but a few at whose rims a sample is seen or not.
  EXPECT_LT(percentile(differences, 0.998), 0.05);
}

}  // namespace widestereo::test
