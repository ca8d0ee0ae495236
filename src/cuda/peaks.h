// SPDX-License-Identifier: MIT
#pragma once

#include "widestereo/device.h"

namespace widestereo {

/// What the CUDA runtime says about a device's speed.
struct CudaSpeeds {
  int major = 0, minor = 0;  ///< compute capability
  int multiprocessors = 0;
  int clock_khz = 0;  ///< the highest
  int memory_clock_khz = 0;
  int bus_bits = 0;
};

/// Peaks that follow from it; 0 where it says nothing or the compute capability is not known here.
DevicePeaks peaks_of(const CudaSpeeds& speeds);

}  // namespace widestereo
