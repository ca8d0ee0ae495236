// SPDX-License-Identifier: MIT
// Owners of the CUDA runtime's objects. Their owner keeps the objects' device current while they
// are made and destroyed.
#pragma once

#include <cuda_runtime_api.h>

#include <cstddef>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "cuda/result.h"
#include "text/mebibytes.h"

namespace widestereo {

/// Makes a device current in this thread for a scope; -1 leaves whichever is current.
class SelectedDevice {
 public:
  SelectedDevice(int ordinal, const std::string& name) {
    if (ordinal < 0) return;
    check(cudaGetDevice(&previous_), name, "be found by the CUDA runtime");
    if (previous_ == ordinal) return;
    const cudaError_t result = cudaSetDevice(ordinal);
    if (result != cudaSuccess) restore();  // it may have changed it nevertheless
    check(result, name, "be made current");
    changed_ = true;
  }
  ~SelectedDevice() {
    if (changed_) restore();
  }
  SelectedDevice(const SelectedDevice&) = delete;
  SelectedDevice& operator=(const SelectedDevice&) = delete;

 private:
  void restore() const {
    // The application's next question must not get an error of this.
    if (cudaSetDevice(previous_) != cudaSuccess) cudaGetLastError();
  }

  int previous_ = 0;
  bool changed_ = false;
};

/// Lets this thread allocate and free for a scope while another one captures, which the default
/// mode of captures forbids. What is called on no capturing stream does not disturb them.
class RelaxedCaptures {
 public:
  explicit RelaxedCaptures(const std::string& name) {
    check(cudaThreadExchangeStreamCaptureMode(&mode_), name, "work while others capture");
  }
  ~RelaxedCaptures() { cudaThreadExchangeStreamCaptureMode(&mode_); }
  RelaxedCaptures(const RelaxedCaptures&) = delete;
  RelaxedCaptures& operator=(const RelaxedCaptures&) = delete;

 private:
  cudaStreamCaptureMode mode_ = cudaStreamCaptureModeRelaxed;
};

/// What all work on a device needs of this thread, for a scope; -1: on whichever is current.
class CurrentDevice {
 public:
  CurrentDevice(int ordinal, const std::string& name) : device_(ordinal, name), captures_(name) {}

 private:
  SelectedDevice device_;
  RelaxedCaptures captures_;  // then: a first call may make a context on the current device
};

template <auto destroy>
struct CudaDestroy {
  template <class T>
  void operator()(T* object) const {
    destroy(object);
  }
};
using CudaStream =
    std::unique_ptr<std::remove_pointer_t<cudaStream_t>, CudaDestroy<&cudaStreamDestroy>>;
using CudaEvent =
    std::unique_ptr<std::remove_pointer_t<cudaEvent_t>, CudaDestroy<&cudaEventDestroy>>;
using CudaGraph =
    std::unique_ptr<std::remove_pointer_t<cudaGraph_t>, CudaDestroy<&cudaGraphDestroy>>;
using CudaGraphExec =
    std::unique_ptr<std::remove_pointer_t<cudaGraphExec_t>, CudaDestroy<&cudaGraphExecDestroy>>;

class CudaTexture {
 public:
  CudaTexture() = default;
  explicit CudaTexture(cudaTextureObject_t object) : object_(object) {}
  CudaTexture(CudaTexture&& other) noexcept : object_(std::exchange(other.object_, 0)) {}
  CudaTexture& operator=(CudaTexture&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~CudaTexture() {
    if (object_ != 0) cudaDestroyTextureObject(object_);
  }
  cudaTextureObject_t get() const { return object_; }

 private:
  cudaTextureObject_t object_ = 0;
};

/// Host memory that the device writes by itself, or, where so much cannot be pinned, any other one,
/// which a driver fills by way of its own, at a fraction of the speed.
class TransferMemory {
 public:
  TransferMemory() = default;
  TransferMemory(std::size_t bytes, const std::string& device) {
    void* memory = nullptr;
    const cudaError_t result = cudaMallocHost(&memory, bytes);
    if (result == cudaErrorMemoryAllocation) {
      cudaGetLastError();
      pageable_.resize(bytes);
      return;
    }
    check(result, device, "pin " + mebibytes(bytes) + " of the host's memory for transfers");
    pinned_.reset(memory);
  }

  /// Null where there is none yet.
  void* get() { return pinned_ ? pinned_.get() : pageable_.data(); }

 private:
  std::unique_ptr<void, CudaDestroy<&cudaFreeHost>> pinned_;
  std::vector<unsigned char> pageable_;
};

/// Device memory of a number of T, which the stream makes all zero. Nothing here waits for the
/// whole device or uses its default stream: that would end what other threads capture on it.
template <class T>
class DeviceArray {
 public:
  DeviceArray() = default;
  DeviceArray(std::size_t count, cudaStream_t stream, const std::string& device,
              const std::string& purpose)
      : bytes_(count * sizeof(T)) {
    void* memory = nullptr;
    const std::string action = "allocate " + mebibytes(bytes_) + " for " + purpose;
    check(cudaMalloc(&memory, bytes_), device, action);
    memory_.reset(static_cast<T*>(memory));
    check(cudaMemsetAsync(memory, 0, bytes_, stream), device, "clear " + purpose);
  }

  T* get() const { return memory_.get(); }
  std::size_t bytes() const { return bytes_; }

 private:
  struct Free {
    void operator()(T* memory) const { cudaFree(memory); }
  };
  std::unique_ptr<T, Free> memory_;
  std::size_t bytes_ = 0;
};

}  // namespace widestereo
