// SPDX-License-Identifier: MIT
// Formats of the images and texel buffers that kernels read and write.
#pragma once

#include <vulkan/vulkan_core.h>

namespace widestereo {

inline constexpr VkFormat intensity_format = VK_FORMAT_R32_SFLOAT;
inline constexpr VkFormat format_of_maps = VK_FORMAT_R32G32B32A32_SFLOAT;
/// Texels of fewer bytes take texture units fewer cycles.
inline constexpr VkFormat format_of_filtered_texels = VK_FORMAT_R16_SFLOAT;
/// Without texture units: each with the neighbours that a bilinear sample reads.
inline constexpr VkFormat format_of_loaded_texels = VK_FORMAT_R32G32B32A32_SFLOAT;

}  // namespace widestereo
