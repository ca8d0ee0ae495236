// SPDX-License-Identifier: MIT
#include "cuda/device_image.h"

#include <algorithm>
#include <vector>

#include "cuda/kernels.h"

namespace widestereo {
namespace {

/// Waits for the stream.
template <class Texel>
void fill(void* memory, std::size_t count, Texel value, cudaStream_t stream,
          const std::string& device) {
  constexpr std::size_t most_at_once = 1 << 18;  // of the host's memory
  const std::vector<Texel> values(std::min(count, most_at_once), value);
  for (std::size_t done = 0; done < count; done += values.size()) {
    const std::size_t bytes = std::min(values.size(), count - done) * sizeof(Texel);
    check(cudaMemcpyAsync(static_cast<Texel*>(memory) + done, values.data(), bytes,
                          cudaMemcpyHostToDevice, stream),
          device, "clear the images");
  }
  check(cudaStreamSynchronize(stream), device, "clear the images");
}

}  // namespace

DeviceImage::DeviceImage(cv::Size size, int apron, int texel_bytes, cudaStream_t stream,
                         const std::string& device)
    : size_(size), apron_(apron), texel_bytes_(texel_bytes) {
  // Rows of whole cache lines, which are also what textures ask for.
  const int line = 128 / texel_bytes;
  stride_ = (size.width + line - 1) / line * line;
  const std::size_t count =
      static_cast<std::size_t>(stride_) * static_cast<std::size_t>(size.height);
  memory_ = DeviceArray<unsigned char>(count * static_cast<std::size_t>(texel_bytes), stream,
                                       device, "the images");
  if (texel_bytes == sizeof(float)) {
    fill(memory_.get(), count, MASKED_INTENSITY, stream, device);
  } else {
    fill(memory_.get(), count, kernel::cuda::lowest_half_bits, stream, device);
  }
}

CudaTexture DeviceImage::make_texture(const std::string& device) const {
  cudaResourceDesc resource{};
  resource.resType = cudaResourceTypePitch2D;
  resource.res.pitch2D.devPtr = memory_.get();
  resource.res.pitch2D.desc =
      cudaCreateChannelDesc(8 * texel_bytes_, 0, 0, 0, cudaChannelFormatKindFloat);
  resource.res.pitch2D.width = static_cast<std::size_t>(size_.width);
  resource.res.pitch2D.height = static_cast<std::size_t>(size_.height);
  resource.res.pitch2D.pitchInBytes = static_cast<std::size_t>(stride_ * texel_bytes_);
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
