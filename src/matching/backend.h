// SPDX-License-Identifier: MIT
// What a back end must provide: memory, images and launching; no algorithm.
#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "schedule/schedule.h"
#include "widestereo/matcher.h"

namespace widestereo {

/// Sums of device time per kernel, in order of first use.
class KernelTimes {
 public:
  void clear() { times_.clear(); }
  void add(Kernel kernel, int dispatches, double milliseconds);
  const std::vector<KernelTime>& list() const { return times_; }

 private:
  std::vector<KernelTime> times_;
};

/// Turns finished patch samples into calls of a progress function.
class ScheduleProgress {
 public:
  ScheduleProgress(const Schedule& schedule, const Matcher::Progress& progress);
  void advance(long long samples);

 private:
  const Matcher::Progress& progress_;
  long long total_ = 0;
  long long done_ = 0;
};

inline std::size_t area(cv::Size size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
}
/// Of the largest view.
std::size_t largest_area(const std::vector<cv::Size>& sizes);

/// Size of the memory of an image of intensities (shaders/parameters.glsl).
inline cv::Size with_apron(cv::Size size) {
  return {size.width + 2 * APRON, size.height + 2 * APRON};
}
/// Likewise of the texels that it is sampled from.
inline cv::Size size_of_texels(cv::Size size, const KernelConstants& constants) {
  return with_apron(size) * constants.texels_per_pixel;
}

/// Patch samples that a slow device of each kind works off in about 100 ms: dispatches of more are
/// split where a watchdog may end them.
inline constexpr long long samples_of_discrete_gpu = 2'000'000'000;
inline constexpr long long samples_of_integrated_gpu = 300'000'000;
inline constexpr long long samples_of_software = 20'000'000;

/// Throws Error unless a map for a view has its size and type.
void require_map(const cv::Mat& map, int view, cv::Size size, int type);
/// Throws Error unless a schedule was made for the constants of a back end's kernels.
void require_constants(const Schedule& schedule, const KernelConstants& constants);

/// Memory and kernels for matches of fixed sizes on one device. All maps have their view's size.
class Backend {
 public:
  virtual ~Backend() = default;
  /// Unit rays, CV_32FC4 as from ray_image(); set once.
  virtual void set_rays(int view, const cv::Mat& rays) = 0;
  /// Intensities in [0, 1], CV_32FC1, MASKED_INTENSITY where masked; before every run.
  virtual void set_intensity(int view, const cv::Mat& intensity) = 0;
  /// Makes what a schedule runs, which takes a while where kernels are compiled; else run() does.
  virtual void compile(const Schedule&) {}
  /// Runs the dispatches in order and waits for them. `progress` may be empty.
  virtual void run(const Schedule& schedule, const Matcher::Progress& progress) = 0;
  /// Plane hypotheses (m, cost), CV_32FC4: memory of the back end, until its next call.
  virtual cv::Mat hypotheses(int view) = 0;
  virtual void set_hypotheses(int view, const cv::Mat& hypotheses) = 0;
  /// What the check kernel wrote, CV_32FC4: relative difference, displacement (px), confidence,
  /// reason bits; likewise.
  virtual cv::Mat checks(int view) = 0;
  /// Device time per kernel of the last run.
  virtual std::vector<KernelTime> times() const = 0;
  /// See Matcher::time_kernels().
  virtual void time_kernels(bool) {}
  /// Device time of the last run.
  virtual double device_milliseconds() const;
  virtual std::size_t device_bytes() const = 0;
};

/// A device of any kind, behind the public handle.
class Device::Implementation {
 public:
  virtual ~Implementation() = default;
  /// Throws Error when memory or a feature is missing. `sizes`: of each view's image.
  virtual std::unique_ptr<Backend> make_backend(const std::vector<cv::Size>& sizes,
                                                const KernelConstants& constants) = 0;
  virtual std::vector<std::string> validation_messages() const { return {}; }
  DeviceInfo info;
  std::string note;
};

}  // namespace widestereo
