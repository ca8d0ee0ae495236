// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "vulkan/functions.h"
#include "widestereo/device.h"

namespace widestereo {

VkPhysicalDeviceProperties properties_of(const InstanceFunctions& vk, VkPhysicalDevice device);

/// Name, type, driver and UUID; `unusable` says what the kernels need and the device lacks.
DeviceInfo describe(const InstanceFunctions& vk, VkPhysicalDevice device, int index);

/// The device's reason for being unusable in one sentence, empty if it can run the kernels.
std::string why_unusable(const InstanceFunctions& vk, VkPhysicalDevice device);

/// First queue family that computes: of those that measure time, or else of all, preferably one
/// that does not draw, whose work would wait.
std::optional<std::uint32_t> compute_queue_family(const InstanceFunctions& vk,
                                                  VkPhysicalDevice device);

/// Why a queue of this family cannot run kernels, after the device's name; empty if it can.
std::string why_no_compute(const InstanceFunctions& vk, VkPhysicalDevice device,
                           std::uint32_t queue_family);

/// Bits of a timestamp of a queue family, 0 where it has none.
std::uint32_t timestamp_bits(const InstanceFunctions& vk, VkPhysicalDevice device,
                             std::uint32_t queue_family);

bool has_device_extension(const InstanceFunctions& vk, VkPhysicalDevice device, const char* name);

/// Most bytes of one allocation, at least 2^30. `device` must offer Vulkan 1.1.
VkDeviceSize largest_allocation(const InstanceFunctions& vk, VkPhysicalDevice device);

/// Whether kernels load texels and read maps as texel buffers, as is faster on devices that are
/// programs, rather than sample textures: where limits allow so many, for texel buffers count as
/// images.
bool loads_texels(const VkPhysicalDeviceProperties& properties);

/// Whether images of intensities can be filtered.
bool filters_intensities(const InstanceFunctions& vk, VkPhysicalDevice device);
/// Whether it offers shaderStorageImageExtendedFormats.
bool has_extended_storage_formats(const InstanceFunctions& vk, VkPhysicalDevice device);
/// With that feature, whether images of half precision can be written and filtered.
bool filters_half_precision(const InstanceFunctions& vk, VkPhysicalDevice device);

}  // namespace widestereo
