// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "vulkan/context.h"

namespace widestereo {

/// Of command buffers that are recorded again and again.
Handle<VkCommandPool> make_command_pool(const VulkanContext& context);

/// A command buffer of our own with the fence that tells when it has finished and timestamps in
/// between.
class Submission {
 public:
  Submission(const VulkanContext& context, VkCommandPool pool, std::uint32_t max_timestamps);
  ~Submission();
  Submission(const Submission&) = delete;
  Submission& operator=(const Submission&) = delete;

  /// Starts recording; waits for the end of what is still in flight. What was recorded and, as
  /// something failed, not submitted is dropped.
  VkCommandBuffer begin();
  /// Notes the time when all earlier commands have finished. Does nothing on devices without a
  /// clock.
  void write_timestamp();
  /// Ends recording and submits.
  void submit();
  bool in_flight() const { return in_flight_; }
  /// Waits for the end, if in flight.
  void wait();
  /// Likewise, for whoever must not throw; a lost device counts as finished.
  VkResult finish();
  /// Milliseconds between each two consecutive timestamps of the finished submission; empty without
  /// a clock.
  std::vector<double> elapsed() const;

 private:
  const VulkanContext& context_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;  // belongs to the pool
  Handle<VkFence> fence_;
  Handle<VkQueryPool> queries_;
  std::uint32_t max_timestamps_ = 0;
  std::uint32_t timestamps_ = 0;
  bool recording_ = false;
  bool in_flight_ = false;
};

}  // namespace widestereo
