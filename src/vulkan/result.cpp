// SPDX-License-Identifier: MIT
#include "vulkan/result.h"

#include "widestereo/error.h"

namespace widestereo {
namespace {

std::string reason(VkResult result) {
  switch (result) {
    case VK_ERROR_OUT_OF_HOST_MEMORY:
      return "out of host memory; close other programs or use smaller images.";
    case VK_ERROR_OUT_OF_DEVICE_MEMORY:
      return "out of device memory; use smaller images or another device.";
    case VK_ERROR_DEVICE_LOST:
      return "the device was lost (driver crash or watchdog); open it again, with smaller "
             "dispatches (max_samples_per_dispatch; of a VulkanMatcher more command buffers) if "
             "this repeats.";
    case VK_ERROR_INITIALIZATION_FAILED:
      return "the driver refused; update it or use another device.";
    case VK_ERROR_INCOMPATIBLE_DRIVER:
      return "no Vulkan driver was found; install one (mesa-vulkan-drivers has a software driver).";
    case VK_ERROR_LAYER_NOT_PRESENT:
      return "a layer is not installed.";
    case VK_ERROR_EXTENSION_NOT_PRESENT:
      return "an extension is missing; update the driver.";
    case VK_ERROR_FEATURE_NOT_PRESENT:
      return "a feature is missing; update the driver or use another device.";
    default:
      return "Vulkan error " + std::to_string(static_cast<int>(result)) +
             "; update the driver, or use smaller images or another device.";
  }
}

}  // namespace

void check(VkResult result, const std::string& device, const std::string& action) {
  if (result == VK_SUCCESS) return;
  throw Error(device + " could not " + action + ": " + reason(result));
}

}  // namespace widestereo
