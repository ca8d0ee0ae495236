// SPDX-License-Identifier: MIT
#pragma once

#include "vulkan/functions.h"

namespace widestereo {

/// The machine's Vulkan loader, opened at run time so that nothing needs it to start.
class VulkanLoader {
 public:
  /// Throws Error when there is no loader.
  VulkanLoader();
  ~VulkanLoader();
  VulkanLoader(const VulkanLoader&) = delete;
  VulkanLoader& operator=(const VulkanLoader&) = delete;

  PFN_vkGetInstanceProcAddr get_instance_proc_addr() const { return get_; }

 private:
  void* library_ = nullptr;
  PFN_vkGetInstanceProcAddr get_ = nullptr;
};

}  // namespace widestereo
