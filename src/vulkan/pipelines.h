// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <span>
#include <string>

#include "schedule/schedule.h"
#include "vulkan/context.h"
#include "vulkan/pipeline_cache.h"

namespace widestereo {

/// Bindings of shaders/bindings.glsl.
enum Binding : std::uint32_t {
  binding_parameters = 0,
  binding_places = 1,
  binding_intensities = 2,
  binding_rays = 3,
  binding_hypotheses = 4,
  binding_priors = 5,
  binding_checks = 6,
  binding_texel_texture = 7,
  binding_texels = 8,
  binding_nearest = 9,
  binding_winner = 10,
};

// All throw Error naming the device and what failed.
Handle<VkDescriptorSetLayout> make_set_layout(
    const VulkanContext& context, std::span<const VkDescriptorSetLayoutBinding> bindings);
Handle<VkPipelineLayout> make_pipeline_layout(const VulkanContext& context,
                                              std::span<const VkDescriptorSetLayout> sets,
                                              std::uint32_t push_constant_bytes);
Handle<VkDescriptorPool> make_descriptor_pool(const VulkanContext& context, std::uint32_t sets,
                                              std::span<const VkDescriptorPoolSize> sizes);
/// Belongs to the pool.
VkDescriptorSet allocate_set(const VulkanContext& context, VkDescriptorPool pool,
                             VkDescriptorSetLayout layout);

/// One compute pipeline for each kernel that schedules run, specialised for constants; all share
/// one descriptor set layout. Context and cache must outlive it.
class Pipelines {
 public:
  /// `sampled`: texels are read through the texture units instead of as storage images, which
  /// hold them in another format, and intensities and maps as storage buffers instead of texel
  /// buffers (shaders/bindings.glsl). Those that texture units filter have half precision where the
  /// device can write it.
  Pipelines(const VulkanContext& context, const KernelConstants& constants, bool sampled,
            PipelineCache& cache);

  /// Makes those that a schedule runs and that are not there yet, side by side (drivers take
  /// seconds for all), and saves the cache. Throws Error for iterate_raster, which is sequential,
  /// too.
  void compile(const Schedule& schedule);

  bool sampled() const { return sampled_; }
  /// Whether texture units filter.
  bool filters() const { return constants_.kernel.filter == static_cast<int>(Filter::device); }
  /// How many workgroups cover so many pixels of a row, or of a column.
  std::uint32_t workgroups_of_row(int pixels) const;
  std::uint32_t workgroups_of_column(int pixels) const;
  bool half_precision() const { return half_precision_; }
  VkDescriptorType type_of_maps() const {
    return sampled_ ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER : VK_DESCRIPTOR_TYPE_STORAGE_TEXEL_BUFFER;
  }
  VkDescriptorSetLayout set_layout() const { return set_layout_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  /// Of a schedule that was compiled.
  VkPipeline get(Kernel kernel) const { return pipelines_[static_cast<std::size_t>(kernel)].get(); }
  /// A further kernel, of shader_code(), with the same constants.
  Handle<VkPipeline> make(const std::string& name, VkPipelineLayout layout) const;

 private:
  void make_layouts();
  /// The name among shader_code() of a kernel of the schedule, as these constants want it.
  std::string variant_of(Kernel kernel) const;
  /// Whether `iterate` keeps what patches have in common in memory of workgroups
  /// (shaders/patch_tile.glsl).
  bool shares_patches() const;

  /// What shaders are specialised for, by their numbers in shaders/bindings.glsl.
  struct Constants {
    KernelConstants kernel;
    std::uint32_t width = 0;  ///< of a workgroup, in pixels
    std::uint32_t height = 0;
  };

  const VulkanContext& context_;
  PipelineCache& cache_;
  Constants constants_;
  bool sampled_;
  bool half_precision_;
  Handle<VkDescriptorSetLayout> set_layout_;
  Handle<VkPipelineLayout> layout_;
  std::array<Handle<VkPipeline>, kernel_count> pipelines_;
};

}  // namespace widestereo
