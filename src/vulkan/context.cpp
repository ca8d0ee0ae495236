// SPDX-License-Identifier: MIT
#include "vulkan/context.h"

#include "vulkan/physical_device.h"
#include "vulkan/result.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

[[noreturn]] void refuse_old_instance() {
  throw Error(
      "The Vulkan instance was made for Vulkan 1.0; set VkApplicationInfo::apiVersion to "
      "VK_API_VERSION_1_1 or newer.");
}

/// The handles of an application, none of which may be missing.
const VulkanHandles& complete(const VulkanHandles& handles) {
  const auto require = [](bool given, const std::string& name) {
    if (given) return;
    throw Error("The Vulkan handles have no " + name + "; set VulkanHandles::" + name + ".");
  };
  require(handles.get_instance_proc_addr != nullptr, "get_instance_proc_addr");
  require(handles.instance != VK_NULL_HANDLE, "instance");
  require(handles.physical_device != VK_NULL_HANDLE, "physical_device");
  require(handles.device != VK_NULL_HANDLE, "device");
  require(handles.queue != VK_NULL_HANDLE, "queue");
  // Drivers themselves have no such function for an instance of Vulkan 1.0.
  if (handles.get_instance_proc_addr(handles.instance, "vkGetPhysicalDeviceProperties2") ==
      nullptr) {
    refuse_old_instance();
  }
  return handles;
}

}  // namespace

VulkanContext::VulkanContext(PFN_vkGetInstanceProcAddr get, VkInstance instance,
                             VkPhysicalDevice physical_device)
    : handles_{.get_instance_proc_addr = get,
               .instance = instance,
               .physical_device = physical_device},
      instance_functions_(InstanceFunctions::load(get, instance)) {
  require_usable();
  handles_.queue_family = compute_queue_family(instance_functions_, physical_device).value();
  create_device();
  load_functions();
  functions_.vkGetDeviceQueue(handles_.device, handles_.queue_family, 0, &handles_.queue);
}

VulkanContext::VulkanContext(const VulkanHandles& adopted)
    : handles_(complete(adopted)),
      instance_functions_(
          InstanceFunctions::load(adopted.get_instance_proc_addr, adopted.instance)) {
  require_usable();
  // The loader's function leaves out what is newer than Vulkan 1.0 then; every device has a limit.
  if (largest_allocation_ == 0) refuse_old_instance();
  const std::string why =
      why_no_compute(instance_functions_, handles_.physical_device, handles_.queue_family);
  if (!why.empty()) throw Error("The Vulkan device " + name() + " " + why);
  load_functions();
}

void VulkanContext::require_usable() {
  properties_ = properties_of(instance_functions_, handles_.physical_device);
  const std::string why = why_unusable(instance_functions_, handles_.physical_device);
  if (!why.empty()) throw Error("The Vulkan device " + name() + " cannot be used: " + why);
  largest_allocation_ =
      widestereo::largest_allocation(instance_functions_, handles_.physical_device);
}

void VulkanContext::create_device() {
  const float priority = 1;
  VkDeviceQueueCreateInfo queue{};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = handles_.queue_family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkDeviceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  // Must be enabled where it is offered; its macro is behind VK_ENABLE_BETA_EXTENSIONS.
  constexpr const char* portability_subset = "VK_KHR_portability_subset";
  if (has_device_extension(instance_functions_, handles_.physical_device, portability_subset)) {
    info.enabledExtensionCount = 1;
    info.ppEnabledExtensionNames = &portability_subset;
  }
  handles_.extended_storage_formats =
      has_extended_storage_formats(instance_functions_, handles_.physical_device);
  VkPhysicalDeviceFeatures features{};
  features.shaderStorageImageExtendedFormats =
      handles_.extended_storage_formats ? VK_TRUE : VK_FALSE;
  info.pEnabledFeatures = &features;
  check(instance_functions_.vkCreateDevice(handles_.physical_device, &info, nullptr,
                                           &handles_.device),
        "be opened");
  owned_.device = handles_.device;
  owned_.destroy = reinterpret_cast<PFN_vkDestroyDevice>(
      instance_functions_.vkGetDeviceProcAddr(handles_.device, "vkDestroyDevice"));
}

void VulkanContext::load_functions() {
  timestamp_bits_ = widestereo::timestamp_bits(instance_functions_, handles_.physical_device,
                                               handles_.queue_family);
  functions_ = DeviceFunctions::load(instance_functions_.vkGetDeviceProcAddr, handles_.device);
}

DeviceInfo VulkanContext::info() const {
  DeviceInfo info = describe(instance_functions_, handles_.physical_device, 0);
  // An application may not have enabled what the device offers.
  info.filters_intensities = info.filters_intensities && filters_intensities();
  return info;
}

VkImageFormatProperties VulkanContext::image_limits(VkFormat format,
                                                    VkImageUsageFlags usage) const {
  VkImageFormatProperties limits{};
  const VkResult result = instance_functions_.vkGetPhysicalDeviceImageFormatProperties(
      handles_.physical_device, format, VK_IMAGE_TYPE_2D, VK_IMAGE_TILING_OPTIMAL, usage, 0,
      &limits);
  return result == VK_SUCCESS ? limits : VkImageFormatProperties{};
}

bool VulkanContext::filters_intensities() const {
  return filters_half_precision() ||
         widestereo::filters_intensities(instance_functions_, handles_.physical_device);
}

bool VulkanContext::filters_half_precision() const {
  return handles_.extended_storage_formats &&
         widestereo::filters_half_precision(instance_functions_, handles_.physical_device);
}

std::uint32_t VulkanContext::memory_type(std::uint32_t allowed,
                                         VkMemoryPropertyFlags wanted) const {
  VkPhysicalDeviceMemoryProperties memory{};
  instance_functions_.vkGetPhysicalDeviceMemoryProperties(handles_.physical_device, &memory);
  for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    const bool offers = (memory.memoryTypes[i].propertyFlags & wanted) == wanted;
    if ((allowed >> i & 1) != 0 && offers) return i;
  }
  return VK_MAX_MEMORY_TYPES;
}

VkResult VulkanContext::submit(const VkSubmitInfo& info, VkFence fence) const {
  const std::lock_guard lock(queue_mutex_);
  return functions_.vkQueueSubmit(handles_.queue, 1, &info, fence);
}

void VulkanContext::check(VkResult result, const std::string& action) const {
  widestereo::check(result, "The Vulkan device " + name(), action);
}

}  // namespace widestereo
