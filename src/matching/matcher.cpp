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

/// Rows of new memory are written by many threads, which share the page faults as well.
template <class OnRow>
void for_rows(int rows, const OnRow& on_row) {
  cv::parallel_for_(cv::Range(0, rows), [&](const cv::Range& range) {
    for (int y = range.start; y < range.end; ++y) on_row(y);
  });
}

/// Intensities with every pixel without a usable ray marked as masked.
cv::Mat masked_intensities(const cv::Mat& image, const View& view, const cv::Mat& rays) {
  const std::string name = "The image of " + view.name;
  require_calibrated_size(image, view, name);
  cv::Mat intensity = to_intensity(image, name);
  for_rows(intensity.rows, [&](int y) {
    const auto* ray = rays.ptr<cv::Vec4f>(y);
    float* pixel = intensity.ptr<float>(y);
    for (int x = 0; x < intensity.cols; ++x) {
      if (ray[x][3] == 0) pixel[x] = MASKED_INTENSITY;
    }
  });
  return intensity;
}

/// Distance, normal and cost maps of plane hypotheses; planes without a cost are left out.
void unpack_hypotheses(const cv::Mat_<cv::Vec4f>& hypotheses, const cv::Mat_<cv::Vec4f>& rays,
                       ViewResult& result) {
  result.hypotheses.create(hypotheses.size(), CV_32FC4);
  result.distance.create(hypotheses.size(), CV_32FC1);
  result.normals.create(hypotheses.size(), CV_32FC3);
  result.cost.create(hypotheses.size(), CV_32FC1);
  for_rows(hypotheses.rows, [&](int y) {
    const cv::Vec4f* hypothesis = hypotheses[y];
    const cv::Vec4f* ray = rays[y];
    auto* held = result.hypotheses.ptr<cv::Vec4f>(y);
    float* distance = result.distance.ptr<float>(y);
    auto* normal = result.normals.ptr<cv::Vec3f>(y);
    float* cost = result.cost.ptr<float>(y);
    for (int x = 0; x < hypotheses.cols; ++x) {
      held[x] = hypothesis[x];
      cost[x] = hypothesis[x][3];
      distance[x] = kernel::plane_distance(to_vec4(hypothesis[x]), to_vec4(ray[x]));
      const kernel::vec3 n = kernel::plane_normal(to_vec4(hypothesis[x]), to_vec4(ray[x]));
      normal[x] = {n.x, n.y, n.z};
    }
  });
}

void require_overlap(const std::vector<ViewResult>& views) {
  for (const ViewResult& view : views) {
    const auto has_cost = [](float cost) { return cost < INVALID_COST; };
    if (std::any_of(view.cost.begin<float>(), view.cost.end<float>(), has_cost)) return;
  }
  throw NoOverlap(
      "The images do not overlap: no pixel of any view is seen by another one within the distance "
      "range; check the calibration, the order of the images, masks and the range.");
}

void unpack_checks(const cv::Mat_<cv::Vec4f>& checks, ViewResult& result) {
  result.differences.create(checks.size(), CV_32FC2);
  result.confidence.create(checks.size(), CV_32FC1);
  result.reasons.create(checks.size(), CV_16UC1);
  for_rows(checks.rows, [&](int y) {
    const cv::Vec4f* check = checks[y];
    auto* difference = result.differences.ptr<cv::Vec2f>(y);
    float* confidence = result.confidence.ptr<float>(y);
    auto* reasons = result.reasons.ptr<std::uint16_t>(y);
    for (int x = 0; x < checks.cols; ++x) {
      difference[x] = {check[x][0], check[x][1]};
      confidence[x] = check[x][2];
      reasons[x] = static_cast<std::uint16_t>(check[x][3]);
    }
  });
}

void add_work(std::vector<KernelTime>& times, const Schedule& schedule) {
  for (const Dispatch& dispatch : schedule.dispatches) {
    const auto time = std::find_if(times.begin(), times.end(), [&](const KernelTime& t) {
      return t.kernel == to_string(dispatch.kernel);
    });
    if (time == times.end()) continue;
    time->work += work_of(schedule, dispatch);
  }
}

}  // namespace

class Matcher::Implementation {
 public:
  Implementation(Device& device, const Rig& rig, const Options& options)
      : rig_(rig),
        setup_(rig, options, device.info()),
        backend_(device.implementation().make_backend(setup_.sizes, setup_.schedule.constants)),
        rays_(setup_.set_rays(*backend_)),
        max_gain_(options.max_gain) {
    backend_->compile(setup_.schedule);
  }

  StereoResult match(const std::vector<cv::Mat>& images, const Progress& progress) {
    return run(setup_.schedule, images, progress);
  }

  StereoResult match_next(const std::vector<cv::Mat>& images, const WarmStart& start,
                          const Progress& progress) {
    require_planes(holds_planes_ || !start.hypotheses.empty(),
                   "match one without a warm start or give its planes.");
    if (!start.hypotheses.empty() && start.hypotheses.size() != rig_.views.size()) {
      throw Error("The rig has " + std::to_string(rig_.views.size()) + " views, but planes of " +
                  std::to_string(start.hypotheses.size()) +
                  " were given to start from; give a map for each view.");
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
                  std::to_string(images.size()) + " image(s) were given; give one for each view.");
    }
    std::vector<cv::Mat> intensities;
    std::vector<double> gains;
    for (std::size_t i = 0; i < images.size(); ++i) {
      intensities.push_back(masked_intensities(images[i], rig_.views[i], rays_[i]));
      gains.push_back(contrast_gain(intensities.back(), max_gain_));
      if (gains.back() == 1) continue;
      const cv::Mat masked = intensities.back() < 0;
      intensities.back() *= gains.back();
      intensities.back().setTo(MASKED_INTENSITY, masked);
    }
    // What is refused is refused above, and leaves the planes of the last match in place.
    holds_planes_ = false;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const int view = static_cast<int>(i);
      backend_->set_intensity(view, intensities[i]);
      if (!hypotheses.empty()) backend_->set_hypotheses(view, hypotheses[i]);
    }
    backend_->run(schedule, progress);

    StereoResult result;
    for (std::size_t i = 0; i < images.size(); ++i) {
      ViewResult& view = result.views.emplace_back();
      unpack_hypotheses(backend_->hypotheses(static_cast<int>(i)), rays_[i], view);
      unpack_checks(backend_->checks(static_cast<int>(i)), view);
      view.gain = gains[i];
    }
    require_overlap(result.views);
    holds_planes_ = true;
    for (const Dispatch& dispatch : schedule.dispatches) result.samples += dispatch.samples;
    result.times = backend_->times();
    add_work(result.times, schedule);
    result.device_milliseconds = backend_->device_milliseconds();
    result.device_bytes = backend_->device_bytes();
    result.filter = setup_.filter();
    result.levels = static_cast<int>(schedule.views.size() / images.size());
    result.milliseconds =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    return result;
  }

  Rig rig_;
  MatchSetup setup_;
  std::unique_ptr<Backend> backend_;
  std::vector<cv::Mat> rays_;  // of the rig's views
  double max_gain_;
  bool holds_planes_ = false;  // of a frame that was matched to the end
};

cv::Mat accepted_distance(const ViewResult& view) {
  require_type(view.distance, CV_32FC1, "The distance map");
  require_map(view.reasons, view.distance.size(), CV_16UC1, "The map of reasons");
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
