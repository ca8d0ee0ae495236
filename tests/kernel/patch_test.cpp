// SPDX-License-Identifier: MIT
// The kernels' patch cost against a slow, literal double-precision reference.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <random>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;
using kernel::vec3;

/// Bilinear sample, or nothing outside the image or beside a masked pixel.
bool sample(const cv::Mat_<float>& image, const Eigen::Vector2d& u, double& value) {
  if (!(u.x() >= 0 && u.y() >= 0 && u.x() <= image.cols - 1 && u.y() <= image.rows - 1))
    return false;
  const int x = std::min(static_cast<int>(u.x()), image.cols - 2);
  const int y = std::min(static_cast<int>(u.y()), image.rows - 2);
  const double fx = u.x() - x;
  const double fy = u.y() - y;
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    const double tap = static_cast<double>(image(y + i / 2, x + i % 2));
    if (tap < 0) return false;
    sum += tap * (i % 2 ? fx : 1 - fx) * (i / 2 ? fy : 1 - fy);
  }
  value = sum;
  return true;
}

/// The definition, term by term: intersect every ray of the patch with the plane, move the point to
/// the source, project it, sample, and take the normalised correlation, weighted by likeness to the
/// centre. Returns 2 where invalid.
double literal_cost(KernelFixture& fixture, int reference, int source, ivec2 pixel,
                    const Eigen::Vector3d& m, const Options& options) {
  const int radius = options.window_radius;
  const Rig& rig = fixture.rig();
  const Eigen::Isometry3d motion = source_from_reference(rig.views[source], rig.views[reference]);
  const cv::Mat_<float> a_image = fixture.view(reference).image();
  const cv::Mat_<float> b_image = fixture.view(source).image();
  if (m.dot(motion.inverse().translation()) >= 1) return 2;
  std::vector<double> weights, a_values, b_values;
  int of_patch = 0;
  bool centre_seen = false;
  for (int dy = -radius; dy <= radius; ++dy) {
    for (int dx = -radius; dx <= radius; ++dx) {
      const int x = pixel.x + dx;
      const int y = pixel.y + dy;
      if (x < 0 || y < 0 || x >= a_image.cols || y >= a_image.rows || a_image(y, x) < 0) continue;
      ++of_patch;
      Eigen::Vector3d ray;
      if (!unproject(rig.views[reference].camera, {x, y}, ray) || m.dot(ray) <= 0) continue;
      const Eigen::Vector3d point = ray / m.dot(ray);
      Eigen::Vector2d u;
      double b = 0;
      if (!project(rig.views[source].camera, motion * point, u) || !sample(b_image, u, b)) continue;
      if (dx == 0 && dy == 0) centre_seen = true;
      const float difference = 255 * (a_image(y, x) - a_image(pixel.y, pixel.x));
      weights.push_back(
          options.weight_scale == 0
              ? 1
              : std::pow(1 + std::abs(static_cast<double>(difference)) / (8 * options.weight_scale),
                         -8));
      a_values.push_back(static_cast<double>(a_image(y, x)));
      b_values.push_back(b);
    }
  }
  if (!centre_seen || static_cast<double>(a_values.size()) < options.min_visible * of_patch) {
    return 2;
  }
  const double n = std::accumulate(weights.begin(), weights.end(), 0.0);
  double mean_a = 0;
  double mean_b = 0;
  for (std::size_t i = 0; i < a_values.size(); ++i) {
    mean_a += weights[i] * a_values[i] / n;
    mean_b += weights[i] * b_values[i] / n;
  }
  double aa = 0;
  double bb = 0;
  double ab = 0;
  for (std::size_t i = 0; i < a_values.size(); ++i) {
    aa += weights[i] * (a_values[i] - mean_a) * (a_values[i] - mean_a);
    bb += weights[i] * (b_values[i] - mean_b) * (b_values[i] - mean_b);
    ab += weights[i] * (a_values[i] - mean_a) * (b_values[i] - mean_b);
  }
  return 1 - ab / std::sqrt(aa * bb);
}

/// Planes at random distances with normals within 70 degrees of facing the camera.
Eigen::Vector3d random_plane(std::mt19937& random, const Eigen::Vector3d& ray) {
  std::uniform_real_distribution<double> unit(-1, 1);
  const double distance = std::exp(std::uniform_real_distribution<double>(-1, 2.5)(random));
  Eigen::Vector3d normal;
  do {
    normal = Eigen::Vector3d(unit(random), unit(random), unit(random));
  } while (normal.norm() > 1 || normal.normalized().dot(ray) < 0.35);
  normal.normalize();
  return normal / (distance * normal.dot(ray));
}

struct Case {
  PatchWarp warp;
  int reference;
  double tolerance_p99;
  double weight_scale = 0;
  double min_visible = 0.6;
};

class PatchCost : public ::testing::TestWithParam<Case> {};

TEST_P(PatchCost, AgreesWithTheLiteralDefinition) {
  Options options;
  options.window_radius = 4;
  options.warp = GetParam().warp;
  options.min_texture = 0;
  options.weight_scale = GetParam().weight_scale;
  options.min_visible = GetParam().min_visible;
  const int reference = GetParam().reference;
  KernelFixture fixture(fisheye_rig(128), options);
  fixture.set_reference(reference);
  std::mt19937 random(7);
  std::uniform_int_distribution<int> coordinate(0, 127);
  std::vector<double> differences;
  int invalid = 0;
  int validity_differs = 0;
  while (differences.size() < 2000) {
    const ivec2 pixel(coordinate(random), coordinate(random));
    const cv::Vec4f ray = fixture.view(reference).rays(pixel.y, pixel.x);
    if (ray[3] == 0) continue;
    const Eigen::Vector3d m =
        random_plane(random, Eigen::Vector3f(ray[0], ray[1], ray[2]).cast<double>());
    const Eigen::Vector3f mf = m.cast<float>();
    const float cost =
        kernel::cpu::patch_cost(fixture.context(), pixel, vec3(mf.x(), mf.y(), mf.z()));
    const double expected = literal_cost(fixture, reference, 1 - reference, pixel, m, options);
    if ((cost >= 2) != (expected >= 2)) {
      ++validity_differs;
      continue;
    }
    if (cost >= 2) {
      ++invalid;
      continue;
    }
    differences.push_back(std::abs(static_cast<double>(cost) - expected));
  }
  std::sort(differences.begin(), differences.end());
  EXPECT_LT(differences[differences.size() / 2], GetParam().tolerance_p99 / 3);
  EXPECT_LT(differences[differences.size() * 99 / 100], GetParam().tolerance_p99);
  EXPECT_GT(invalid, 20) << "the set must contain planes that leave the source image";
  EXPECT_LT(validity_differs, 20) << "of " << differences.size();
}

INSTANTIATE_TEST_SUITE_P(
    Warps, PatchCost,
    ::testing::Values(Case{PatchWarp::exact, 0, 2e-4}, Case{PatchWarp::exact, 1, 2e-4},
                      Case{PatchWarp::exact, 0, 2e-4, 12, 0.9},
                      // At 128 px the lens bends four times as much per pixel as at 512 px.
                      Case{PatchWarp::affine, 0, 0.2}, Case{PatchWarp::quadratic, 0, 0.03}));

TEST(PatchWeights, OfTheSmallestScalesGiveCosts) {
  Options options;
  options.min_texture = 0;
  for (const double scale : {std::numeric_limits<double>::denorm_min(), 1e-37, 1e-5}) {
    options.weight_scale = scale;
    KernelFixture fixture(fisheye_rig(64), options);
    fixture.set_reference(0);
    // False for NaN.
    EXPECT_LE(kernel::cpu::patch_cost(fixture.context(), {32, 32}, vec3(0, 0, 0.5f)),
              NO_INFORMATION_COST)
        << scale;
  }
}

/// How far (pixels) a mapped patch lies from the exact warp: root mean square of its samples, and
/// their mean.
struct MapErrors {
  std::vector<double> of_samples;
  std::vector<double> of_patches;
};

/// Of random planes seen whole; samples up to `radius` from the middle of windows of 11x11.
MapErrors map_errors(PatchWarp warp, int radius) {
  Options options;
  options.window_radius = 5;
  options.warp = warp;
  options.interpolation = Interpolation::linear;  // texels are pixels
  KernelFixture fixture(fisheye_rig(512), options);
  fixture.set_reference(0);
  const auto context = fixture.context();
  const kernel::ViewPair pair = context.parameters.pairs[1];
  const kernel::CameraParameters camera = context.parameters.cameras[1];
  const int samples = (2 * radius + 1) * (2 * radius + 1);
  std::mt19937 random(3);
  std::uniform_int_distribution<int> coordinate(0, 511);
  MapErrors errors;
  while (errors.of_samples.size() < 3000) {
    const ivec2 pixel(coordinate(random), coordinate(random));
    const cv::Vec4f ray = fixture.view(0).rays(pixel.y, pixel.x);
    if (ray[3] == 0) continue;
    const Eigen::Vector3f m =
        random_plane(random, Eigen::Vector3f(ray[0], ray[1], ray[2]).cast<double>()).cast<float>();
    kernel::cpu::PatchStart start{};
    if (!kernel::cpu::begin_patch(context, pair, camera, camera.size.z, 1, pixel,
                                  vec3(m.x(), m.y(), m.z()), true, radius, start)) {
      continue;
    }
    kernel::vec2 sum(0, 0);
    double squares = 0;
    int n = 0;
    for (int dy = -radius; dy <= radius; ++dy) {
      const kernel::cpu::RowMap row = kernel::cpu::map_row(
          context, start.map, static_cast<float>(-radius), static_cast<float>(dy));
      for (int dx = -radius; dx <= radius; ++dx) {
        kernel::vec2 exact{};
        if (!kernel::cpu::warp_pixel(context, start.warp, camera, camera.size.z,
                                     ivec2(pixel.x + dx, pixel.y + dy), exact)) {
          continue;
        }
        const kernel::vec2 error =
            kernel::cpu::map_offset(context, row, static_cast<float>(dx + radius)) - exact;
        sum = sum + error;
        squares += static_cast<double>(dot(error, error));
        ++n;
      }
    }
    if (n < samples) continue;
    errors.of_samples.push_back(std::sqrt(squares / samples));
    errors.of_patches.push_back(static_cast<double>(length(sum)) / samples);
  }
  std::sort(errors.of_samples.begin(), errors.of_samples.end());
  std::sort(errors.of_patches.begin(), errors.of_patches.end());
  return errors;
}

TEST(PatchWarps, AffineAndQuadraticStayCloseToTheExactMap) {
  for (const auto& [warp, median_limit, p95_limit] :
       {std::tuple{PatchWarp::affine, 0.02, 0.08}, {PatchWarp::quadratic, 0.002, 0.01}}) {
    const std::vector<double> errors = map_errors(warp, 5).of_samples;
    EXPECT_LT(errors[1500], median_limit);
    EXPECT_LT(errors[2850], p95_limit);
  }
}

TEST(PatchWarps, DisplaceNoPatchAsAWhole) {
  for (const PatchWarp warp : {PatchWarp::affine, PatchWarp::quadratic}) {
    for (const int radius : {1, 5}) {
      const std::vector<double> errors = map_errors(warp, radius).of_patches;
      EXPECT_LT(errors[1500], 0.001) << radius;
      EXPECT_LT(errors[2850], 0.005) << radius;
    }
  }
}

TEST(PatchCostRules, TexturelessPatchCarriesNoInformation) {
  Options options;
  options.window_radius = 3;
  KernelFixture fixture(fisheye_rig(64), options);
  fixture.view(0).image().setTo(0.5);
  const cv::Vec4f ray = fixture.view(0).rays(32, 32);
  const vec3 m(ray[0] / 2, ray[1] / 2, ray[2] / 2);
  EXPECT_EQ(kernel::cpu::patch_cost(fixture.context(), ivec2(32, 32), m), NO_INFORMATION_COST);
  // One pixel of 49 differs.
  fixture.view(0).image()(32, 33) = 0.6f;
  const double deviation = 255 * 0.1 * std::sqrt(48.0) / 49;
  const auto cost = [&](double min_texture) {
    Options other = options;
    other.min_texture = min_texture;
    fixture.schedule() = make_schedule(fixture.rig(), other);
    return kernel::cpu::patch_cost(fixture.context(), ivec2(32, 32), m);
  };
  EXPECT_EQ(cost(1.02 * deviation), NO_INFORMATION_COST);
  EXPECT_NE(cost(0.98 * deviation), NO_INFORMATION_COST);
}

TEST(PatchCostRules, PlaneBetweenTheCamerasIsInvalid) {
  Options options;
  KernelFixture fixture(fisheye_rig(64), options);
  // Normal along the baseline, plane through its middle: camera 1 sees it from behind.
  const Eigen::Vector3d c = fixture.rig().views[1].world_from_camera.translation();
  const Eigen::Vector3f m = (c.normalized() / (0.5 * c.norm())).cast<float>();
  for (int x = 40; x < 64; ++x) {
    EXPECT_EQ(kernel::cpu::patch_cost(fixture.context(), ivec2(x, 32), vec3(m.x(), m.y(), m.z())),
              INVALID_COST);
  }
}

TEST(PatchCostRules, AnExactPatchLiesInFrontAltogether) {
  // Rays at the corners of a patch of 9x9 pixels are tens of degrees from the middle one.
  Options options = wide_range("paper");
  options.window_radius = 4;
  options.min_texture = 0;
  KernelFixture fixture(fisheye_rig(32), options);
  fixture.set_reference(0);
  const ivec2 pixel(16, 16);
  const Eigen::Vector3d axis = fixture.ray(0, pixel);
  const Eigen::Vector3d corner = fixture.ray(0, {20, 20});
  const Eigen::Vector3d sideways = (corner - axis.dot(corner) * axis).normalized();
  const double angle = std::acos(axis.dot(corner));
  const auto cost = [&](double tilt) {
    const Eigen::Vector3d m = 0.5 * (axis - std::tan(tilt) * sideways);
    return kernel::cpu::patch_cost(
        fixture.context(), pixel,
        vec3(static_cast<float>(m.x()), static_cast<float>(m.y()), static_cast<float>(m.z())));
  };
  // The corner's ray runs along the plane when that is tilted by a right angle less its own.
  const double along_corner = std::numbers::pi / 2 - angle;
  EXPECT_LT(cost(along_corner - 0.02), INVALID_COST);
  EXPECT_EQ(cost(along_corner + 0.02), INVALID_COST);
}

TEST(PatchCostRules, MeanOfTheBestSources) {
  Rig rig = fisheye_rig(64);
  rig.views.push_back(rig.views[1]);
  rig.views[2].name = "cam2";
  rig.views[2].world_from_camera.translation() += Eigen::Vector3d(0, 0.1, 0);
  Options options;
  options.window_radius = 3;
  options.min_texture = 0;
  KernelFixture fixture(rig, options);
  const cv::Vec4f ray = fixture.view(0).rays(30, 34);
  const vec3 m(ray[0] / 2, ray[1] / 2, ray[2] / 2);
  const ivec2 pixel(34, 30);
  const float first = kernel::cpu::source_cost(fixture.context(), 1, pixel, m);
  const float second = kernel::cpu::source_cost(fixture.context(), 2, pixel, m);
  ASSERT_LT(first, 2);
  ASSERT_LT(second, 2);
  EXPECT_FLOAT_EQ(kernel::cpu::patch_cost(fixture.context(), pixel, m), std::min(first, second));
  fixture.schedule().parameters.search.z = 2;
  EXPECT_FLOAT_EQ(kernel::cpu::patch_cost(fixture.context(), pixel, m), (first + second) / 2);
}

TEST(PixelInSource, IsFoundByItsCentreAndNowhereOutside) {
  KernelFixture fixture(fisheye_rig(64), {});
  fixture.set_reference(0);
  const cv::Vec4f r = fixture.view(0).rays(32, 32);
  const vec3 ray(r[0], r[1], r[2]);
  kernel::CameraParameters& source = fixture.schedule().parameters.cameras[1];
  const auto finds = [&](float x, float y, ivec2 expected) {
    source.intrinsics = {0, 0, x, y};  // everything lands there
    ivec2 found;
    if (!kernel::cpu::pixel_in_source(fixture.context(), 1, ray, ray, found)) return false;
    EXPECT_EQ(found.x, expected.x);
    EXPECT_EQ(found.y, expected.y);
    return true;
  };
  EXPECT_TRUE(finds(-0.5f, 63.49f, {0, 63}));
  EXPECT_TRUE(finds(63.49f, -0.5f, {63, 0}));
  EXPECT_TRUE(finds(20.5f, 30.49f, {21, 30}));
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  // The last ones are more than an integer holds.
  for (const float outside : {-0.51f, 63.5f, 64.0f, 3e9f, -3e9f, 1e30f, nan}) {
    EXPECT_FALSE(finds(outside, 20, {})) << outside;
    EXPECT_FALSE(finds(20, outside, {})) << outside;
  }
}

}  // namespace
}  // namespace widestereo::test
