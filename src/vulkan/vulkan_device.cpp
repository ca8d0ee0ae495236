// SPDX-License-Identifier: MIT
#include "vulkan/vulkan_device.h"

#include <utility>

#include "vulkan/context.h"
#include "vulkan/instance.h"
#include "vulkan/loader.h"
#include "vulkan/physical_device.h"
#include "vulkan/pipeline_cache.h"
#include "vulkan/vulkan_backend.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

VkPhysicalDevice physical_device(const VulkanInstance& instance, int index) {
  const std::vector<VkPhysicalDevice> devices = instance.physical_devices();
  if (index < 0 || static_cast<std::size_t>(index) >= devices.size()) {
    throw Error("There is no Vulkan device " + std::to_string(index) + "; this machine has " +
                std::to_string(devices.size()) + ", counted from 0.");
  }
  return devices[static_cast<std::size_t>(index)];
}

class VulkanDevice final : public Device::Implementation {
 public:
  VulkanDevice(PFN_vkGetInstanceProcAddr get, std::unique_ptr<VulkanLoader> loader, int index,
               const DeviceRequest& request)
      : loader_(std::move(loader)),
        instance_(get, request.validation),
        context_(get, instance_.handle(), physical_device(instance_, index)),
        cache_(context_, request.pipeline_cache),
        max_samples_(request.max_samples_per_dispatch) {
    info = describe(instance_.functions(), physical_device(instance_, index), index);
  }

  std::unique_ptr<Backend> make_backend(const std::vector<cv::Size>& sizes,
                                        const KernelConstants& constants) override {
    return std::make_unique<VulkanBackend>(context_, sizes, constants, cache_,
                                           VulkanTuning{.max_samples = max_samples_});
  }

  std::vector<std::string> validation_messages() const override {
    return instance_.validation_messages();
  }

 private:
  std::unique_ptr<VulkanLoader> loader_;  // outlives all that was got from it
  VulkanInstance instance_;
  VulkanContext context_;
  PipelineCache cache_;
  long long max_samples_;
};

}  // namespace

std::vector<DeviceInfo> list_vulkan_devices(std::string* why_none) {
  std::vector<DeviceInfo> list;
  std::string why;
  try {
    const VulkanLoader loader;
    const VulkanInstance instance(loader.get_instance_proc_addr(), false);
    for (const VkPhysicalDevice device : instance.physical_devices()) {
      list.push_back(describe(instance.functions(), device, static_cast<int>(list.size())));
    }
    if (list.empty()) why = "No Vulkan driver offers a device; check that a driver is installed.";
  } catch (const Error& error) {
    list.clear();
    why = error.what();
  }
  if (why_none != nullptr) *why_none = why;
  return list;
}

std::unique_ptr<Device::Implementation> open_vulkan_device(int index,
                                                           const DeviceRequest& request) {
  auto loader = std::make_unique<VulkanLoader>();
  const PFN_vkGetInstanceProcAddr get = loader->get_instance_proc_addr();
  return std::make_unique<VulkanDevice>(get, std::move(loader), index, request);
}

std::unique_ptr<Device::Implementation> open_vulkan_device(int index, const DeviceRequest& request,
                                                           PFN_vkGetInstanceProcAddr get) {
  return std::make_unique<VulkanDevice>(get, nullptr, index, request);
}

}  // namespace widestereo
