// SPDX-License-Identifier: MIT
#include "cuda/peaks.h"

namespace widestereo {
namespace {

/// Of one multiprocessor and clock, by compute capability (NVIDIA's architecture white papers and
/// the throughput table of the CUDA programming guide).
struct Multiprocessor {
  int lanes = 0;       ///< of single precision
  int load_bytes = 0;  ///< from the first-level cache, through which texels are loaded
};

Multiprocessor multiprocessor(int major, int minor) {
  if (major == 7) return {64, minor < 5 ? 128 : 64};
  if (major == 8 && minor == 0) return {64, 128};
  if (major >= 8 && major <= 12) return {128, 128};
  return {};
}

}  // namespace

DevicePeaks peaks_of(const CudaSpeeds& speeds) {
  const Multiprocessor of_one = multiprocessor(speeds.major, speeds.minor);
  const double clocks = 1e3 * speeds.clock_khz * speeds.multiprocessors;  // of all, a second
  constexpr int bytes_of_texel = 4;
  // Two transfers a clock; a fused multiply-add counts as two operations.
  return {.gflops = 2e-9 * clocks * of_one.lanes,
          .gtexels = 1e-9 * clocks * of_one.load_bytes / bytes_of_texel,
          .gbps = 2e-9 * 1e3 * speeds.memory_clock_khz * speeds.bus_bits / 8};
}

}  // namespace widestereo
