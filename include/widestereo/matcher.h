// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/device.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"

namespace widestereo {

/// Why a pixel was rejected: bits of ViewResult::reasons (values of the kernels,
/// shaders/parameters.glsl).
enum Reason : std::uint16_t {
  reason_no_ray = 1,         ///< outside the lens, the model's domain or the mask, or no intensity
  reason_no_overlap = 2,     ///< no plane there is visible in any source view
  reason_no_texture = 4,     ///< the patch carries no information
  reason_high_cost = 8,      ///< cost above Options::max_cost
  reason_inconsistent = 16,  ///< the source view's own plane disagrees
  reason_unchecked = 32,  ///< the point does not project to a pixel with a plane in the source view
  reason_low_parallax = 64,  ///< the distance is not observable here (near an epipole)
  reason_tilt = 128,         ///< the plane is seen at too grazing an angle
  reason_ambiguous = 256,    ///< another place in the source matches better
  reason_speckle = 512,      ///< hardly a plane around agrees
  reason_filled = 1024,      ///< not a reason: the rejected pixel took the plane of accepted ones
  reason_low_confidence = 2048,  ///< confidence below Options::min_confidence
};

/// What a bit of ViewResult::reasons is called.
struct NamedReason {
  Reason bit;
  const char* name;
};
/// In the order of the bits, from 1 on.
inline constexpr std::array<NamedReason, 12> named_reasons = {
    {{reason_no_ray, "no ray"},
     {reason_no_overlap, "no overlap"},
     {reason_no_texture, "no texture"},
     {reason_high_cost, "high cost"},
     {reason_inconsistent, "inconsistent"},
     {reason_unchecked, "unchecked"},
     {reason_low_parallax, "low parallax"},
     {reason_tilt, "tilt"},
     {reason_ambiguous, "ambiguous"},
     {reason_speckle, "speckle"},
     {reason_filled, "filled"},
     {reason_low_confidence, "low confidence"}}};

/// Result for one reference view. All maps have the view's size.
struct ViewResult {
  cv::Mat hypotheses;  ///< CV_32FC4 (m, cost): plane {X : m . X = 1} in the camera frame, 1/metres;
                       ///< cost 2 = none
  cv::Mat
      distance;  ///< CV_32FC1, metres along the unit ray, 0 where there is no plane; not filtered
  cv::Mat normals;  ///< CV_32FC3, unit, camera frame, facing the camera; 0 where there is no plane
  cv::Mat cost;     ///< CV_32FC1, 1 - ZNCC in [0, 2]
  /// CV_32FC2: relative difference of distance (share) and displacement (pixels) between the
  /// pixel's point and where the best agreeing source view's own plane puts it, 999 at most;
  /// 1000 where that cannot be measured. Of a filled pixel: those of the plane that was rejected.
  cv::Mat differences;
  /// CV_32FC1 in [0, 1]: probability that the pixel's point lies within 2 px of its true place in
  /// the source view, rejected or not; 0 where there is no plane or it was filled.
  cv::Mat confidence;
  cv::Mat reasons;  ///< CV_16UC1, Reason bits; 0 = accepted
  double gain = 1;  ///< by which the view's intensities were multiplied (Options::max_gain)
};

/// Work of a kernel, counted from the order of kernels and the parameters for comparing times with
/// what a device can do: all pixels count, and all patches with full windows, so that a kernel may
/// do somewhat less. Regressions, which ask wider neighbourhoods where smaller ones do not tell,
/// count with the fewest.
struct KernelWork {
  double samples = 0;  ///< patch samples, those in all source views together
  /// Single-precision additions, multiplications, divisions, roots and elementary functions of
  /// patches and regressions; what else kernels compute is not counted.
  double operations = 0;
  double texels = 0;  ///< of source images that the samples blend, four each
  /// What moves to and from memory if every launch reads and writes each pixel of its maps once.
  double bytes = 0;

  KernelWork& operator+=(const KernelWork& other) {
    samples += other.samples;
    operations += other.operations;
    texels += other.texels;
    bytes += other.bytes;
    return *this;
  }
  KernelWork& operator*=(double factor) {
    for (double* sum : {&samples, &operations, &texels, &bytes}) *sum *= factor;
    return *this;
  }
};

struct KernelTime {
  std::string kernel;
  int dispatches = 0;
  double milliseconds = 0;  ///< device time, summed; 0 where kernels are not timed, or the
                            ///< device has no clock
  KernelWork work = {};     ///< summed
};

struct StereoResult {
  std::vector<ViewResult> views;   ///< one for each view of the rig
  std::vector<KernelTime> times;   ///< per kernel, in order of first use
  double milliseconds = 0;         ///< wall time of match(), uploads and downloads included
  double device_milliseconds = 0;  ///< of the kernels together; 0 where the device has no clock
  long long samples = 0;         ///< patch samples of the schedule at full windows (an upper bound)
  std::size_t device_bytes = 0;  ///< memory taken on the device
  Filter filter = Filter::exact;  ///< that was used: Options::filter where the device has it
  int levels = 1;                 ///< of the image pyramid: Options::levels, or by size
};

/// `distance` with rejected pixels (reasons != 0) that were not filled set to 0. Throws Error where
/// the two maps are not there or do not fit.
cv::Mat accepted_distance(const ViewResult& view);

/// How a frame of a sequence starts from the frame before it.
struct WarmStart {
  /// How points moved in the rig's frame (that of View::world_from_camera, metres) since then:
  /// X now = T X previous, so for poses P of the rig in the world: P(now)^-1 P(previous). Left out
  /// where unknown: the planes then start where they were. A rotation and a translation, or
  /// matching throws Error.
  std::optional<Eigen::Isometry3d> now_from_previous = std::nullopt;
  /// ViewResult::hypotheses of the previous frame, one for each view; empty: those of this
  /// matcher's last match, which are still on the device.
  std::vector<cv::Mat> hypotheses = {};
  /// Number of the frame in its sequence; every number draws other random numbers.
  int frame = 1;
};

/// Matches images of one rig; made once, used for many frames of the same sizes.
/// Not thread-safe, nor to be called from its own Progress; matchers are independent of each other,
/// also those of one device in different threads, and must not outlive their device.
class Matcher {
 public:
  /// Called between submissions with the share done in [0, 1]. What it throws ends the match.
  using Progress = std::function<void(double)>;

  /// Views that a rig may have; where Options::levels asks for four levels it is 12, for five 9,
  /// for six 8, for seven or eight 6.
  static constexpr int most_views = 15;

  /// Throws Error when the rig or the options are invalid or the device lacks memory or a feature.
  Matcher(Device& device, const Rig& rig, const Options& options);
  ~Matcher();
  Matcher(Matcher&&) noexcept;
  Matcher& operator=(Matcher&&) noexcept;

  /// One image per view: 8 or 16 bit, or floats in [0, 1], grey or colour. The same seed gives the
  /// same bits on one device. Throws Error for images that do not fit, and NoOverlap where no view
  /// sees what another one does.
  StereoResult match(const std::vector<cv::Mat>& images, const Progress& progress = {});
  StereoResult match(const cv::Mat& left, const cv::Mat& right, const Progress& progress = {}) {
    return match(std::vector<cv::Mat>{left, right}, progress);
  }

  /// The same for the next frame of a sequence, from the previous frame's planes instead of from
  /// none (Options::warm_iterations): a fraction of the work where most of the scene was seen
  /// before. The first time, drivers of Vulkan compile what it needs besides. Throws Error where
  /// there are no such planes, and where match() does.
  StereoResult match_next(const std::vector<cv::Mat>& images, const WarmStart& start,
                          const Progress& progress = {});

  /// Whether each kernel is timed (StereoResult::times), as it is unless this says otherwise. A
  /// GPU then finishes each before the next. Without, CUDA devices let those of different views
  /// overlap where there is no progress function, as a CudaMatcher does, and Vulkan devices start
  /// each as soon as barriers allow, as in a VulkanMatcher's commands. The CPU back end times
  /// them in any case, CUDA devices do where there is a progress function.
  void time_kernels(bool each);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace widestereo
