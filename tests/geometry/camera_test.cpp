// SPDX-License-Identifier: MIT
#include "widestereo/camera.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <random>
#include <set>

#include "error_of.h"
#include "geometry/angle.h"
#include "geometry/camera_parameters.h"
#include "geometry/direction.h"
#include "geometry/named_cameras.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::cameras;
using test::direction;
using test::make_camera;
using test::NamedCamera;
constexpr double degree = radians_per_degree;

class EveryCamera : public ::testing::TestWithParam<NamedCamera> {};

TEST_P(EveryCamera, RoundTripOverTheWholeDomain) {
  const Camera& camera = GetParam().camera;
  validate(camera, "test");
  const double limit = model_max_theta(camera);
  // Near the limit the projection flattens and the inverse loses digits: stay a little inside.
  const double reach = std::min(limit, std::numbers::pi - 1e-6) * 0.995;
  int checked = 0;
  for (int i = 0; i <= 200; ++i) {
    for (int j = 0; j < 24; ++j) {
      const Vector3d expected = direction(reach * i / 200, j * 15 * degree + 0.01);
      Vector2d pixel;
      ASSERT_TRUE(project(camera, 3.7 * expected, pixel));
      if (pixel.norm() > 1e5) continue;  // a pinhole near 90 degrees
      Vector3d ray;
      ASSERT_TRUE(unproject(camera, pixel, ray)) << "theta " << reach * i / 200 / degree;
      Vector2d again;
      ASSERT_TRUE(project(camera, ray, again));
      EXPECT_LT((again - pixel).norm(), 1e-6);
      EXPECT_LT((ray - expected).norm(), 1e-6) << "theta " << reach * i / 200 / degree;
      EXPECT_NEAR(ray.norm(), 1, 1e-12);
      ++checked;
    }
  }
  EXPECT_GT(checked, 3000);
}

TEST_P(EveryCamera, PixelsRoundTrip) {
  const Camera& camera = GetParam().camera;
  int rays = 0;
  for (double v = -20; v < camera.height + 20; v += 17.3) {
    for (double u = -20; u < camera.width + 20; u += 17.3) {
      Vector3d ray;
      if (!unproject(camera, {u, v}, ray)) continue;
      Vector2d pixel;
      ASSERT_TRUE(project(camera, ray, pixel));
      EXPECT_LT((pixel - Vector2d(u, v)).norm(), 2e-6);
      ++rays;
    }
  }
  EXPECT_GT(rays, 100);
  Vector3d axis;
  ASSERT_TRUE(unproject(camera, {camera.cx, camera.cy}, axis));
  EXPECT_LT((axis - Vector3d::UnitZ()).norm(), 1e-12);
}

TEST_P(EveryCamera, JacobianMatchesFiniteDifferences) {
  const Camera& camera = GetParam().camera;
  const double reach = std::min(model_max_theta(camera), 2.6) * 0.97;
  for (int i = 0; i <= 20; ++i) {
    for (int j = 0; j < 8; ++j) {
      const Vector3d point = 1.7 * direction(reach * i / 20, j * 45 * degree + 0.1);
      Vector2d pixel;
      Eigen::Matrix<double, 2, 3> jacobian;
      ASSERT_TRUE(project(camera, point, pixel, jacobian));
      Vector2d same;
      ASSERT_TRUE(project(camera, point, same));
      EXPECT_LT((same - pixel).norm(), 1e-9 * (1 + pixel.norm()));
      if (pixel.norm() > 1e4) continue;
      constexpr double h = 1e-6;
      for (int k = 0; k < 3; ++k) {
        Vector2d low;
        Vector2d high;
        if (!project(camera, point - h * Vector3d::Unit(k), low) ||
            !project(camera, point + h * Vector3d::Unit(k), high)) {
          continue;
        }
        const Vector2d numeric = (high - low) / (2 * h);
        EXPECT_LT((numeric - jacobian.col(k)).norm(), 1e-4 * (1 + jacobian.norm()));
      }
    }
  }
}

TEST_P(EveryCamera, DomainEndsAtTheModelsLimit) {
  const Camera& camera = GetParam().camera;
  const double limit = model_max_theta(camera);
  Vector2d pixel;
  EXPECT_TRUE(project(camera, direction(limit - 1e-6, 0), pixel));
  if (limit < std::numbers::pi - 1e-6) {
    EXPECT_FALSE(project(camera, direction(limit + 1e-6, 0), pixel));
    EXPECT_FALSE(project(camera, direction(std::min(limit + 0.3, 3.1), 0), pixel));
  }
  EXPECT_FALSE(project(camera, Vector3d::Zero(), pixel));
  // The radius must grow with theta all the way: no direction may fold back onto another.
  double previous = -1;
  for (int i = 1; i < 2000; ++i) {
    ASSERT_TRUE(project(camera, direction(limit * i / 2000, 0), pixel));
    const double radius = (pixel - Vector2d(camera.cx, camera.cy)).norm();
    ASSERT_GT(radius, previous - 1e-3) << "theta " << limit * i / 2000 / degree;
    previous = std::max(radius, previous);
  }
}

TEST_P(EveryCamera, FieldOfViewLimitsProjectionAndRays) {
  const Camera& full = GetParam().camera;
  Camera camera = resized(full, full.width / 4, full.height / 4);  // for speed
  camera.max_theta = 0.6 * model_max_theta(camera);
  Vector2d pixel;
  EXPECT_TRUE(project(camera, direction(camera.max_theta - 1e-6, 1), pixel));
  Vector3d ray;
  EXPECT_TRUE(unproject(camera, pixel, ray));
  EXPECT_FALSE(project(camera, direction(camera.max_theta + 1e-6, 1), pixel));
  const cv::Mat rays = ray_image(camera, {});
  for (int y = 0; y < camera.height; y += 5) {
    for (int x = 0; x < camera.width; x += 5) {
      const cv::Vec4f r = rays.at<cv::Vec4f>(y, x);
      const bool has_ray = unproject(camera, Vector2d(x, y), ray);
      ASSERT_EQ(r[3] == 1, has_ray);
      if (has_ray) {
        EXPECT_LT((Eigen::Vector3f(r[0], r[1], r[2]).cast<double>() - ray).norm(), 1e-6);
      }
    }
  }
}

TEST_P(EveryCamera, SinglePrecisionKernelAgrees) {
  const Camera& camera = GetParam().camera;
  const kernel::CameraParameters parameters = kernel_camera(camera);
  const double reach = std::min(model_max_theta(camera), 2.2) * 0.97;
  for (int i = 0; i <= 100; ++i) {
    for (int j = 0; j < 12; ++j) {
      const Vector3d point = direction(reach * i / 100, j * 30 * degree + 0.05);
      const Eigen::Vector3f single = point.cast<float>();
      Vector2d expected;
      ASSERT_TRUE(project(camera, single.cast<double>(), expected));
      // Inside or near the image, where it matters.
      if (expected.x() < -100 || expected.y() < -100 || expected.x() > camera.width + 100 ||
          expected.y() > camera.height + 100) {
        continue;
      }
      kernel::vec2 pixel{};
      ASSERT_TRUE(kernel::project(parameters, parameters.size.z,
                                  kernel::vec3(single.x(), single.y(), single.z()), pixel));
      EXPECT_NEAR(static_cast<double>(pixel.x), expected.x(), 1e-3);
      EXPECT_NEAR(static_cast<double>(pixel.y), expected.y(), 1e-3);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Models, EveryCamera, ::testing::ValuesIn(cameras()),
                         [](const auto& tested) { return std::string(tested.param.name); });

/// Radial polynomial of an angle.
double polynomial(const std::vector<double>& k, double theta) {
  double sum = 1;
  double power = 1;
  for (const double coefficient : k) sum += coefficient * (power *= theta * theta);
  return sum;
}

/// As Project Aria's documentation writes tangential distortion, with p = (p0, p1), and prisms.
Vector2d decentred(const Vector2d& radial, const Vector2d& at, const Camera& c) {
  const Vector2d p(c.p2, c.p1);
  const double r2 = at.squaredNorm();
  return radial + 2 * at.dot(p) * at + r2 * p +
         Vector2d(c.s1 * r2 + c.s2 * r2 * r2, c.s3 * r2 + c.s4 * r2 * r2);
}

/// The point on the normalised plane of models with more coefficients, as their authors write them.
Vector2d literal_point(const Camera& c, double theta, double azimuth) {
  const Vector2d unit(std::cos(azimuth), std::sin(azimuth));
  if (c.model == CameraModel::pinhole_rational) {
    const Vector2d at = std::tan(theta) * unit;
    const double q = at.squaredNorm();
    const double factor = (1 + c.k1 * q + c.k2 * q * q + c.k3 * q * q * q) /
                          (1 + c.k4 * q + c.k5 * q * q + c.k6 * q * q * q);
    return decentred(factor * at, at, c);
  }
  const Vector2d angle = theta * unit;
  if (c.model == CameraModel::polynomial_fisheye) {
    const double k[] = {c.k1, c.k2, c.k3, c.k4, c.k5, c.k6, c.k7, c.k8, c.k9, c.k10, c.k11};
    double factor = 1;
    for (int i = 0; i < 11; ++i) factor += k[i] * std::pow(theta, i + 1);
    return factor * angle;
  }
  if (c.model == CameraModel::thin_prism_fisheye) {
    return decentred(polynomial({c.k1, c.k2, c.k3, c.k4}, theta) * angle, angle, c);
  }
  const Vector2d radial = polynomial({c.k1, c.k2, c.k3, c.k4, c.k5, c.k6}, theta) * angle;
  return decentred(radial, radial, c);
}

TEST(ModelFormulas, AreTheirAuthors) {
  int compared = 0;
  for (const NamedCamera& named : cameras()) {
    const Camera& c = named.camera;
    if (c.model < CameraModel::pinhole_rational) continue;
    for (int i = 1; i < 40; ++i) {
      const double theta = 0.97 * model_max_theta(c) * i / 40;
      const double azimuth = 0.7 * i;
      const Vector2d m = literal_point(c, theta, azimuth);
      Vector2d pixel;
      ASSERT_TRUE(project(c, 2.5 * direction(theta, azimuth), pixel));
      const Vector2d expected(c.fx * m.x() + c.skew * m.y() + c.cx,
                              c.shear * m.x() + c.fy * m.y() + c.cy);
      EXPECT_LT((pixel - expected).norm(), 1e-12 * (1000 + expected.norm())) << named.name;
      ++compared;
    }
  }
  EXPECT_EQ(compared, 7 * 39);
}

TEST(ModelRelations, ModelsWithPrismsContainThoseWithout) {
  for (const NamedCamera& named : cameras()) {
    const Camera& plain = named.camera;
    std::vector<CameraModel> larger;
    if (plain.model == CameraModel::kannala_brandt) {
      larger = {CameraModel::thin_prism_fisheye, CameraModel::rad_tan_thin_prism_fisheye};
    } else if (plain.model == CameraModel::pinhole_radtan) {
      larger = {CameraModel::pinhole_rational};
    }
    for (const CameraModel model : larger) {
      Camera camera = plain;
      camera.model = model;
      EXPECT_NEAR(model_max_theta(camera), model_max_theta(plain), 1e-9) << named.name;
      for (int i = 0; i < 50; ++i) {
        const Vector3d point = direction(0.99 * model_max_theta(plain) * i / 50, 0.3 * i);
        Vector2d expected;
        Vector2d pixel;
        ASSERT_TRUE(project(plain, point, expected));
        ASSERT_TRUE(project(camera, point, pixel));
        EXPECT_LT((pixel - expected).norm(), 1e-9 * (1 + expected.norm())) << named.name;
      }
    }
  }
}

TEST(ModelRelations, UnifiedIsDoubleSphereAndExtendedUnifiedInDisguise) {
  Camera unified = make_camera(CameraModel::unified, 512, 512, 300, 300, 256, 256);
  unified.xi = 1.5;
  const double alpha = unified.xi / (1 + unified.xi);
  Camera extended =
      make_camera(CameraModel::extended_unified, 512, 512, 300 / 2.5, 300 / 2.5, 256, 256);
  extended.alpha = alpha;
  extended.beta = 1;
  Camera sphere = extended;
  sphere.model = CameraModel::double_sphere;
  sphere.xi = 0;
  for (int i = 0; i < 50; ++i) {
    const Vector3d point = direction(2.0 * i / 50, 0.3 * i);
    Vector2d a;
    Vector2d b;
    Vector2d c;
    ASSERT_TRUE(project(unified, point, a));
    ASSERT_TRUE(project(extended, point, b));
    ASSERT_TRUE(project(sphere, point, c));
    EXPECT_LT((a - b).norm(), 1e-9);
    EXPECT_LT((a - c).norm(), 1e-9);
  }
  EXPECT_NEAR(model_max_theta(unified), std::acos(-1 / 1.5), 1e-9);
  EXPECT_NEAR(model_max_theta(unified), model_max_theta(sphere), 1e-9);
}

TEST(ModelLimits, ExactDoubleSphereDomain) {
  // Limits computed independently from (xi d + z) > -w1 d2; the published condition is narrower.
  Camera c = make_camera(CameraModel::double_sphere, 512, 512, 158, 158, 255, 257);
  c.xi = -0.17213086;
  c.alpha = 0.59311776;
  EXPECT_NEAR(model_max_theta(c) / degree, 126.2, 0.1);
  c.xi = 0.46;
  c.alpha = 0.77;
  const auto inside = [&c](double theta) {
    const double w1 = (1 - c.alpha) / c.alpha;
    const double k = c.xi + std::cos(theta);
    return k > -w1 * std::hypot(std::sin(theta), k);
  };
  EXPECT_TRUE(inside(model_max_theta(c) - 1e-9));
  EXPECT_FALSE(inside(model_max_theta(c) + 1e-9));
  c.xi = 0.9;
  c.alpha = 0.6;
  EXPECT_NEAR(model_max_theta(c) / degree, 173.9, 0.1);
}

/// First sign change of a function on [0, end] by fine sampling, or `end`.
template <class Function>
double first_negative(Function function, double end) {
  constexpr int steps = 4000;
  for (int i = 1; i <= steps; ++i) {
    if (function(end * i / steps) < 0) return end * i / steps;
  }
  return end;
}

TEST(ModelLimits, KannalaBrandtEndsAtTheFirstRootOfTheSlope) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  int folding = 0;
  for (int i = 0; i < 2000; ++i) {
    Camera c = make_camera(CameraModel::kannala_brandt, 512, 512, 190, 190, 255, 255);
    const double size = std::pow(10, 3 * unit(random) - 2);
    c.k1 = size * unit(random);
    c.k2 = size * unit(random);
    c.k3 = size * unit(random);
    // Vanishing high terms must not hide the root of the others.
    c.k4 = i % 3 == 0 ? 0 : i % 3 == 1 ? 1e-200 * unit(random) : size * unit(random);
    const auto slope = [&c](double theta) {
      const double t = theta * theta;
      return 1 + t * (3 * c.k1 + t * (5 * c.k2 + t * (7 * c.k3 + t * 9 * c.k4)));
    };
    const double sampled = first_negative(slope, std::numbers::pi);
    const double limit = camera_parameters(c).domain.y;
    ASSERT_LE(limit, sampled + 1e-9);
    if (limit < std::numbers::pi) {
      ASSERT_NEAR(slope(limit), 0, 1e-6 * (1 + size * 1e4));
      // Sampling may step over a pair of roots; the search must not.
      if (sampled < std::numbers::pi) ++folding;
    }
  }
  EXPECT_GT(folding, 500);
}

TEST(ModelLimits, BrownConradyEndsWhereItsJacobianBecomesSingular) {
  std::mt19937 random(12);
  std::uniform_real_distribution<double> unit(-1, 1);
  int folding = 0;
  for (int i = 0; i < 40; ++i) {
    Camera c = make_camera(CameraModel::pinhole_radtan, 640, 480, 1, 1, 0, 0);
    c.k1 = 0.4 * unit(random);
    c.k2 = 0.2 * unit(random);
    c.k3 = 0.05 * unit(random);
    c.p1 = 3e-3 * unit(random);
    c.p2 = 3e-3 * unit(random);
    double first = 10;
    for (int j = 0; j < 72; ++j) {
      const double azimuth = j * 5 * degree;
      const auto determinant = [&](double radius) {
        // Independent of the implementation: central differences.
        const auto distort = [&c](double x, double y) {
          const double q = x * x + y * y;
          const double f = 1 + q * (c.k1 + q * (c.k2 + q * c.k3));
          return Vector2d(x * f + 2 * c.p1 * x * y + c.p2 * (q + 2 * x * x),
                          y * f + c.p1 * (q + 2 * y * y) + 2 * c.p2 * x * y);
        };
        const double x = radius * std::cos(azimuth);
        const double y = radius * std::sin(azimuth);
        constexpr double h = 1e-5;
        const Vector2d dx = (distort(x + h, y) - distort(x - h, y)) / (2 * h);
        const Vector2d dy = (distort(x, y + h) - distort(x, y - h)) / (2 * h);
        return dx.x() * dy.y() - dx.y() * dy.x();
      };
      first = std::min(first, first_negative(determinant, 10));
    }
    const double limit = std::sqrt(camera_parameters(c).domain.y);
    if (first == 10) {
      EXPECT_GT(limit, 9.9);
    } else {
      // Sampling 4000 radii and 72 azimuths finds the end slightly late.
      EXPECT_LT(limit, first + 1e-9);
      EXPECT_GT(limit, first - 0.01 - 0.01 * first);
      ++folding;
    }
  }
  EXPECT_GT(folding, 10);
}

/// k1, k2, k4 and k5 of one size, k3 and k6 of another, and small tangential terms and prisms.
void draw_prism_coefficients(Camera& c, double radial, double third, std::mt19937& random) {
  std::uniform_real_distribution<double> sign(-1, 1);
  for (double Camera::*k : {&Camera::k1, &Camera::k2, &Camera::k4, &Camera::k5}) {
    c.*k = radial * sign(random);
  }
  c.k3 = third * sign(random);
  c.k6 = third * sign(random);
  for (double Camera::*small :
       {&Camera::p1, &Camera::p2, &Camera::s1, &Camera::s2, &Camera::s3, &Camera::s4}) {
    c.*small = 2e-3 * sign(random);
  }
}

TEST(ModelLimits, PrismsEndBeforeTheirJacobianBecomesSingular) {
  std::mt19937 random(14);
  int folding = 0;
  for (const CameraModel model : {CameraModel::pinhole_rational, CameraModel::thin_prism_fisheye,
                                  CameraModel::rad_tan_thin_prism_fisheye}) {
    for (int i = 0; i < 20; ++i) {
      Camera c = make_camera(model, 640, 480, 1, 1, 0, 0);
      draw_prism_coefficients(c, 0.3, 0.05, random);
      const double end = model == CameraModel::pinhole_rational ? 1.5 : std::numbers::pi;
      double first = end;
      for (int j = 0; j < 24; ++j) {
        const double azimuth = j * 15 * degree;
        // Along and across the azimuth.
        const auto determinant = [&](double theta) {
          constexpr double h = 1e-6;
          const Vector2d along =
              literal_point(c, theta + h, azimuth) - literal_point(c, theta - h, azimuth);
          const Vector2d across =
              literal_point(c, theta, azimuth + h) - literal_point(c, theta, azimuth - h);
          return along.x() * across.y() - along.y() * across.x();
        };
        first = std::min(first, first_negative(determinant, first));
      }
      const double limit = model_max_theta(c);
      if (first == end) {
        EXPECT_GT(limit, 0.999 * end) << to_string(model);
        continue;
      }
      // Sampling finds the end slightly late; the bound may be reached slightly early.
      EXPECT_LT(limit, first + 1e-9) << to_string(model);
      EXPECT_GT(limit, 0.98 * first) << to_string(model);
      ++folding;
    }
  }
  EXPECT_GT(folding, 30);
}

/// A random camera of the model with parameters from its whole valid range.
Camera random_camera(CameraModel model, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::uniform_real_distribution<double> sign(-1, 1);
  Camera c = make_camera(model, 1000, 800, 200 + 400 * unit(random), 200 + 400 * unit(random),
                         500 + 10 * sign(random), 400 + 10 * sign(random));
  c.skew = sign(random);
  switch (model) {
    case CameraModel::pinhole:
      break;
    case CameraModel::mei:
    case CameraModel::pinhole_radtan:
      c.k1 = 0.4 * sign(random);
      c.k2 = 0.2 * sign(random);
      c.k3 = 0.05 * sign(random);
      c.p1 = 2e-3 * sign(random);
      c.p2 = 2e-3 * sign(random);
      c.xi = model == CameraModel::mei ? 3 * unit(random) : 0;
      break;
    case CameraModel::kannala_brandt:
      c.k1 = 0.05 * sign(random);
      c.k2 = 0.05 * sign(random);
      c.k3 = 0.03 * sign(random);
      c.k4 = 0.01 * sign(random);
      break;
    case CameraModel::double_sphere:
      c.xi = -0.9 + 1.9 * unit(random);
      c.alpha = unit(random);
      break;
    case CameraModel::unified:
      c.xi = 3 * unit(random);
      break;
    case CameraModel::extended_unified:
      c.alpha = unit(random);
      c.beta = 0.3 + 2 * unit(random);
      break;
    case CameraModel::field_of_view:
      c.omega = 0.01 + 3 * unit(random);
      break;
    case CameraModel::equirectangular:
      break;
    case CameraModel::pinhole_rational:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::rad_tan_thin_prism_fisheye:
      draw_prism_coefficients(c, 0.1, 0.03, random);
      break;
    case CameraModel::polynomial_fisheye:
      c.shear = sign(random);
      c.k1 = 0.1 * sign(random);
      c.k2 = 0.1 * sign(random);
      c.k3 = 0.05 * sign(random);
      for (double Camera::*k : {&Camera::k4, &Camera::k5, &Camera::k6, &Camera::k7, &Camera::k8}) {
        c.*k = 1e-3 * sign(random);
      }
      for (double Camera::*k : {&Camera::k9, &Camera::k10, &Camera::k11}) {
        c.*k = 1e-5 * sign(random);
      }
      break;
  }
  return c;
}

TEST(ModelLimits, PolynomialEndsAtTheFirstRootOfTheSlope) {
  std::mt19937 random(15);
  int folding = 0;
  for (int i = 0; i < 500; ++i) {
    Camera c = random_camera(CameraModel::polynomial_fisheye, random);
    c.k2 *= 3;
    const auto radius = [&c](double theta) { return literal_point(c, theta, 0).x(); };
    const auto slope = [&](double theta) { return radius(theta + 1e-6) - radius(theta - 1e-6); };
    const double sampled = first_negative(slope, std::numbers::pi);
    const double limit = camera_parameters(c).domain.y;
    ASSERT_LE(limit, sampled + 1e-6);
    if (limit == std::numbers::pi) continue;
    ASSERT_NEAR(slope(limit), 0, 1e-10);
    ++folding;
  }
  EXPECT_GT(folding, 100);
  EXPECT_LT(folding, 400);
}

TEST(RandomCameras, RoundTripUpToTheEdgeOfTheDomain) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int model = 0; model < camera_models; ++model) {
    int checked = 0;
    for (int i = 0; i < 100; ++i) {
      const Camera camera = random_camera(static_cast<CameraModel>(model), random);
      validate(camera, "random");
      const double limit = model_max_theta(camera);
      for (int j = 0; j < 100; ++j) {
        // Every fourth within 10 % to one millionth of the edge.
        const double part = j % 4 != 0 ? unit(random) : 1 - std::pow(10, -1 - 5 * unit(random));
        const Vector3d expected = direction(part * limit, 360 * degree * unit(random));
        Vector2d pixel;
        ASSERT_TRUE(project(camera, expected, pixel)) << to_string(camera.model);
        if (pixel.norm() > 1e4) continue;
        Vector3d ray;
        Vector2d again;
        ASSERT_TRUE(unproject(camera, pixel, ray)) << to_string(camera.model) << " at " << part;
        ASSERT_TRUE(project(camera, ray, again));
        EXPECT_LT((again - pixel).norm(), 1e-6) << to_string(camera.model) << " at " << part;
        EXPECT_LT((ray - expected).norm(), 1e-6) << to_string(camera.model) << " at " << part;
        ++checked;
      }
    }
    EXPECT_GT(checked, 7000) << model;
  }
}

TEST(Pixels, ReachHalfAPixelToEitherSide) {
  Camera camera;
  camera.width = 4;
  camera.height = 3;
  camera.fx = camera.fy = 100;
  const PreparedCamera prepared(camera);
  Eigen::Vector2d pixel;
  const auto is_inside = [&](double x, double y) {
    return prepared.project_into_image({x / 100, y / 100, 1}, pixel);
  };
  for (const auto& [x, y] : {std::pair(-0.49, 1.0), {3.49, 1.0}, {1.0, -0.49}, {1.0, 2.49}}) {
    EXPECT_TRUE(is_inside(x, y)) << x << ", " << y;
  }
  for (const auto& [x, y] : {std::pair(-0.51, 1.0), {3.51, 1.0}, {1.0, -0.51}, {1.0, 2.51}}) {
    EXPECT_FALSE(is_inside(x, y)) << x << ", " << y;
  }
}

TEST(BehindTheCamera, OnlyWideModelsSeeSidewaysAndBackwards) {
  for (const NamedCamera& named : cameras()) {
    const Camera& camera = named.camera;
    const double limit = model_max_theta(camera);
    for (const double theta : {90.1, 100.0, 170.0}) {
      Vector2d pixel;
      EXPECT_EQ(project(camera, direction(theta * degree, 0.7), pixel), theta * degree < limit)
          << named.name << " at " << theta;
    }
    // Straight behind there is no azimuth, hence no pixel.
    Vector2d pixel;
    EXPECT_FALSE(project(camera, {0, 0, -1}, pixel)) << named.name;
  }
}

TEST(WholeSphere, LooksAllAround) {
  const Camera c = whole_sphere(360, 180);  // a pixel is a degree
  EXPECT_EQ(c.model, CameraModel::equirectangular);
  const auto expect = [&c](const Vector3d& direction, double u, double v) {
    Vector2d pixel;
    ASSERT_TRUE(project(c, direction, pixel)) << direction.transpose();
    EXPECT_NEAR(pixel.x(), u, 1e-9) << direction.transpose();
    EXPECT_NEAR(pixel.y(), v, 1e-9) << direction.transpose();
  };
  expect({0, 0, 1}, 179.5, 89.5);
  expect({3, 0, 0}, 269.5, 89.5);
  expect({-3, 0, 0}, 89.5, 89.5);
  expect({1, 0, 1}, 224.5, 89.5);
  expect({0, 1, 1}, 179.5, 134.5);
  expect({std::sqrt(0.5), -1, -std::sqrt(0.5)}, 314.5, 44.5);
  expect({1e-12, 0, -1}, 359.5, 89.5);
  expect({-1e-12, 0, -1}, -0.5, 89.5);
  // Every pixel has a ray, and their solid angles add up to the sphere's.
  double solid_angle = 0;
  for (int v = 0; v < 180; ++v) {
    for (int u = 0; u < 360; ++u) {
      Vector3d ray;
      ASSERT_TRUE(unproject(c, {u, v}, ray)) << u << " " << v;
      solid_angle += degree * degree * std::hypot(ray.x(), ray.z());
    }
  }
  EXPECT_NEAR(solid_angle, 4 * std::numbers::pi, 1e-3);
  Vector3d ray;
  EXPECT_FALSE(unproject(c, {359.6, 90}, ray));
  EXPECT_FALSE(unproject(c, {-0.6, 90}, ray));
  EXPECT_FALSE(unproject(c, {90, 179.6}, ray));
  Vector2d pixel;
  EXPECT_FALSE(project(c, {0, 1, 0}, pixel)) << "a pole";
}

TEST(BehindTheCamera, PixelsBeyondTheModelHaveNoRay) {
  Vector3d ray;
  Camera c = make_camera(CameraModel::unified, 512, 512, 300, 300, 256, 256);
  c.xi = 2;  // a disc of radius f / sqrt(xi^2 - 1)
  const double radius = 300 / std::sqrt(3.0);
  EXPECT_TRUE(unproject(c, {256 + radius - 0.01, 256}, ray));
  EXPECT_FALSE(unproject(c, {256 + radius + 0.01, 256}, ray));
  c = make_camera(CameraModel::double_sphere, 512, 512, 158, 158, 256, 256);
  c.xi = -0.17;
  c.alpha = 0.6;
  EXPECT_TRUE(unproject(c, {256, 256 + 158 / std::sqrt(0.2) - 0.01}, ray));
  EXPECT_FALSE(unproject(c, {256, 256 + 158 / std::sqrt(0.2) + 0.01}, ray));
  c = make_camera(CameraModel::field_of_view, 512, 512, 150, 150, 256, 256);
  c.omega = 1;  // 180 degrees off axis at f pi / omega
  EXPECT_TRUE(unproject(c, {256 + 150 * std::numbers::pi - 0.01, 256}, ray));
  EXPECT_FALSE(unproject(c, {256 + 150 * std::numbers::pi + 0.01, 256}, ray));
}

TEST(Resizing, KeepsRaysOfCorrespondingPixels) {
  Camera camera = cameras()[6].camera;
  const Camera half = resized(camera, 256, 256);
  // The corner between four pixels is the centre of one pixel of half size.
  Vector3d full_ray;
  Vector3d half_ray;
  ASSERT_TRUE(unproject(camera, {100.5, 200.5}, full_ray));
  ASSERT_TRUE(unproject(half, {50, 100}, half_ray));
  EXPECT_LT((full_ray - half_ray).norm(), 1e-12);
}

TEST(Resizing, ScalesTheAxesApart) {
  Camera camera = cameras()[5].camera;  // with skew
  const Camera stretched = resized(camera, 2 * camera.width, camera.height / 2);
  validate(stretched, "stretched");
  for (const double theta : {0.0, 0.4, 1.2}) {
    Vector2d before;
    Vector2d after;
    ASSERT_TRUE(project(camera, direction(theta, 2.2), before));
    ASSERT_TRUE(project(stretched, direction(theta, 2.2), after));
    EXPECT_NEAR(after.x() + 0.5, 2 * (before.x() + 0.5), 1e-9);
    EXPECT_NEAR(after.y() + 0.5, 0.5 * (before.y() + 0.5), 1e-9);
  }
  EXPECT_THROW(resized(camera, 0, 10), Error);
  EXPECT_THROW(resized(Camera(), 10, 10), Error);
}

TEST(Resizing, ByAFactorIsExactWhereSizesAreRounded) {
  Camera camera = cameras()[5].camera;  // with skew
  for (const auto& [side, reduced_side] : {std::pair(201, 100), {203, 102}, {200, 100}}) {
    camera.width = side;
    camera.height = 161;
    // Whose pixels tell where they were.
    cv::Mat columns(161, side, CV_32FC1);
    for (int x = 0; x < side; ++x) columns.col(x) = cv::Scalar(x);
    cv::Mat reduced;
    cv::resize(columns, reduced, {}, 0.5, 0.5, cv::INTER_AREA);
    const Camera half = scaled(camera, 0.5);
    validate(half, "half");
    EXPECT_EQ(cv::Size(half.width, half.height), reduced.size());
    EXPECT_EQ(half.width, reduced_side);
    Vector3d full_ray;
    Vector3d half_ray;
    const double column = reduced.at<float>(30, 40);
    ASSERT_TRUE(unproject(camera, {column, 2 * 30 + 0.5}, full_ray));
    ASSERT_TRUE(unproject(half, {40, 30}, half_ray));
    EXPECT_LT((full_ray - half_ray).norm(), 1e-12);
  }
  EXPECT_EQ(scaled(camera, 1), camera);
  EXPECT_EQ(scaled(scaled(camera, 2), 0.5), camera);
  for (const double factor : {0.0, -1.0, 1e-9, 1e9, std::nan("")}) {
    EXPECT_THROW(scaled(camera, factor), Error) << factor;
  }
}

TEST(RayImage, RefusesWhatDoesNotFit) {
  const Camera camera = cameras()[6].camera;
  EXPECT_THROW(ray_image(camera, cv::Mat(10, 10, CV_8UC1, cv::Scalar(1))), Error);
  EXPECT_THROW(ray_image(camera, cv::Mat(512, 512, CV_32FC1, cv::Scalar(1))), Error);
  EXPECT_THROW(ray_image(Camera(), {}), Error);
}

TEST(ModelNames, AreDistinctAndUnknownModelsRefused) {
  std::set<std::string> names;
  for (int i = 0; i < camera_models; ++i) names.insert(to_string(static_cast<CameraModel>(i)));
  EXPECT_EQ(names.size(), std::size_t{camera_models});
  EXPECT_THROW(to_string(static_cast<CameraModel>(camera_models)), Error);
  EXPECT_THROW(to_string(static_cast<CameraModel>(-1)), Error);
}

TEST(RayImage, HonoursTheMask) {
  const Camera camera = cameras()[6].camera;
  cv::Mat mask(camera.height, camera.width, CV_8UC1, cv::Scalar(255));
  mask(cv::Rect(0, 0, 256, 512)).setTo(0);
  const cv::Mat rays = ray_image(camera, mask);
  EXPECT_EQ(rays.at<cv::Vec4f>(250, 200)[3], 0);
  EXPECT_GT(cv::norm(rays.at<cv::Vec4f>(250, 200)), 0.99) << "masked pixels keep their ray";
  EXPECT_EQ(rays.at<cv::Vec4f>(250, 300)[3], 1);
  EXPECT_EQ(cv::norm(rays, ray_image(camera, mask & 1), cv::NORM_INF), 0) << "of zeros and ones";
}

TEST(CameraValidation, NamesWhatIsWrong) {
  const auto message = [](auto change) {
    Camera camera = cameras()[6].camera;
    change(camera);
    return test::error_of([&] { validate(camera, "calib.yaml: cam0"); });
  };
  const auto has = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos && text.find("calib.yaml: cam0") == 0;
  };
  EXPECT_TRUE(has(message([](Camera& c) { c.fx = 0; }), "fx"));
  EXPECT_TRUE(has(message([](Camera& c) { c.fy = -3; }), "fy"));
  EXPECT_TRUE(has(message([](Camera& c) { c.cx = std::nan(""); }), "cx"));
  EXPECT_TRUE(has(message([](Camera& c) { c.cy = INFINITY; }), "cy"));
  EXPECT_TRUE(has(message([](Camera& c) { c.alpha = 1.2; }), "alpha"));
  EXPECT_TRUE(has(message([](Camera& c) { c.xi = -1.2; }), "xi"));
  EXPECT_TRUE(has(message([](Camera& c) { c.width = 0; }), "width"));
  EXPECT_TRUE(has(message([](Camera& c) { c.width = 1; }), "width"));
  EXPECT_TRUE(has(message([](Camera& c) { c.height = 100000; }), "height"));
  EXPECT_TRUE(has(message([](Camera& c) { c.max_theta = 0; }), "max_theta"));
  EXPECT_TRUE(has(message([](Camera& c) { c.max_theta = 4; }), "max_theta"));
  EXPECT_TRUE(has(message([](Camera& c) { c.model = CameraModel::unified; }), "xi"));
  EXPECT_TRUE(has(message([](Camera& c) {
                    c.model = CameraModel::extended_unified;
                    c.beta = 0;
                  }),
                  "beta"));
  for (const double omega : {0.0, 3.2}) {
    EXPECT_TRUE(has(message([omega](Camera& c) {
                      c.model = CameraModel::field_of_view;
                      c.omega = omega;
                    }),
                    "omega"));
  }
  EXPECT_TRUE(has(message([](Camera& c) { c.model = static_cast<CameraModel>(42); }), "42"));
  EXPECT_TRUE(has(message([](Camera& c) { c.shear = 0.1; }), "shear"));
  EXPECT_TRUE(has(message([](Camera& c) {
                    c.model = CameraModel::polynomial_fisheye;
                    c.skew = c.shear = 2 * c.fx;
                  }),
                  "determinant"));
  EXPECT_EQ(message([](Camera&) {}), "");
}

}  // namespace
}  // namespace widestereo
