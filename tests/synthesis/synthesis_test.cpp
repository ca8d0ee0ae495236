// SPDX-License-Identifier: MIT
#include "widestereo/synthesis.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <opencv2/core.hpp>

#include "same_bits.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

using test::same_bits;

/// Bilinear grey value of a BGR image, -1 outside.
double grey_at(const cv::Mat& image, const Eigen::Vector2d& u) {
  if (u.x() < 0 || u.y() < 0 || u.x() >= image.cols - 1 || u.y() >= image.rows - 1) return -1;
  const int x = static_cast<int>(u.x());
  const int y = static_cast<int>(u.y());
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    const cv::Vec3b& bgr = image.at<cv::Vec3b>(y + i / 2, x + i % 2);
    const double weight = (i % 2 ? u.x() - x : 1 - u.x() + x) * (i / 2 ? u.y() - y : 1 - u.y() + y);
    sum += weight * (bgr[0] + bgr[1] + bgr[2]) / 3.0;
  }
  return sum;
}

TEST(RenderPlane, TruthIsTheRayPlaneIntersection) {
  Rig rig = demo_rig(64);
  rig.views[0].world_from_camera = Eigen::Translation3d(0.3, -0.2, 0.1) *
                                   Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 1, 0).normalized());
  const Eigen::Vector3d normal(0.2, -0.3, 1);
  const RenderedPair pair = render_plane(rig, normal, 2.0);
  for (int view = 0; view < 2; ++view) {
    const Eigen::Isometry3d& pose = pair.rig.views[view].world_from_camera;
    int hits = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        Eigen::Vector3d ray;
        const float distance = pair.views[view].truth.distance.at<float>(y, x);
        if (!unproject(rig.views[view].camera, Eigen::Vector2d(x, y), ray)) {
          EXPECT_EQ(distance, 0);
          continue;
        }
        const double expected =
            (2.0 - normal.dot(pose.translation())) / normal.dot(pose.linear() * ray);
        if (expected <= 0) {
          EXPECT_EQ(distance, 0);
          continue;
        }
        EXPECT_NEAR(distance, expected, 1e-5 * expected);
        const cv::Vec3f& n = pair.views[view].truth.normals.at<cv::Vec3f>(y, x);
        const Eigen::Vector3d in_camera = pose.linear().transpose() * -normal.normalized();
        EXPECT_NEAR(std::abs(in_camera.dot(Eigen::Vector3d(n[0], n[1], n[2]))), 1, 1e-6);
        EXPECT_LT(ray.dot(Eigen::Vector3d(n[0], n[1], n[2])), 0) << "normals face the camera";
        ++hits;
      }
    }
    EXPECT_GT(hits, 1000);
  }
}

TEST(RenderDemo, ViewsShowTheSameSceneThroughTheirTruth) {
  const RenderedPair pair = render_demo(192);
  const View& first = pair.rig.views[0];
  const View& second = pair.rig.views[1];
  const Eigen::Isometry3d motion = source_from_reference(second, first);
  std::vector<double> differences;
  int beyond_90 = 0;
  int hidden = 0;
  int counts[3] = {0, 0, 0};
  for (int y = 0; y < 192; ++y) {
    for (int x = 0; x < 192; ++x) {
      const GroundTruth& truth = pair.views[0].truth;
      if (truth.valid.at<uchar>(y, x) == 0) continue;
      const uchar occlusion = truth.occlusion.at<uchar>(y, x);
      ++counts[occlusion / 127];
      Eigen::Vector3d ray;
      ASSERT_TRUE(unproject(first.camera, Eigen::Vector2d(x, y), ray));
      beyond_90 += ray.z() < 0;
      const Eigen::Vector3d point =
          motion * (static_cast<double>(truth.distance.at<float>(y, x)) * ray);
      Eigen::Vector2d u;
      const bool projects = project(second.camera, point, u) && u.x() >= -0.5 && u.y() >= -0.5 &&
                            u.x() < 191.5 && u.y() < 191.5;
      EXPECT_EQ(projects, occlusion != 128);
      if (occlusion == 0) {
        // Something nearer stands there in the other view (but for the rounding to its pixels).
        const float there = pair.views[1].truth.distance.at<float>(
            std::clamp(static_cast<int>(std::lround(u.y())), 0, 191),
            std::clamp(static_cast<int>(std::lround(u.x())), 0, 191));
        hidden += there > 0 && static_cast<double>(there) < 1.02 * point.norm();
      }
      if (occlusion != 255) continue;
      const double other = grey_at(pair.views[1].image, u);
      if (other < 0) continue;
      differences.push_back(std::abs(other - grey_at(pair.views[0].image, Eigen::Vector2d(x, y))));
    }
  }
  ASSERT_GT(differences.size(), 20000u);
  std::sort(differences.begin(), differences.end());
  EXPECT_LT(differences[differences.size() / 2], 4) << "grey levels";
  EXPECT_LT(differences[differences.size() * 9 / 10], 20);
  EXPECT_GT(beyond_90, 500);
  EXPECT_GT(counts[0], 100) << "occluded";
  EXPECT_GT(hidden, 0.8 * counts[0]);
  EXPECT_GT(counts[1], 100) << "outside";
  EXPECT_GT(counts[2], 20000) << "visible";
}

TEST(RenderDemo, NeedsPixels) {
  for (const int size : {-5, 0}) EXPECT_THROW(render_demo(size), Error);
}

TEST(RenderDemo, IsDeterministicAndInRange) {
  const RenderedPair a = render_demo(64);
  const RenderedPair b = render_demo(64);
  EXPECT_TRUE(same_bits(a.views[1].image, b.views[1].image));
  EXPECT_FALSE(same_bits(a.views[0].image, render_demo(64, 2).views[0].image));
  const auto [nearest, farthest] = demo_distance_range();
  double low = 0;
  double high = 0;
  cv::minMaxLoc(a.views[0].truth.distance, &low, &high, nullptr, nullptr, a.views[0].truth.valid);
  EXPECT_GT(low, nearest);
  EXPECT_LT(high, farthest);
}

}  // namespace
}  // namespace widestereo
