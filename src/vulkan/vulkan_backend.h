// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "matching/backend.h"
#include "schedule/bands.h"
#include "vulkan/memory.h"
#include "vulkan/pipeline_cache.h"
#include "vulkan/pipelines.h"
#include "vulkan/submission.h"

namespace widestereo {

/// What suits a device; with exact filtering the result does not depend on it.
struct VulkanTuning {
  /// Longest dispatch and submission in patch samples, 0 = by device type.
  long long max_samples = 0;
  /// Reads texels through the texture units; unset: everywhere but on CPUs. Without, filtering
  /// is exact, and texels take four times the memory.
  std::optional<bool> sampled = std::nullopt;
};

/// Memory and kernels for matches of fixed sizes on a Vulkan device. Not thread-safe; the context
/// must outlive it. Everything but the constructor, compile() and record_…() submits to the
/// context's queue and waits for its own fence.
class VulkanBackend final : public Backend {
 public:
  /// Throws Error naming the device and the memory, limit or feature that it lacks.
  VulkanBackend(const VulkanContext& context, const std::vector<cv::Size>& sizes,
                const KernelConstants& constants, PipelineCache& cache,
                const VulkanTuning& tuning = {});
  ~VulkanBackend() override;

  /// Records a whole schedule that was compiled into command buffers of the caller's, which the
  /// caller submits to a queue of the context's family; submits nothing and waits for nothing. The
  /// parameters come first, in the first of them; further kernels may follow, and then the
  /// dispatches in shares of about the same work. The commands wait for earlier compute and
  /// transfer commands of the queue; a caller that reads the results puts a barrier after them
  /// (from compute shader writes).
  void record_parameters(VkCommandBuffer commands, const Schedule& schedule) const;
  void record_dispatches(std::span<const VkCommandBuffer> commands, const Schedule& schedule) const;
  /// Lets a kernel see what earlier ones wrote.
  void record_barrier(VkCommandBuffer commands) const;
  const Pipelines& pipelines() const { return pipelines_; }
  /// Of Pipelines::set_layout(): all that kernels of a level read and write, which is named by its
  /// first view.
  VkDescriptorSet descriptor_set(int first_view) const;

  void set_rays(int view, const cv::Mat& rays) override;
  void set_intensity(int view, const cv::Mat& intensity) override;
  void compile(const Schedule& schedule) override;
  void run(const Schedule& schedule, const Matcher::Progress& progress) override;
  cv::Mat hypotheses(int view) override;
  void set_hypotheses(int view, const cv::Mat& hypotheses) override;
  cv::Mat checks(int view) override;
  std::vector<KernelTime> times() const override { return times_.list(); }
  void time_kernels(bool each) override { time_each_ = each; }
  double device_milliseconds() const override { return milliseconds_; }
  std::size_t device_bytes() const override;
  /// Frees what transfers from and to the host have taken, and take again.
  void release_staging() { staging_ = {}; }

 private:
  struct Run;  // of run(): what is in flight
  /// Where a view lies in a buffer.
  struct Place {
    int first = 0;   ///< number of pixel (0, 0)
    int stride = 0;  ///< from row to row
  };

  static constexpr std::size_t map_count = 5;
  /// By their bindings, from binding_intensities on.
  std::array<const MapBuffer*, map_count> maps() const {
    return {&intensities_, &rays_, &hypotheses_, &priors_, &checks_};
  }

  void make_images(const VulkanContext& context);
  void make_buffers(const VulkanContext& context);
  void make_descriptor_sets();
  VkDescriptorSet make_descriptor_set(const LayeredImage& texels_of_level);
  /// Fills memory once, when something is to be transferred or run and not before: an application's
  /// queue is left alone while kernels are compiled.
  void start_memory();
  VkCommandBuffer begin_transfer();
  void transition(VkCommandBuffer commands, const LayeredImage& image,
                  const VkImageSubresourceRange& layers, VkImageLayout from,
                  VkImageLayout to) const;
  void record_band(VkCommandBuffer commands, const Band& band) const;
  /// Lets later commands of some stages see what earlier ones of others wrote.
  void barrier(VkCommandBuffer commands, VkPipelineStageFlags from, VkPipelineStageFlags to,
               VkAccessFlags access) const;
  const Buffer& staging();
  /// Puts a map for a view into the staging buffer.
  void stage(int view, const cv::Mat& map, int type);
  void upload(const MapBuffer& map, int view, const cv::Mat& values);
  cv::Mat download(const MapBuffer& map, int view);
  VkDeviceSize first_byte_of_map(int view) const;
  VkDeviceSize map_bytes(int view) const;
  int views_of_level() const { return constants_.source_count + 1; }

  const VulkanContext& context_;
  std::vector<cv::Size> sizes_;
  std::vector<Place> places_of_maps_;
  std::vector<Place> places_of_intensities_;  // which an apron surrounds
  KernelConstants constants_;
  long long max_samples_;
  Pipelines pipelines_;
  MapBuffer intensities_;
  MapBuffer rays_;
  MapBuffer hypotheses_;
  MapBuffer priors_;
  MapBuffer checks_;
  std::vector<LayeredImage> texels_;  // of each level
  Buffer parameters_;
  Buffer places_;
  Buffer transfer_nearest_;
  Buffer transfer_winner_;
  Buffer staging_;  // once something is transferred; of the largest view's maps
  Handle<VkSampler> sampler_;
  Handle<VkDescriptorPool> descriptor_pool_;
  std::vector<VkDescriptorSet> descriptor_sets_;  // of each level
  Handle<VkCommandPool> command_pool_;
  std::array<std::unique_ptr<Submission>, 2> submissions_;  // one is recorded while the other runs
  KernelTimes times_;
  bool memory_started_ = false;
  bool time_each_ = true;
  double milliseconds_ = 0;  // of the last run
};

}  // namespace widestereo
