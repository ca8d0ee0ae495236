// SPDX-License-Identifier: MIT
// Plane algebra and random numbers of the shared kernel source against independent arithmetic.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>
#include <tuple>

#include "geometry/angle.h"
#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;
using kernel::vec3;

TEST(Plane, HoldsTheGivenPointAndNormal) {
  const Eigen::Vector3d ray = Eigen::Vector3d(0.9, -0.2, -0.3).normalized();  // beyond 90 degrees
  const Eigen::Vector3d normal = Eigen::Vector3d(-0.7, 0.4, 0.5).normalized();
  const Eigen::Vector3d m =
      to_eigen(kernel::cpu::plane_through(to_kernel(ray), 2.5f, to_kernel(normal)));
  EXPECT_NEAR(m.dot(2.5 * ray), 1, 1e-6);
  EXPECT_NEAR(m.normalized().cross(normal).norm(), 0, 1e-6);
}

TEST(Plane, MovesToTheSourceFrame) {
  const KernelFixture fixture(fisheye_rig(32), Options{});
  KernelFixture& f = const_cast<KernelFixture&>(fixture);
  const Eigen::Isometry3d motion = source_from_reference(f.rig().views[1], f.rig().views[0]);
  const kernel::ViewPair pair = f.schedule().parameters.pairs[1];
  const Eigen::Vector3d m(0.3, -0.2, 0.5);
  const Eigen::Vector3d moved = to_eigen(kernel::cpu::plane_in_source(pair, to_kernel(m)));
  for (const Eigen::Vector3d& direction :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0.5, 0.4), Eigen::Vector3d(-0.1, -1, 0.2)}) {
    const Eigen::Vector3d point = direction / m.dot(direction);
    EXPECT_NEAR(moved.dot(motion * point), 1, 1e-5);
  }
  const Eigen::Vector3d centre = motion.inverse().translation();
  EXPECT_NEAR(static_cast<double>(kernel::cpu::side_of_source(pair, to_kernel(m))),
              1 - m.dot(centre), 1e-6);
}

TEST(Random, IsUniformAndIndependentOfOrder) {
  constexpr int n = 200;
  double mean = 0;
  double square = 0;
  std::set<float> distinct;
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x < n; ++x) {
      const kernel::vec4 u = kernel::cpu::random4(1, 0, ivec2(x, y), 3, 5);
      for (const float value : {u.x, u.y, u.z, u.w}) {
        ASSERT_GE(value, 0);
        ASSERT_LT(value, 1);
        mean += static_cast<double>(value) / (4.0 * n * n);
        square += static_cast<double>(value) * static_cast<double>(value) / (4.0 * n * n);
        distinct.insert(value);
      }
    }
  }
  EXPECT_NEAR(mean, 0.5, 0.005);
  EXPECT_NEAR(square, 1.0 / 3, 0.005);
  EXPECT_GT(distinct.size(), 4 * n * n * 0.98);
  EXPECT_NE(kernel::cpu::random4(1, 0, ivec2(4, 5), 3, 5).x,
            kernel::cpu::random4(2, 0, ivec2(4, 5), 3, 5).x);
  EXPECT_NE(kernel::cpu::random4(1, 0, ivec2(4, 5), 3, 5).x,
            kernel::cpu::random4(1, 1, ivec2(4, 5), 3, 5).x);
  EXPECT_NE(kernel::cpu::random4(1, 0, ivec2(4, 5), 3, 5).x,
            kernel::cpu::random4(1, 0, ivec2(4, 5), 4, 5).x);
}

TEST(Search, DrawsStayAdmissible) {
  for (const DistanceSampling sampling : {DistanceSampling::uniform, DistanceSampling::inverse}) {
    Options options;
    options.min_distance = 0.5;
    options.max_distance = 20;
    options.sampling = sampling;
    KernelFixture fixture(fisheye_rig(64), options);
    double mean_distance = 0;
    double mean_inverse = 0;
    int n = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const cv::Vec4f r = fixture.view(0).rays(y, x);
        if (r[3] == 0) continue;
        const vec3 ray(r[0], r[1], r[2]);
        const vec3 drawn = kernel::cpu::random_plane(fixture.context(), ivec2(x, y), ray, 0);
        ASSERT_TRUE(kernel::cpu::admissible(fixture.context(), ray, drawn));
        const double w = static_cast<double>(dot(drawn, ray));
        ASSERT_GT(w / to_eigen(drawn).norm(),
                  std::cos((options.max_tilt + 0.01) * radians_per_degree));
        mean_distance += 1 / w;
        mean_inverse += w;
        ++n;
        const vec3 near =
            kernel::cpu::perturbed_plane(fixture.context(), ivec2(x, y), ray, drawn, 1.0f, 4);
        const double distance = 1 / static_cast<double>(dot(near, ray));
        ASSERT_GT(distance, 0.4999);
        ASSERT_LT(distance, 20.002);
      }
    }
    if (sampling == DistanceSampling::uniform) {
      EXPECT_NEAR(mean_distance / n, 10.25, 0.4);
    } else {
      EXPECT_NEAR(mean_inverse / n, (2 + 0.05) / 2, 0.04);
    }
  }
}

TEST(Search, PerturbationsAreOfWhatIsSampledUniformly) {
  for (const auto& [sampling, held, range] : {std::tuple(DistanceSampling::uniform, 10.0, 19.5),
                                              {DistanceSampling::inverse, 0.1, 1.95}}) {
    Options options;
    options.min_distance = 0.5;
    options.max_distance = 20;
    options.sampling = sampling;
    KernelFixture fixture(fisheye_rig(64), options);
    fixture.set_reference(0);
    double low = std::numeric_limits<double>::infinity();
    double high = 0;
    for (int y = 10; y < 54; ++y) {
      for (int x = 10; x < 54; ++x) {
        const vec3 ray = to_kernel(fixture.view(0).rays(y, x));
        const vec3 m =
            kernel::cpu::perturbed_plane(fixture.context(), ivec2(x, y), ray, 0.1f * ray, 0.01f, 4);
        const auto w = static_cast<double>(dot(m, ray));
        low = std::min(low, sampling == DistanceSampling::uniform ? 1 / w : w);
        high = std::max(high, sampling == DistanceSampling::uniform ? 1 / w : w);
      }
    }
    const double reach = 0.01 * 0.25 * range;
    EXPECT_NEAR(low, held - reach, 0.03 * reach);
    EXPECT_NEAR(high, held + reach, 0.03 * reach);
  }
}

}  // namespace
}  // namespace widestereo::test
