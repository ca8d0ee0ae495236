// SPDX-License-Identifier: MIT
#include "cuda/cuda_device.h"

#include <cuda_runtime_api.h>

#include "cuda/architectures.h"
#include "cuda/convert_maps.h"
#include "cuda/cuda_backend.h"
#include "cuda/peaks.h"
#include "text/hexadecimal.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

int driver_version() {
  int version = 0;
  return cudaDriverGetVersion(&version) == cudaSuccess ? version : 0;
}

/// "12.4" for 12040.
std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

std::string why_no_device(cudaError_t result) {
  switch (result) {
    case cudaSuccess:
    case cudaErrorNoDevice:
      return "The NVIDIA driver finds no CUDA device; check nvidia-smi and CUDA_VISIBLE_DEVICES.";
    case cudaErrorInsufficientDriver: {
      const int version = driver_version();
      if (version == 0) return "There is no NVIDIA driver; install one.";
      return "The NVIDIA driver is too old: it knows CUDA " + version_text(version) +
             ", this build needs " + version_text(CUDART_VERSION) + "; update the driver.";
    }
    default:
      return "The NVIDIA driver failed to start: " + explain(result);
  }
}

/// The number of devices, 0 with the reason in `why_none`.
int count_devices(std::string& why_none) {
  int count = 0;
  const cudaError_t result = cudaGetDeviceCount(&count);
  if (result == cudaSuccess && count > 0) return count;
  cudaGetLastError();
  why_none = why_no_device(result);
  return 0;
}

int attribute(cudaDeviceAttr which, int index) {
  int value = 0;
  return cudaDeviceGetAttribute(&value, which, index) == cudaSuccess ? value : 0;
}

DeviceInfo describe_cuda_device(int index) {
  DeviceInfo info;
  info.kind = DeviceKind::cuda;
  info.id = "cuda:" + std::to_string(index);
  cudaDeviceProp properties{};
  const cudaError_t result = cudaGetDeviceProperties(&properties, index);
  if (result != cudaSuccess) {
    cudaGetLastError();
    info.name = "CUDA device " + std::to_string(index);
    info.unusable = "Its properties cannot be read: " + explain(result);
    return info;
  }
  info.name = properties.name;
  info.filters_intensities = true;
  info.type = properties.integrated != 0 ? "integrated gpu" : "discrete gpu";
  const std::string capability =
      std::to_string(properties.major) + "." + std::to_string(properties.minor);
  info.driver =
      "CUDA driver " + version_text(driver_version()) + ", compute capability " + capability;
  info.uuid = hexadecimal(properties.uuid.bytes);
  // As attributes: CUDA 13 has no clocks among the properties.
  info.peaks = peaks_of({.major = properties.major,
                         .minor = properties.minor,
                         .multiprocessors = attribute(cudaDevAttrMultiProcessorCount, index),
                         .clock_khz = attribute(cudaDevAttrClockRate, index),
                         .memory_clock_khz = attribute(cudaDevAttrMemoryClockRate, index),
                         .bus_bits = attribute(cudaDevAttrGlobalMemoryBusWidth, index)});
  if (!runs_on(built_architectures(), properties.major, properties.minor)) {
    info.unusable = "This build has no kernels for compute capability " + capability +
                    " (only for " + built_architectures() +
                    "); build with CMAKE_CUDA_ARCHITECTURES set to it.";
  } else if (attribute(cudaDevAttrComputeMode, index) == cudaComputeModeProhibited) {
    info.unusable = "Its compute mode forbids use; set it with nvidia-smi -c 0.";
  }
  return info;
}

/// About 100 ms where a display's time limit ends kernels after seconds.
long long default_max_samples(int index) {
  if (attribute(cudaDevAttrKernelExecTimeout, index) == 0) return 0;
  return attribute(cudaDevAttrIntegrated, index) != 0 ? samples_of_integrated_gpu
                                                      : samples_of_discrete_gpu;
}

class CudaDevice final : public Device::Implementation {
 public:
  CudaDevice(int index, const DeviceRequest& request) : target_(cuda_target(index, request)) {
    info = describe_cuda_device(index);
    const CurrentDevice current(index, info.name);
    check(cudaFree(nullptr), info.name, "be started");  // makes the context
    // All files are compiled for the same devices: what runs none of these runs no kernel.
    check(load_conversions(), info.name, "load its kernels");
  }

  std::unique_ptr<Backend> make_backend(const std::vector<cv::Size>& sizes,
                                        const KernelConstants& constants) override {
    return std::make_unique<CudaBackend>(target_, sizes, constants);
  }

 private:
  CudaTarget target_;
};

}  // namespace

std::vector<DeviceInfo> list_cuda_devices(std::string* why_none) {
  std::string why;
  std::vector<DeviceInfo> list;
  const int count = count_devices(why);
  for (int index = 0; index < count; ++index) list.push_back(describe_cuda_device(index));
  if (why_none != nullptr) *why_none = why;
  return list;
}

bool cuda_driver_found() { return driver_version() > 0; }

CudaTarget cuda_target(int index, const DeviceRequest& request) {
  std::string why_none;
  const int count = count_devices(why_none);
  if (count == 0) throw Error("No CUDA device: " + why_none);
  if (index < 0 || index >= count) {
    throw Error("There is no CUDA device " + std::to_string(index) + "; this machine has " +
                std::to_string(count) + ", counted from 0.");
  }
  const DeviceInfo info = describe_cuda_device(index);
  if (!info.unusable.empty()) {
    throw Error("The CUDA device " + info.name + " cannot be used: " + info.unusable);
  }
  const long long asked = request.max_samples_per_dispatch;
  return {.ordinal = index,
          .name = info.name,
          .max_samples = asked > 0 ? asked : default_max_samples(index)};
}

std::unique_ptr<Device::Implementation> open_cuda_device(int index, const DeviceRequest& request) {
  return std::make_unique<CudaDevice>(index, request);
}

}  // namespace widestereo
