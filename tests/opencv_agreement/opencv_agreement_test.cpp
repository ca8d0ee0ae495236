// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/ccalib/omnidir.hpp>
#include <random>

#include "geometry/direction.h"
#include "geometry/named_cameras.h"
#include "widestereo/camera.h"

namespace widestereo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::cameras;
using test::direction;
using test::NamedCamera;

/// Random points within `reach` of the axis.
std::vector<cv::Point3d> random_points(double reach) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<cv::Point3d> points;
  for (int i = 0; i < 500; ++i) {
    const Vector3d p =
        (0.5 + 3 * unit(random)) * direction(reach * unit(random), 6.28 * unit(random));
    points.emplace_back(p.x(), p.y(), p.z());
  }
  return points;
}

cv::Matx33d matrix_of(const Camera& c) { return {c.fx, c.skew, c.cx, 0, c.fy, c.cy, 0, 0, 1}; }

void expect_equal_projections(const Camera& camera, const std::vector<cv::Point3d>& points,
                              const std::vector<cv::Point2d>& expected) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vector2d pixel;
    ASSERT_TRUE(project(camera, {points[i].x, points[i].y, points[i].z}, pixel));
    EXPECT_NEAR(pixel.x(), expected[i].x, 1e-6);
    EXPECT_NEAR(pixel.y(), expected[i].y, 1e-6);
  }
}

TEST(OpenCvAgreement, Fisheye) {
  for (const NamedCamera& named : cameras()) {
    Camera c = named.camera;
    if (c.model != CameraModel::kannala_brandt) continue;
    const std::vector<cv::Point3d> points = random_points(1.4);  // OpenCV's reaches 90 degrees only
    std::vector<cv::Point2d> pixels;
    const double alpha = c.skew / c.fx;
    const cv::Matx33d k(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1);
    cv::fisheye::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), k,
                               cv::Vec4d(c.k1, c.k2, c.k3, c.k4), alpha);
    expect_equal_projections(c, points, pixels);
  }
}

TEST(OpenCvAgreement, Omnidir) {
  for (const NamedCamera& named : cameras()) {
    Camera c = named.camera;
    if (c.model != CameraModel::mei) continue;
    c.skew = 0.7;
    const std::vector<cv::Point3d> points = random_points(0.97 * model_max_theta(c));
    std::vector<cv::Point2d> pixels;
    cv::omnidir::projectPoints(points, pixels, cv::Vec3d(), cv::Vec3d(), matrix_of(c), c.xi,
                               cv::Vec4d(c.k1, c.k2, c.p1, c.p2));
    expect_equal_projections(c, points, pixels);
  }
}

TEST(OpenCvAgreement, PinholeRadtan) {
  for (const NamedCamera& named : cameras()) {
    const Camera& c = named.camera;
    if (c.model != CameraModel::pinhole_radtan && c.model != CameraModel::pinhole) continue;
    const std::vector<cv::Point3d> points = random_points(std::min(0.8, 0.97 * model_max_theta(c)));
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(points, cv::Vec3d(), cv::Vec3d(), matrix_of(c),
                      std::vector<double>{c.k1, c.k2, c.p1, c.p2, c.k3}, pixels);
    expect_equal_projections(c, points, pixels);
  }
}

TEST(OpenCvAgreement, Rational) {
  int compared = 0;
  for (const NamedCamera& named : cameras()) {
    const Camera& c = named.camera;
    if (c.model != CameraModel::pinhole_rational) continue;
    const std::vector<cv::Point3d> points = random_points(std::min(0.8, 0.97 * model_max_theta(c)));
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(
        points, cv::Vec3d(), cv::Vec3d(), matrix_of(c),
        std::vector<double>{c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6, c.s1, c.s2, c.s3, c.s4},
        pixels);
    expect_equal_projections(c, points, pixels);
    ++compared;
  }
  EXPECT_EQ(compared, 2);
}

}  // namespace
}  // namespace widestereo
