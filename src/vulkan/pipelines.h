// SPDX-License-Identifier: MIT
#pragma once

#include <array>

#include "schedule/schedule.h"
#include "vulkan/context.h"

namespace widestereo {

/// Bindings of shaders/bindings.glsl.
enum Binding : std::uint32_t {
  binding_parameters = 0,
  binding_intensity_texture = 1,
  binding_intensities = 2,
  binding_rays = 3,
  binding_hypotheses = 4,
  binding_half_pixel_texture = 5,
  binding_nearest = 6,
  binding_winner = 7,
  binding_half_pixels = 8,
};

/// One compute pipeline for each kernel (iterate_raster, which is sequential, excepted),
/// specialised for constants; all share one descriptor set layout.
class Pipelines {
 public:
  /// `sampled`: intensities are read through the texture units instead of as storage images.
  Pipelines(const VulkanContext& context, const KernelConstants& constants, bool sampled,
            VkPipelineCache cache);

  VkDescriptorSetLayout set_layout() const { return set_layout_.get(); }
  VkPipelineLayout layout() const { return layout_.get(); }
  /// Throws Error for iterate_raster.
  VkPipeline get(Kernel kernel) const;

 private:
  void make_layouts(const VulkanContext& context);

  Handle<VkDescriptorSetLayout> set_layout_;
  Handle<VkPipelineLayout> layout_;
  std::array<Handle<VkPipeline>, kernel_count> pipelines_;
};

}  // namespace widestereo
