// SPDX-License-Identifier: MIT
#include "vulkan/memory.h"

#include "text/mebibytes.h"
#include "text/size_text.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

VkDeviceSize bytes_of(VkFormat format) {
  return format == VK_FORMAT_R16_SFLOAT ? 2 : format == VK_FORMAT_R32_SFLOAT ? 4 : 16;
}

void require_limit(const VulkanContext& context, VkDeviceSize bytes, const std::string& limit,
                   VkDeviceSize offered, const std::string& purpose) {
  if (bytes <= offered) return;
  throw Error("The Vulkan device " + context.name() + " cannot hold " + purpose + " of " +
              mebibytes(bytes) + ": its " + limit + " is " + mebibytes(offered) +
              "; use smaller images or another device.");
}

Handle<VkDeviceMemory> allocate(const VulkanContext& context,
                                const VkMemoryRequirements& requirements, std::uint32_t type,
                                const std::string& purpose) {
  require_limit(context, requirements.size, "maxMemoryAllocationSize", context.largest_allocation(),
                purpose);
  VkMemoryAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  info.allocationSize = requirements.size;
  info.memoryTypeIndex = type;
  VkDeviceMemory memory = VK_NULL_HANDLE;
  context.check(context.vk().vkAllocateMemory(context.device(), &info, nullptr, &memory),
                "allocate " + mebibytes(requirements.size) + " for " + purpose);
  return context.own(memory, context.vk().vkFreeMemory);
}

/// Device memory is a wish: where none is allowed, any type will do.
std::uint32_t device_memory_type(const VulkanContext& context, std::uint32_t allowed) {
  const std::uint32_t type = context.memory_type(allowed, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT);
  return type < VK_MAX_MEMORY_TYPES ? type : context.memory_type(allowed, 0);
}

/// A coherent host type exists on every device.
std::uint32_t host_memory_type(const VulkanContext& context, std::uint32_t allowed) {
  constexpr VkMemoryPropertyFlags coherent =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  const std::uint32_t cached =
      context.memory_type(allowed, coherent | VK_MEMORY_PROPERTY_HOST_CACHED_BIT);
  return cached < VK_MAX_MEMORY_TYPES ? cached : context.memory_type(allowed, coherent);
}

Buffer make_buffer(const VulkanContext& context, VkDeviceSize bytes, VkBufferUsageFlags usage,
                   std::uint32_t (*choose_type)(const VulkanContext&, std::uint32_t),
                   const std::string& purpose) {
  const DeviceFunctions& vk = context.vk();
  VkBufferCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = bytes;
  info.usage = usage;
  info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  VkBuffer buffer = VK_NULL_HANDLE;
  context.check(vk.vkCreateBuffer(context.device(), &info, nullptr, &buffer), "make " + purpose);
  Buffer result;
  result.handle = context.own(buffer, vk.vkDestroyBuffer);
  VkMemoryRequirements requirements{};
  vk.vkGetBufferMemoryRequirements(context.device(), buffer, &requirements);
  result.memory =
      allocate(context, requirements, choose_type(context, requirements.memoryTypeBits), purpose);
  result.bytes = requirements.size;
  context.check(vk.vkBindBufferMemory(context.device(), buffer, result.memory.get(), 0),
                "bind the memory of " + purpose);
  return result;
}

void require_image_limits(const VulkanContext& context, VkFormat format, cv::Size size, int layers,
                          VkImageUsageFlags usage, const std::string& purpose) {
  const VkImageFormatProperties limits = context.image_limits(format, usage);
  if (limits.maxExtent.width == 0) {
    throw Error("The Vulkan device " + context.name() + " has no images of the format " +
                std::to_string(format) + " for " + purpose +
                "; update its driver or use another device.");
  }
  const auto refuse = [&](const std::string& limit, const std::string& offered) {
    throw Error("The Vulkan device " + context.name() + " cannot hold " + purpose + " (" +
                size_text(size.width, size.height) + " pixels, " + std::to_string(layers) +
                " layers): its " + limit + " is " + offered +
                "; use smaller images or another device.");
  };
  if (size.width > static_cast<long long>(limits.maxExtent.width)) {
    refuse("largest image width", std::to_string(limits.maxExtent.width));
  }
  if (size.height > static_cast<long long>(limits.maxExtent.height)) {
    refuse("largest image height", std::to_string(limits.maxExtent.height));
  }
  if (layers > static_cast<long long>(limits.maxArrayLayers)) {
    refuse("maxImageArrayLayers", std::to_string(limits.maxArrayLayers));
  }
  const VkDeviceSize bytes = bytes_of(format) * static_cast<VkDeviceSize>(size.width) *
                             static_cast<VkDeviceSize>(size.height) *
                             static_cast<VkDeviceSize>(layers);
  if (bytes > limits.maxResourceSize) refuse("maxResourceSize", mebibytes(limits.maxResourceSize));
}

}  // namespace

Buffer make_device_buffer(const VulkanContext& context, VkDeviceSize bytes,
                          VkBufferUsageFlags usage, const std::string& purpose) {
  if ((usage & VK_BUFFER_USAGE_STORAGE_BUFFER_BIT) != 0) {
    require_limit(context, bytes, "maxStorageBufferRange",
                  context.properties().limits.maxStorageBufferRange, purpose);
  }
  return make_buffer(context, bytes, usage, device_memory_type, purpose);
}

MapBuffer make_map_buffer(const VulkanContext& context, VkDeviceSize elements, VkFormat format,
                          VkDescriptorType type, const std::string& purpose) {
  const VkDeviceSize bytes_of_element = bytes_of(format);
  const VkDeviceSize bytes = elements * bytes_of_element;
  constexpr VkBufferUsageFlags transfers =
      VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  MapBuffer map;
  if (type == VK_DESCRIPTOR_TYPE_STORAGE_BUFFER) {
    map.buffer =
        make_device_buffer(context, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | transfers, purpose);
    return map;
  }
  require_limit(context, bytes,
                "maxTexelBufferElements times " + std::to_string(bytes_of_element) + " bytes",
                context.properties().limits.maxTexelBufferElements * bytes_of_element, purpose);
  map.buffer = make_device_buffer(context, bytes,
                                  VK_BUFFER_USAGE_STORAGE_TEXEL_BUFFER_BIT | transfers, purpose);
  VkBufferViewCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO;
  info.buffer = map.buffer.handle.get();
  info.format = format;
  info.range = VK_WHOLE_SIZE;
  VkBufferView view = VK_NULL_HANDLE;
  context.check(context.vk().vkCreateBufferView(context.device(), &info, nullptr, &view),
                "make a view of " + purpose);
  map.view = context.own(view, context.vk().vkDestroyBufferView);
  return map;
}

Buffer make_staging_buffer(const VulkanContext& context, VkDeviceSize bytes) {
  Buffer buffer = make_buffer(context, bytes,
                              VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT,
                              host_memory_type, "the staging buffer");
  context.check(context.vk().vkMapMemory(context.device(), buffer.memory.get(), 0, VK_WHOLE_SIZE, 0,
                                         &buffer.mapped),
                "map the staging buffer");
  return buffer;
}

LayeredImage make_image(const VulkanContext& context, VkFormat format, cv::Size size, int layers,
                        VkImageUsageFlags usage, const std::string& purpose) {
  require_image_limits(context, format, size, layers, usage, purpose);
  const DeviceFunctions& vk = context.vk();
  VkImageCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_CREATE_INFO;
  info.imageType = VK_IMAGE_TYPE_2D;
  info.format = format;
  info.extent = {static_cast<std::uint32_t>(size.width), static_cast<std::uint32_t>(size.height),
                 1};
  info.mipLevels = 1;
  info.arrayLayers = static_cast<std::uint32_t>(layers);
  info.samples = VK_SAMPLE_COUNT_1_BIT;
  info.tiling = VK_IMAGE_TILING_OPTIMAL;
  info.usage = usage;
  info.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
  info.initialLayout = VK_IMAGE_LAYOUT_UNDEFINED;
  VkImage image = VK_NULL_HANDLE;
  context.check(vk.vkCreateImage(context.device(), &info, nullptr, &image), "make " + purpose);
  LayeredImage result;
  result.handle = context.own(image, vk.vkDestroyImage);

  VkMemoryRequirements requirements{};
  vk.vkGetImageMemoryRequirements(context.device(), image, &requirements);
  result.memory = allocate(context, requirements,
                           device_memory_type(context, requirements.memoryTypeBits), purpose);
  result.bytes = requirements.size;
  context.check(vk.vkBindImageMemory(context.device(), image, result.memory.get(), 0),
                "bind the memory of " + purpose);

  VkImageViewCreateInfo view_info{};
  view_info.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
  view_info.image = image;
  view_info.viewType = VK_IMAGE_VIEW_TYPE_2D_ARRAY;
  view_info.format = format;
  view_info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, info.arrayLayers};
  VkImageView view = VK_NULL_HANDLE;
  context.check(vk.vkCreateImageView(context.device(), &view_info, nullptr, &view),
                "make a view of " + purpose);
  result.view = context.own(view, vk.vkDestroyImageView);
  return result;
}

}  // namespace widestereo
