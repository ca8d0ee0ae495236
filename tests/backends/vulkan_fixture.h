// SPDX-License-Identifier: MIT
// A small match on the first Vulkan device, and a loader that fails on demand.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <functional>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "backend_fixture.h"
#include "error_of.h"
#include "kernel/kernel_fixture.h"
#include "vulkan/instance.h"
#include "vulkan/loader.h"
#include "vulkan/pipeline_cache.h"
#include "vulkan/vulkan_device.h"
#include "widestereo/error.h"

namespace widestereo::test {

/// Skips the test where there is no Vulkan device; where WIDESTEREO_REQUIRE_VULKAN is set it fails
/// instead.
#define REQUIRE_VULKAN_OR_SKIP()                                                   \
  do {                                                                             \
    std::string why_none;                                                          \
    if (::widestereo::list_vulkan_devices(&why_none).empty()) {                    \
      if (std::getenv("WIDESTEREO_REQUIRE_VULKAN") != nullptr) FAIL() << why_none; \
      GTEST_SKIP() << why_none;                                                    \
    }                                                                              \
  } while (false)

/// Cold and warm matches with the presets paper and fast together have every kernel.
inline Options options_of_small_match(const std::string& preset) {
  Options options = Options::preset_named(preset);
  options.min_distance = 0.3;
  options.max_distance = 10;
  options.window_radius = 2;
  options.first_iterations = 2;
  options.second_iterations = 1;
  if (preset == "fast") {
    options.ambiguity_margin = 0.2;
    options.fill_radius = 4;
  }
  return options;
}

/// Two views of different sizes, which also are no multiples of a workgroup.
inline KernelFixture small_match(const std::string& preset = "paper") {
  Rig rig = fisheye_rig(45);
  rig.views[1].camera = fisheye_camera(38);
  return KernelFixture(std::move(rig), options_of_small_match(preset));
}

/// All maps of a match in one matrix of a single column, for comparing bits.
inline cv::Mat download(Backend& backend, const Rig& rig) {
  cv::Mat all;
  for (int i = 0; i < static_cast<int>(rig.views.size()); ++i) {
    const auto append = [&all](const cv::Mat& map) {
      all.push_back(map.reshape(1, static_cast<int>(map.total()) * 4));
    };
    append(backend.hypotheses(i));
    append(backend.checks(i));
  }
  return all;
}

inline cv::Mat run(Backend& backend, KernelFixture& match) {
  upload(backend, match);
  backend.run(match.schedule(), {});
  return download(backend, match.rig());
}

inline cv::Mat run(Device::Implementation& device, KernelFixture& match) {
  return run(*make_backend(device, match.schedule()), match);
}

/// Parts of an application that has a device of its own.
struct Application {
  explicit Application(bool validation = true)
      : instance(loader.get_instance_proc_addr(), validation),
        context(loader.get_instance_proc_addr(), instance.handle(),
                instance.physical_devices().at(0)),
        cache(context, {}) {}

  VulkanLoader loader;
  VulkanInstance instance;
  VulkanContext context;
  PipelineCache cache;
};

/// What the faulty loader does wrong; one at a time, reset by its owner.
struct Faults {
  int failing_allocation = -1;  ///< the n-th vkAllocateMemory is out of device memory
  int failing_submission = -1;  ///< the n-th vkQueueSubmit loses the device
  int failing_wait = -1;        ///< the n-th vkWaitForFences loses the device
  /// The n-th call of another function of the device is out of host memory.
  std::string failing_function = {};
  int failing_call = 0;
  bool no_layers = false;
  bool no_formats = false;
  bool no_filtering = false;                      ///< images of no format can be filtered
  bool no_filtering_of_floats = false;            ///< likewise of 32 bits
  std::optional<VkPhysicalDeviceType> type = {};  ///< what the device says it is
  /// Instead of the device's own, if any.
  std::vector<VkQueueFamilyProperties> queue_families = {};
  bool old_device = false;  ///< Vulkan 1.0
  std::uint32_t largest_image = 0;
  VkDeviceSize largest_resource = 0;
  VkDeviceSize largest_allocation = 0;
  std::uint32_t largest_push_constants = 0;
  std::uint32_t largest_buffer = 0;  ///< bytes
  std::uint32_t storage_buffers = 0;
  std::uint32_t storage_images = 0;
  std::string missing_function = {};
  int growing_caches = 0;  ///< how often a pipeline cache grows while it is read
  int allocations = 0;
  int submissions = 0;
  int waits = 0;
  std::map<std::string, int> calls = {};  ///< of such functions
};

/// A vkGetInstanceProcAddr around the machine's that injects faults(). The Vulkan API passes no
/// user data to it, so the state is static; tests run one after the other.
class FaultyLoader {
 public:
  static Faults& faults();
  static PFN_vkGetInstanceProcAddr get_instance_proc_addr();
  /// Clears the faults at the end of a scope.
  struct Scope {
    Scope() { faults() = {}; }
    ~Scope() { faults() = {}; }
  };
};

/// Does `work` on a device of its own again and again while one function after the other that makes
/// something fails, in the middle one of its calls, and finds what is left.
void expect_failures_leave_no_object(const std::function<void(const VulkanContext&)>& work);

}  // namespace widestereo::test
