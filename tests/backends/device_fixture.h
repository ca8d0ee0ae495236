// SPDX-License-Identifier: MIT
// Devices for tests that run on every back end, with the Vulkan validation layers on.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

#include "widestereo/device.h"
#include "widestereo/error.h"

namespace widestereo::test {

/// Whether this machine must have the device: a missing one then fails a test instead of skipping
/// it.
inline bool is_required(const std::string& device) {
  const bool cuda = device.starts_with("cuda");
  return std::getenv(cuda ? "WIDESTEREO_REQUIRE_CUDA" : "WIDESTEREO_REQUIRE_VULKAN") != nullptr;
}

/// Opens a device, or skips the test with the reason; where WIDESTEREO_REQUIRE_VULKAN (for CUDA
/// devices WIDESTEREO_REQUIRE_CUDA) is set, a missing device or validation layer fails it instead.
#define OPEN_DEVICE_OR_SKIP(device, name)                              \
  std::optional<::widestereo::Device> device;                          \
  try {                                                                \
    device.emplace(::widestereo::test::open_validated(name));          \
  } catch (const ::widestereo::Error& error) {                         \
    if (::widestereo::test::is_required(name)) FAIL() << error.what(); \
    GTEST_SKIP() << error.what();                                      \
  }

inline Device open_validated(const std::string& name, long max_samples_per_dispatch = 0) {
  DeviceRequest request;
  request.device = name;
  request.validation = name.starts_with("vulkan");
  request.max_samples_per_dispatch = max_samples_per_dispatch;
  return Device::open(request);
}

/// Empty where exact filtering gives the same bits as on the CPU.
inline std::string why_bits_may_differ(const DeviceInfo& info) {
  if (info.kind != DeviceKind::vulkan || info.driver.find("Mesa 22.3") != std::string::npos) {
    return "";
  }
  return "Vulkan drivers may contract and reorder; Mesa 22.3's lavapipe does not.";
}
inline std::string why_bits_may_differ(const Device& device) {
  return why_bits_may_differ(device.info());
}

/// To be called at the end of a test: any message of the validation layers fails it.
inline void expect_no_validation_messages(const Device& device) {
  for (const std::string& message : device.validation_messages()) ADD_FAILURE() << message;
}

}  // namespace widestereo::test
