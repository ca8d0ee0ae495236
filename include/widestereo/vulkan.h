// SPDX-License-Identifier: MIT
// Matching inside a Vulkan application: its device, its command buffers, its images and buffers, no
// copies through the host.
//
//   widestereo::VulkanMatcher matcher(handles, rig, options);  // once
//   widestereo::VulkanTexture images[] = {{left}, {right}};    // or in buffers: VulkanImage
//   widestereo::VulkanViewMaps maps[2];
//   maps[0].distance = {distance, 0, 4 * width};           // what is left out is not written
//   widestereo::VulkanBindings bindings = matcher.bind(images, maps);  // for each set of them
//   matcher.record(commands, bindings);              // per frame, or once for many submissions
//   matcher.record_next(commands, bindings, {motion});  // or from the planes of the frame before
#pragma once

#include <vulkan/vulkan_core.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "widestereo/matcher.h"
#include "widestereo/options.h"
#include "widestereo/pixel_type.h"
#include "widestereo/rig.h"

namespace widestereo {

/// What an application hands in to have matching done on its own device. The instance (its
/// apiVersion) and the device must be of Vulkan 1.1 or newer and the queue family must compute; no
/// feature or extension needs to be enabled, though one makes it faster. Nothing handed in is ever
/// destroyed. Only VulkanMatcher's constructor uses `queue`.
struct VulkanHandles {
  PFN_vkGetInstanceProcAddr get_instance_proc_addr = nullptr;
  VkInstance instance = VK_NULL_HANDLE;
  VkPhysicalDevice physical_device = VK_NULL_HANDLE;
  VkDevice device = VK_NULL_HANDLE;
  VkQueue queue = VK_NULL_HANDLE;
  std::uint32_t queue_family = 0;
  /// The device was made with the feature shaderStorageImageExtendedFormats. Texture units then
  /// filter half precision, in fewer cycles; a Matcher does so where the feature is offered.
  /// Left false, devices that cannot filter 32-bit floats filter exactly (VulkanMatcher::filter()).
  bool extended_storage_formats = false;
};

/// A view's image in a buffer, of the calibrated size. The buffer needs
/// VK_BUFFER_USAGE_STORAGE_BUFFER_BIT and must reach to a multiple of 4 bytes after the last pixel.
struct VulkanImage {
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceSize offset = 0;  ///< of the first pixel, bytes, a multiple of a pixel's
  VkDeviceSize pitch = 0;   ///< bytes from row to row, likewise
  PixelType pixel = PixelType::grey8;
};

/// A view's image as an image view, of the calibrated size: of type VK_IMAGE_VIEW_TYPE_2D, one
/// sample a pixel, usage VK_IMAGE_USAGE_SAMPLED_BIT, and a format that shaders read as floats, as
/// VK_FORMAT_R8_UNORM (also the luma plane of a camera's NV12), R16_UNORM, R32_SFLOAT or
/// R8G8B8A8_UNORM. Values outside [0, 1], NaN included, and pixels beyond a smaller image count as
/// masked. An sRGB format hands in linear values, not those of the file that a Matcher works with.
struct VulkanTexture {
  VkImageView view = VK_NULL_HANDLE;
  VkImageLayout layout = VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL;  ///< while the commands run
  bool colour = false;  ///< red, green and blue are weighted as cv::cvtColor does; else the first
};

/// A map in a buffer (VK_BUFFER_USAGE_STORAGE_BUFFER_BIT), of a view's size; without a buffer it is
/// not written.
struct VulkanMap {
  VkBuffer buffer = VK_NULL_HANDLE;
  VkDeviceSize offset = 0;  ///< of the first pixel, bytes, a multiple of 4
  VkDeviceSize pitch = 0;   ///< bytes from row to row, likewise
};

/// Results for one reference view; the same values as in ViewResult, distances and normals to
/// rounding, as a ViewResult's are computed on the host; 4 bytes each.
struct VulkanViewMaps {
  VulkanMap distance;    ///< float: metres along the unit ray, 0 = no plane; not filtered
  VulkanMap normals;     ///< three floats x y z next to each other, 12 bytes a pixel
  VulkanMap cost;        ///< float: 1 - ZNCC in [0, 2], 2 = no plane
  VulkanMap confidence;  ///< float in [0, 1]
  VulkanMap reasons;     ///< std::uint32_t: Reason bits, 0 = accepted
};

/// Where a matcher reads its images and writes its maps. Must outlive the execution of what was
/// recorded with it, and not the matcher.
class VulkanBindings {
 public:
  ~VulkanBindings();
  VulkanBindings(VulkanBindings&&) noexcept;
  VulkanBindings& operator=(VulkanBindings&&) noexcept;

 private:
  friend class VulkanMatcher;
  class Implementation;
  explicit VulkanBindings(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

/// Matches images of one rig in an application's command buffers. Not thread-safe; frames of one
/// matcher must follow each other on one queue. Results equal a Matcher's on the same device whose
/// Options::max_gain is 1, with VulkanHandles::extended_storage_formats or Filter::exact. Of
/// textures, only grey ones of floats do so to the last bit: devices may round what they make of
/// whole numbers, and colours keep the fractions of grey levels that a Matcher's images of whole
/// numbers lose.
class VulkanMatcher {
 public:
  /// Allocates all memory, compiles the kernels, then submits to the queue and waits for it. Vulkan
  /// requires that nobody else, another matcher in another thread included, uses the queue
  /// meanwhile: a lock must cover the whole call, most of which is compilation. Where others cannot
  /// wait, hand in another queue of the family; what is recorded may run on any of them.
  /// `pipeline_cache`: a file that keeps compiled kernels between runs; empty for none. Throws
  /// Error when the rig, the options or the device do not do, or that file cannot be written.
  VulkanMatcher(const VulkanHandles& handles, const Rig& rig, const Options& options,
                const std::string& pipeline_cache = {});
  /// What was recorded must have finished.
  ~VulkanMatcher();
  VulkanMatcher(VulkanMatcher&&) noexcept;
  VulkanMatcher& operator=(VulkanMatcher&&) noexcept;

  /// For images and maps, one for each view. Throws Error for those that do not fit.
  VulkanBindings bind(std::span<const VulkanImage> images,
                      std::span<const VulkanViewMaps> maps) const;
  VulkanBindings bind(std::span<const VulkanTexture> images,
                      std::span<const VulkanViewMaps> maps) const;

  /// Records one match, outside a render pass, into a command buffer for a queue of the handles'
  /// family, which must own the images and maps while the commands run (or share them): reads the
  /// images and writes the maps. Neither submits, waits nor allocates device memory. The commands
  /// wait for earlier compute and transfer commands of the queue; images that
  /// other stages write, and the layouts of textures, need a barrier before them (to
  /// VK_ACCESS_SHADER_READ_BIT of the compute stage), and where other stages still read the maps,
  /// their next match needs one from these to the compute stage. Whoever reads the maps puts one
  /// behind them (from VK_ACCESS_SHADER_WRITE_BIT of the compute stage), and so does whoever writes
  /// the next images. Leaves its own compute pipeline, descriptor sets and push constants bound.
  /// May be submitted again and again. Where nothing overlaps, all costs are 2.
  void record(VkCommandBuffer commands, const VulkanBindings& bindings);

  /// Spreads the match over several command buffers of about the same work, to be submitted in this
  /// order: watchdogs end what takes too long, some systems (amdgpu, Metal) counting submissions
  /// rather than dispatches, and between them other work gets its turn. A Matcher's own submissions
  /// are made for a tenth of a second on a slow GPU.
  void record(std::span<const VkCommandBuffer> commands, const VulkanBindings& bindings);

  /// The same for the next frame of a sequence, from the planes that whatever ran before leaves on
  /// the device, as Matcher::match_next() does: a fraction of the work. `start` is fixed when it is
  /// recorded; its hypotheses must be empty. Throws Error where no match was recorded before.
  void record_next(VkCommandBuffer commands, const VulkanBindings& bindings,
                   const WarmStart& start = {});
  void record_next(std::span<const VkCommandBuffer> commands, const VulkanBindings& bindings,
                   const WarmStart& start = {});

  /// That is used: Options::filter where the device has it, as handed in.
  Filter filter() const;
  std::size_t device_bytes() const;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace widestereo
