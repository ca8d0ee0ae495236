// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "matching/backend.h"

namespace widestereo {

/// Opens the best of these devices that can be used and opens, as another process may have taken
/// one; null where none does. `passed_over`: sentences, a space after each, to which those about
/// devices that are at least as good are added, and which the device is noted with.
std::unique_ptr<Device::Implementation> open_first(std::vector<DeviceInfo> devices,
                                                   const DeviceRequest& request,
                                                   std::string& passed_over);

}  // namespace widestereo
