// SPDX-License-Identifier: MIT
#include "cuda/result.h"

#include <cuda_runtime_api.h>

#include "widestereo/error.h"

namespace widestereo {

std::string explain(cudaError_t result) {
  const std::string name = std::string(" (") + cudaGetErrorName(result) + ")";
  switch (result) {
    case cudaErrorMemoryAllocation:
      return "out of memory; use smaller images, fewer levels or another device.";
    case cudaErrorNoKernelImageForDevice:
    case cudaErrorInvalidDeviceFunction:
    case cudaErrorUnsupportedPtxVersion:
      return "this build has no kernels for its architecture; build with CMAKE_CUDA_ARCHITECTURES "
             "for it, or update the driver" +
             name + ".";
    case cudaErrorCallRequiresNewerDriver:
      return "the NVIDIA driver is too old for this build; update the driver" + name + ".";
    case cudaErrorStreamCaptureImplicit:
      return "another thread captures on a stream that waits for the default stream; use a stream "
             "of your own, or capture on a non-blocking one" +
             name + ".";
    case cudaErrorDevicesUnavailable:
      return "it is busy or its compute mode forbids use; close the program that holds it or set "
             "the mode with nvidia-smi -c 0" +
             name + ".";
    case cudaErrorLaunchTimeout:
      return "a kernel ran into the display's time limit; restart the program with smaller "
             "dispatches (max_samples_per_dispatch; of a CudaMatcher smaller images).";
    // After these nothing works on the device until the process ends.
    case cudaErrorIllegalAddress:
    case cudaErrorLaunchFailure:
    case cudaErrorHardwareStackError:
    case cudaErrorIllegalInstruction:
    case cudaErrorMisalignedAddress:
    case cudaErrorInvalidAddressSpace:
    case cudaErrorInvalidPc:
    case cudaErrorECCUncorrectable:
    case cudaErrorAssert:
      return "the device was lost" + name +
             "; restart the program, and check the driver's log if this repeats.";
    case cudaErrorUnknown:
      return "the driver failed" + name +
             "; restart the program, and if this repeats, as after a suspend, load the driver's "
             "module nvidia_uvm again or restart the machine.";
    default:
      return std::string(cudaGetErrorString(result)) + name + ".";
  }
}

void check(cudaError_t result, const std::string& device, const std::string& action) {
  if (result == cudaSuccess) return;
  cudaGetLastError();
  throw Error(device + " could not " + action + ": " + explain(result));
}

}  // namespace widestereo
