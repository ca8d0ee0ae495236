// SPDX-License-Identifier: MIT
#include "widestereo/matcher.h"

#include <chrono>
#include <opencv2/core.hpp>

#include "matching/backend.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

constexpr float masked_intensity = -1;
constexpr float no_plane_cost = 2;

/// Intensities with every pixel without a usable ray marked as masked.
cv::Mat masked_intensities(const cv::Mat& image, const View& view, const cv::Mat& rays) {
  const cv::Size size(view.camera.width, view.camera.height);
  if (image.size() != size) {
    throw Error("The image of " + view.name + " is " + std::to_string(image.cols) + "x" +
                std::to_string(image.rows) + " pixels, but its calibration is for " +
                std::to_string(size.width) + "x" + std::to_string(size.height) +
                "; use images of the calibrated size.");
  }
  cv::Mat intensity = to_intensity(image, "The image of " + view.name);
  cv::Mat usable;
  cv::extractChannel(rays, usable, 3);
  intensity.setTo(masked_intensity, usable == 0);
  return intensity;
}

/// Distance, normal and cost maps of plane hypotheses; planes without a cost are left out.
void unpack_hypotheses(const cv::Mat_<cv::Vec4f>& rays, ViewResult& result) {
  const cv::Mat_<cv::Vec4f> hypotheses = result.hypotheses;
  result.distance = cv::Mat::zeros(hypotheses.size(), CV_32FC1);
  result.normals = cv::Mat::zeros(hypotheses.size(), CV_32FC3);
  cv::extractChannel(hypotheses, result.cost, 3);
  for (int y = 0; y < hypotheses.rows; ++y) {
    for (int x = 0; x < hypotheses.cols; ++x) {
      const cv::Vec4f& h = hypotheses(y, x);
      const cv::Vec4f& ray = rays(y, x);
      const cv::Vec3f m(h[0], h[1], h[2]);
      const float w = m.dot(cv::Vec3f(ray[0], ray[1], ray[2]));
      if (h[3] >= no_plane_cost || !(w > 0)) continue;
      result.distance.at<float>(y, x) = 1 / w;
      result.normals.at<cv::Vec3f>(y, x) = -m / static_cast<float>(cv::norm(m));
    }
  }
}

void require_overlap(const std::vector<ViewResult>& views) {
  for (const ViewResult& view : views) {
    if (cv::countNonZero(view.cost < no_plane_cost) > 0) return;
  }
  throw Error(
      "The images do not overlap: no pixel of any view is seen by another one within the distance "
      "range; check the calibration, the order of the images, masks and the range.");
}

void unpack_checks(const cv::Mat& checks, ViewResult& result) {
  std::vector<cv::Mat> channels;
  cv::split(checks, channels);
  cv::merge(std::vector<cv::Mat>{channels[0], channels[1]}, result.differences);
  result.confidence = channels[2];
  channels[3].convertTo(result.reasons, CV_8U);
}

}  // namespace

class Matcher::Implementation {
 public:
  Implementation(Device& device, const Rig& rig, const Options& options)
      : rig_(rig), schedule_(make_schedule(rig, options)) {
    if (options.propagation == Propagation::raster && device.info().kind != DeviceKind::cpu) {
      throw Error(
          "Raster-order propagation is sequential and runs on the CPU only; choose the "
          "device \"cpu\" or checkerboard propagation.");
    }
    std::vector<cv::Size> sizes;
    for (const View& view : schedule_.views) {
      sizes.emplace_back(view.camera.width, view.camera.height);
      rays_.push_back(ray_image(view.camera, view.mask));
    }
    backend_ = device.implementation().make_backend(sizes, schedule_.constants);
    for (std::size_t i = 0; i < rays_.size(); ++i) {
      backend_->set_rays(static_cast<int>(i), rays_[i]);
    }
  }

  StereoResult match(const std::vector<cv::Mat>& images, const Progress& progress) {
    const auto start = std::chrono::steady_clock::now();
    if (images.size() != rig_.views.size()) {
      throw Error("The rig has " + std::to_string(rig_.views.size()) + " views, but " +
                  std::to_string(images.size()) + " image(s) were given.");
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      backend_->set_intensity(static_cast<int>(i),
                              masked_intensities(images[i], rig_.views[i], rays_[i]));
    }
    backend_->run(schedule_, progress);

    StereoResult result;
    for (std::size_t i = 0; i < images.size(); ++i) {
      ViewResult& view = result.views.emplace_back();
      view.hypotheses = backend_->hypotheses(static_cast<int>(i));
      unpack_hypotheses(rays_[i], view);
      unpack_checks(backend_->checks(static_cast<int>(i)), view);
    }
    require_overlap(result.views);
    for (const Dispatch& dispatch : schedule_.dispatches) result.samples += dispatch.samples;
    result.times = backend_->times();
    result.device_bytes = backend_->device_bytes();
    result.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return result;
  }

 private:
  Rig rig_;
  Schedule schedule_;
  std::vector<cv::Mat> rays_;
  std::unique_ptr<Backend> backend_;
};

cv::Mat accepted_distance(const ViewResult& view) {
  cv::Mat distance = view.distance.clone();
  distance.setTo(0, view.reasons != 0);
  return distance;
}

Matcher::Matcher(Device& device, const Rig& rig, const Options& options)
    : implementation_(std::make_unique<Implementation>(device, rig, options)) {}
Matcher::~Matcher() = default;
Matcher::Matcher(Matcher&&) noexcept = default;
Matcher& Matcher::operator=(Matcher&&) noexcept = default;

StereoResult Matcher::match(const std::vector<cv::Mat>& images, const Progress& progress) {
  return implementation_->match(images, progress);
}

}  // namespace widestereo
