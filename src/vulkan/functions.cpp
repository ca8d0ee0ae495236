// SPDX-License-Identifier: MIT
#include "vulkan/functions.h"

#include <string>

#include "widestereo/error.h"

namespace widestereo {
namespace {

template <class Function, class Get, class Owner>
Function load_function(Get get, Owner owner, const char* name) {
  const auto function = reinterpret_cast<Function>(get(owner, name));
  if (function == nullptr) {
    throw Error(std::string("The Vulkan driver lacks the core 1.1 function ") + name +
                "; update the driver.");
  }
  return function;
}

}  // namespace

#define WIDESTEREO_LOAD_INSTANCE(name) table.name = load_function<PFN_##name>(get, instance, #name);
InstanceFunctions InstanceFunctions::load(PFN_vkGetInstanceProcAddr get, VkInstance instance) {
  InstanceFunctions table;
  WIDESTEREO_INSTANCE_FUNCTIONS(WIDESTEREO_LOAD_INSTANCE)
  return table;
}

#define WIDESTEREO_LOAD_DEVICE(name) table.name = load_function<PFN_##name>(get, device, #name);
DeviceFunctions DeviceFunctions::load(PFN_vkGetDeviceProcAddr get, VkDevice device) {
  DeviceFunctions table;
  WIDESTEREO_DEVICE_FUNCTIONS(WIDESTEREO_LOAD_DEVICE)
  return table;
}

}  // namespace widestereo
