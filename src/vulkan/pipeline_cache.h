// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <mutex>
#include <vector>

#include "vulkan/context.h"

namespace widestereo {

/// Compiled pipelines kept in a file between runs. The file carries a checksum and is used only if
/// it is intact and of this very device and driver; other caches are ignored and replaced.
/// Matchers may be made in several threads at once: Vulkan itself guards get().
class PipelineCache {
 public:
  /// `path`: empty for a cache that is not kept.
  PipelineCache(const VulkanContext& context, std::filesystem::path path);

  VkPipelineCache get() const { return cache_.get(); }
  bool loaded_from_file() const { return !saved_.empty(); }
  /// Writes the file if the driver's data have changed. Throws Error when it cannot be written or
  /// is something else.
  void save();

 private:
  std::vector<char> data() const;

  const VulkanContext& context_;
  std::filesystem::path path_;
  std::mutex saving_;
  std::vector<char> saved_;  // what the file holds
  Handle<VkPipelineCache> cache_;
};

}  // namespace widestereo
