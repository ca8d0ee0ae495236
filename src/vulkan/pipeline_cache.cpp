// SPDX-License-Identifier: MIT
#include "vulkan/pipeline_cache.h"

#include <array>
#include <cstring>
#include <fstream>
#include <optional>
#include <system_error>
#include <utility>

#include "widestereo/error.h"
#include "widestereo/files.h"

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

/// Of a file that begins as ours do, though it may end within the header.
std::optional<FileHeader> header_of(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return std::nullopt;
  const FileHeader expected;
  FileHeader header;
  header.magic = {};
  std::ifstream(path, std::ios::binary).read(reinterpret_cast<char*>(&header), sizeof header);
  return header.magic == expected.magic ? std::optional(header) : std::nullopt;
}

/// Whether nothing else is lost, however the file was given.
bool may_be_replaced(const std::filesystem::path& path) {
  std::error_code ignored;
  return !std::filesystem::exists(path, ignored) || header_of(path) ||
         (std::filesystem::is_regular_file(path, ignored) &&
          std::filesystem::is_empty(path, ignored));
}

/// The driver's data, empty unless the file is intact and of this device.
std::vector<char> read_cache(const std::filesystem::path& path,
                             const VkPhysicalDeviceProperties& device) {
  const std::optional<FileHeader> header = header_of(path);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  constexpr std::uint64_t most_bytes = 1 << 30;
  const bool is_whole = header && !error && header->bytes <= most_bytes && size >= sizeof *header &&
                        size - sizeof *header == header->bytes;
  if (!is_whole) return {};
  std::vector<char> data(header->bytes);
  std::ifstream file(path, std::ios::binary);
  file.seekg(sizeof *header);
  file.read(data.data(), static_cast<std::streamsize>(data.size()));
  const bool intact = file && header->checksum == checksum(data.data(), data.size());
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
  std::vector<char> data;
  VkResult result = VK_INCOMPLETE;  // also where the driver added something in between
  while (result == VK_INCOMPLETE) {
    std::size_t bytes = 0;
    context_.check(vk.vkGetPipelineCacheData(context_.device(), get(), &bytes, nullptr),
                   "read its pipeline cache");
    data.resize(bytes);
    result = vk.vkGetPipelineCacheData(context_.device(), get(), &bytes, data.data());
    data.resize(bytes);
  }
  context_.check(result, "read its pipeline cache");
  return data;
}

void PipelineCache::save() {
  if (path_.empty()) return;
  const std::lock_guard lock(saving_);
  std::vector<char> current = data();
  if (current == saved_) return;
  if (!may_be_replaced(path_)) {
    throw Error(path_.string() +
                " is there already and is no pipeline cache; give the name of a new file.");
  }
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
