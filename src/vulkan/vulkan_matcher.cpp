// SPDX-License-Identifier: MIT
#include <array>
#include <utility>
#include <vector>

#include "kernel/maps.h"
#include "matching/device_rows.h"
#include "matching/match_setup.h"
#include "vulkan/conversions.h"
#include "widestereo/error.h"
#include "widestereo/vulkan.h"

namespace widestereo {
namespace {

using Way = Conversion::Way;
using Commands = std::span<const VkCommandBuffer>;

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

class VulkanBindings::Implementation {
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
        conversions_(context_, backend_, setup_.sizes) {
    backend_.compile(setup_.schedule);
    backend_.compile(setup_.warm_schedule);
    setup_.set_rays(backend_);
    backend_.release_staging();
  }

  VulkanBindings bind(std::span<const VulkanImage> images,
                      std::span<const VulkanViewMaps> maps) const {
    require_one_for_each_view(rig_.views.size(), images.size(), maps.size());
    std::vector<Conversion> conversions;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const VulkanImage& image = images[i];
      const std::size_t pixel = bytes_of(image.pixel);
      const std::size_t row = width(i) * pixel;
      const std::string what = "The image of " + rig_.views[i].name;
      if (image.buffer == VK_NULL_HANDLE) throw Error(what + " has no buffer; give one.");
      require_rows({image.offset, image.pitch, pixel, row, "offset"}, what);
      conversions.push_back({.name = what,
                             .way = Way::image_from_buffer,
                             .view = static_cast<int>(i),
                             .kind = static_cast<int>(image.pixel),
                             .buffer = image.buffer,
                             .offset = image.offset,
                             .pitch = image.pitch,
                             .row_bytes = row});
    }
    return bind(std::move(conversions), maps);
  }

  VulkanBindings bind(std::span<const VulkanTexture> images,
                      std::span<const VulkanViewMaps> maps) const {
    require_one_for_each_view(rig_.views.size(), images.size(), maps.size());
    std::vector<Conversion> conversions;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const VulkanTexture& image = images[i];
      const std::string what = "The image of " + rig_.views[i].name;
      if (image.view == VK_NULL_HANDLE) throw Error(what + " has no image view; give one.");
      conversions.push_back({.name = what,
                             .way = Way::image_from_texture,
                             .view = static_cast<int>(i),
                             .kind = image.colour ? TEXELS_COLOUR : TEXELS_GREY,
                             .texture = image.view,
                             .layout = image.layout});
    }
    return bind(std::move(conversions), maps);
  }

  void record(Commands commands, const VulkanBindings::Implementation& bindings) {
    record(commands, bindings, setup_.schedule);
    holds_planes_ = true;
  }

  void record_next(Commands commands, const VulkanBindings::Implementation& bindings,
                   const WarmStart& start) {
    require_planes(holds_planes_, "record a match without a warm start before.");
    if (!start.hypotheses.empty()) {
      throw Error(
          "A recorded match starts from the planes on the device; leave the hypotheses empty.");
    }
    set_motion(setup_.warm_schedule, rig_,
               start.now_from_previous.value_or(Eigen::Isometry3d::Identity()), start.frame);
    record(commands, bindings, setup_.warm_schedule);
  }

  Filter filter() const { return setup_.filter(); }
  std::size_t device_bytes() const { return backend_.device_bytes(); }

 private:
  std::size_t width(std::size_t view) const {
    return static_cast<std::size_t>(rig_.views[view].camera.width);
  }

  /// `conversions`: of the images.
  VulkanBindings bind(std::vector<Conversion> conversions,
                      std::span<const VulkanViewMaps> maps) const {
    for (std::size_t i = 0; i < maps.size(); ++i) {
      for (const MapOfView& of_view : maps_of_view) {
        const VulkanMap& map = maps[i].*of_view.map;
        if (map.buffer == VK_NULL_HANDLE) continue;
        const std::size_t row = width(i) * of_view.values * word;
        const std::string what = of_view.name + rig_.views[i].name;
        require_rows({map.offset, map.pitch, word, row, "offset"}, what);
        conversions.push_back({.name = what,
                               .way = Way::map_to_buffer,
                               .view = static_cast<int>(i),
                               .kind = of_view.kind,
                               .buffer = map.buffer,
                               .offset = map.offset,
                               .pitch = map.pitch,
                               .row_bytes = row});
      }
    }
    auto bindings = std::make_unique<VulkanBindings::Implementation>();
    bindings->conversions = conversions_.bind(conversions);
    bindings->matcher = this;
    return VulkanBindings(std::move(bindings));
  }

  void record(Commands commands, const VulkanBindings::Implementation& bindings,
              const Schedule& schedule) const {
    if (bindings.matcher != this) {
      throw Error("The bindings were made by another matcher; use those of this one.");
    }
    if (commands.empty()) throw Error("There is no command buffer to record into; give one.");
    backend_.record_parameters(commands.front(), schedule);
    conversions_.record_images(commands.front(), bindings.conversions);
    backend_.record_dispatches(commands, schedule);
    conversions_.record_maps(commands.back(), bindings.conversions);
  }

  Rig rig_;
  VulkanContext context_;
  PipelineCache cache_;
  MatchSetup setup_;
  VulkanBackend backend_;
  Conversions conversions_;
  bool holds_planes_ = false;
};

VulkanBindings::VulkanBindings(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
VulkanBindings::~VulkanBindings() = default;
VulkanBindings::VulkanBindings(VulkanBindings&&) noexcept = default;
VulkanBindings& VulkanBindings::operator=(VulkanBindings&&) noexcept = default;

VulkanMatcher::VulkanMatcher(const VulkanHandles& handles, const Rig& rig, const Options& options,
                             const std::string& pipeline_cache)
    : implementation_(std::make_unique<Implementation>(handles, rig, options, pipeline_cache)) {}
VulkanMatcher::~VulkanMatcher() = default;
VulkanMatcher::VulkanMatcher(VulkanMatcher&&) noexcept = default;
VulkanMatcher& VulkanMatcher::operator=(VulkanMatcher&&) noexcept = default;

VulkanBindings VulkanMatcher::bind(std::span<const VulkanImage> images,
                                   std::span<const VulkanViewMaps> maps) const {
  return implementation_->bind(images, maps);
}
VulkanBindings VulkanMatcher::bind(std::span<const VulkanTexture> images,
                                   std::span<const VulkanViewMaps> maps) const {
  return implementation_->bind(images, maps);
}
void VulkanMatcher::record(VkCommandBuffer commands, const VulkanBindings& bindings) {
  record({&commands, 1}, bindings);
}
void VulkanMatcher::record(Commands commands, const VulkanBindings& bindings) {
  implementation_->record(commands, *bindings.implementation_);
}
void VulkanMatcher::record_next(VkCommandBuffer commands, const VulkanBindings& bindings,
                                const WarmStart& start) {
  record_next({&commands, 1}, bindings, start);
}
void VulkanMatcher::record_next(Commands commands, const VulkanBindings& bindings,
                                const WarmStart& start) {
  implementation_->record_next(commands, *bindings.implementation_, start);
}
Filter VulkanMatcher::filter() const { return implementation_->filter(); }
std::size_t VulkanMatcher::device_bytes() const { return implementation_->device_bytes(); }

}  // namespace widestereo
