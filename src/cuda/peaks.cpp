// SPDX-License-Identifier: MIT
#include "cuda/peaks.h"

namespace widestereo {
namespace {

/// Of one multiprocessor and clock, by compute capability (NVIDIA's architecture white papers and
/// the throughput table of the CUDA programming guide).
struct Multiprocessor {
  int lanes = 0;   ///< of single precision
  int texels = 0;  ///< four for each texture unit, which filters them
};

Multiprocessor multiprocessor(int major, int minor) {
  constexpr int texels = 16;
  if (major == 7 || (major == 8 && minor == 0)) return {64, texels};
  if (major >= 8 && major <= 12) return {128, texels};
  return {};
}

}  // namespace

DevicePeaks peaks_of(const CudaSpeeds& speeds) {
  const Multiprocessor of_one = multiprocessor(speeds.major, speeds.minor);
  const double clocks = 1e3 * speeds.clock_khz * speeds.multiprocessors;  // of all, a second
  // Two transfers a clock; a fused multiply-add counts as two operations.
  return {.gflops = 2e-9 * clocks * of_one.lanes,
          .gtexels = 1e-9 * clocks * of_one.texels,
          .gbps = 2e-9 * 1e3 * speeds.memory_clock_khz * speeds.bus_bits / 8};
}

}  // namespace widestereo
