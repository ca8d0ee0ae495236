// SPDX-License-Identifier: MIT
// Matching inside a CUDA application: its stream, its device memory, no copies through the host.
//
//   widestereo::CudaMatcher matcher(rig, options);        // once
//   widestereo::CudaImage images[] = {{left, left_pitch}, {right, right_pitch}};
//   widestereo::CudaViewMaps maps[2];
//   maps[0].distance = {distance, distance_pitch};        // what is left out is not written
//   matcher.enqueue(images, maps, stream);                // per frame; returns at once
//   matcher.enqueue_next(images, maps, stream, {motion}); // or from the planes of the frame before
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <memory>
#include <optional>
#include <span>

#include "widestereo/cuda_maps.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"

struct CUstream_st;  // cudaStream_t is a pointer to it

namespace widestereo {

/// How a frame starts from the frame before it. What is given by value is fixed when it is
/// enqueued, also in a graph that captures it; for a graph that is launched frame after frame, give
/// the motion in device memory and leave the frame's number out.
struct CudaWarmStart {
  /// As WarmStart::now_from_previous; left out where unknown.
  std::optional<Eigen::Isometry3d> now_from_previous = std::nullopt;
  /// The first three rows of the same matrix, row after row (12 values), in device memory, instead:
  /// read when the work runs. Aligned as double.
  const double* device_now_from_previous = nullptr;
  /// As WarmStart::frame. Left out: counted on the device, one more than that of the matcher's
  /// warm start that ran before, from 1 on.
  std::optional<int> frame = std::nullopt;
};

/// Matches images of one rig on an application's streams. Not thread-safe; frames of one matcher
/// must follow each other: on one stream, or on several that wait for each other. Results equal a
/// Matcher's on the same device whose Options::max_gain is 1.
class CudaMatcher {
 public:
  /// The device and context that are current in the calling thread.
  static constexpr int current_device = -1;

  /// Allocates all memory and waits for the device; compiles nothing, unless the device is newer
  /// than those that the library was built for: its driver then does, once. With `current_device`
  /// the same context must be current in every later call, the destructor included; with an ordinal
  /// of the CUDA runtime its primary context is used and the thread's current device is left as it
  /// was; where contexts made by cuCtxCreate() may be current, give `current_device`. Throws Error
  /// when the rig, the options or the device do not do, or CUDA is not in this build.
  CudaMatcher(const Rig& rig, const Options& options, int device = current_device);
  /// The work enqueued must have finished, and graphs that captured some must not be launched
  /// afterwards: they use the matcher's memory. Assigning another matcher does the same.
  ~CudaMatcher();
  CudaMatcher(CudaMatcher&&) noexcept;
  CudaMatcher& operator=(CudaMatcher&&) noexcept;

  /// Enqueues one match: reads the images, one for each view, and writes the maps, likewise.
  /// Neither waits nor allocates device memory, and may be captured into a graph of the
  /// application's. Throws Error for images or maps that do not fit, and for the default stream
  /// while a blocking stream captures; where nothing overlaps, all costs are 2.
  void enqueue(std::span<const CudaImage> images, std::span<const CudaViewMaps> maps,
               CUstream_st* stream);

  /// The same for the next frame of a sequence, from the planes that the last frame enqueued leaves
  /// on the device, as Matcher::match_next() does: a fraction of the work. Throws Error where no
  /// frame was enqueued before. In a captured graph it starts from whatever ran before the graph.
  void enqueue_next(std::span<const CudaImage> images, std::span<const CudaViewMaps> maps,
                    CUstream_st* stream, const CudaWarmStart& start = {});

  /// That is used, as VulkanMatcher::filter().
  Filter filter() const;
  std::size_t device_bytes() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace widestereo
