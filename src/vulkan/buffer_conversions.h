// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "vulkan/pipeline_cache.h"
#include "vulkan/vulkan_backend.h"

namespace widestereo {

/// An image or a map of a view in an application's buffer.
struct BufferConversion {
  enum class Direction { import_image, export_map };
  Direction direction = Direction::import_image;
  int view = 0;
  int kind = 0;  ///< PIXEL_GREY8 and the like, or MAP_DISTANCE and the like (shaders/maps.glsl)
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceSize offset = 0;     ///< of the first pixel, bytes
  VkDeviceSize pitch = 0;      ///< bytes from row to row
  VkDeviceSize row_bytes = 0;  ///< of a row's pixels
};

/// Conversions with the descriptors that they need.
struct BoundConversions {
  struct One {
    BufferConversion conversion;
    kernel::BufferRows rows{};
    VkDescriptorSet set = VK_NULL_HANDLE;  // belongs to the pool
  };
  Handle<VkDescriptorPool> pool;
  std::vector<One> all;
};

/// The kernels between an application's buffers and a back end's maps. Context and back end must
/// outlive it.
class BufferConversions {
 public:
  BufferConversions(const VulkanContext& context, const VulkanBackend& backend,
                    const std::vector<cv::Size>& sizes, const PipelineCache& cache);

  /// Throws Error where the device cannot reach so much of a buffer.
  BoundConversions bind(std::span<const BufferConversion> conversions) const;
  /// Records those of one direction; the schedule's parameters must have been recorded before.
  void record(VkCommandBuffer commands, const BoundConversions& bound,
              BufferConversion::Direction direction) const;

 private:
  const VulkanContext& context_;
  const VulkanBackend& backend_;
  std::vector<cv::Size> sizes_;
  Handle<VkDescriptorSetLayout> set_layout_;
  Handle<VkPipelineLayout> layout_;
  Handle<VkPipeline> import_;
  Handle<VkPipeline> export_;
};

}  // namespace widestereo
