// SPDX-License-Identifier: MIT
#pragma once

#include <memory>

#include "matching/backend.h"

namespace widestereo {

DeviceInfo cpu_device_info();

/// The reference back end: the shared kernel source, compiled for this processor, on all cores.
std::unique_ptr<Device::Implementation> open_cpu_device();

}  // namespace widestereo
