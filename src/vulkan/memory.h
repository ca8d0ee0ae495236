// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/types.hpp>
#include <string>

#include "vulkan/context.h"

namespace widestereo {

/// A buffer with memory of its own; `mapped` is set for host memory, as long as the buffer lives.
struct Buffer {
  Handle<VkDeviceMemory> memory;  // before the buffer: freed after it
  Handle<VkBuffer> handle;
  VkDeviceSize bytes = 0;
  void* mapped = nullptr;
};

/// A buffer that kernels read and write as one array of a float or of four: as a storage buffer,
/// or, with a view, as a texel buffer.
struct MapBuffer {
  Buffer buffer;
  Handle<VkBufferView> view;
};

/// A 2D array image with memory of its own and a view of all layers.
struct LayeredImage {
  Handle<VkDeviceMemory> memory;
  Handle<VkImage> handle;
  Handle<VkImageView> view;
  VkDeviceSize bytes = 0;
};

/// `purpose` names the object in messages. All throw Error naming the device and what is missing.
Buffer make_device_buffer(const VulkanContext& context, VkDeviceSize bytes,
                          VkBufferUsageFlags usage, const std::string& purpose);

/// `format`: of its elements; `type`: of its descriptors.
MapBuffer make_map_buffer(const VulkanContext& context, VkDeviceSize elements, VkFormat format,
                          VkDescriptorType type, const std::string& purpose);

/// Host-visible, coherent and, where there is such memory, cached: for uploads and downloads.
Buffer make_staging_buffer(const VulkanContext& context, VkDeviceSize bytes);

LayeredImage make_image(const VulkanContext& context, VkFormat format, cv::Size size, int layers,
                        VkImageUsageFlags usage, const std::string& purpose);

}  // namespace widestereo
