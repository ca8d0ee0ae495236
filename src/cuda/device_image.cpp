// SPDX-License-Identifier: MIT
#include "cuda/device_image.h"

#include <vector>

#include "kernel/host.h"

namespace widestereo {

DeviceImage::DeviceImage(cv::Size size, int apron, cudaStream_t stream, const std::string& device)
    : size_(size), apron_(apron) {
  // Rows of whole cache lines, which are also what textures ask for.
  constexpr int line = 128 / sizeof(float);
  stride_ = (size.width + line - 1) / line * line;
  const std::size_t count =
      static_cast<std::size_t>(stride_) * static_cast<std::size_t>(size.height);
  memory_ = DeviceArray<float>(count, stream, device, "the images");
  const std::vector<float> masked(count, MASKED_INTENSITY);
  check(cudaMemcpyAsync(memory_.get(), masked.data(), memory_.bytes(), cudaMemcpyHostToDevice,
                        stream),
        device, "clear the images");
  check(cudaStreamSynchronize(stream), device, "clear the images");
}

CudaTexture DeviceImage::make_texture(const std::string& device) const {
  cudaResourceDesc resource{};
  resource.resType = cudaResourceTypePitch2D;
  resource.res.pitch2D.devPtr = memory_.get();
  resource.res.pitch2D.desc = cudaCreateChannelDesc(32, 0, 0, 0, cudaChannelFormatKindFloat);
  resource.res.pitch2D.width = static_cast<std::size_t>(size_.width);
  resource.res.pitch2D.height = static_cast<std::size_t>(size_.height);
  resource.res.pitch2D.pitchInBytes = static_cast<std::size_t>(stride_) * sizeof(float);
  // Beyond the memory lies what is at its rim: masked.
  cudaTextureDesc how{};
  how.addressMode[0] = cudaAddressModeClamp;
  how.addressMode[1] = cudaAddressModeClamp;
  how.filterMode = cudaFilterModeLinear;
  how.readMode = cudaReadModeElementType;
  cudaTextureObject_t texture = 0;
  check(cudaCreateTextureObject(&texture, &resource, &how, nullptr), device,
        "make a texture of an image");
  return CudaTexture(texture);
}

}  // namespace widestereo
