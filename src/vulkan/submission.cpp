// SPDX-License-Identifier: MIT
#include "vulkan/submission.h"

#include <limits>
#include <utility>

namespace widestereo {
namespace {

constexpr std::uint64_t no_timeout = std::numeric_limits<std::uint64_t>::max();

}  // namespace

Handle<VkCommandPool> make_command_pool(const VulkanContext& context) {
  VkCommandPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  info.flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT;
  info.queueFamilyIndex = context.queue_family();
  VkCommandPool pool = VK_NULL_HANDLE;
  context.check(context.vk().vkCreateCommandPool(context.device(), &info, nullptr, &pool),
                "make a command pool");
  return context.own(pool, context.vk().vkDestroyCommandPool);
}

Submission::Submission(const VulkanContext& context, VkCommandPool pool,
                       std::uint32_t max_timestamps)
    : context_(context), max_timestamps_(max_timestamps) {
  const DeviceFunctions& vk = context.vk();
  VkCommandBufferAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  info.commandPool = pool;
  info.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  info.commandBufferCount = 1;
  context.check(vk.vkAllocateCommandBuffers(context.device(), &info, &commands_),
                "make a command buffer");

  VkFenceCreateInfo fence_info{};
  fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  VkFence fence = VK_NULL_HANDLE;
  context.check(vk.vkCreateFence(context.device(), &fence_info, nullptr, &fence), "make a fence");
  fence_ = context.own(fence, vk.vkDestroyFence);

  if (context.timestamp_bits() == 0) return;
  VkQueryPoolCreateInfo query_info{};
  query_info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  query_info.queryType = VK_QUERY_TYPE_TIMESTAMP;
  query_info.queryCount = max_timestamps;
  VkQueryPool queries = VK_NULL_HANDLE;
  context.check(vk.vkCreateQueryPool(context.device(), &query_info, nullptr, &queries),
                "make timestamp queries");
  queries_ = context.own(queries, vk.vkDestroyQueryPool);
}

Submission::~Submission() { finish(); }

VkCommandBuffer Submission::begin() {
  wait();
  const DeviceFunctions& vk = context_.vk();
  if (std::exchange(recording_, false)) {
    context_.check(vk.vkResetCommandBuffer(commands_, 0), "drop commands");
  }
  VkCommandBufferBeginInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  info.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  context_.check(vk.vkBeginCommandBuffer(commands_, &info), "record commands");
  recording_ = true;
  timestamps_ = 0;
  if (queries_.get() != VK_NULL_HANDLE) {
    vk.vkCmdResetQueryPool(commands_, queries_.get(), 0, max_timestamps_);
  }
  return commands_;
}

void Submission::write_timestamp() {
  if (queries_.get() == VK_NULL_HANDLE || timestamps_ == max_timestamps_) return;
  context_.vk().vkCmdWriteTimestamp(commands_, VK_PIPELINE_STAGE_BOTTOM_OF_PIPE_BIT, queries_.get(),
                                    timestamps_++);
}

void Submission::submit() {
  const DeviceFunctions& vk = context_.vk();
  recording_ = false;
  context_.check(vk.vkEndCommandBuffer(commands_), "record commands");
  const VkFence fence = fence_.get();
  context_.check(vk.vkResetFences(context_.device(), 1, &fence), "reset a fence");
  VkSubmitInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands_;
  context_.check(context_.submit(info, fence), "run commands");
  in_flight_ = true;
}

void Submission::wait() { context_.check(finish(), "finish its commands"); }

VkResult Submission::finish() {
  if (!in_flight_) return VK_SUCCESS;
  const VkFence fence = fence_.get();
  const VkResult result =
      context_.vk().vkWaitForFences(context_.device(), 1, &fence, VK_TRUE, no_timeout);
  if (result == VK_SUCCESS || result == VK_ERROR_DEVICE_LOST) in_flight_ = false;
  return result;
}

std::vector<double> Submission::elapsed() const {
  if (timestamps_ < 2) return {};
  std::vector<std::uint64_t> ticks(timestamps_);
  context_.check(
      context_.vk().vkGetQueryPoolResults(
          context_.device(), queries_.get(), 0, timestamps_, ticks.size() * sizeof ticks.front(),
          ticks.data(), sizeof ticks.front(), VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
      "read its clock");
  const std::uint64_t valid =
      std::numeric_limits<std::uint64_t>::max() >> (64 - std::min(context_.timestamp_bits(), 64u));
  const double period = static_cast<double>(context_.properties().limits.timestampPeriod) * 1e-6;
  std::vector<double> milliseconds;
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    milliseconds.push_back(static_cast<double>((ticks[i] - ticks[i - 1]) & valid) * period);
  }
  return milliseconds;
}

}  // namespace widestereo
