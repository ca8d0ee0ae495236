// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <mutex>
#include <string>

#include "vulkan/functions.h"
#include "vulkan/handle.h"
#include "widestereo/device.h"
#include "widestereo/vulkan.h"

namespace widestereo {

/// A device with one compute queue, its own or an application's, and the functions to drive it.
class VulkanContext {
 public:
  /// Makes a device of its own. Throws Error naming what the physical device lacks.
  VulkanContext(PFN_vkGetInstanceProcAddr get, VkInstance instance,
                VkPhysicalDevice physical_device);
  /// Uses an application's device. Throws Error naming what it lacks.
  explicit VulkanContext(const VulkanHandles& adopted);
  VulkanContext(const VulkanContext&) = delete;
  VulkanContext& operator=(const VulkanContext&) = delete;

  const VulkanHandles& handles() const { return handles_; }
  const DeviceFunctions& vk() const { return functions_; }
  VkDevice device() const { return handles_.device; }
  VkQueue queue() const { return handles_.queue; }
  std::uint32_t queue_family() const { return handles_.queue_family; }
  const VkPhysicalDeviceProperties& properties() const { return properties_; }
  std::string name() const { return properties_.deviceName; }
  DeviceInfo info() const;
  std::uint32_t timestamp_bits() const { return timestamp_bits_; }  ///< 0: cannot measure time

  /// Largest extent and layer count of such an image; zeros where it is not supported at all.
  VkImageFormatProperties image_limits(VkFormat format, VkImageUsageFlags usage) const;
  /// Whether images of intensities can be filtered, in half precision if so.
  bool filters_intensities() const;
  bool filters_half_precision() const;
  VkDeviceSize largest_allocation() const { return largest_allocation_; }  ///< bytes
  /// First memory type of `allowed` with all of `wanted`, or VK_MAX_MEMORY_TYPES.
  std::uint32_t memory_type(std::uint32_t allowed, VkMemoryPropertyFlags wanted) const;
  /// Hands commands to the queue, from one thread at a time: all matchers of a device share it.
  VkResult submit(const VkSubmitInfo& info, VkFence fence) const;
  /// Throws Error when a call failed; `action` completes "could not ...".
  void check(VkResult result, const std::string& action) const;

  template <class T>
  Handle<T> own(T object, typename Handle<T>::Destroy destroy) const {
    return Handle<T>(handles_.device, object, destroy);
  }

 private:
  void require_usable();
  void create_device();
  void load_functions();

  /// Destroys the device when it is ours.
  struct OwnedDevice {
    VkDevice device = VK_NULL_HANDLE;
    PFN_vkDestroyDevice destroy = nullptr;
    ~OwnedDevice() {
      if (destroy != nullptr) destroy(device, nullptr);
    }
  };

  VulkanHandles handles_;
  InstanceFunctions instance_functions_;
  VkPhysicalDeviceProperties properties_{};
  OwnedDevice owned_;
  DeviceFunctions functions_;
  std::uint32_t timestamp_bits_ = 0;
  VkDeviceSize largest_allocation_ = 0;
  mutable std::mutex queue_mutex_;
};

}  // namespace widestereo
