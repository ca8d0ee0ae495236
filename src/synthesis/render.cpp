// SPDX-License-Identifier: MIT
#include "synthesis/render.h"

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "evaluation/ground_truth.h"
#include "geometry/validation.h"

namespace widestereo::synthesis {
namespace {

/// Samples along each side of a pixel.
constexpr int supersampling = 3;
/// Share of brightness lost at the rim of the field of view.
constexpr double vignetting = 0.3;

Ray world_ray(const View& view, const Eigen::Vector3d& ray) {
  return {view.world_from_camera.translation(), view.world_from_camera.linear() * ray};
}

/// Renders pixels of one view.
class ViewRenderer {
 public:
  ViewRenderer(const Scene& scene, const View& view, const View& other, std::uint32_t seed)
      : scene_(scene),
        view_(view),
        other_(other),
        camera_(view.camera),
        other_camera_(other.camera),
        seed_(seed) {
    pixel_angle_ = 1 / std::max(view.camera.fx, view.camera.fy);
    const cv::Size size(view.camera.width, view.camera.height);
    result_.image = cv::Mat::zeros(size, CV_8UC3);
    result_.truth.distance = cv::Mat::zeros(size, CV_32FC1);
    result_.truth.valid = cv::Mat::zeros(size, CV_8UC1);
    result_.truth.occlusion = cv::Mat::zeros(size, CV_8UC1);
    result_.truth.normals = cv::Mat::zeros(size, CV_32FC3);
  }

  RenderedView render() {
    cv::parallel_for_(cv::Range(0, view_.camera.height), [this](const cv::Range& rows) {
      for (int y = rows.start; y < rows.end; ++y) {
        for (int x = 0; x < view_.camera.width; ++x) {
          set_truth(x, y);
          set_colour(x, y);
        }
      }
    });
    return std::move(result_);
  }

 private:
  void set_truth(int x, int y) {
    Eigen::Vector3d ray;
    if (!camera_.unproject({x, y}, ray)) return;
    const auto hit = scene_.cast(world_ray(view_, ray));
    if (!hit) return;
    const Eigen::Vector3d normal = view_.world_from_camera.linear().transpose() * hit->normal;
    result_.truth.distance.at<float>(y, x) = static_cast<float>(hit->distance);
    result_.truth.valid.at<uchar>(y, x) = 255;
    result_.truth.normals.at<cv::Vec3f>(y, x) = {static_cast<float>(normal.x()),
                                                 static_cast<float>(normal.y()),
                                                 static_cast<float>(normal.z())};
    result_.truth.occlusion.at<uchar>(y, x) =
        visibility(view_.world_from_camera * (hit->distance * ray));
  }

  /// From the other view.
  uchar visibility(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d in_other = other_.world_from_camera.inverse() * point;
    Eigen::Vector2d pixel;
    if (!other_camera_.project_into_image(in_other, pixel)) return outside_label;
    const double distance = in_other.norm();
    const auto hit = scene_.cast(world_ray(other_, in_other / distance));
    return hit && hit->distance < distance * (1 - 1e-6) ? hidden_label : visible_label;
  }

  void set_colour(int x, int y) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < supersampling * supersampling; ++i) {
      const double dx = (i % supersampling + 0.5) / supersampling - 0.5;
      const double dy = (i / supersampling + 0.5) / supersampling - 0.5;
      Eigen::Vector3d ray;
      if (!camera_.unproject({x + dx, y + dy}, ray)) continue;
      const Ray world = world_ray(view_, ray);
      const auto hit = scene_.cast(world);
      if (!hit) continue;
      const double facing = std::max(0.15, -hit->normal.dot(world.direction));
      const double footprint = hit->distance * pixel_angle_ / facing;
      const double theta = std::atan2(ray.head<2>().norm(), ray.z());
      const double falloff = 1 - vignetting * std::pow(theta / view_.camera.max_theta, 2);
      sum += falloff * scene_.shade(world, *hit, footprint, seed_);
    }
    sum *= 255.0 / (supersampling * supersampling);
    result_.image.at<cv::Vec3b>(y, x) = {cv::saturate_cast<uchar>(sum.z()),
                                         cv::saturate_cast<uchar>(sum.y()),
                                         cv::saturate_cast<uchar>(sum.x())};
  }

  const Scene& scene_;
  const View& view_;
  const View& other_;
  PreparedCamera camera_, other_camera_;
  std::uint32_t seed_;
  double pixel_angle_;
  RenderedView result_;
};

}  // namespace

RenderedPair render(const Scene& scene, const Rig& rig, std::uint32_t seed) {
  RenderedPair pair;
  pair.rig = rig;
  for (const View& view : rig.views) require_valid(view, "The rig to render");
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    const View& other = rig.views[(i + 1) % rig.views.size()];
    pair.views.push_back(ViewRenderer(scene, rig.views[i], other, seed).render());
  }
  return pair;
}

}  // namespace widestereo::synthesis
