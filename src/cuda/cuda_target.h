// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "widestereo/device.h"

namespace widestereo {

/// Which device a CUDA back end works on, and how.
struct CudaTarget {
  int ordinal = -1;  ///< -1: whichever device and context are current in the calling thread
  std::string name;  ///< for messages
  long long max_samples = 0;  ///< longest launch in patch samples, 0 = no limit
};

/// The device with this index. Throws Error when it is missing or unusable.
CudaTarget cuda_target(int index, const DeviceRequest& request);

}  // namespace widestereo
