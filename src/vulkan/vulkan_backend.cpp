// SPDX-License-Identifier: MIT
#include "vulkan/vulkan_backend.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "vulkan/formats.h"
#include "vulkan/physical_device.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr std::size_t max_bands_per_submission = 256;
constexpr VkPipelineStageFlags compute_and_transfer =
    VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_TRANSFER_BIT;

/// About 100 ms on a slow device of each kind.
long long default_max_samples(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return samples_of_discrete_gpu;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return samples_of_integrated_gpu;
    default:
      return samples_of_software;
  }
}

/// As the block of shaders/bindings.glsl.
struct PlaceBlock {
  std::array<std::array<std::int32_t, 4>, MAX_VIEWS> places{};
};

cv::Size largest(std::span<const cv::Size> sizes) {
  cv::Size size;
  for (const cv::Size& one : sizes) {
    size = {std::max(size.width, one.width), std::max(size.height, one.height)};
  }
  return size;
}

/// `sampled`: images are read as textures. Filters that the device lacks become exact.
Pipelines make_pipelines(const VulkanContext& context, KernelConstants constants, bool sampled,
                         PipelineCache& cache) {
  if (!sampled || !context.filters_intensities()) {
    constants.filter = static_cast<int>(Filter::exact);
  }
  return Pipelines(context, constants, sampled, cache);
}

/// Where `filters` is false, texels may be of a format that the device filters in no way.
Handle<VkSampler> make_sampler(const VulkanContext& context, bool filters) {
  const VkFilter filter = filters ? VK_FILTER_LINEAR : VK_FILTER_NEAREST;
  VkSamplerCreateInfo info{};
  info.sType = VK_STRUCTURE_TYPE_SAMPLER_CREATE_INFO;
  info.magFilter = filter;
  info.minFilter = filter;
  info.mipmapMode = VK_SAMPLER_MIPMAP_MODE_NEAREST;
  info.addressModeU = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  info.addressModeV = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  info.addressModeW = VK_SAMPLER_ADDRESS_MODE_CLAMP_TO_EDGE;
  VkSampler sampler = VK_NULL_HANDLE;
  context.check(context.vk().vkCreateSampler(context.device(), &info, nullptr, &sampler),
                "make a sampler");
  return context.own(sampler, context.vk().vkDestroySampler);
}

}  // namespace

VulkanBackend::VulkanBackend(const VulkanContext& context, const std::vector<cv::Size>& sizes,
                             const KernelConstants& constants, PipelineCache& cache,
                             const VulkanTuning& tuning)
    : context_(context),
      sizes_(sizes),
      constants_(constants),
      max_samples_(tuning.max_samples > 0 ? tuning.max_samples
                                          : default_max_samples(context.properties().deviceType)),
      pipelines_(make_pipelines(
          context, constants, tuning.sampled.value_or(!loads_texels(context.properties())), cache)),
      sampler_(make_sampler(context, pipelines_.filters())),
      command_pool_(make_command_pool(context)) {
  make_images(context);
  make_buffers(context);
  make_descriptor_sets();
  for (auto& submission : submissions_) {
    submission =
        std::make_unique<Submission>(context, command_pool_.get(), max_bands_per_submission + 1);
  }
}

VulkanBackend::~VulkanBackend() = default;

void VulkanBackend::make_images(const VulkanContext& context) {
  const VkFormat format_of_texels = pipelines_.half_precision() ? format_of_filtered_texels
                                    : pipelines_.sampled()      ? intensity_format
                                                                : format_of_loaded_texels;
  const std::span<const cv::Size> sizes = sizes_;
  const auto views = static_cast<std::size_t>(views_of_level());
  for (std::size_t first = 0; first < sizes.size(); first += views) {
    texels_.push_back(make_image(
        context, format_of_texels, size_of_texels(largest(sizes.subspan(first, views)), constants_),
        views_of_level(),
        VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_STORAGE_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
        "the images' texels"));
  }
}

void VulkanBackend::make_buffers(const VulkanContext& context) {
  VkDeviceSize pixels = APRON;  // rays are read so far before and after a view's
  VkDeviceSize intensities = 0;
  for (const cv::Size& size : sizes_) {
    const cv::Size whole = with_apron(size);
    places_of_maps_.push_back({static_cast<int>(pixels), size.width});
    places_of_intensities_.push_back(
        {static_cast<int>(intensities) + APRON * whole.width + APRON, whole.width});
    pixels += static_cast<VkDeviceSize>(size.width) * static_cast<VkDeviceSize>(size.height);
    intensities += static_cast<VkDeviceSize>(whole.width) * static_cast<VkDeviceSize>(whole.height);
  }
  intensities_ = make_map_buffer(context, intensities, intensity_format, pipelines_.type_of_maps(),
                                 "the images");
  const auto make_map = [&](const char* purpose) {
    return make_map_buffer(context, pixels + APRON, format_of_maps, pipelines_.type_of_maps(),
                           purpose);
  };
  rays_ = make_map("the viewing rays");
  hypotheses_ = make_map("the planes");
  priors_ = make_map("the planes' priors");
  checks_ = make_map("the consistency maps");
  constexpr VkBufferUsageFlags uniform =
      VK_BUFFER_USAGE_UNIFORM_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  parameters_ =
      make_device_buffer(context, sizeof(kernel::MatchParameters), uniform, "the parameters");
  places_ = make_device_buffer(context, sizeof(PlaceBlock), uniform, "the places of the views");
  const VkDeviceSize transfer_bytes = largest_area(sizes_) * sizeof(std::uint32_t);
  for (Buffer* buffer : {&transfer_nearest_, &transfer_winner_}) {
    *buffer = make_device_buffer(context, transfer_bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT,
                                 "a transfer buffer");
  }
}

void VulkanBackend::make_descriptor_sets() {
  const auto levels = static_cast<std::uint32_t>(texels_.size());
  const std::array<VkDescriptorPoolSize, 5> pool_sizes = {{
      {VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, 2 * levels},
      {VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, levels},
      {VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, levels},
      {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 2 * levels},
      {pipelines_.type_of_maps(), static_cast<std::uint32_t>(map_count) * levels},
  }};
  descriptor_pool_ = make_descriptor_pool(context_, levels, pool_sizes);
  for (const LayeredImage& texels : texels_) {
    descriptor_sets_.push_back(make_descriptor_set(texels));
  }
}

VkDescriptorSet VulkanBackend::make_descriptor_set(const LayeredImage& texels_of_level) {
  const VkDescriptorSet set =
      allocate_set(context_, descriptor_pool_.get(), pipelines_.set_layout());
  std::vector<VkWriteDescriptorSet> writes;
  const auto write = [&](Binding binding, VkDescriptorType type, const VkDescriptorImageInfo* image,
                         const VkDescriptorBufferInfo* buffer, const VkBufferView* view = nullptr) {
    VkWriteDescriptorSet& one = writes.emplace_back();
    one.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    one.dstSet = set;
    one.dstBinding = binding;
    one.descriptorCount = 1;
    one.descriptorType = type;
    one.pImageInfo = image;
    one.pBufferInfo = buffer;
    one.pTexelBufferView = view;
  };
  const auto buffer_info = [](const Buffer& buffer) {
    return VkDescriptorBufferInfo{buffer.handle.get(), 0, VK_WHOLE_SIZE};
  };
  const VkDescriptorImageInfo texels = {sampler_.get(), texels_of_level.view.get(),
                                        VK_IMAGE_LAYOUT_GENERAL};
  const VkDescriptorBufferInfo parameters = buffer_info(parameters_);
  const VkDescriptorBufferInfo places = buffer_info(places_);
  const VkDescriptorBufferInfo nearest = buffer_info(transfer_nearest_);
  const VkDescriptorBufferInfo winner = buffer_info(transfer_winner_);
  write(binding_parameters, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, nullptr, &parameters);
  write(binding_places, VK_DESCRIPTOR_TYPE_UNIFORM_BUFFER, nullptr, &places);
  std::array<VkDescriptorBufferInfo, map_count> of_maps;
  std::array<VkBufferView, map_count> views_of_maps;
  for (std::size_t i = 0; i < map_count; ++i) {
    const MapBuffer& map = *maps()[i];
    of_maps[i] = buffer_info(map.buffer);
    views_of_maps[i] = map.view.get();
    write(static_cast<Binding>(binding_intensities + i), pipelines_.type_of_maps(), nullptr,
          &of_maps[i], &views_of_maps[i]);
  }
  write(binding_texel_texture, VK_DESCRIPTOR_TYPE_COMBINED_IMAGE_SAMPLER, &texels, nullptr);
  write(binding_texels, VK_DESCRIPTOR_TYPE_STORAGE_IMAGE, &texels, nullptr);
  write(binding_nearest, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, nullptr, &nearest);
  write(binding_winner, VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, nullptr, &winner);
  context_.vk().vkUpdateDescriptorSets(context_.device(), static_cast<std::uint32_t>(writes.size()),
                                       writes.data(), 0, nullptr);
  return set;
}

VkDescriptorSet VulkanBackend::descriptor_set(int first_view) const {
  return descriptor_sets_.at(static_cast<std::size_t>(first_view / views_of_level()));
}

void VulkanBackend::start_memory() {
  if (memory_started_) return;
  const VkCommandBuffer commands = submissions_[0]->begin();
  const auto clear = [&](const LayeredImage& image, const VkClearColorValue& value) {
    constexpr VkImageSubresourceRange all = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0,
                                             VK_REMAINING_ARRAY_LAYERS};
    transition(commands, image, all, VK_IMAGE_LAYOUT_UNDEFINED,
               VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    context_.vk().vkCmdClearColorImage(commands, image.handle.get(),
                                       VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, &value, 1, &all);
    transition(commands, image, all, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, VK_IMAGE_LAYOUT_GENERAL);
  };
  VkClearColorValue masked{};
  std::fill_n(masked.float32, 4, MASKED_INTENSITY);
  if (pipelines_.half_precision()) std::fill_n(masked.float32, 4, LOWEST_HALF);
  for (const LayeredImage& texels : texels_) clear(texels, masked);
  for (const MapBuffer* map : maps()) {
    const float value = map == &intensities_ ? MASKED_INTENSITY : 0;
    context_.vk().vkCmdFillBuffer(commands, map->buffer.handle.get(), 0, VK_WHOLE_SIZE,
                                  std::bit_cast<std::uint32_t>(value));
  }

  PlaceBlock block;
  for (std::size_t view = 0; view < sizes_.size(); ++view) {
    const Place& maps = places_of_maps_[view];
    const Place& intensities = places_of_intensities_[view];
    block.places[view] = {maps.first, maps.stride, intensities.first, intensities.stride};
  }
  context_.vk().vkCmdUpdateBuffer(commands, places_.handle.get(), 0, sizeof block, &block);
  submissions_[0]->submit();
  submissions_[0]->wait();
  memory_started_ = true;
}

VkCommandBuffer VulkanBackend::begin_transfer() {
  start_memory();
  return submissions_[0]->begin();
}

void VulkanBackend::transition(VkCommandBuffer commands, const LayeredImage& image,
                               const VkImageSubresourceRange& layers, VkImageLayout from,
                               VkImageLayout to) const {
  VkImageMemoryBarrier info{};
  info.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
  info.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  info.dstAccessMask = VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT |
                       VK_ACCESS_TRANSFER_READ_BIT | VK_ACCESS_TRANSFER_WRITE_BIT;
  info.oldLayout = from;
  info.newLayout = to;
  info.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  info.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
  info.image = image.handle.get();
  info.subresourceRange = layers;
  context_.vk().vkCmdPipelineBarrier(commands, compute_and_transfer, compute_and_transfer, 0, 0,
                                     nullptr, 0, nullptr, 1, &info);
}

void VulkanBackend::barrier(VkCommandBuffer commands, VkPipelineStageFlags from,
                            VkPipelineStageFlags to, VkAccessFlags access) const {
  VkMemoryBarrier memory{};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  memory.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
  if ((from & VK_PIPELINE_STAGE_TRANSFER_BIT) != 0) {
    memory.srcAccessMask |= VK_ACCESS_TRANSFER_WRITE_BIT;
  }
  memory.dstAccessMask = access;
  context_.vk().vkCmdPipelineBarrier(commands, from, to, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

const Buffer& VulkanBackend::staging() {
  if (staging_.mapped == nullptr) {
    staging_ = make_staging_buffer(context_, largest_area(sizes_) * sizeof(cv::Vec4f));
  }
  return staging_;
}

void VulkanBackend::stage(int view, const cv::Mat& map, int type) {
  const cv::Size size = sizes_.at(static_cast<std::size_t>(view));
  require_map(map, view, size, type);
  map.copyTo(cv::Mat(size, type, staging().mapped));
}

VkDeviceSize VulkanBackend::first_byte_of_map(int view) const {
  const int first = places_of_maps_.at(static_cast<std::size_t>(view)).first;
  return static_cast<VkDeviceSize>(first) * sizeof(cv::Vec4f);
}

VkDeviceSize VulkanBackend::map_bytes(int view) const {
  return area(sizes_.at(static_cast<std::size_t>(view))) * sizeof(cv::Vec4f);
}

void VulkanBackend::upload(const MapBuffer& map, int view, const cv::Mat& values) {
  stage(view, values, CV_32FC4);
  const VkBufferCopy all = {0, first_byte_of_map(view), map_bytes(view)};
  const VkCommandBuffer commands = begin_transfer();
  context_.vk().vkCmdCopyBuffer(commands, staging_.handle.get(), map.buffer.handle.get(), 1, &all);
  submissions_[0]->submit();
  submissions_[0]->wait();
}

cv::Mat VulkanBackend::download(const MapBuffer& map, int view) {
  const cv::Size size = sizes_.at(static_cast<std::size_t>(view));
  const VkBufferCopy all = {first_byte_of_map(view), 0, map_bytes(view)};
  const Buffer& received = staging();
  const VkCommandBuffer commands = begin_transfer();
  barrier(commands, compute_and_transfer, VK_PIPELINE_STAGE_TRANSFER_BIT,
          VK_ACCESS_TRANSFER_READ_BIT);
  context_.vk().vkCmdCopyBuffer(commands, map.buffer.handle.get(), received.handle.get(), 1, &all);
  barrier(commands, compute_and_transfer, VK_PIPELINE_STAGE_HOST_BIT, VK_ACCESS_HOST_READ_BIT);
  submissions_[0]->submit();
  submissions_[0]->wait();
  return cv::Mat(size, CV_32FC4, received.mapped);
}

void VulkanBackend::set_rays(int view, const cv::Mat& rays) { upload(rays_, view, rays); }
void VulkanBackend::set_intensity(int view, const cv::Mat& intensity) {
  stage(view, intensity, CV_32FC1);
  const cv::Size size = intensity.size();
  const Place& place = places_of_intensities_[static_cast<std::size_t>(view)];
  const VkDeviceSize row = static_cast<VkDeviceSize>(size.width) * sizeof(float);
  std::vector<VkBufferCopy> rows;
  for (int y = 0; y < size.height; ++y) {
    rows.push_back({static_cast<VkDeviceSize>(y) * row,
                    static_cast<VkDeviceSize>(place.first + y * place.stride) * sizeof(float),
                    row});
  }
  const VkCommandBuffer commands = begin_transfer();
  context_.vk().vkCmdCopyBuffer(commands, staging_.handle.get(), intensities_.buffer.handle.get(),
                                static_cast<std::uint32_t>(rows.size()), rows.data());
  submissions_[0]->submit();
  submissions_[0]->wait();
}
void VulkanBackend::set_hypotheses(int view, const cv::Mat& hypotheses) {
  upload(hypotheses_, view, hypotheses);
}
cv::Mat VulkanBackend::hypotheses(int view) { return download(hypotheses_, view); }
cv::Mat VulkanBackend::checks(int view) { return download(checks_, view); }

std::size_t VulkanBackend::device_bytes() const {
  VkDeviceSize bytes = 0;
  for (const MapBuffer* map : maps()) bytes += map->buffer.bytes;
  for (const LayeredImage& texels : texels_) bytes += texels.bytes;
  for (const Buffer* buffer :
       {&parameters_, &places_, &transfer_nearest_, &transfer_winner_, &staging_}) {
    bytes += buffer->bytes;
  }
  return static_cast<std::size_t>(bytes);
}

void VulkanBackend::record_barrier(VkCommandBuffer commands) const {
  barrier(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
          VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT);
}

void VulkanBackend::record_parameters(VkCommandBuffer commands, const Schedule& schedule) const {
  require_constants(schedule, constants_);
  barrier(commands, compute_and_transfer, VK_PIPELINE_STAGE_TRANSFER_BIT,
          VK_ACCESS_TRANSFER_WRITE_BIT);
  context_.vk().vkCmdUpdateBuffer(commands, parameters_.handle.get(), 0, sizeof schedule.parameters,
                                  &schedule.parameters);
  barrier(commands, compute_and_transfer, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
          VK_ACCESS_SHADER_READ_BIT | VK_ACCESS_SHADER_WRITE_BIT | VK_ACCESS_UNIFORM_READ_BIT);
}

void VulkanBackend::record_band(VkCommandBuffer commands, const Band& band) const {
  const DeviceFunctions& vk = context_.vk();
  // Bands of one dispatch would need none, but synchronization validation sees whole buffers only,
  // and draining the device costs nothing beside a band.
  record_barrier(commands);
  vk.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE,
                       pipelines_.get(band.dispatch->kernel));
  kernel::PassParameters pass = band.dispatch->pass;
  const VkDescriptorSet set = descriptor_set(pass.first_view);
  vk.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, pipelines_.layout(), 0, 1,
                             &set, 0, nullptr);
  pass.first_row = band.first_row;
  pass.last_row = band.last_row;
  vk.vkCmdPushConstants(commands, pipelines_.layout(), VK_SHADER_STAGE_COMPUTE_BIT, 0, sizeof pass,
                        &pass);
  const int columns = columns_of(band.dispatch->width, pass.colour);
  vk.vkCmdDispatch(commands, pipelines_.workgroups_of_row(columns),
                   pipelines_.workgroups_of_column(band.last_row - band.first_row),
                   static_cast<std::uint32_t>(band.dispatch->views));
}

void VulkanBackend::record_dispatches(std::span<const VkCommandBuffer> commands,
                                      const Schedule& schedule) const {
  long long total = 0;
  for (const Band& band : split_into_bands(schedule, max_samples_)) total += band.work;
  const long long share = total / static_cast<long long>(commands.size());
  const std::vector<Band> bands = split_into_bands(schedule, std::clamp(share, 1LL, max_samples_));
  const auto shares = share_out(bands, commands.size());
  for (std::size_t i = 0; i < commands.size(); ++i) {
    for (const Band& band : shares[i]) record_band(commands[i], band);
  }
}

/// Feeds the two submissions in turn and accounts for what they have finished.
struct VulkanBackend::Run {
  Run(VulkanBackend& of, const Schedule& runs, const Matcher::Progress& reports_to)
      : backend(of), schedule(runs), progress(runs, reports_to) {}
  /// What is left of an aborted run must not write what the next one uploads.
  ~Run() {
    for (const auto& submission : backend.submissions_) submission->finish();
  }
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  /// Consecutive bands of one kernel: what lies between two timestamps.
  struct Stretch {
    Kernel kernel = Kernel::initialise;
    int dispatches = 0;
  };
  struct InFlight {
    std::vector<Stretch> stretches;
    long long samples = 0;
  };

  void submit(std::span<const Band> bands, bool first) {
    Submission& submission = *backend.submissions_[turn];
    InFlight& work = in_flight[turn];
    work = {};
    const VkCommandBuffer commands = submission.begin();
    if (first) backend.record_parameters(commands, schedule);
    submission.write_timestamp();
    for (std::size_t i = 0; i < bands.size(); ++i) {
      const Band& band = bands[i];
      const Kernel kernel = band.dispatch->kernel;
      if (work.stretches.empty()) {
        work.stretches.push_back({kernel, 0});
      } else if (work.stretches.back().kernel != kernel) {
        if (backend.time_each_) submission.write_timestamp();
        work.stretches.push_back({kernel, 0});
      }
      if (band.first_row == 0) ++work.stretches.back().dispatches;
      work.samples += band.samples;
      backend.record_band(commands, band);
    }
    submission.write_timestamp();
    submission.submit();
    turn = 1 - turn;
  }

  /// Waits for the older submission.
  void finish() {
    Submission& submission = *backend.submissions_[turn];
    if (!submission.in_flight()) return;
    submission.wait();
    const InFlight& work = in_flight[turn];
    const std::vector<double> elapsed = submission.elapsed();
    for (std::size_t i = 0; i < work.stretches.size(); ++i) {
      const bool timed = backend.time_each_ && i < elapsed.size();
      backend.times_.add(work.stretches[i].kernel, work.stretches[i].dispatches,
                         timed ? elapsed[i] : 0);
    }
    backend.milliseconds_ += std::accumulate(elapsed.begin(), elapsed.end(), 0.0);
    progress.advance(work.samples);
  }

  VulkanBackend& backend;
  const Schedule& schedule;
  ScheduleProgress progress;
  std::array<InFlight, 2> in_flight{};
  std::size_t turn = 0;
};

void VulkanBackend::compile(const Schedule& schedule) {
  require_constants(schedule, constants_);
  pipelines_.compile(schedule);
}

void VulkanBackend::run(const Schedule& schedule, const Matcher::Progress& progress) {
  compile(schedule);
  start_memory();
  times_.clear();
  milliseconds_ = 0;
  const std::vector<Band> bands = split_into_bands(schedule, max_samples_);
  Run run(*this, schedule, progress);
  bool first = true;
  for (const auto group : group_for_submission(bands, max_samples_, max_bands_per_submission)) {
    run.finish();
    run.submit(group, first);
    first = false;
  }
  run.finish();
  run.turn = 1 - run.turn;
  run.finish();
}

}  // namespace widestereo
