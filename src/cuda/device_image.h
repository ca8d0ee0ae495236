// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/types.hpp>
#include <string>

#include "cuda/handle.h"
#include "kernel/host.h"

namespace widestereo {

/// Device memory of a view's intensities: masked everywhere, APRON pixels wider than the image on
/// every side, with a texture over it.
class DeviceImage {
 public:
  DeviceImage() = default;
  /// Throws Error naming the device. The memory may be filled after the constructor returns, on the
  /// default stream.
  DeviceImage(cv::Size size, const std::string& device);

  /// Of pixel (0, 0).
  float* get() const { return memory_.get() + (stride_ + 1) * APRON; }
  /// Bilinear, in pixels of the memory: the image's first one has its centre at APRON + 0.5.
  cudaTextureObject_t texture() const { return texture_.get(); }
  /// Pixels from row to row.
  int stride() const { return stride_; }
  std::size_t bytes() const { return memory_.bytes(); }

 private:
  int stride_ = 0;
  DeviceArray<float> memory_;
  CudaTexture texture_;  // destroyed before the memory
};

}  // namespace widestereo
