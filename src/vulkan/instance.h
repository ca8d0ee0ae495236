// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "vulkan/functions.h"

namespace widestereo {

/// Errors and warnings of the validation layers, which may report from any thread.
class ValidationLog {
 public:
  void add(std::string message);
  std::vector<std::string> messages() const;

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> messages_;
};

/// An instance of our own, for use without an application's.
class VulkanInstance {
 public:
  /// `validation` turns on the Khronos validation layer with synchronization validation.
  /// Throws Error when there is no driver, the loader is older than 1.1 or the layer is missing.
  VulkanInstance(PFN_vkGetInstanceProcAddr get, bool validation);
  ~VulkanInstance();
  VulkanInstance(const VulkanInstance&) = delete;
  VulkanInstance& operator=(const VulkanInstance&) = delete;

  VkInstance handle() const { return instance_; }
  const InstanceFunctions& functions() const { return functions_; }
  /// In the driver's order.
  std::vector<VkPhysicalDevice> physical_devices() const;
  std::vector<std::string> validation_messages() const { return log_->messages(); }

 private:
  void create_messenger(const VkDebugUtilsMessengerCreateInfoEXT& info);

  PFN_vkGetInstanceProcAddr get_;
  std::unique_ptr<ValidationLog> log_;  // at a fixed address: the layers hold it
  VkInstance instance_ = VK_NULL_HANDLE;
  InstanceFunctions functions_;
  VkDebugUtilsMessengerEXT messenger_ = VK_NULL_HANDLE;
  PFN_vkDestroyDebugUtilsMessengerEXT destroy_messenger_ = nullptr;
};

}  // namespace widestereo
