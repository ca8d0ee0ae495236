// SPDX-License-Identifier: MIT
#include "widestereo/matcher.h"

#include <algorithm>
#include <chrono>
#include <opencv2/core.hpp>

#include "geometry/validation.h"
#include "kernel/maps.h"
#include "matching/match_setup.h"
#include "schedule/work.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

kernel::vec4 to_vec4(const cv::Vec4f& v) { return {v[0], v[1], v[2], v[3]}; }

/// Intensities with every pixel without a usable ray marked as masked.
cv::Mat masked_intensities(const cv::Mat& image, const View& view, const cv::Mat& rays) {
  const std::string name = "The image of " + view.name;
  require_calibrated_size(image, view, name);
  cv::Mat intensity = to_intensity(image, name);
  cv::Mat usable;
  cv::extractChannel(rays, usable, 3);
  intensity.setTo(MASKED_INTENSITY, usable == 0);
  return intensity;
}

/// Distance, normal and cost maps of plane hypotheses; planes without a cost are left out.
void unpack_hypotheses(const cv::Mat_<cv::Vec4f>& rays, ViewResult& result) {
  const cv::Mat_<cv::Vec4f> hypotheses = result.hypotheses;
  result.distance = cv::Mat::zeros(hypotheses.size(), CV_32FC1);
  result.normals = cv::Mat::zeros(hypotheses.size(), CV_32FC3);
  cv::extractChannel(hypotheses, result.cost, 3);
  cv::parallel_for_(cv::Range(0, hypotheses.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < hypotheses.cols; ++x) {
        const kernel::vec4 hypothesis = to_vec4(hypotheses(y, x));
        const float distance = kernel::plane_distance(hypothesis, to_vec4(rays(y, x)));
        if (!(distance > 0)) continue;
        const kernel::vec3 normal = kernel::plane_normal(hypothesis);
        result.distance.at<float>(y, x) = distance;
        result.normals.at<cv::Vec3f>(y, x) = {normal.x, normal.y, normal.z};
      }
    }
  });
}

void require_overlap(const std::vector<ViewResult>& views) {
  for (const ViewResult& view : views) {
    if (cv::countNonZero(view.cost < INVALID_COST) > 0) return;
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
  channels[3].convertTo(result.reasons, CV_16U);
}

void add_work(std::vector<KernelTime>& times, const Schedule& schedule) {
  for (const Dispatch& dispatch : schedule.dispatches) {
    const auto time = std::find_if(times.begin(), times.end(), [&](const KernelTime& t) {
      return t.kernel == to_string(dispatch.kernel);
    });
    if (time == times.end()) continue;
    const KernelWork work = work_of(schedule, dispatch);
    time->work.samples += work.samples;
    time->work.operations += work.operations;
    time->work.texels += work.texels;
    time->work.bytes += work.bytes;
  }
}

}  // namespace

class Matcher::Implementation {
 public:
  Implementation(Device& device, const Rig& rig, const Options& options)
      : rig_(rig),
        setup_(rig, options, device.info()),
        backend_(device.implementation().make_backend(setup_.sizes, setup_.schedule.constants)),
        rays_(setup_.set_rays(*backend_)) {}

  StereoResult match(const std::vector<cv::Mat>& images, const Progress& progress) {
    return run(setup_.schedule, images, progress);
  }

  StereoResult match_next(const std::vector<cv::Mat>& images, const WarmStart& start,
                          const Progress& progress) {
    if (start.hypotheses.empty() && !holds_planes_) {
      throw Error(
          "There are no planes of a previous frame to start from; match one without a warm start "
          "or give its planes.");
    }
    if (!start.hypotheses.empty() && start.hypotheses.size() != rig_.views.size()) {
      throw Error("The rig has " + std::to_string(rig_.views.size()) + " views, but planes of " +
                  std::to_string(start.hypotheses.size()) + " were given to start from.");
    }
    for (std::size_t i = 0; i < start.hypotheses.size(); ++i) {
      const View& view = rig_.views[i];
      require_map(start.hypotheses[i], {view.camera.width, view.camera.height}, CV_32FC4,
                  "The map of planes to start " + view.name + " from");
    }
    set_motion(setup_.warm_schedule, rig_,
               start.now_from_previous.value_or(Eigen::Isometry3d::Identity()), start.frame);
    return run(setup_.warm_schedule, images, progress, start.hypotheses);
  }

  void time_kernels(bool each) { backend_->time_kernels(each); }

 private:
  /// `hypotheses`: planes to upload, one map for each view, or none.
  StereoResult run(const Schedule& schedule, const std::vector<cv::Mat>& images,
                   const Progress& progress, const std::vector<cv::Mat>& hypotheses = {}) {
    const auto start = std::chrono::steady_clock::now();
    if (images.size() != rig_.views.size()) {
      throw Error("The rig has " + std::to_string(rig_.views.size()) + " views, but " +
                  std::to_string(images.size()) + " image(s) were given.");
    }
    std::vector<cv::Mat> intensities;
    for (std::size_t i = 0; i < images.size(); ++i) {
      intensities.push_back(masked_intensities(images[i], rig_.views[i], rays_[i]));
    }
    // What is refused is refused above, and leaves the planes of the last match in place.
    holds_planes_ = false;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const int view = static_cast<int>(i);
      backend_->set_intensity(view, intensities[i]);
      if (!hypotheses.empty()) backend_->set_hypotheses(view, hypotheses[i]);
    }
    backend_->run(schedule, progress);
    holds_planes_ = true;

    StereoResult result;
    for (std::size_t i = 0; i < images.size(); ++i) {
      ViewResult& view = result.views.emplace_back();
      view.hypotheses = backend_->hypotheses(static_cast<int>(i));
      unpack_hypotheses(rays_[i], view);
      unpack_checks(backend_->checks(static_cast<int>(i)), view);
    }
    require_overlap(result.views);
    for (const Dispatch& dispatch : schedule.dispatches) result.samples += dispatch.samples;
    result.times = backend_->times();
    add_work(result.times, schedule);
    result.device_milliseconds = backend_->device_milliseconds();
    result.device_bytes = backend_->device_bytes();
    result.filter = static_cast<Filter>(schedule.constants.filter);
    result.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return result;
  }

  Rig rig_;
  MatchSetup setup_;
  std::unique_ptr<Backend> backend_;
  std::vector<cv::Mat> rays_;  // of the rig's views
  bool holds_planes_ = false;  // of a frame that was matched to the end
};

cv::Mat accepted_distance(const ViewResult& view) {
  cv::Mat distance = view.distance.clone();
  const cv::Mat filled = (view.reasons & reason_filled) != 0;
  distance.setTo(0, (view.reasons != 0) & ~filled);
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

StereoResult Matcher::match_next(const std::vector<cv::Mat>& images, const WarmStart& start,
                                 const Progress& progress) {
  return implementation_->match_next(images, start, progress);
}

void Matcher::time_kernels(bool each) { implementation_->time_kernels(each); }

}  // namespace widestereo
