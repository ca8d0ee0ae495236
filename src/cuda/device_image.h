// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/types.hpp>
#include <string>

#include "cuda/handle.h"
#include "kernel/host.h"

namespace widestereo {

/// Device memory of a view's intensities: masked everywhere.
class DeviceImage {
 public:
  DeviceImage() = default;
  /// `size`: with the aprons of this many pixels on every side. `texel_bytes`: 4, or 2 for floats
  /// of half precision. Waits for the stream, which fills it. Throws Error naming the device.
  DeviceImage(cv::Size size, int apron, int texel_bytes, cudaStream_t stream,
              const std::string& device);

  /// Of pixel (0, 0).
  void* get() const { return memory_.get() + (stride_ + 1) * apron_ * texel_bytes_; }
  /// Bilinear, in pixels of the memory: the image's first one has its centre at its apron + 0.5.
  /// The image must outlive it. Throws Error naming the device.
  CudaTexture make_texture(const std::string& device) const;
  /// Pixels from row to row.
  int stride() const { return stride_; }
  std::size_t bytes() const { return memory_.bytes(); }

 private:
  cv::Size size_;
  int apron_ = 0;
  int texel_bytes_ = 0;
  int stride_ = 0;
  DeviceArray<unsigned char> memory_;
};

}  // namespace widestereo
