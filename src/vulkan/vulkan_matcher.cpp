// SPDX-License-Identifier: MIT
#include <array>
#include <utility>
#include <vector>

#include "kernel/maps.h"
#include "matching/device_rows.h"
#include "matching/match_setup.h"
#include "vulkan/buffer_conversions.h"
#include "widestereo/error.h"
#include "widestereo/vulkan.h"

namespace widestereo {
namespace {

using Direction = BufferConversion::Direction;

constexpr std::size_t word = sizeof(float);

/// A map of a view, and how a sentence names it.
struct MapOfView {
  const VulkanMap VulkanViewMaps::*map;
  int kind;
  std::size_t values;  ///< of a pixel
  const char* name;
};
constexpr std::array<MapOfView, 5> maps_of_view = {{
    {&VulkanViewMaps::distance, MAP_DISTANCE, 1, "The distance map of "},
    {&VulkanViewMaps::normals, MAP_NORMALS, 3, "The normal map of "},
    {&VulkanViewMaps::cost, MAP_COST, 1, "The cost map of "},
    {&VulkanViewMaps::confidence, MAP_CONFIDENCE, 1, "The confidence map of "},
    {&VulkanViewMaps::reasons, MAP_REASONS, 1, "The reason map of "},
}};

}  // namespace

class VulkanBuffers::Implementation {
 public:
  BoundConversions conversions;
  const void* matcher = nullptr;  ///< whose images and maps they are
};

class VulkanMatcher::Implementation {
 public:
  Implementation(const VulkanHandles& handles, const Rig& rig, const Options& options,
                 const std::string& pipeline_cache)
      : rig_(rig),
        context_(handles),
        cache_(context_, pipeline_cache),
        setup_(rig, options, context_.info()),
        backend_(context_, setup_.sizes, setup_.schedule.constants, cache_),
        conversions_(context_, backend_, setup_.sizes, cache_) {
    cache_.save();
    setup_.set_rays(backend_);
  }

  VulkanBuffers bind(std::span<const VulkanImage> images,
                     std::span<const VulkanViewMaps> maps) const {
    const std::size_t views = rig_.views.size();
    require_one_for_each_view(views, images.size(), maps.size());
    std::vector<BufferConversion> conversions;
    for (std::size_t i = 0; i < views; ++i) {
      const int view = static_cast<int>(i);
      const auto width = static_cast<std::size_t>(rig_.views[i].camera.width);
      const VulkanImage& image = images[i];
      const std::size_t pixel = bytes_of(image.pixel);
      const std::string what = "The image of " + rig_.views[i].name;
      if (image.buffer == VK_NULL_HANDLE) throw Error(what + " has no buffer; give one.");
      require_rows({image.offset, image.pitch, pixel, width * pixel, "offset"}, what);
      conversions.push_back({Direction::import_image, view, static_cast<int>(image.pixel),
                             image.buffer, image.offset, image.pitch, width * pixel});
      for (const MapOfView& of_view : maps_of_view) {
        const VulkanMap& map = maps[i].*of_view.map;
        if (map.buffer == VK_NULL_HANDLE) continue;
        const std::size_t row = width * of_view.values * word;
        require_rows({map.offset, map.pitch, word, row, "offset"},
                     of_view.name + rig_.views[i].name);
        conversions.push_back(
            {Direction::export_map, view, of_view.kind, map.buffer, map.offset, map.pitch, row});
      }
    }
    auto buffers = std::make_unique<VulkanBuffers::Implementation>();
    buffers->conversions = conversions_.bind(conversions);
    buffers->matcher = this;
    return VulkanBuffers(std::move(buffers));
  }

  void record(VkCommandBuffer commands, const VulkanBuffers::Implementation& buffers) {
    record(commands, buffers, setup_.schedule);
    holds_planes_ = true;
  }

  void record_next(VkCommandBuffer commands, const VulkanBuffers::Implementation& buffers,
                   const WarmStart& start) {
    if (!holds_planes_) {
      throw Error(
          "There are no planes of a previous frame to start from; record a match without a warm "
          "start before.");
    }
    if (!start.hypotheses.empty()) {
      throw Error(
          "A recorded match starts from the planes on the device; leave the hypotheses empty.");
    }
    set_motion(setup_.warm_schedule, rig_,
               start.now_from_previous.value_or(Eigen::Isometry3d::Identity()), start.frame);
    record(commands, buffers, setup_.warm_schedule);
  }

  std::size_t device_bytes() const { return backend_.device_bytes(); }

 private:
  void record(VkCommandBuffer commands, const VulkanBuffers::Implementation& buffers,
              const Schedule& schedule) const {
    if (buffers.matcher != this) {
      throw Error("The buffers were bound by another matcher; use those of this one.");
    }
    backend_.record_parameters(commands, schedule);
    conversions_.record(commands, buffers.conversions, Direction::import_image);
    backend_.record_dispatches(commands, schedule);
    conversions_.record(commands, buffers.conversions, Direction::export_map);
  }

  Rig rig_;
  VulkanContext context_;
  PipelineCache cache_;
  MatchSetup setup_;
  VulkanBackend backend_;
  BufferConversions conversions_;
  bool holds_planes_ = false;
};

VulkanBuffers::VulkanBuffers(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
VulkanBuffers::~VulkanBuffers() = default;
VulkanBuffers::VulkanBuffers(VulkanBuffers&&) noexcept = default;
VulkanBuffers& VulkanBuffers::operator=(VulkanBuffers&&) noexcept = default;

VulkanMatcher::VulkanMatcher(const VulkanHandles& handles, const Rig& rig, const Options& options,
                             const std::string& pipeline_cache)
    : implementation_(std::make_unique<Implementation>(handles, rig, options, pipeline_cache)) {}
VulkanMatcher::~VulkanMatcher() = default;
VulkanMatcher::VulkanMatcher(VulkanMatcher&&) noexcept = default;
VulkanMatcher& VulkanMatcher::operator=(VulkanMatcher&&) noexcept = default;

VulkanBuffers VulkanMatcher::bind(std::span<const VulkanImage> images,
                                  std::span<const VulkanViewMaps> maps) const {
  return implementation_->bind(images, maps);
}
void VulkanMatcher::record(VkCommandBuffer commands, const VulkanBuffers& buffers) {
  implementation_->record(commands, *buffers.implementation_);
}
void VulkanMatcher::record_next(VkCommandBuffer commands, const VulkanBuffers& buffers,
                                const WarmStart& start) {
  implementation_->record_next(commands, *buffers.implementation_, start);
}
std::size_t VulkanMatcher::device_bytes() const { return implementation_->device_bytes(); }

}  // namespace widestereo
