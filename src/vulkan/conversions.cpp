// SPDX-License-Identifier: MIT
#include "vulkan/conversions.h"

#include <algorithm>

#include "widestereo/error.h"

namespace widestereo {
namespace {

using Way = Conversion::Way;

constexpr VkDeviceSize word = sizeof(std::uint32_t);

/// As the shaders have them behind each other.
struct PushConstants {
  kernel::PassParameters pass;
  kernel::ConversionParameters conversion;
};
static_assert(sizeof(PushConstants) <= 128);  // every device's limit

/// What the kernels of a way are called and bind.
struct Kind {
  const char* kernel;
  VkDescriptorType descriptor;
};
constexpr std::array<Kind, Conversion::ways> kinds = {{
    {"import_image", VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
    {"import_texture", VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE},
    {"export_map", VK_DESCRIPTOR_TYPE_STORAGE_BUFFER},
}};

std::size_t index(Way way) { return static_cast<std::size_t>(way); }

/// The part of the buffer that the conversion needs, as descriptors may name it.
VkDescriptorBufferInfo part_of_buffer(const Conversion& conversion, int height,
                                      const VulkanContext& context) {
  const VkPhysicalDeviceLimits& limits = context.properties().limits;
  const VkDeviceSize alignment = std::max(limits.minStorageBufferOffsetAlignment, word);
  const VkDeviceSize start = conversion.offset / alignment * alignment;
  // 32 bits of the limit and of a pitch within it leave room for all rows in 64.
  const VkDeviceSize pitch = std::min<VkDeviceSize>(conversion.pitch, UINT32_MAX);
  const VkDeviceSize length = conversion.offset - start +
                              pitch * static_cast<VkDeviceSize>(height - 1) + conversion.row_bytes;
  const VkDeviceSize bytes = (length + word - 1) / word * word;
  if (bytes > limits.maxStorageBufferRange || pitch != conversion.pitch) {
    throw Error(conversion.name + " with a pitch of " + std::to_string(conversion.pitch) +
                " bytes reaches over " + std::to_string(bytes) +
                " bytes of its buffer or more; the maxStorageBufferRange of the Vulkan device " +
                context.name() + " is " + std::to_string(limits.maxStorageBufferRange) +
                "; use a smaller pitch.");
  }
  return {conversion.buffer, start, bytes};
}

VkWriteDescriptorSet write_of(Way way, VkDescriptorSet set) {
  VkWriteDescriptorSet write{};
  write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
  write.dstSet = set;
  write.descriptorCount = 1;
  write.descriptorType = kinds[index(way)].descriptor;
  return write;
}

}  // namespace

Conversions::Conversions(const VulkanContext& context, const VulkanBackend& backend,
                         const std::vector<cv::Size>& sizes)
    : context_(context), backend_(backend), sizes_(sizes) {
  for (std::size_t i = 0; i < ways_.size(); ++i) {
    OfWay& way = ways_[i];
    const VkDescriptorSetLayoutBinding binding = {0, kinds[i].descriptor, 1,
                                                  VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
    way.set_layout = make_set_layout(context, {&binding, 1});
    const std::array sets = {backend.pipelines().set_layout(), way.set_layout.get()};
    way.layout = make_pipeline_layout(context, sets, sizeof(PushConstants));
    way.pipeline = backend.pipelines().make(kinds[i].kernel, way.layout.get());
  }
}

BoundConversions Conversions::bind(const std::vector<Conversion>& conversions) const {
  const auto count = static_cast<std::uint32_t>(conversions.size());
  const std::array<VkDescriptorPoolSize, 2> descriptors = {{
      {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, count},
      {VK_DESCRIPTOR_TYPE_SAMPLED_IMAGE, count},
  }};
  BoundConversions bound;
  bound.pool = make_descriptor_pool(context_, count, descriptors);
  for (const Conversion& conversion : conversions) {
    const VkDescriptorSet set =
        allocate_set(context_, bound.pool.get(), ways_[index(conversion.way)].set_layout.get());
    bound.all.push_back(conversion.way == Way::image_from_texture ? bind_texture(conversion, set)
                                                                  : bind_buffer(conversion, set));
  }
  return bound;
}

BoundConversions::One Conversions::bind_buffer(const Conversion& conversion,
                                               VkDescriptorSet set) const {
  const int height = sizes_.at(static_cast<std::size_t>(conversion.view)).height;
  const VkDescriptorBufferInfo part = part_of_buffer(conversion, height, context_);
  VkWriteDescriptorSet write = write_of(conversion.way, set);
  write.pBufferInfo = &part;
  context_.vk().vkUpdateDescriptorSets(context_.device(), 1, &write, 0, nullptr);
  // Images are addressed by bytes, maps by words.
  const VkDeviceSize unit = conversion.way == Way::image_from_buffer ? 1 : word;
  return {conversion.way,
          conversion.view,
          {static_cast<std::uint32_t>((conversion.offset - part.offset) / unit),
           static_cast<std::uint32_t>(conversion.pitch / unit), conversion.kind},
          set};
}

BoundConversions::One Conversions::bind_texture(const Conversion& conversion,
                                                VkDescriptorSet set) const {
  const VkDescriptorImageInfo image = {VK_NULL_HANDLE, conversion.texture, conversion.layout};
  VkWriteDescriptorSet write = write_of(conversion.way, set);
  write.pImageInfo = &image;
  context_.vk().vkUpdateDescriptorSets(context_.device(), 1, &write, 0, nullptr);
  return {conversion.way, conversion.view, {0, 0, conversion.kind}, set};
}

void Conversions::record_images(VkCommandBuffer commands, const BoundConversions& bound) const {
  for (const BoundConversions::One& one : bound.all) {
    if (one.way != Way::map_to_buffer) record(commands, one);
  }
}

void Conversions::record_maps(VkCommandBuffer commands, const BoundConversions& bound) const {
  for (const BoundConversions::One& one : bound.all) {
    if (one.way == Way::map_to_buffer) record(commands, one);
  }
}

void Conversions::record(VkCommandBuffer commands, const BoundConversions::One& one) const {
  const DeviceFunctions& vk = context_.vk();
  const OfWay& way = ways_[index(one.way)];
  const cv::Size size = sizes_.at(static_cast<std::size_t>(one.view));
  PushConstants constants{{}, one.parameters};
  constants.pass.reference = one.view;
  constants.pass.colour = -1;
  constants.pass.last_row = size.height;
  const std::array sets = {backend_.descriptor_set(0), one.set};
  // Between maps in one buffer, too: synchronization validation sees whole buffers only.
  backend_.record_barrier(commands);
  vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, way.pipeline.get());
  vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, way.layout.get(), 0,
                             static_cast<std::uint32_t>(sets.size()), sets.data(), 0, nullptr);
  vk.vkCmdPushConstants(commands, way.layout.get(), VK_SHADER_STAGE_COMPUTE_BIT, 0,
                        sizeof constants, &constants);
  const Pipelines& pipelines = backend_.pipelines();
  vk.vkCmdDispatch(commands, pipelines.workgroups_of_row(size.width),
                   pipelines.workgroups_of_column(size.height), 1);
}

}  // namespace widestereo
