// SPDX-License-Identifier: MIT
#include "vulkan/instance.h"

#include <algorithm>
#include <cstring>

#include "vulkan/result.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr const char* validation_layer = "VK_LAYER_KHRONOS_validation";

/// The functions that exist before an instance.
struct GlobalFunctions {
  explicit GlobalFunctions(PFN_vkGetInstanceProcAddr get)
      : enumerate_version(load<PFN_vkEnumerateInstanceVersion>(get, "vkEnumerateInstanceVersion")),
        enumerate_extensions(load<PFN_vkEnumerateInstanceExtensionProperties>(
            get, "vkEnumerateInstanceExtensionProperties")),
        enumerate_layers(load<PFN_vkEnumerateInstanceLayerProperties>(
            get, "vkEnumerateInstanceLayerProperties")),
        create_instance(load<PFN_vkCreateInstance>(get, "vkCreateInstance")) {}

  /// A loader of Vulkan 1.0 lacks the first one.
  template <class Function>
  static Function load(PFN_vkGetInstanceProcAddr get, const char* name) {
    const auto function = reinterpret_cast<Function>(get(VK_NULL_HANDLE, name));
    if (function == nullptr) {
      throw Error(std::string("The Vulkan loader lacks ") + name +
                  "; install one of 1.1 or newer.");
    }
    return function;
  }

  PFN_vkEnumerateInstanceVersion enumerate_version;
  PFN_vkEnumerateInstanceExtensionProperties enumerate_extensions;
  PFN_vkEnumerateInstanceLayerProperties enumerate_layers;
  PFN_vkCreateInstance create_instance;
};

bool has_layer(const GlobalFunctions& vk, const char* name) {
  std::uint32_t count = 0;
  check(vk.enumerate_layers(&count, nullptr), "The Vulkan loader", "list its layers");
  std::vector<VkLayerProperties> layers(count);
  check(vk.enumerate_layers(&count, layers.data()), "The Vulkan loader", "list its layers");
  return std::any_of(layers.begin(), layers.end(), [name](const VkLayerProperties& layer) {
    return std::strcmp(layer.layerName, name) == 0;
  });
}

/// `layer`: null for the loader and the drivers.
bool has_extension(const GlobalFunctions& vk, const char* layer, const char* name) {
  std::uint32_t count = 0;
  check(vk.enumerate_extensions(layer, &count, nullptr), "The Vulkan loader",
        "list its extensions");
  std::vector<VkExtensionProperties> extensions(count);
  check(vk.enumerate_extensions(layer, &count, extensions.data()), "The Vulkan loader",
        "list its extensions");
  return std::any_of(extensions.begin(), extensions.end(), [name](const auto& extension) {
    return std::strcmp(extension.extensionName, name) == 0;
  });
}

void require_validation(const GlobalFunctions& vk) {
  if (!has_layer(vk, validation_layer)) {
    throw Error(std::string("Validation was asked for, but ") + validation_layer +
                " is not installed; install vulkan-validationlayers or do without validation.");
  }
  for (const char* extension :
       {VK_EXT_DEBUG_UTILS_EXTENSION_NAME, VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME}) {
    if (!has_extension(vk, validation_layer, extension) && !has_extension(vk, nullptr, extension)) {
      throw Error(std::string("The installed ") + validation_layer + " lacks " + extension +
                  "; install another version or do without validation.");
    }
  }
}

VKAPI_ATTR VkBool32 VKAPI_CALL report(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                      VkDebugUtilsMessageTypeFlagsEXT,
                                      const VkDebugUtilsMessengerCallbackDataEXT* data, void* log) {
  static_cast<ValidationLog*>(log)->add(data->pMessage != nullptr ? data->pMessage : "");
  return VK_FALSE;
}

VkDebugUtilsMessengerCreateInfoEXT messenger_info(ValidationLog* log) {
  VkDebugUtilsMessengerCreateInfoEXT info{};
  info.sType = VK_STRUCTURE_TYPE_DEBUG_UTILS_MESSENGER_CREATE_INFO_EXT;
  info.messageSeverity = VK_DEBUG_UTILS_MESSAGE_SEVERITY_WARNING_BIT_EXT |
                         VK_DEBUG_UTILS_MESSAGE_SEVERITY_ERROR_BIT_EXT;
  // Not the loader's general chatter: only what the layer says of our calls.
  info.messageType = VK_DEBUG_UTILS_MESSAGE_TYPE_VALIDATION_BIT_EXT |
                     VK_DEBUG_UTILS_MESSAGE_TYPE_PERFORMANCE_BIT_EXT;
  info.pfnUserCallback = report;
  info.pUserData = log;
  return info;
}

}  // namespace

void ValidationLog::add(std::string message) {
  const std::lock_guard lock(mutex_);
  messages_.push_back(std::move(message));
}

std::vector<std::string> ValidationLog::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

VulkanInstance::VulkanInstance(PFN_vkGetInstanceProcAddr get, bool validation)
    : get_(get), log_(std::make_unique<ValidationLog>()) {
  const GlobalFunctions vk(get);
  VkApplicationInfo application{};
  application.sType = VK_STRUCTURE_TYPE_APPLICATION_INFO;
  application.pApplicationName = "widestereo";
  application.apiVersion = VK_API_VERSION_1_1;

  VkInstanceCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_INSTANCE_CREATE_INFO;
  info.pApplicationInfo = &application;
  std::vector<const char*> extensions;
  if (has_extension(vk, nullptr, VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME)) {
    extensions.push_back(VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME);
    info.flags |= VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR;
  }
  VkDebugUtilsMessengerCreateInfoEXT messenger = messenger_info(log_.get());
  const VkValidationFeatureEnableEXT synchronization =
      VK_VALIDATION_FEATURE_ENABLE_SYNCHRONIZATION_VALIDATION_EXT;
  VkValidationFeaturesEXT features{};
  features.sType = VK_STRUCTURE_TYPE_VALIDATION_FEATURES_EXT;
  features.pNext = &messenger;
  features.enabledValidationFeatureCount = 1;
  features.pEnabledValidationFeatures = &synchronization;
  if (validation) {
    require_validation(vk);
    extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
    extensions.push_back(VK_EXT_VALIDATION_FEATURES_EXTENSION_NAME);
    info.enabledLayerCount = 1;
    info.ppEnabledLayerNames = &validation_layer;
    info.pNext = &features;
  }
  info.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
  info.ppEnabledExtensionNames = extensions.data();
  check(vk.create_instance(&info, nullptr, &instance_), "The Vulkan loader", "make an instance");

  try {
    functions_ = InstanceFunctions::load(get, instance_);
    if (validation) create_messenger(messenger);
  } catch (...) {
    const auto destroy =
        reinterpret_cast<PFN_vkDestroyInstance>(get(instance_, "vkDestroyInstance"));
    if (destroy != nullptr) destroy(instance_, nullptr);
    throw;
  }
}

void VulkanInstance::create_messenger(const VkDebugUtilsMessengerCreateInfoEXT& info) {
  const auto create = reinterpret_cast<PFN_vkCreateDebugUtilsMessengerEXT>(
      get_(instance_, "vkCreateDebugUtilsMessengerEXT"));
  destroy_messenger_ = reinterpret_cast<PFN_vkDestroyDebugUtilsMessengerEXT>(
      get_(instance_, "vkDestroyDebugUtilsMessengerEXT"));
  if (create != nullptr && destroy_messenger_ != nullptr) {
    create(instance_, &info, nullptr, &messenger_);
  }
  if (messenger_ == VK_NULL_HANDLE) {
    throw Error(
        "The validation layer takes no message callback; install another version or do "
        "without validation.");
  }
}

VulkanInstance::~VulkanInstance() {
  if (messenger_ != VK_NULL_HANDLE) destroy_messenger_(instance_, messenger_, nullptr);
  functions_.vkDestroyInstance(instance_, nullptr);
}

std::vector<VkPhysicalDevice> VulkanInstance::physical_devices() const {
  std::uint32_t count = 0;
  check(functions_.vkEnumeratePhysicalDevices(instance_, &count, nullptr), "The Vulkan loader",
        "list its devices");
  std::vector<VkPhysicalDevice> devices(count);
  check(functions_.vkEnumeratePhysicalDevices(instance_, &count, devices.data()),
        "The Vulkan loader", "list its devices");
  devices.resize(count);
  return devices;
}

}  // namespace widestereo
