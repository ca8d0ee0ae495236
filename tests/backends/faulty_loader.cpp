// SPDX-License-Identifier: MIT
#include <gmock/gmock.h>

#include <algorithm>
#include <mutex>

#include "vulkan_fixture.h"

namespace widestereo::test {
namespace {

PFN_vkGetInstanceProcAddr real_get() {
  static const VulkanLoader loader;
  return loader.get_instance_proc_addr();
}

// The real functions behind the wrappers, noted when they are asked for.
PFN_vkGetDeviceProcAddr real_get_device = nullptr;
PFN_vkAllocateMemory real_allocate = nullptr;
PFN_vkQueueSubmit real_submit = nullptr;
PFN_vkWaitForFences real_wait = nullptr;
PFN_vkGetPipelineCacheData real_cache_data = nullptr;
PFN_vkGetPhysicalDeviceProperties real_properties = nullptr;
PFN_vkGetPhysicalDeviceProperties2 real_properties_since_1_1 = nullptr;
PFN_vkGetPhysicalDeviceFormatProperties real_formats = nullptr;
PFN_vkGetPhysicalDeviceImageFormatProperties real_image_limits = nullptr;

Faults& faults() { return FaultyLoader::faults(); }
std::mutex counting;  // pipelines are made in several threads

/// A function of a device that may fail, named by `Name::text`.
template <class Function, class Name>
struct Fallible {
  static PFN_vkVoidFunction wrap(PFN_vkVoidFunction real) { return real; }  // says no result
};
template <class... Arguments, class Name>
struct Fallible<VkResult(VKAPI_PTR*)(Arguments...), Name> {
  static inline VkResult(VKAPI_PTR* real)(Arguments...) = nullptr;
  static VKAPI_ATTR VkResult VKAPI_CALL call(Arguments... arguments) {
    int calls_before = 0;
    {
      const std::lock_guard lock(counting);
      calls_before = faults().calls[Name::text]++;
    }
    if (faults().failing_function == Name::text && faults().failing_call == calls_before) {
      return VK_ERROR_OUT_OF_HOST_MEMORY;
    }
    return real(arguments...);
  }
  static PFN_vkVoidFunction wrap(PFN_vkVoidFunction function) {
    real = reinterpret_cast<decltype(real)>(function);
    return reinterpret_cast<PFN_vkVoidFunction>(&call);
  }
};

#define DEFINE_NAME(name)                      \
  struct NameOf_##name {                       \
    static constexpr const char* text = #name; \
  };
WIDESTEREO_DEVICE_FUNCTIONS(DEFINE_NAME)
#undef DEFINE_NAME

VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkMemoryAllocateInfo* info,
                                        const VkAllocationCallbacks* callbacks,
                                        VkDeviceMemory* memory) {
  if (faults().allocations++ == faults().failing_allocation) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
  return real_allocate(device, info, callbacks, memory);
}

VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos,
                                      VkFence fence) {
  if (faults().submissions++ == faults().failing_submission) return VK_ERROR_DEVICE_LOST;
  return real_submit(queue, count, infos, fence);
}

VKAPI_ATTR VkResult VKAPI_CALL wait(VkDevice device, std::uint32_t count, const VkFence* fences,
                                    VkBool32 all, std::uint64_t timeout) {
  // Truly waits: the device is not lost, so what it uses may not be destroyed yet.
  const VkResult result = real_wait(device, count, fences, all, timeout);
  return faults().waits++ == faults().failing_wait ? VK_ERROR_DEVICE_LOST : result;
}

VKAPI_ATTR VkResult VKAPI_CALL no_layers(std::uint32_t* count, VkLayerProperties*) {
  *count = 0;
  return VK_SUCCESS;
}

VKAPI_ATTR void VKAPI_CALL formats(VkPhysicalDevice device, VkFormat format,
                                   VkFormatProperties* properties) {
  *properties = {};
  if (faults().no_formats) return;
  real_formats(device, format, properties);
  if (faults().no_filtering ||
      (faults().no_filtering_of_floats && format == VK_FORMAT_R32_SFLOAT)) {
    properties->optimalTilingFeatures &=
        ~static_cast<VkFormatFeatureFlags>(VK_FORMAT_FEATURE_SAMPLED_IMAGE_FILTER_LINEAR_BIT);
  }
}

VKAPI_ATTR VkResult VKAPI_CALL cache_data(VkDevice device, VkPipelineCache cache,
                                          std::size_t* bytes, void* data) {
  if (data == nullptr || faults().growing_caches == 0) {
    return real_cache_data(device, cache, bytes, data);
  }
  --faults().growing_caches;
  *bytes = 0;
  return VK_INCOMPLETE;
}

VKAPI_ATTR void VKAPI_CALL properties(VkPhysicalDevice device, VkPhysicalDeviceProperties* out) {
  real_properties(device, out);
  out->deviceType = faults().type.value_or(out->deviceType);
  if (faults().old_device) out->apiVersion = VK_API_VERSION_1_0;
  if (faults().largest_push_constants > 0) {
    out->limits.maxPushConstantsSize = faults().largest_push_constants;
  }
  if (faults().largest_buffer > 0) {
    out->limits.maxStorageBufferRange = faults().largest_buffer;
    out->limits.maxTexelBufferElements = faults().largest_buffer / 16;
  }
  if (faults().storage_buffers > 0) {
    out->limits.maxPerStageDescriptorStorageBuffers = faults().storage_buffers;
  }
  if (faults().storage_images > 0) {
    out->limits.maxPerStageDescriptorStorageImages = faults().storage_images;
  }
}

VKAPI_ATTR void VKAPI_CALL properties_since_1_1(VkPhysicalDevice device,
                                                VkPhysicalDeviceProperties2* out) {
  EXPECT_FALSE(faults().old_device) << "Vulkan 1.0 has no vkGetPhysicalDeviceProperties2";
  real_properties_since_1_1(device, out);
  if (faults().largest_allocation == 0) return;
  auto* next = static_cast<VkBaseOutStructure*>(out->pNext);
  for (; next != nullptr; next = next->pNext) {
    if (next->sType != VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_3_PROPERTIES) continue;
    reinterpret_cast<VkPhysicalDeviceMaintenance3Properties*>(next)->maxMemoryAllocationSize =
        faults().largest_allocation;
  }
}

VKAPI_ATTR void VKAPI_CALL queue_families(VkPhysicalDevice, std::uint32_t* count,
                                          VkQueueFamilyProperties* families) {
  const auto all = static_cast<std::uint32_t>(faults().queue_families.size());
  *count = families == nullptr ? all : std::min(*count, all);
  if (families != nullptr) std::copy_n(faults().queue_families.begin(), *count, families);
}

VKAPI_ATTR VkResult VKAPI_CALL image_limits(VkPhysicalDevice device, VkFormat format,
                                            VkImageType type, VkImageTiling tiling,
                                            VkImageUsageFlags usage, VkImageCreateFlags flags,
                                            VkImageFormatProperties* limits) {
  const VkResult result = real_image_limits(device, format, type, tiling, usage, flags, limits);
  if (faults().largest_image > 0) {
    limits->maxExtent.width = std::min(limits->maxExtent.width, faults().largest_image);
  }
  if (faults().largest_resource > 0) limits->maxResourceSize = faults().largest_resource;
  return result;
}

template <class Function>
PFN_vkVoidFunction wrap(PFN_vkVoidFunction real, Function& slot, Function wrapper) {
  slot = reinterpret_cast<Function>(real);
  return reinterpret_cast<PFN_vkVoidFunction>(wrapper);
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_device(VkDevice device, const char* name) {
  const std::string wanted = name;
  const PFN_vkVoidFunction real = real_get_device(device, name);
  if (wanted == faults().missing_function) return nullptr;
  if (wanted == "vkAllocateMemory") return wrap(real, real_allocate, &allocate);
  if (wanted == "vkQueueSubmit") return wrap(real, real_submit, &submit);
  if (wanted == "vkWaitForFences") return wrap(real, real_wait, &wait);
  if (wanted == "vkGetPipelineCacheData") return wrap(real, real_cache_data, &cache_data);
#define WRAP(name) \
  if (wanted == #name) return Fallible<PFN_##name, NameOf_##name>::wrap(real);
  WIDESTEREO_DEVICE_FUNCTIONS(WRAP)
#undef WRAP
  return real;
}

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_instance(VkInstance instance, const char* name) {
  const std::string wanted = name;
  const PFN_vkVoidFunction real = real_get()(instance, name);
  if (wanted == faults().missing_function) return nullptr;
  if (wanted == "vkGetDeviceProcAddr") return wrap(real, real_get_device, &get_device);
  if (wanted == "vkEnumerateInstanceLayerProperties" && faults().no_layers) {
    return reinterpret_cast<PFN_vkVoidFunction>(&no_layers);
  }
  if (wanted == "vkGetPhysicalDeviceFormatProperties") return wrap(real, real_formats, &formats);
  if (wanted == "vkGetPhysicalDeviceProperties") {
    return wrap(real, real_properties, &properties);
  }
  if (wanted == "vkGetPhysicalDeviceProperties2") {
    return wrap(real, real_properties_since_1_1, &properties_since_1_1);
  }
  if (wanted == "vkGetPhysicalDeviceQueueFamilyProperties" && !faults().queue_families.empty()) {
    return reinterpret_cast<PFN_vkVoidFunction>(&queue_families);
  }
  if (wanted == "vkGetPhysicalDeviceImageFormatProperties") {
    return wrap(real, real_image_limits, &image_limits);
  }
  return real;
}

}  // namespace

Faults& FaultyLoader::faults() {
  static Faults state;
  return state;
}

PFN_vkGetInstanceProcAddr FaultyLoader::get_instance_proc_addr() { return &get_instance; }

void expect_failures_leave_no_object(const std::function<void(const VulkanContext&)>& work) {
  const FaultyLoader::Scope scope;
  const auto get = FaultyLoader::get_instance_proc_addr();
  const VulkanInstance instance(get, true);
  const auto message = [&] {
    return error_of(
        [&] { work(VulkanContext(get, instance.handle(), instance.physical_devices().at(0))); });
  };
  ASSERT_EQ(message(), "");
  const std::map<std::string, int> calls = faults().calls;
  // From the first to the last thing that is made: each takes the compilation of all kernels.
  for (const char* name : {"vkCreateShaderModule", "vkCreateComputePipelines", "vkCreateBuffer",
                           "vkCreateImageView", "vkAllocateDescriptorSets", "vkCreateFence"}) {
    ASSERT_TRUE(calls.contains(name)) << name;
    faults() = {.failing_function = name, .failing_call = calls.at(name) / 2};
    EXPECT_THAT(message(), ::testing::HasSubstr("out of host memory")) << name;
  }
  // The layer names every object that outlives its device.
  EXPECT_THAT(instance.validation_messages(), ::testing::IsEmpty());
}

}  // namespace widestereo::test
