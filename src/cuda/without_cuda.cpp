// SPDX-License-Identifier: MIT
// Stands for the CUDA back end in builds without it.
#include "cuda/cuda_device.h"
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

}  // namespace widestereo
