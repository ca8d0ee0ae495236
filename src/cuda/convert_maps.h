// SPDX-License-Identifier: MIT
// Between an application's images and maps in device memory and those of a match.
#pragma once

#include <driver_types.h>

#include "cuda/kernels.h"
#include "widestereo/cuda_maps.h"

namespace widestereo {

/// Fills a view's intensities as Matcher does: in [0, 1], masked where there is no usable ray.
cudaError_t import_image(const CudaImage& image, const kernel::cuda::ViewMemory& view, int height,
                         cudaStream_t stream);

/// Writes the maps that have data from a view's planes and checks, as Matcher does.
cudaError_t export_maps(const kernel::cuda::ViewMemory& view, const CudaViewMaps& maps, int height,
                        cudaStream_t stream);

}  // namespace widestereo
