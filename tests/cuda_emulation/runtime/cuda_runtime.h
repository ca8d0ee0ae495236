// SPDX-License-Identifier: MIT
// What device code needs to run on the CPU, one thread after the other.
#pragma once

#include <math.h>

#include "cuda_runtime_api.h"

#define __device__
#define __global__
#define __grid_constant__
#define __launch_bounds__(threads, blocks)

// Not thread_local, whose wrapper for initialisation g++'s sanitizer takes for a null pointer.
extern __thread dim3 blockIdx;
extern __thread dim3 threadIdx;

inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }

template <class T>
T __ldg(const T* address) {
  return *address;
}

// As the hardware, by a power of two; glibc has a function of the same name.
#define __expf(a) ::exp2f(1.442695041f * (a))

inline unsigned atomicMax(unsigned* address, unsigned value) {
  unsigned seen = __atomic_load_n(address, __ATOMIC_RELAXED);
  while (seen < value && !__atomic_compare_exchange_n(address, &seen, value, true, __ATOMIC_RELAXED,
                                                      __ATOMIC_RELAXED)) {
  }
  return seen;
}

inline unsigned atomicMin(unsigned* address, unsigned value) {
  unsigned seen = __atomic_load_n(address, __ATOMIC_RELAXED);
  while (seen > value && !__atomic_compare_exchange_n(address, &seen, value, true, __ATOMIC_RELAXED,
                                                      __ATOMIC_RELAXED)) {
  }
  return seen;
}
