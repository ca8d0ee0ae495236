// SPDX-License-Identifier: MIT
// Between an application's images, motion and maps in device memory and those of a match.
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

/// What changes from one warm start to the next.
struct FrameStart {
  int views;
  int frame;                               ///< its number, unless it is counted
  bool counted;                            ///< one more than in the parameters
  const double* now_from_previous;         ///< of the rig, 3x4 row-major in device memory, or null:
  kernel::ViewPair pairs[MAX_IMAGES];      ///< the motion of each view
  double rig_from_camera[MAX_IMAGES][12];  ///< 3x4 row-major
};
static_assert(sizeof(FrameStart) <= 4000);  // with a pointer an argument of CUDA 11

/// Sets the number of the frame and the motion of each view, as set_motion() does.
cudaError_t start_frame(const FrameStart& start, kernel::MatchParameters* parameters,
                        cudaStream_t stream);

/// Loads these kernels, which cannot be done while a stream captures.
cudaError_t load_conversions();

}  // namespace widestereo
