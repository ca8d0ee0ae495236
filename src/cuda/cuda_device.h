// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "matching/backend.h"

namespace widestereo {

/// CUDA devices of this machine in the runtime's order (info.id "cuda:INDEX"); empty without CUDA
/// in this build, driver or device, in which case `why_none` (may be null) says so in one sentence.
std::vector<DeviceInfo> list_cuda_devices(std::string* why_none);

/// Whether this build and this machine's driver are there at all, so that missing devices are worth
/// telling someone who did not ask for CUDA.
bool cuda_driver_found();

/// Opens the device with this index. Throws Error when it is missing or unusable.
std::unique_ptr<Device::Implementation> open_cuda_device(int index, const DeviceRequest& request);

}  // namespace widestereo
