// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "matching/backend.h"
#include "vulkan/functions.h"

namespace widestereo {

/// Vulkan devices of this machine in the driver's order (info.id "vulkan:INDEX"); empty without a
/// loader or driver, in which case `why_none` (may be null) says so in one sentence.
std::vector<DeviceInfo> list_vulkan_devices(std::string* why_none);

/// Opens the device with this index. Throws Error when it is missing or unusable.
std::unique_ptr<Device::Implementation> open_vulkan_device(int index, const DeviceRequest& request);

/// The same through the caller's vkGetInstanceProcAddr, which must outlive the device.
std::unique_ptr<Device::Implementation> open_vulkan_device(int index, const DeviceRequest& request,
                                                           PFN_vkGetInstanceProcAddr get);

}  // namespace widestereo
