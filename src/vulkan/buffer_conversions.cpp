// SPDX-License-Identifier: MIT
#include "vulkan/buffer_conversions.h"

#include <algorithm>
#include <array>

#include "widestereo/error.h"

namespace widestereo {
namespace {

using Direction = BufferConversion::Direction;

constexpr VkDeviceSize word = sizeof(std::uint32_t);

/// As the shaders have them behind each other.
struct PushConstants {
  kernel::PassParameters pass;
  kernel::BufferRows rows;
};
static_assert(sizeof(PushConstants) <= 128);  // every device's limit

Handle<VkDescriptorSetLayout> make_buffer_layout(const VulkanContext& context) {
  const VkDescriptorSetLayoutBinding buffer = {0, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 1,
                                               VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  return make_set_layout(context, {&buffer, 1});
}

Handle<VkPipelineLayout> make_layout(const VulkanContext& context, const VulkanBackend& backend,
                                     VkDescriptorSetLayout of_buffer) {
  const std::array sets = {backend.pipelines().set_layout(), of_buffer};
  return make_pipeline_layout(context, sets, sizeof(PushConstants));
}

/// The part of the buffer that the conversion needs, as descriptors may name it.
VkDescriptorBufferInfo part_of_buffer(const BufferConversion& conversion, int height,
                                      const VulkanContext& context) {
  const VkPhysicalDeviceLimits& limits = context.properties().limits;
  const VkDeviceSize alignment = std::max(limits.minStorageBufferOffsetAlignment, word);
  const VkDeviceSize start = conversion.offset / alignment * alignment;
  const VkDeviceSize end = conversion.offset +
                           conversion.pitch * static_cast<VkDeviceSize>(height - 1) +
                           conversion.row_bytes;
  const VkDeviceSize bytes = (end - start + word - 1) / word * word;
  if (bytes > limits.maxStorageBufferRange) {
    throw Error("An image or a map reaches over " + std::to_string(bytes) +
                " bytes of its buffer; the maxStorageBufferRange of the Vulkan device " +
                context.name() + " is " + std::to_string(limits.maxStorageBufferRange) +
                "; use a smaller pitch.");
  }
  return {conversion.buffer, start, bytes};
}

}  // namespace

BufferConversions::BufferConversions(const VulkanContext& context, const VulkanBackend& backend,
                                     const std::vector<cv::Size>& sizes, const PipelineCache& cache)
    : context_(context),
      backend_(backend),
      sizes_(sizes),
      set_layout_(make_buffer_layout(context)),
      layout_(make_layout(context, backend, set_layout_.get())),
      import_(backend.pipelines().make(context, "import_image", layout_.get(), cache.get())),
      export_(backend.pipelines().make(context, "export_map", layout_.get(), cache.get())) {}

BoundConversions BufferConversions::bind(std::span<const BufferConversion> conversions) const {
  const auto count = static_cast<std::uint32_t>(conversions.size());
  const VkDescriptorPoolSize buffers = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, count};
  BoundConversions bound;
  bound.pool = make_descriptor_pool(context_, count, {&buffers, 1});
  for (const BufferConversion& conversion : conversions) {
    const int height = sizes_.at(static_cast<std::size_t>(conversion.view)).height;
    const VkDescriptorBufferInfo part = part_of_buffer(conversion, height, context_);
    // Images are addressed by bytes, maps by words.
    const VkDeviceSize unit = conversion.direction == Direction::import_image ? 1 : word;
    const kernel::BufferRows rows = {
        static_cast<std::uint32_t>((conversion.offset - part.offset) / unit),
        static_cast<std::uint32_t>(conversion.pitch / unit), conversion.kind};
    const VkDescriptorSet set = allocate_set(context_, bound.pool.get(), set_layout_.get());
    VkWriteDescriptorSet write{};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = set;
    write.descriptorCount = 1;
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = &part;
    context_.vk().vkUpdateDescriptorSets(context_.device(), 1, &write, 0, nullptr);
    bound.all.push_back({conversion, rows, set});
  }
  return bound;
}

void BufferConversions::record(VkCommandBuffer commands, const BoundConversions& bound,
                               Direction direction) const {
  const DeviceFunctions& vk = context_.vk();
  const VkPipeline pipeline = direction == Direction::import_image ? import_.get() : export_.get();
  for (const BoundConversions::One& one : bound.all) {
    if (one.conversion.direction != direction) continue;
    const cv::Size size = sizes_.at(static_cast<std::size_t>(one.conversion.view));
    PushConstants constants{{}, one.rows};
    constants.pass.reference = one.conversion.view;
    constants.pass.colour = -1;
    constants.pass.last_row = size.height;
    const std::array sets = {backend_.descriptor_set(), one.set};
    // Between maps in one buffer, too: synchronization validation sees whole buffers only.
    backend_.record_barrier(commands);
    vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline);
    vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout_.get(), 0,
                               static_cast<std::uint32_t>(sets.size()), sets.data(), 0, nullptr);
    vk.vkCmdPushConstants(commands, layout_.get(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof constants,
                          &constants);
    vk.vkCmdDispatch(commands, workgroups(size.width), workgroups(size.height), 1);
  }
}

}  // namespace widestereo
