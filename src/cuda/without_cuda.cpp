// SPDX-License-Identifier: MIT
// Stands for the CUDA back end in builds without it.
#include "cuda/cuda_device.h"
#include "widestereo/cuda.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr const char* built_without =
    "This program was built without CUDA; build it where nvcc is installed (WIDESTEREO_CUDA=ON).";

}  // namespace

std::vector<DeviceInfo> list_cuda_devices(std::string* why_none) {
  if (why_none != nullptr) *why_none = built_without;
  return {};
}

bool cuda_driver_found() { return false; }

std::unique_ptr<Device::Implementation> open_cuda_device(int, const DeviceRequest&) {
  throw Error(std::string("No CUDA device: ") + built_without);
}

class CudaMatcher::Implementation {};

CudaMatcher::CudaMatcher(const Rig&, const Options&, int) {
  throw Error(std::string("No CUDA device: ") + built_without);
}
CudaMatcher::~CudaMatcher() = default;
CudaMatcher::CudaMatcher(CudaMatcher&&) noexcept = default;
CudaMatcher& CudaMatcher::operator=(CudaMatcher&&) noexcept = default;
void CudaMatcher::enqueue(std::span<const CudaImage>, std::span<const CudaViewMaps>, CUstream_st*) {
}
void CudaMatcher::enqueue_next(std::span<const CudaImage>, std::span<const CudaViewMaps>,
                               CUstream_st*, const CudaWarmStart&) {}
Filter CudaMatcher::filter() const { return Filter::exact; }
std::size_t CudaMatcher::device_bytes() const { return 0; }

}  // namespace widestereo
