// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <memory>
#include <string>
#include <vector>

#include "widestereo/error.h"

namespace widestereo {

enum class DeviceKind { cpu, vulkan, cuda };

/// What a device can do at most, as follows from its description; 0 where that is not known.
struct DevicePeaks {
  double gflops = 0;   ///< 10^9 single-precision operations a second, a multiply-add being two
  double gtexels = 0;  ///< 10^9 texels of four bytes a second
  double gbps = 0;     ///< 10^9 bytes a second to and from device memory
};

struct DeviceInfo {
  DeviceKind kind = DeviceKind::cpu;
  std::string id;        ///< what Device::open takes: "cpu", "vulkan:0", "cuda:0"
  std::string name;      ///< as the driver says
  std::string type;      ///< "cpu", "discrete gpu", "integrated gpu", "virtual gpu", "other"
  std::string driver;    ///< name and version, where known; of the CPU, its threads
  std::string uuid;      ///< 32 hexadecimal digits, empty for the CPU
  std::string unusable;  ///< why the device cannot be used, empty if it can
  DevicePeaks peaks;     ///< known for CUDA devices only
  bool filters_intensities = false;  ///< its texture units can (Filter::device)
};

struct DeviceRequest {
  /// "auto" (the best CUDA device, else the best Vulkan device, else the CPU), "cpu", "cuda",
  /// "vulkan", and either of the two with ":INDEX", ":NAME PART" or ":UUID"; a number is an index.
  std::string device = "auto";
  bool validation = false;  ///< Vulkan: validation layers with synchronization validation
  /// Vulkan: file that keeps compiled pipelines between runs, empty for none. Matchers write it,
  /// and throw Error where they cannot.
  std::string pipeline_cache = {};
  /// GPUs: longest dispatch in patch samples, so that slow devices answer within watchdog limits;
  /// 0 chooses by device. The result does not depend on it.
  long max_samples_per_dispatch = 0;
};

/// A compute device. Owns its handles; movable, not thread-safe; devices are independent of each
/// other.
class Device {
 public:
  /// Throws Error where no device has that name or the one that has cannot be used as asked for,
  /// naming the cause and the remedy. "auto" passes such devices over (note()), "cpu" is always
  /// there; neither throws.
  static Device open(const DeviceRequest& request);
  /// The same with the other requests at their defaults. A template, which no braces call: to
  /// g++ 12 {.device = "cpu"} could be a string, too.
  template <std::convertible_to<std::string> Name>
  static Device open(const Name& device) {
    return open(DeviceRequest{.device = device});
  }
  /// All devices of this machine, best first: the CPU after all that can be used, then those that
  /// cannot. Never throws for a missing driver.
  static std::vector<DeviceInfo> list();
  /// Why list() has no device of this kind, one sentence; empty if it has.
  static std::string why_none(DeviceKind kind);

  ~Device();
  Device(Device&&) noexcept;
  Device& operator=(Device&&) noexcept;

  const DeviceInfo& info() const;
  /// For the user: which devices at least as good `auto`, `cuda` or `vulkan` passed over, as they
  /// cannot be used or did not open, and why; empty if none.
  const std::string& note() const;
  /// Messages of the validation layers so far (errors and warnings).
  std::vector<std::string> validation_messages() const;

  class Implementation;  // src/matching/backend.h
  explicit Device(std::unique_ptr<Implementation> implementation);
  Implementation& implementation() const { return *implementation_; }

 private:
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace widestereo
