// SPDX-License-Identifier: MIT
#include "vulkan/physical_device.h"

#include <algorithm>
#include <cstring>
#include <vector>

#include "kernel/host.h"
#include "text/hexadecimal.h"
#include "vulkan/formats.h"

namespace widestereo {
namespace {

// Storage images and texel buffers of a stage, with those of conversions.
constexpr std::uint32_t images_of_loading = 6;

std::vector<VkQueueFamilyProperties> queue_families(const InstanceFunctions& vk,
                                                    VkPhysicalDevice device) {
  std::uint32_t count = 0;
  vk.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  vk.vkGetPhysicalDeviceQueueFamilyProperties(device, &count, families.data());
  return families;
}

std::string type_name(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return "discrete gpu";
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return "integrated gpu";
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return "virtual gpu";
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return "cpu";
    default:
      return "other";
  }
}

std::string version_text(std::uint32_t version) {
  return std::to_string(VK_API_VERSION_MAJOR(version)) + "." +
         std::to_string(VK_API_VERSION_MINOR(version)) + "." +
         std::to_string(VK_API_VERSION_PATCH(version));
}

std::string too_low(const char* limit, std::uint64_t needed, std::uint64_t offered) {
  return std::string(limit) + " is " + std::to_string(offered) + ", but " + std::to_string(needed) +
         " is needed; use another device.";
}

bool has_format(const InstanceFunctions& vk, VkPhysicalDevice device, VkFormat format,
                VkFormatFeatureFlags features) {
  VkFormatProperties properties{};
  vk.vkGetPhysicalDeviceFormatProperties(device, format, &properties);
  return (properties.optimalTilingFeatures & features) == features;
}

}  // namespace

bool filters_intensities(const InstanceFunctions& vk, VkPhysicalDevice device) {
  return has_format(vk, device, intensity_format,
                    VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);
}

bool has_extended_storage_formats(const InstanceFunctions& vk, VkPhysicalDevice device) {
  VkPhysicalDeviceFeatures features{};
  vk.vkGetPhysicalDeviceFeatures(device, &features);
  return features.shaderStorageImageExtendedFormats == VK_TRUE;
}

bool filters_half_precision(const InstanceFunctions& vk, VkPhysicalDevice device) {
  return has_format(vk, device, format_of_filtered_texels,
                    VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT |
                        VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT |
                        VK_FORMAT_FEATURE_TRANSFER_DST_BIT);
}

VkPhysicalDeviceProperties properties_of(const InstanceFunctions& vk, VkPhysicalDevice device) {
  VkPhysicalDeviceProperties properties{};
  vk.vkGetPhysicalDeviceProperties(device, &properties);
  return properties;
}

VkDeviceSize largest_allocation(const InstanceFunctions& vk, VkPhysicalDevice device) {
  VkPhysicalDeviceMaintenance3Properties limits{};
  limits.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES;
  VkPhysicalDeviceProperties2 properties{};
  properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  properties.pNext = &limits;
  vk.vkGetPhysicalDeviceProperties2(device, &properties);
  return limits.maxMemoryAllocationSize;
}

bool has_device_extension(const InstanceFunctions& vk, VkPhysicalDevice device, const char* name) {
  std::uint32_t count = 0;
  if (vk.vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr) != VK_SUCCESS) {
    return false;
  }
  std::vector<VkExtensionProperties> extensions(count);
  if (vk.vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data()) !=
      VK_SUCCESS) {
    return false;
  }
  return std::any_of(extensions.begin(), extensions.end(), [name](const auto& extension) {
    return std::strcmp(extension.extensionName, name) == 0;
  });
}

std::optional<std::uint32_t> compute_queue_family(const InstanceFunctions& vk,
                                                  VkPhysicalDevice device) {
  const auto merit = [](const VkQueueFamilyProperties& family) {
    return (family.timestampValidBits > 0 ? 2 : 0) +
           ((family.queueFlags & VK_QUEUE_GRAPHICS_BIT) == 0 ? 1 : 0);
  };
  std::optional<std::uint32_t> best;
  const auto families = queue_families(vk, device);
  for (std::uint32_t i = 0; i < families.size(); ++i) {
    if ((families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) continue;
    if (!best || merit(families[i]) > merit(families[*best])) best = i;
  }
  return best;
}

std::string why_no_compute(const InstanceFunctions& vk, VkPhysicalDevice device,
                           std::uint32_t queue_family) {
  const auto families = queue_families(vk, device);
  const std::string family = "queue family " + std::to_string(queue_family);
  if (queue_family >= families.size()) {
    return "has no " + family + ", only " + std::to_string(families.size()) +
           ", counted from 0; give the family of the queue.";
  }
  if ((families[queue_family].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) {
    return "has a " + family + " that cannot compute; give a queue of another family.";
  }
  return "";
}

std::uint32_t timestamp_bits(const InstanceFunctions& vk, VkPhysicalDevice device,
                             std::uint32_t queue_family) {
  return queue_families(vk, device).at(queue_family).timestampValidBits;
}

bool loads_texels(const VkPhysicalDeviceProperties& properties) {
  return properties.deviceType == VK_PHYSICAL_DEVICE_TYPE_CPU &&
         properties.limits.maxPerStageDescriptorStorageImages >= images_of_loading;
}

std::string why_unusable(const InstanceFunctions& vk, VkPhysicalDevice device) {
  const VkPhysicalDeviceProperties properties = properties_of(vk, device);
  const VkPhysicalDeviceLimits& limits = properties.limits;
  if (properties.apiVersion < VK_API_VERSION_1_1) {
    return "it offers Vulkan " + version_text(properties.apiVersion) +
           ", but 1.1 is needed; update the driver.";
  }
  if (!compute_queue_family(vk, device)) return "it has no compute queue; use another device.";
  const bool loads = loads_texels(properties);
  if (loads &&
      !has_format(vk, device, format_of_loaded_texels,
                  VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT | VK_FORMAT_FEATURE_TRANSFER_DST_BIT)) {
    return "it lacks storage images of four 32-bit floats; use another device.";
  }
  if (!has_format(vk, device, intensity_format,
                  VK_FORMAT_FEATURE_SAMPLED_IMAGE_BIT | VK_FORMAT_FEATURE_STORAGE_IMAGE_BIT |
                      VK_FORMAT_FEATURE_TRANSFER_DST_BIT)) {
    return "it lacks sampled and storage images of 32-bit floats; use another device.";
  }
  if (limits.maxPushConstantsSize < sizeof(kernel::PassParameters)) {
    return too_low("maxPushConstantsSize", sizeof(kernel::PassParameters),
                   limits.maxPushConstantsSize);
  }
  if (limits.maxUniformBufferRange < sizeof(kernel::MatchParameters)) {
    return too_low("maxUniformBufferRange", sizeof(kernel::MatchParameters),
                   limits.maxUniformBufferRange);
  }
  if (limits.maxComputeWorkGroupInvocations < 128) {
    return too_low("maxComputeWorkGroupInvocations", 128, limits.maxComputeWorkGroupInvocations);
  }
  const std::uint32_t buffers = loads ? 3 : 8;
  const std::uint32_t images = loads ? images_of_loading : 1;
  if (limits.maxPerStageDescriptorStorageBuffers < buffers) {
    return too_low("maxPerStageDescriptorStorageBuffers", buffers,
                   limits.maxPerStageDescriptorStorageBuffers);
  }
  if (limits.maxPerStageDescriptorStorageImages < images) {
    return too_low("maxPerStageDescriptorStorageImages", images,
                   limits.maxPerStageDescriptorStorageImages);
  }
  return "";
}

DeviceInfo describe(const InstanceFunctions& vk, VkPhysicalDevice device, int index) {
  DeviceInfo info;
  info.kind = DeviceKind::vulkan;
  info.id = "vulkan:" + std::to_string(index);
  const VkPhysicalDeviceProperties plain = properties_of(vk, device);
  info.name = plain.deviceName;
  info.type = type_name(plain.deviceType);
  info.driver = version_text(plain.driverVersion);
  info.unusable = why_unusable(vk, device);
  if (plain.apiVersion < VK_API_VERSION_1_1) return info;
  // Devices that are programs have no texture units: exact filtering costs them less.
  info.filters_intensities =
      plain.deviceType != VK_PHYSICAL_DEVICE_TYPE_CPU &&
      (filters_intensities(vk, device) ||
       (has_extended_storage_formats(vk, device) && filters_half_precision(vk, device)));

  VkPhysicalDeviceDriverProperties driver{};
  driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
  VkPhysicalDeviceIDProperties identity{};
  identity.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_ID_PROPERTIES;
  if (has_device_extension(vk, device, VK_KHR_DRIVER_PROPERTIES_EXTENSION_NAME)) {
    identity.pNext = &driver;
  }
  VkPhysicalDeviceProperties2 properties{};
  properties.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  properties.pNext = &identity;
  vk.vkGetPhysicalDeviceProperties2(device, &properties);
  info.uuid = hexadecimal(identity.deviceUUID);
  if (driver.driverName[0] != '\0') {
    info.driver = std::string(driver.driverName) + " " + driver.driverInfo;
  }
  return info;
}

}  // namespace widestereo
