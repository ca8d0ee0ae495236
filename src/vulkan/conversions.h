// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <vector>

#include "vulkan/vulkan_backend.h"

namespace widestereo {

/// An image of a view in an application's memory to read, or a map to write.
struct Conversion {
  enum class Way { image_from_buffer, image_from_texture, map_to_buffer };
  static constexpr std::size_t ways = 3;

  std::string name;  ///< of the image or map, in messages
  Way way = Way::image_from_buffer;
  int view = 0;
  int kind = 0;  ///< PIXEL_GREY8, TEXELS_GREY, MAP_DISTANCE and the like (shaders/maps.glsl)
  // Of a buffer:
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceSize offset = 0;     ///< of the first pixel, bytes
  VkDeviceSize pitch = 0;      ///< bytes from row to row
  VkDeviceSize row_bytes = 0;  ///< of a row's pixels
  // Of a texture:
  VkImageView texture = VK_NULL_HANDLE;
  VkImageLayout layout = VK_IMAGE_LAYOUT_UNDEFINED;
};

/// Conversions with the descriptors that they need.
struct BoundConversions {
  struct One {
    Conversion::Way way = Conversion::Way::image_from_buffer;
    int view = 0;
    kernel::ConversionParameters parameters{};
    VkDescriptorSet set = VK_NULL_HANDLE;  // belongs to the pool
  };
  Handle<VkDescriptorPool> pool;
  std::vector<One> all;
};

/// The kernels between an application's memory and a back end's maps. Context and back end must
/// outlive it.
class Conversions {
 public:
  Conversions(const VulkanContext& context, const VulkanBackend& backend,
              const std::vector<cv::Size>& sizes);

  /// Throws Error where the device cannot reach so much of a buffer.
  BoundConversions bind(const std::vector<Conversion>& conversions) const;
  // The schedule's parameters must have been recorded before.
  void record_images(VkCommandBuffer commands, const BoundConversions& bound) const;
  void record_maps(VkCommandBuffer commands, const BoundConversions& bound) const;

 private:
  struct OfWay {
    Handle<VkDescriptorSetLayout> set_layout;
    Handle<VkPipelineLayout> layout;
    Handle<VkPipeline> pipeline;
  };

  BoundConversions::One bind_buffer(const Conversion& conversion, VkDescriptorSet set) const;
  BoundConversions::One bind_texture(const Conversion& conversion, VkDescriptorSet set) const;
  void record(VkCommandBuffer commands, const BoundConversions::One& one) const;

  const VulkanContext& context_;
  const VulkanBackend& backend_;
  std::vector<cv::Size> sizes_;
  std::array<OfWay, Conversion::ways> ways_;
};

}  // namespace widestereo
