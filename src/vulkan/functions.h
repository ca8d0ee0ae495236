// SPDX-License-Identifier: MIT
// Vulkan entry points as tables, one for an instance and one for a device: nothing is linked and
// nothing is global, so an application may bring its own loader and several devices.
#pragma once

#ifndef VK_NO_PROTOTYPES
#define VK_NO_PROTOTYPES
#endif
#include <vulkan/vulkan.h>

namespace widestereo {

// clang-format off
#define WIDESTEREO_INSTANCE_FUNCTIONS(X)          \
  X(vkDestroyInstance)                            \
  X(vkEnumeratePhysicalDevices)                   \
  X(vkEnumerateDeviceExtensionProperties)         \
  X(vkGetPhysicalDeviceProperties)                \
  X(vkGetPhysicalDeviceProperties2)               \
  X(vkGetPhysicalDeviceQueueFamilyProperties)     \
  X(vkGetPhysicalDeviceMemoryProperties)          \
  X(vkGetPhysicalDeviceFeatures)                  \
  X(vkGetPhysicalDeviceFormatProperties)          \
  X(vkGetPhysicalDeviceImageFormatProperties)     \
  X(vkCreateDevice)                               \
  X(vkGetDeviceProcAddr)

#define WIDESTEREO_DEVICE_FUNCTIONS(X)            \
  X(vkGetDeviceQueue)                             \
  X(vkQueueSubmit)                                \
  X(vkAllocateMemory)                             \
  X(vkFreeMemory)                                 \
  X(vkMapMemory)                                  \
  X(vkCreateBuffer)                               \
  X(vkDestroyBuffer)                              \
  X(vkGetBufferMemoryRequirements)                \
  X(vkBindBufferMemory)                           \
  X(vkCreateBufferView)                           \
  X(vkDestroyBufferView)                          \
  X(vkCreateImage)                                \
  X(vkDestroyImage)                               \
  X(vkGetImageMemoryRequirements)                 \
  X(vkBindImageMemory)                            \
  X(vkCreateImageView)                            \
  X(vkDestroyImageView)                           \
  X(vkCreateSampler)                              \
  X(vkDestroySampler)                             \
  X(vkCreateShaderModule)                         \
  X(vkDestroyShaderModule)                        \
  X(vkCreatePipelineCache)                        \
  X(vkDestroyPipelineCache)                       \
  X(vkGetPipelineCacheData)                       \
  X(vkCreatePipelineLayout)                       \
  X(vkDestroyPipelineLayout)                      \
  X(vkCreateComputePipelines)                     \
  X(vkDestroyPipeline)                            \
  X(vkCreateDescriptorSetLayout)                  \
  X(vkDestroyDescriptorSetLayout)                 \
  X(vkCreateDescriptorPool)                       \
  X(vkDestroyDescriptorPool)                      \
  X(vkAllocateDescriptorSets)                     \
  X(vkUpdateDescriptorSets)                       \
  X(vkCreateCommandPool)                          \
  X(vkDestroyCommandPool)                         \
  X(vkAllocateCommandBuffers)                     \
  X(vkBeginCommandBuffer)                         \
  X(vkResetCommandBuffer)                         \
  X(vkEndCommandBuffer)                           \
  X(vkCreateFence)                                \
  X(vkDestroyFence)                               \
  X(vkResetFences)                                \
  X(vkWaitForFences)                              \
  X(vkCreateQueryPool)                            \
  X(vkDestroyQueryPool)                           \
  X(vkGetQueryPoolResults)                        \
  X(vkCmdBindPipeline)                            \
  X(vkCmdBindDescriptorSets)                      \
  X(vkCmdPushConstants)                           \
  X(vkCmdDispatch)                                \
  X(vkCmdPipelineBarrier)                         \
  X(vkCmdUpdateBuffer)                            \
  X(vkCmdCopyBuffer)                              \
  X(vkCmdFillBuffer)                              \
  X(vkCmdClearColorImage)                         \
  X(vkCmdCopyBufferToImage)                       \
  X(vkCmdResetQueryPool)                          \
  X(vkCmdWriteTimestamp)
// clang-format on

#define WIDESTEREO_DECLARE_FUNCTION(name) PFN_##name name = nullptr;

/// Functions of an instance. Throws Error naming the first one that the driver lacks.
struct InstanceFunctions {
  WIDESTEREO_INSTANCE_FUNCTIONS(WIDESTEREO_DECLARE_FUNCTION)
  static InstanceFunctions load(PFN_vkGetInstanceProcAddr get, VkInstance instance);
};

/// Functions of a device. Throws Error naming the first one that the driver lacks.
struct DeviceFunctions {
  WIDESTEREO_DEVICE_FUNCTIONS(WIDESTEREO_DECLARE_FUNCTION)
  static DeviceFunctions load(PFN_vkGetDeviceProcAddr get, VkDevice device);
};

#undef WIDESTEREO_DECLARE_FUNCTION

}  // namespace widestereo
