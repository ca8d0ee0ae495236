// SPDX-License-Identifier: MIT
// Images and maps in a CUDA application's device memory. Needs C++11 only, for .cu files.
#pragma once

#include <cstddef>
#include <cstdint>

#include "widestereo/pixel_type.h"

namespace widestereo {

/// A view's image in device memory, of the calibrated size.
struct CudaImage {
  const void* data = nullptr;  ///< aligned to a pixel
  std::size_t pitch = 0;       ///< bytes from row to row, a multiple of a pixel's
  PixelType pixel = PixelType::grey8;
};

/// A map in device memory, of a view's size; without data it is not written.
template <class T>
struct CudaMap {
  T* data = nullptr;      ///< aligned to T
  std::size_t pitch = 0;  ///< bytes from row to row, a multiple of T's
};

/// Results for one reference view; the same values as in ViewResult.
struct CudaViewMaps {
  CudaMap<float> distance;         ///< metres along the unit ray, 0 = no plane; not filtered
  CudaMap<float> normals;          ///< x y z of each pixel next to each other, 12 bytes a pixel
  CudaMap<float> cost;             ///< 1 - ZNCC in [0, 2], 2 = no plane
  CudaMap<float> confidence;       ///< in [0, 1]
  CudaMap<std::uint16_t> reasons;  ///< Reason bits, 0 = accepted
};

}  // namespace widestereo
