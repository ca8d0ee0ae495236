// SPDX-License-Identifier: MIT
// What device code needs to run on the CPU, one thread after the other.
#pragma once

#include <math.h>

#include "cuda_fp16.h"
#include "cuda_runtime_api.h"

#define __device__
#define __global__
#define __grid_constant__
#define __launch_bounds__(threads, blocks)
#define __shared__ static __thread

// Not thread_local, whose wrapper for initialisation g++'s sanitizer takes for a null pointer.
extern __thread dim3 blockIdx;
extern __thread dim3 threadIdx;

/// Threads of a block run one after the other: first up to its barrier, which they leave by
/// throwing this, and then again to the end. What stands before a barrier must do the same a second
/// time.
struct BlockBarrier {};
extern __thread bool stops_at_barrier;
inline void __syncthreads() {
  if (stops_at_barrier) throw BlockBarrier();
}

inline float4 make_float4(float x, float y, float z, float w) { return {x, y, z, w}; }

template <class T>
T __ldg(const T* address) {
  return *address;
}

/// What a texture object is a handle of.
struct EmulatedTexture {
  const void* texels;
  int texel_bytes;  // of floats, or of half precision
  int width, height, stride;

  float at(int i) const {
    if (texel_bytes == sizeof(float)) return static_cast<const float*>(texels)[i];
    return static_cast<const __half*>(texels)[i];
  }
};

// As the programming guide defines linear filtering, with weights of eight bits.
template <class T>
T tex2DLod(cudaTextureObject_t object, float x, float y, float) {
  const auto& texture = *reinterpret_cast<const EmulatedTexture*>(object);
  const auto split = [](float position, int size, int* texel) {
    const float limited = fminf(fmaxf(position - 0.5f, -1.0f), static_cast<float>(size));
    const float whole = floorf(limited);
    *texel = static_cast<int>(whole);
    return rintf((limited - whole) * 256) / 256;
  };
  int column = 0;
  int row = 0;
  const float fx = split(x, texture.width, &column);
  const float fy = split(y, texture.height, &row);
  const auto texel = [&](int dx, int dy) {
    const int i = column + dx < 0               ? 0
                  : column + dx < texture.width ? column + dx
                                                : texture.width - 1;
    const int j = row + dy < 0 ? 0 : row + dy < texture.height ? row + dy : texture.height - 1;
    return texture.at(j * texture.stride + i);
  };
  return (1 - fx) * (1 - fy) * texel(0, 0) + fx * (1 - fy) * texel(1, 0) +
         (1 - fx) * fy * texel(0, 1) + fx * fy * texel(1, 1);
}

inline unsigned __funnelshift_r(unsigned low, unsigned high, unsigned bits) {
  return static_cast<unsigned>((static_cast<unsigned long long>(high) << 32 | low) >> bits % 32);
}

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
