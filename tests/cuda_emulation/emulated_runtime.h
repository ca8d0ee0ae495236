// SPDX-License-Identifier: MIT
// A CUDA runtime on the CPU, for testing the host side of the CUDA back end without a GPU. It is as
// lazy as it may be: what is enqueued on a stream runs when something waits for it, so that a
// missing wait shows. It counts what it hands out and fails on demand.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <functional>

namespace widestereo::test {

/// Of the emulated devices, which are alike; tests run one after the other.
struct Emulation {
  int devices = 1;
  const char* name = "Emulated GPU";  ///< of each device
  int driver_version = 12040;
  cudaError_t count_error = cudaSuccess;
  int compute_mode = cudaComputeModeDefault;
  bool has_kernels = true;  ///< for these devices
  int major = 9;
  bool time_limit = false;
  bool can_pin = true;  ///< memory of the host
  std::size_t memory = std::size_t{1} << 30;

  long failing_call = -1;  ///< the n-th call that can fail does, with `failure`
  cudaError_t failure = cudaSuccess;
  bool sticky = false;  ///< and every one after it

  /// Of each launch the last block and its last thread come first, of a graph the last node that
  /// may.
  bool backwards = false;

  long calls = 0;
  int current_device = 0;
  std::size_t allocated = 0;
  int live_objects = 0;  ///< allocations, streams, events, graphs
  int graphs_made = 0;
  int kernels_run = 0;
};
Emulation& emulation();

/// Restores the defaults at both ends of a scope, keeping the counts of live objects.
struct EmulationScope {
  EmulationScope();
  ~EmulationScope();
};

/// Runs one thread of a kernel with arguments that were copied at the launch.
using ThreadFunction = std::function<void()>;
/// By the kernel's address; empty for an unknown kernel. Defined with the kernels.
ThreadFunction bind_kernel(const void* function, void** arguments);

}  // namespace widestereo::test
