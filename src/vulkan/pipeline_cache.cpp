// SPDX-License-Identifier: MIT
#include "vulkan/pipeline_cache.h"

#include <array>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

/// Precedes the driver's data, which a driver may trust blindly.
struct FileHeader {
  std::array<char, 8> magic = {'w', 's', 't', 'c', 'a', 'c', 'h', 'e'};
  std::uint64_t bytes = 0;
  std::uint64_t checksum = 0;
};

/// FNV-1a, 64 bits.
std::uint64_t checksum(const char* data, std::size_t bytes) {
  std::uint64_t hash = 14695981039346656037u;
  for (std::size_t i = 0; i < bytes; ++i) {
    hash = (hash ^ static_cast<unsigned char>(data[i])) * 1099511628211u;
  }
  return hash;
}

bool made_by(const std::vector<char>& data, const VkPhysicalDeviceProperties& device) {
  VkPipelineCacheHeaderVersionOne header{};
  if (data.size() < sizeof header) return false;
  std::memcpy(&header, data.data(), sizeof header);
  return header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE &&
         header.headerSize >= sizeof header && header.vendorID == device.vendorID &&
         header.deviceID == device.deviceID &&
         std::memcmp(header.pipelineCacheUUID, device.pipelineCacheUUID, VK_UUID_SIZE) == 0;
}

/// The driver's data, empty unless the file is intact and of this device.
std::vector<char> read_cache(const std::filesystem::path& path,
                             const VkPhysicalDeviceProperties& device) {
  std::ifstream file(path, std::ios::binary);
  FileHeader header;
  const FileHeader expected;
  if (!file.read(reinterpret_cast<char*>(&header), sizeof header)) return {};
  const std::vector<char> data{std::istreambuf_iterator<char>(file), {}};
  const bool intact = header.magic == expected.magic && header.bytes == data.size() &&
                      header.checksum == checksum(data.data(), data.size());
  return intact && made_by(data, device) ? data : std::vector<char>{};
}

}  // namespace

PipelineCache::PipelineCache(const VulkanContext& context, std::filesystem::path path)
    : context_(context), path_(std::move(path)) {
  if (!path_.empty()) saved_ = read_cache(path_, context.properties());
  VkPipelineCacheCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
  info.initialDataSize = saved_.size();
  info.pInitialData = saved_.data();
  VkPipelineCache cache = VK_NULL_HANDLE;
  context.check(context.vk().vkCreatePipelineCache(context.device(), &info, nullptr, &cache),
                "make a pipeline cache");
  cache_ = context.own(cache, context.vk().vkDestroyPipelineCache);
}

std::vector<char> PipelineCache::data() const {
  const DeviceFunctions& vk = context_.vk();
  std::size_t bytes = 0;
  context_.check(vk.vkGetPipelineCacheData(context_.device(), get(), &bytes, nullptr),
                 "read its pipeline cache");
  std::vector<char> data(bytes);
  context_.check(vk.vkGetPipelineCacheData(context_.device(), get(), &bytes, data.data()),
                 "read its pipeline cache");
  data.resize(bytes);
  return data;
}

void PipelineCache::save() {
  if (path_.empty()) return;
  std::vector<char> current = data();
  if (current == saved_) return;
  FileHeader header;
  header.bytes = current.size();
  header.checksum = checksum(current.data(), current.size());
  write_file(path_, [&](std::ostream& stream) {
    stream.write(reinterpret_cast<const char*>(&header), sizeof header);
    stream.write(current.data(), static_cast<std::streamsize>(current.size()));
  });
  saved_ = std::move(current);
}

}  // namespace widestereo
