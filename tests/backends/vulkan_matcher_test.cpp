// SPDX-License-Identifier: MIT
// A Vulkan application that matches in its own command buffers must get what a Matcher gets.
#include <gmock/gmock.h>

#include <cmath>
#include <deque>
#include <limits>

#include "device_fixture.h"
#include "match_fixture.h"
#include "pixel_fixture.h"
#include "same_bits.h"
#include "vulkan/memory.h"
#include "vulkan/submission.h"
#include "vulkan_fixture.h"
#include "widestereo/matcher.h"
#include "widestereo/vulkan.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int side = 65;
constexpr unsigned char untouched = 0xa5;

/// A buffer that the application sees, too.
class SharedBuffer {
 public:
  SharedBuffer(const VulkanContext& context, std::size_t bytes) : bytes_(bytes) {
    const DeviceFunctions& vk = context.vk();
    VkBufferCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
    info.size = bytes;
    info.usage = VK_BUFFER_USAGE_STORAGE_BUFFER_BIT | VK_BUFFER_USAGE_TRANSFER_SRC_BIT;
    VkBuffer buffer = VK_NULL_HANDLE;
    context.check(vk.vkCreateBuffer(context.device(), &info, nullptr, &buffer), "make a buffer");
    buffer_ = context.own(buffer, vk.vkDestroyBuffer);
    VkMemoryRequirements requirements{};
    vk.vkGetBufferMemoryRequirements(context.device(), buffer, &requirements);
    VkMemoryAllocateInfo allocation{};
    allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
    allocation.allocationSize = requirements.size;
    allocation.memoryTypeIndex =
        context.memory_type(requirements.memoryTypeBits, VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                                             VK_MEMORY_PROPERTY_HOST_COHERENT_BIT);
    VkDeviceMemory memory = VK_NULL_HANDLE;
    context.check(vk.vkAllocateMemory(context.device(), &allocation, nullptr, &memory),
                  "allocate memory");
    memory_ = context.own(memory, vk.vkFreeMemory);
    context.check(vk.vkBindBufferMemory(context.device(), buffer, memory, 0), "bind memory");
    void* mapped = nullptr;
    context.check(vk.vkMapMemory(context.device(), memory, 0, VK_WHOLE_SIZE, 0, &mapped), "map");
    mapped_ = static_cast<unsigned char*>(mapped);
    clear();
  }

  void clear() { std::memset(mapped_, untouched, bytes_); }
  VkBuffer get() const { return buffer_.get(); }
  /// Of an image or a map inside.
  cv::Mat mat(cv::Size size, int type, std::size_t offset, std::size_t pitch) const {
    return cv::Mat(size, type, mapped_ + offset, pitch);
  }

 private:
  std::size_t bytes_;
  Handle<VkDeviceMemory> memory_;
  Handle<VkBuffer> buffer_;
  unsigned char* mapped_ = nullptr;
};

/// A command buffer that may be submitted again and again.
class Commands {
 public:
  explicit Commands(const VulkanContext& context) : context_(context) {
    const DeviceFunctions& vk = context.vk();
    pool_ = make_command_pool(context);
    VkCommandBufferAllocateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
    info.commandPool = pool_.get();
    info.commandBufferCount = 1;
    context.check(vk.vkAllocateCommandBuffers(context.device(), &info, &commands_), "commands");
    VkFenceCreateInfo fence_info{};
    fence_info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    VkFence fence = VK_NULL_HANDLE;
    context.check(vk.vkCreateFence(context.device(), &fence_info, nullptr, &fence), "fence");
    fence_ = context.own(fence, vk.vkDestroyFence);
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    context.check(vk.vkBeginCommandBuffer(commands_, &begin), "begin");
  }

  VkCommandBuffer get() const { return commands_; }

  /// What reads the maps waits for them: here, the host.
  void end() {
    VkMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_SHADER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_HOST_READ_BIT;
    context_.vk().vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
                                       VK_PIPELINE_STAGE_HOST_BIT, 0, 1, &barrier, 0, nullptr, 0,
                                       nullptr);
    context_.check(context_.vk().vkEndCommandBuffer(commands_), "end");
  }

  void run() {
    const DeviceFunctions& vk = context_.vk();
    VkSubmitInfo submit{};
    submit.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
    submit.commandBufferCount = 1;
    submit.pCommandBuffers = &commands_;
    const VkFence fence = fence_.get();
    context_.check(vk.vkQueueSubmit(context_.queue(), 1, &submit, fence), "submit");
    context_.check(vk.vkWaitForFences(context_.device(), 1, &fence, VK_TRUE, UINT64_MAX), "wait");
    context_.check(vk.vkResetFences(context_.device(), 1, &fence), "reset");
  }

 private:
  const VulkanContext& context_;
  Handle<VkCommandPool> pool_;
  VkCommandBuffer commands_ = VK_NULL_HANDLE;
  Handle<VkFence> fence_;
};

/// Where a GPU computes 1 / (m ray) of planes m, which a Matcher does on the host: to the rounding
/// of the sum, which the more of it cancels the more tilted the plane is, and of the quotient (2.5
/// units in the last place, as Vulkan allows).
void expect_rounded_distances(const cv::Mat_<float>& actual, const ViewResult& expected) {
  const cv::Mat_<float> distance = expected.distance;
  const cv::Mat_<cv::Vec4f> planes = expected.hypotheses;
  ASSERT_EQ(actual.size(), distance.size());
  constexpr double last_place = std::numeric_limits<float>::epsilon();
  int wrong = 0;
  for (int y = 0; y < distance.rows; ++y) {
    for (int x = 0; x < distance.cols; ++x) {
      const cv::Vec4f& plane = planes(y, x);
      const double d = distance(y, x);
      const double tilt = cv::norm(cv::Vec3d(plane[0], plane[1], plane[2])) * d;
      const double error = std::abs(static_cast<double>(actual(y, x)) - d);
      wrong += !(error <= 3 * last_place * (1 + tilt) * d);  // 0 where there is no distance
    }
  }
  EXPECT_EQ(wrong, 0);
}

/// All maps of both views at odd places of a buffer.
class ApplicationMaps {
 public:
  explicit ApplicationMaps(const VulkanContext& context)
      : maps_(context, 2 * bytes_of_view),
        distances_have_same_bits_(why_bits_may_differ(context.info()).empty()) {}

  std::array<VulkanViewMaps, 2> maps() const {
    std::array<VulkanViewMaps, 2> both;
    for (std::size_t view = 0; view < 2; ++view) {
      const auto map = [&](std::size_t i) {
        return VulkanMap{maps_.get(), offset_of(view, i), pitch_of(i)};
      };
      both[view] = {map(0), map(1), map(2), map(3), map(4)};
    }
    return both;
  }

  void clear() { maps_.clear(); }
  /// Distances of a view.
  cv::Mat distance(std::size_t view) const { return map(view, 0, CV_32FC1); }

  void expect_equal(const StereoResult& expected) const {
    for (std::size_t i = 0; i < 2; ++i) {
      const ViewResult& view = expected.views[i];
      expect_rounded_distances(distance(i), view);
      EXPECT_TRUE(same_bits(distance(i), view.distance) || !distances_have_same_bits_) << i;
      EXPECT_TRUE(cv::checkRange(map(i, 1, CV_32FC3)) && cv::checkRange(view.normals)) << i;
      EXPECT_LT(cv::norm(map(i, 1, CV_32FC3), view.normals, cv::NORM_INF), 1e-6) << i;
      EXPECT_TRUE(same_bits(map(i, 2, CV_32FC1), view.cost)) << i;
      EXPECT_TRUE(same_bits(map(i, 3, CV_32FC1), view.confidence)) << i;
      cv::Mat reasons;
      view.reasons.convertTo(reasons, CV_32S);
      EXPECT_TRUE(same_bits(map(i, 4, CV_32SC1), reasons)) << i;
      for (std::size_t k = 0; k < 5; ++k) expect_untouched_between_rows(i, k);
    }
  }

 private:
  static constexpr std::size_t gap = 8;
  static constexpr std::size_t bytes_of_view = (7 * 4 * side + 5 * gap) * side + 64;

  static std::size_t row_of(std::size_t map) { return (map == 1 ? 3 : 1) * 4 * side; }
  static std::size_t pitch_of(std::size_t map) { return row_of(map) + gap; }
  static std::size_t offset_of(std::size_t view, std::size_t map) {
    std::size_t offset = view * bytes_of_view + 4;
    for (std::size_t i = 0; i < map; ++i) offset += pitch_of(i) * side;
    return offset;
  }

  cv::Mat map(std::size_t view, std::size_t i, int type) const {
    return maps_.mat({side, side}, type, offset_of(view, i), pitch_of(i)).clone();
  }
  void expect_untouched_between_rows(std::size_t view, std::size_t i) const {
    const cv::Mat rest = maps_.mat({static_cast<int>(gap), side}, CV_8UC1,
                                   offset_of(view, i) + row_of(i), pitch_of(i));
    EXPECT_EQ(cv::countNonZero(rest != untouched), 0) << view << " " << i;
  }

  SharedBuffer maps_;
  bool distances_have_same_bits_;
};

/// Maps, and images at odd places of two more buffers.
class ApplicationBuffers : public ApplicationMaps {
 public:
  ApplicationBuffers(const VulkanContext& context, PixelType pixel)
      : ApplicationMaps(context),
        left_(context, image_offset + image_pitch * side + 4),
        right_(context, image_offset + image_pitch * side + 4),
        pixel_(pixel) {}

  std::array<VulkanImage, 2> images() const { return {image(left_), image(right_)}; }

  void set(const std::vector<cv::Mat>& images) {
    const auto copy = [](const cv::Mat& from, const SharedBuffer& to) {
      from.copyTo(to.mat(from.size(), from.type(), image_offset, image_pitch));
    };
    copy(images[0], left_);
    copy(images[1], right_);
    clear();
  }

 private:
  static constexpr std::size_t image_offset = 12;
  static constexpr std::size_t image_pitch = 4 * side + 8;

  VulkanImage image(const SharedBuffer& buffer) const {
    return {buffer.get(), image_offset, image_pitch, pixel_};
  }

  SharedBuffer left_, right_;
  PixelType pixel_;
};

/// An image of the application's, which a copy fills.
class Texture {
 public:
  Texture(const VulkanContext& context, VkFormat format, cv::Size size)
      : context_(context),
        image_(make_image(context, format, size, 1,
                          VK_IMAGE_USAGE_SAMPLED_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT,
                          "a texture")),
        staging_(context, 16 * size.area()) {
    VkImageViewCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_IMAGE_VIEW_CREATE_INFO;
    info.image = image_.handle.get();
    info.viewType = VK_IMAGE_VIEW_TYPE_2D;
    info.format = format;
    info.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    VkImageView view = VK_NULL_HANDLE;
    context.check(context.vk().vkCreateImageView(context.device(), &info, nullptr, &view), "view");
    view_ = context.own(view, context.vk().vkDestroyImageView);
  }

  VkImageView view() const { return view_.get(); }

  /// Fills the image when the commands run, and leaves it to shaders.
  void record_fill(VkCommandBuffer commands, const cv::Mat& texels) const {
    texels.copyTo(staging_.mat(texels.size(), texels.type(), 0, texels.cols * texels.elemSize()));
    transition(commands, VK_IMAGE_LAYOUT_UNDEFINED, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL);
    VkBufferImageCopy region{};
    region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
    region.imageExtent = {static_cast<std::uint32_t>(texels.cols),
                          static_cast<std::uint32_t>(texels.rows), 1};
    context_.vk().vkCmdCopyBufferToImage(commands, staging_.get(), image_.handle.get(),
                                         VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL, 1, &region);
    transition(commands, VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL,
               VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
  }

 private:
  void transition(VkCommandBuffer commands, VkImageLayout from, VkImageLayout to) const {
    VkImageMemoryBarrier barrier{};
    barrier.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER;
    barrier.srcAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT;
    barrier.dstAccessMask = VK_ACCESS_TRANSFER_WRITE_BIT | VK_ACCESS_SHADER_READ_BIT;
    barrier.oldLayout = from;
    barrier.newLayout = to;
    barrier.srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED;
    barrier.image = image_.handle.get();
    barrier.subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1};
    constexpr VkPipelineStageFlags stages =
        VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT;
    context_.vk().vkCmdPipelineBarrier(commands, stages, stages, 0, 0, nullptr, 0, nullptr, 1,
                                       &barrier);
  }

  const VulkanContext& context_;
  LayeredImage image_;
  Handle<VkImageView> view_;
  SharedBuffer staging_;
};

Options small_options(const std::string& preset) {
  Options options = Options::preset_named(preset);
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.first_iterations = 2;
  options.second_iterations = 1;
  options.sweep_steps = 12;
  return options;
}

class VulkanApplication : public ::testing::TestWithParam<PixelType> {};

TEST_P(VulkanApplication, GetsTheMatchersResultInItsBuffers) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  Device device = Device::open("vulkan:0");
  const RenderedPair pair = render_demo(side);
  const std::vector<cv::Mat> images = device_images_of(pair, GetParam());
  for (const char* preset : {"fast", "paper"}) {
    const Options options = small_options(preset);
    VulkanMatcher matcher(application.context.handles(), pair.rig, options);
    ApplicationBuffers memory(application.context, GetParam());
    const VulkanBindings bindings = matcher.bind(memory.images(), memory.maps());
    Commands commands(application.context);
    matcher.record(commands.get(), bindings);
    commands.end();
    const StereoResult expected = Matcher(device, pair.rig, options).match(images);
    for (int submission = 0; submission < 2; ++submission) {
      memory.set(images);
      commands.run();
      memory.expect_equal(expected);
    }
    // It transfers nothing between host and device.
    EXPECT_LE(matcher.device_bytes() + side * side * sizeof(cv::Vec4f), expected.device_bytes);
  }
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(Pixels, VulkanApplication,
                         ::testing::Values(PixelType::grey8, PixelType::grey16,
                                           PixelType::intensity),
                         name_of);

/// A format of textures, and the images of the demo in it.
struct TextureFormat {
  const char* name;
  VkFormat format;
  PixelType pixel;
  bool colour = false;
  double noise = 0;  ///< largest red and blue of colours, which are grey without
};

class VulkanTextures : public ::testing::TestWithParam<TextureFormat> {};

/// Colours that make up these intensities, with noise in red and blue if any.
cv::Mat coloured(const cv::Mat& grey, double noise) {
  const cv::Mat opaque(grey.size(), CV_32F, 1.0);
  cv::Mat rgba;
  if (noise == 0) {
    cv::merge(std::vector<cv::Mat>{grey, grey, grey, opaque}, rgba);
    return rgba;
  }
  cv::Mat red(grey.size(), CV_32F);
  cv::Mat blue(grey.size(), CV_32F);
  cv::RNG random(1);
  random.fill(red, cv::RNG::UNIFORM, 0, noise);
  random.fill(blue, cv::RNG::UNIFORM, 0, noise);
  const cv::Mat green = (grey - 0.299 * red - 0.114 * blue) / 0.587;
  cv::merge(std::vector<cv::Mat>{red, green, blue, opaque}, rgba);
  return rgba;
}

double share_of_right(const cv::Mat& distance, const cv::Mat& truth) {
  return cv::countNonZero(cv::abs(distance - truth) <= 0.05 * truth) /
         static_cast<double>(truth.total());
}

TEST_P(VulkanTextures, AreMatchedAsTheMatcherDoes) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  const RenderedPair pair = render_demo(side);
  Options options = Options::preset_named("fast");
  std::tie(options.min_distance, options.max_distance) = demo_distance_range();
  options.max_gain = 1;  // which an application's images have
  VulkanMatcher matcher(application.context.handles(), pair.rig, options);
  std::vector<cv::Mat> images = device_images_of(pair, GetParam().pixel);
  if (GetParam().colour) {
    for (cv::Mat& image : images) image = 0.25 + 0.3 * image;  // green stays within [0, 1]
  }
  Device device = Device::open("vulkan:0");
  const StereoResult expected = Matcher(device, pair.rig, options).match(images);

  const cv::Mat truth = pair.views[0].truth.distance;
  const double expected_share = share_of_right(expected.views[0].distance, truth);
  EXPECT_GT(expected_share, 0.3);

  const Texture left(application.context, GetParam().format, {side, side});
  const Texture right(application.context, GetParam().format, {side, side});
  const bool colour = GetParam().colour;
  const VulkanTexture textures[] = {{.view = left.view(), .colour = colour},
                                    {.view = right.view(), .colour = colour}};
  ApplicationMaps memory(application.context);
  const VulkanBindings bindings = matcher.bind(textures, memory.maps());
  Commands commands(application.context);
  const auto texels = [&](const cv::Mat& image) {
    return colour ? coloured(image, GetParam().noise) : image;
  };
  left.record_fill(commands.get(), texels(images[0]));
  right.record_fill(commands.get(), texels(images[1]));
  matcher.record(commands.get(), bindings);
  commands.end();
  // Devices may round what they make of whole numbers and colours.
  const bool has_same_bits = GetParam().pixel == PixelType::intensity && GetParam().noise == 0;
  for (int submission = 0; submission < 2; ++submission) {
    memory.clear();
    commands.run();
    if (has_same_bits) memory.expect_equal(expected);
    EXPECT_GE(share_of_right(memory.distance(0), truth), expected_share - 0.05);
  }
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(
    Formats, VulkanTextures,
    ::testing::Values(
        TextureFormat{"R32", VK_FORMAT_R32_SFLOAT, PixelType::intensity},
        TextureFormat{"R8", VK_FORMAT_R8_UNORM, PixelType::grey8},
        TextureFormat{"R16", VK_FORMAT_R16_UNORM, PixelType::grey16},
        TextureFormat{"Colour", VK_FORMAT_R32G32B32A32_SFLOAT, PixelType::intensity, true, 0.4},
        TextureFormat{"GreyAsColour", VK_FORMAT_R32G32B32A32_SFLOAT, PixelType::intensity, true}),
    [](const auto& test) { return test.param.name; });

TEST(VulkanApplications, FindNoObjectLeftBehindWhateverFails) {
  REQUIRE_VULKAN_OR_SKIP();
  const RenderedPair pair = render_demo(side);
  const std::vector<cv::Mat> images = device_images_of(pair, PixelType::grey8);
  expect_failures_leave_no_object([&](const VulkanContext& context) {
    VulkanMatcher matcher(context.handles(), pair.rig, small_options("paper"));
    ApplicationBuffers memory(context, PixelType::grey8);
    const VulkanBindings bindings = matcher.bind(memory.images(), memory.maps());
    Commands commands(context);
    matcher.record(commands.get(), bindings);
    commands.end();
    memory.set(images);
    commands.run();
  });
}

TEST(VulkanApplications, MaskWhatSmallerTexturesDoNotReach) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  const RenderedPair pair = render_demo(side);
  VulkanMatcher matcher(application.context.handles(), pair.rig, small_options("fast"));
  const std::vector<cv::Mat> images = device_images_of(pair, PixelType::grey8);
  const cv::Rect part(0, 0, side, side - 20);
  const Texture left(application.context, VK_FORMAT_R8_UNORM, part.size());
  const Texture right(application.context, VK_FORMAT_R8_UNORM, {side, side});
  const VulkanTexture textures[] = {{left.view()}, {right.view()}};
  ApplicationMaps memory(application.context);
  const VulkanBindings bindings = matcher.bind(textures, memory.maps());
  Commands commands(application.context);
  left.record_fill(commands.get(), images[0](part));
  right.record_fill(commands.get(), images[1]);
  matcher.record(commands.get(), bindings);
  commands.end();
  commands.run();
  const cv::Mat found = memory.distance(0);
  EXPECT_EQ(cv::countNonZero(found.rowRange(side - 20, side)), 0);
  EXPECT_GT(cv::countNonZero(found), side * side / 2);
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanApplications, MaskWhatIsNoIntensityAndWriteWhatIsAskedFor) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  const RenderedPair pair = render_demo(side);
  std::vector<cv::Mat> images = device_images_of(pair, PixelType::intensity);
  images[0](cv::Rect(20, 20, 20, 20)).setTo(std::numeric_limits<float>::quiet_NaN());
  images[0](cv::Rect(20, 20, 20, 5)).setTo(1.1);
  images[0](cv::Rect(20, 25, 20, 5)).setTo(-0.1);
  images[0](cv::Rect(50, 30, 1, 1)).setTo(-0.0);
  Options options = small_options("fast");
  options.fill_radius = side;
  VulkanMatcher matcher(application.context.handles(), pair.rig, options);
  ApplicationBuffers memory(application.context, PixelType::intensity);
  SharedBuffer distance(application.context, 4 * side * side);
  SharedBuffer reasons(application.context, 4 * side * side);
  std::array<VulkanViewMaps, 2> maps;
  maps[0].distance = {distance.get(), 0, 4 * side};
  maps[0].reasons = {reasons.get(), 0, 4 * side};
  const VulkanBindings bindings = matcher.bind(memory.images(), maps);
  Commands commands(application.context);
  matcher.record(commands.get(), bindings);
  commands.end();
  memory.set(images);
  commands.run();
  const cv::Mat found = distance.mat({side, side}, CV_32FC1, 0, 4 * side);
  const cv::Rect masked(20, 20, 20, 20);
  EXPECT_EQ(cv::countNonZero(found(masked)), 0);
  EXPECT_GT(cv::countNonZero(found), side * side / 2);
  const cv::Mat why = reasons.mat({side, side}, CV_32SC1, 0, 4 * side);
  EXPECT_EQ(cv::countNonZero(why(masked) != static_cast<double>(reason_no_ray)), 0);
  EXPECT_NE(why.at<int>(30, 50), reason_no_ray) << "minus zero is an intensity";
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanApplications, StartFromTheFrameBeforeAsTheMatcherDoes) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  Device device = Device::open("vulkan:0");
  const Options options = small_options("fast");
  const Rig rig = render_demo_from(pose_after(0), side).rig;
  Matcher expected(device, rig, options);
  VulkanMatcher matcher(application.context.handles(), rig, options);
  ApplicationBuffers memory(application.context, PixelType::grey8);
  const VulkanBindings bindings = matcher.bind(memory.images(), memory.maps());
  for (int k = 0; k < 3; ++k) {
    const std::vector<cv::Mat> images =
        device_images_of(render_demo_from(pose_after(k), side), PixelType::grey8);
    memory.set(images);
    Commands commands(application.context);
    if (k == 0) {
      matcher.record(commands.get(), bindings);
      commands.end();
      commands.run();
      memory.expect_equal(expected.match(images));
      continue;
    }
    const WarmStart start{.now_from_previous = pose_after(k).inverse() * pose_after(k - 1),
                          .frame = k};
    matcher.record_next(commands.get(), bindings, start);
    commands.end();
    commands.run();
    memory.expect_equal(expected.match_next(images, start));
  }
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

/// The demo's scene in an application's buffers, and what a Matcher makes of it.
struct DemoInApplication {
  Application application;
  Device device = Device::open("vulkan:0");
  RenderedPair pair = render_demo(side);
  std::vector<cv::Mat> images = device_images_of(pair, PixelType::grey8);
  Matcher expected = Matcher(device, pair.rig, small_options("fast"));
  VulkanMatcher matcher =
      VulkanMatcher(application.context.handles(), pair.rig, small_options("fast"));
  ApplicationBuffers memory = ApplicationBuffers(application.context, PixelType::grey8);
  VulkanBindings bindings = matcher.bind(memory.images(), memory.maps());
};

TEST(VulkanApplications, MayGiveSeveralMatchesToOneCommandBuffer) {
  REQUIRE_VULKAN_OR_SKIP();
  DemoInApplication demo;
  Commands commands(demo.application.context);
  demo.matcher.record(commands.get(), demo.bindings);
  demo.matcher.record_next(commands.get(), demo.bindings);
  commands.end();
  demo.memory.set(demo.images);
  commands.run();
  demo.expected.match(demo.images);
  demo.memory.expect_equal(demo.expected.match_next(demo.images, {}));
  EXPECT_THAT(demo.application.instance.validation_messages(), IsEmpty());
}

// Kernels of another kind than those that software runs.
TEST(VulkanApplications, OfGpusGetTheMatchersResultToo) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  FaultyLoader::faults().type = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU;
  const PFN_vkGetInstanceProcAddr loader = FaultyLoader::get_instance_proc_addr();
  Application application;
  VulkanHandles handles = application.context.handles();
  handles.get_instance_proc_addr = loader;
  // Validated, as the application is: the faulty loader knows one kind of functions at a time.
  Device device(open_vulkan_device(0, {.validation = true}, loader));
  const RenderedPair pair = render_demo(side);
  const Options options = small_options("fast");
  Matcher expected(device, pair.rig, options);
  VulkanMatcher matcher(handles, pair.rig, options);

  const std::vector<cv::Mat> images = device_images_of(pair, PixelType::grey8);
  ApplicationBuffers memory(application.context, PixelType::grey8);
  const VulkanBindings buffers = matcher.bind(memory.images(), memory.maps());
  memory.set(images);
  Commands of_buffers(application.context);
  matcher.record(of_buffers.get(), buffers);
  of_buffers.end();
  of_buffers.run();
  memory.expect_equal(expected.match(images));

  const std::vector<cv::Mat> intensities = device_images_of(pair, PixelType::intensity);
  const Texture left(application.context, VK_FORMAT_R32_SFLOAT, {side, side});
  const Texture right(application.context, VK_FORMAT_R32_SFLOAT, {side, side});
  const VulkanTexture textures[] = {{.view = left.view()}, {.view = right.view()}};
  const VulkanBindings of_textures = matcher.bind(textures, memory.maps());
  Commands warm(application.context);
  left.record_fill(warm.get(), intensities[0]);
  right.record_fill(warm.get(), intensities[1]);
  matcher.record_next(warm.get(), of_textures);
  warm.end();
  memory.clear();
  warm.run();
  memory.expect_equal(expected.match_next(intensities, {}));
  EXPECT_THAT(device.validation_messages(), IsEmpty());
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanApplications, KeepTheirQueueUntilAllIsCompiled) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  const Application application(false);
  VulkanHandles handles = application.context.handles();
  handles.get_instance_proc_addr = FaultyLoader::get_instance_proc_addr();
  const Rig rig = render_demo(side).rig;
  const auto compiled = [&](int failing_submission) {
    FaultyLoader::faults() = {.failing_submission = failing_submission};
    const std::string error = error_of([&] { VulkanMatcher(handles, rig, small_options("fast")); });
    EXPECT_EQ(error.empty(), failing_submission < 0) << error;
    return FaultyLoader::faults().calls["vkCreateComputePipelines"];
  };
  const int all = compiled(-1);
  EXPECT_GT(all, 10);
  EXPECT_EQ(compiled(0), all);
}

TEST(VulkanApplications, CanTellWhichFilterIsUsed) {
  REQUIRE_VULKAN_OR_SKIP();
  const FaultyLoader::Scope scope;
  FaultyLoader::faults() = {.no_filtering_of_floats = true,
                            .type = VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU};
  Application application;
  VulkanHandles handles = application.context.handles();
  handles.get_instance_proc_addr = FaultyLoader::get_instance_proc_addr();
  const Rig rig = render_demo(side).rig;
  const auto filter = [&] { return VulkanMatcher(handles, rig, small_options("fast")).filter(); };
  ASSERT_TRUE(handles.extended_storage_formats) << "which Vulkan's profiles ask for";
  EXPECT_EQ(filter(), Filter::device);
  handles.extended_storage_formats = false;
  EXPECT_EQ(filter(), Filter::exact);
  EXPECT_THAT(application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanApplications, MayGiveOneMatchToSeveralCommandBuffers) {
  REQUIRE_VULKAN_OR_SKIP();
  DemoInApplication demo;
  demo.memory.set(demo.images);
  for (const bool warm : {false, true}) {
    std::deque<Commands> parts;
    std::vector<VkCommandBuffer> handles;
    for (int i = 0; i < 5; ++i) {
      handles.push_back(parts.emplace_back(demo.application.context).get());
    }
    warm ? demo.matcher.record_next(handles, demo.bindings)
         : demo.matcher.record(handles, demo.bindings);
    for (Commands& part : parts) part.end();
    demo.memory.clear();
    for (Commands& part : parts) part.run();
    demo.memory.expect_equal(warm ? demo.expected.match_next(demo.images, {})
                                  : demo.expected.match(demo.images));
  }
  EXPECT_THAT(
      error_of([&] { demo.matcher.record(std::span<const VkCommandBuffer>(), demo.bindings); }),
      HasSubstr("no command buffer"));
  EXPECT_THAT(demo.application.instance.validation_messages(), IsEmpty());
}

TEST(VulkanApplications, WhatDoesNotFitIsOneSentence) {
  REQUIRE_VULKAN_OR_SKIP();
  Application application;
  const RenderedPair pair = render_demo(side);
  const Options options = small_options("fast");
  VulkanMatcher matcher(application.context.handles(), pair.rig, options);
  ApplicationBuffers memory(application.context, PixelType::grey16);
  const std::array<VulkanImage, 2> good = memory.images();
  const auto error = [&](const VulkanImage& left, const VulkanViewMaps& of_left) {
    const std::array<VulkanImage, 2> images = {left, good[1]};
    const std::array<VulkanViewMaps, 2> maps = {of_left, VulkanViewMaps{}};
    return error_of([&] { matcher.bind(images, maps); });
  };
  EXPECT_EQ(error(good[0], {}), "");
  EXPECT_THAT(error_of([&] {
                matcher.bind({good.data(), 1}, memory.maps());
              }),
              HasSubstr("2 views, but 1 image"));
  EXPECT_THAT(error({}, {}), HasSubstr("The image of cam0 has no buffer"));
  const VulkanTexture none[] = {{}, {}};
  EXPECT_THAT(error_of([&] { matcher.bind(none, memory.maps()); }),
              HasSubstr("The image of cam0 has no image view"));
  VulkanImage bad = good[0];
  bad.pitch = 2 * side - 2;
  EXPECT_THAT(error(bad, {}), HasSubstr("The image of cam0 has a pitch of 128 bytes"));
  bad = good[0];
  bad.offset = 3;
  EXPECT_THAT(error(bad, {}), HasSubstr("offset and pitch must be multiples of 2"));
  bad = good[0];
  for (const VkDeviceSize pitch : {VkDeviceSize{1} << 40, VkDeviceSize{1} << 63}) {
    bad.pitch = pitch;
    EXPECT_THAT(error(bad, {}), HasSubstr("maxStorageBufferRange"));
  }
  VulkanViewMaps maps;
  maps.normals = {good[0].buffer, 0, 4 * side};
  EXPECT_THAT(error(good[0], maps), HasSubstr("The normal map of cam0"));

  Commands commands(application.context);
  const VulkanBindings bindings = matcher.bind(good, memory.maps());
  EXPECT_THAT(error_of([&] { matcher.record_next(commands.get(), bindings); }),
              HasSubstr("no planes of a previous frame"));
  VulkanMatcher other(application.context.handles(), pair.rig, options);
  EXPECT_THAT(error_of([&] { other.record(commands.get(), bindings); }),
              HasSubstr("another matcher"));
  matcher.record(commands.get(), bindings);
  EXPECT_THAT(
      error_of([&] { matcher.record_next(commands.get(), bindings, {.hypotheses = {cv::Mat()}}); }),
      HasSubstr("leave the hypotheses empty"));
}

}  // namespace
}  // namespace widestereo::test
