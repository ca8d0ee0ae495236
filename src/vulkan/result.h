// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "vulkan/functions.h"

namespace widestereo {

/// Throws Error when a Vulkan call failed. `device` is the device's name, `action` completes
/// "could not ...".
void check(VkResult result, const std::string& device, const std::string& action);

}  // namespace widestereo
