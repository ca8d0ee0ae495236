// SPDX-License-Identifier: MIT
#include "vulkan/pipelines.h"

#include <algorithm>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <string>
#include <utility>
#include <vector>

#include "vulkan/shaders.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

Handle<VkShaderModule> make_module(const VulkanContext& context, const std::string& name) {
  const std::span<const std::uint32_t> code = shader_code(name);
  VkShaderModuleCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  info.codeSize = code.size_bytes();
  info.pCode = code.data();
  VkShaderModule module = VK_NULL_HANDLE;
  context.check(context.vk().vkCreateShaderModule(context.device(), &info, nullptr, &module),
                "load the kernel " + name);
  return context.own(module, context.vk().vkDestroyShaderModule);
}

std::uint32_t count_of(int pixels, std::uint32_t side) {
  return (static_cast<std::uint32_t>(pixels) + side - 1) / side;
}

}  // namespace

std::uint32_t Pipelines::workgroups_of_row(int pixels) const {
  return count_of(pixels, constants_.width);
}
std::uint32_t Pipelines::workgroups_of_column(int pixels) const {
  return count_of(pixels, constants_.height);
}

Handle<VkDescriptorSetLayout> make_set_layout(
    const VulkanContext& context, std::span<const VkDescriptorSetLayoutBinding> bindings) {
  VkDescriptorSetLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  info.bindingCount = static_cast<std::uint32_t>(bindings.size());
  info.pBindings = bindings.data();
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  context.check(context.vk().vkCreateDescriptorSetLayout(context.device(), &info, nullptr, &layout),
                "make a descriptor set layout");
  return context.own(layout, context.vk().vkDestroyDescriptorSetLayout);
}

Handle<VkPipelineLayout> make_pipeline_layout(const VulkanContext& context,
                                              std::span<const VkDescriptorSetLayout> sets,
                                              std::uint32_t push_constant_bytes) {
  const VkPushConstantRange push_constants = {VK_SHADER_STAGE_COMPUTE_BIT, 0, push_constant_bytes};
  VkPipelineLayoutCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = static_cast<std::uint32_t>(sets.size());
  info.pSetLayouts = sets.data();
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &push_constants;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  context.check(context.vk().vkCreatePipelineLayout(context.device(), &info, nullptr, &layout),
                "make a pipeline layout");
  return context.own(layout, context.vk().vkDestroyPipelineLayout);
}

Handle<VkDescriptorPool> make_descriptor_pool(const VulkanContext& context, std::uint32_t sets,
                                              std::span<const VkDescriptorPoolSize> sizes) {
  VkDescriptorPoolCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  info.maxSets = sets;
  info.poolSizeCount = static_cast<std::uint32_t>(sizes.size());
  info.pPoolSizes = sizes.data();
  VkDescriptorPool pool = VK_NULL_HANDLE;
  context.check(context.vk().vkCreateDescriptorPool(context.device(), &info, nullptr, &pool),
                "make a descriptor pool");
  return context.own(pool, context.vk().vkDestroyDescriptorPool);
}

VkDescriptorSet allocate_set(const VulkanContext& context, VkDescriptorPool pool,
                             VkDescriptorSetLayout layout) {
  VkDescriptorSetAllocateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
  info.descriptorPool = pool;
  info.descriptorSetCount = 1;
  info.pSetLayouts = &layout;
  VkDescriptorSet set = VK_NULL_HANDLE;
  context.check(context.vk().vkAllocateDescriptorSets(context.device(), &info, &set),
                "make a descriptor set");
  return set;
}

Pipelines::Pipelines(const VulkanContext& context, const KernelConstants& constants, bool sampled,
                     PipelineCache& cache)
    : context_(context),
      cache_(cache),
      constants_{constants, 8, sampled ? 16u : 8u},
      sampled_(sampled),
      half_precision_(filters() && context.filters_half_precision()) {
  make_layouts();
}

void Pipelines::compile(const Schedule& schedule) {
  std::vector<Kernel> missing;
  for (const Dispatch& dispatch : schedule.dispatches) {
    const Kernel kernel = dispatch.kernel;
    if (kernel == Kernel::iterate_raster) {
      throw Error(std::string("The kernel ") + to_string(kernel) +
                  " is sequential and runs on the CPU only; choose the device \"cpu\".");
    }
    if (get(kernel) != VK_NULL_HANDLE || std::ranges::count(missing, kernel) > 0) continue;
    missing.push_back(kernel);
  }
  const int count = static_cast<int>(missing.size());
  std::vector<std::exception_ptr> errors(missing.size());  // OpenCV would change their type
  cv::parallel_for_(
      cv::Range(0, count),
      [&](const cv::Range& range) {
        for (auto i = static_cast<std::size_t>(range.start); std::cmp_less(i, range.end); ++i) {
          try {
            pipelines_[static_cast<std::size_t>(missing[i])] =
                make(variant_of(missing[i]), layout());
          } catch (...) {
            errors[i] = std::current_exception();
          }
        }
      },
      count);
  for (const std::exception_ptr& error : errors) {
    if (error) std::rethrow_exception(error);
  }
  if (count > 0) cache_.save();
}

std::string Pipelines::variant_of(Kernel kernel) const {
  const std::string name = to_string(kernel);
  if (kernel == Kernel::interpolate && half_precision_) return name + "_half";
  if (kernel == Kernel::iterate && shares_patches()) return name + "_tiled";
  return name;
}

bool Pipelines::shares_patches() const {
  const KernelConstants& kernel = constants_.kernel;
  const auto radius = static_cast<std::uint32_t>(kernel.window_radius);
  return filters() && kernel.warp == WARP_EXACT && kernel.source_count == 1 &&
         PATCH_TILE_SAMPLES(constants_.width, constants_.height, radius) <= LARGEST_PATCH_TILE;
}

void Pipelines::make_layouts() {
  const auto binding = [](Binding number, VkDescriptorType type) {
    return VkDescriptorSetLayoutBinding{number, type, 1, VK_SHADER_STAGE_COMPUTE_BIT, nullptr};
  };
  const std::array bindings = {
      binding(binding_parameters, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER),
      binding(binding_places, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER),
      binding(binding_intensities, type_of_maps()),
      binding(binding_rays, type_of_maps()),
      binding(binding_hypotheses, type_of_maps()),
      binding(binding_priors, type_of_maps()),
      binding(binding_checks, type_of_maps()),
      binding(binding_texel_texture, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER),
      binding(binding_texels, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE),
      binding(binding_nearest, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER),
      binding(binding_winner, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER),
  };
  set_layout_ = make_set_layout(context_, bindings);
  const VkDescriptorSetLayout set_layout = set_layout_.get();
  layout_ = make_pipeline_layout(context_, {&set_layout, 1}, sizeof(kernel::PassParameters));
}

Handle<VkPipeline> Pipelines::make(const std::string& name, VkPipelineLayout layout) const {
  static constexpr std::array<VkSpecializationMapEntry, 10> entries = {{
      {0, offsetof(Constants, kernel.window_radius), sizeof(int)},
      {1, offsetof(Constants, kernel.warp), sizeof(int)},
      {2, offsetof(Constants, kernel.camera_model), sizeof(int)},
      {3, offsetof(Constants, kernel.source_count), sizeof(int)},
      {4, offsetof(Constants, kernel.pattern), sizeof(int)},
      {5, offsetof(Constants, kernel.weighted), sizeof(int)},
      {6, offsetof(Constants, kernel.filter), sizeof(int)},
      {7, offsetof(Constants, kernel.texels_per_pixel), sizeof(int)},
      {8, offsetof(Constants, width), sizeof(std::uint32_t)},
      {9, offsetof(Constants, height), sizeof(std::uint32_t)},
  }};
  const Handle<VkShaderModule> module = make_module(context_, sampled_ ? name : name + "_loads");
  const VkSpecializationInfo specialisation = {static_cast<std::uint32_t>(entries.size()),
                                               entries.data(), sizeof constants_, &constants_};
  VkComputePipelineCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module.get();
  info.stage.pName = "main";
  info.stage.pSpecializationInfo = &specialisation;
  info.layout = layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  const DeviceFunctions& vk = context_.vk();
  context_.check(
      vk.vkCreateComputePipelines(context_.device(), cache_.get(), 1, &info, nullptr, &pipeline),
      "compile the kernel " + name);
  return context_.own(pipeline, vk.vkDestroyPipeline);
}

}  // namespace widestereo
