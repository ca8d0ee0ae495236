// SPDX-License-Identifier: MIT
// What README.md shows of the library, to be compiled and linked; nothing runs it.
#include <widestereo/calibration.h>
#include <widestereo/cuda.h>
#include <widestereo/matcher.h>
#include <widestereo/motion.h>
#include <widestereo/vulkan.h>

#include <opencv2/core.hpp>

namespace ws = widestereo;

namespace readme {

cv::Mat frames(const cv::Mat& left, const cv::Mat& right, const cv::Mat& next_left,
               const cv::Mat& next_right, const Eigen::Isometry3d& pose,
               const Eigen::Isometry3d& previous_pose) {
  ws::Rig rig = ws::read_calibration("camchain.yaml").rig;
  ws::Options options = ws::Options::preset_named("quality");
  options.min_distance = 0.3;
  options.max_distance = 20;

  ws::Device device = ws::Device::open("auto");
  ws::Matcher matcher(device, rig, options);
  ws::StereoResult result = matcher.match(left, right);
  cv::Mat distance = ws::accepted_distance(result.views[0]);

  ws::WarmStart start;
  start.now_from_previous = pose.inverse() * previous_pose;
  start.frame = 1;
  ws::StereoResult next = matcher.match_next({next_left, next_right}, start);

  start.now_from_previous =
      ws::estimate_motion(rig, {left, right}, result.views, {next_left, next_right});
  return distance;
}

void cuda(const ws::Rig& rig, const ws::Options& options, const void* left, std::size_t left_pitch,
          const void* right, std::size_t right_pitch, float* distance, std::size_t distance_pitch,
          const Eigen::Isometry3d& motion, CUstream_st* stream) {
  ws::CudaMatcher matcher(rig, options);
  ws::CudaImage images[] = {{left, left_pitch}, {right, right_pitch}};
  ws::CudaViewMaps maps[2];
  maps[0].distance = {distance, distance_pitch};
  matcher.enqueue(images, maps, stream);
  matcher.enqueue_next(images, maps, stream, {motion});
}

void vulkan(const ws::VulkanHandles& handles, const ws::Rig& rig, const ws::Options& options,
            VkImageView left, VkImageView right, VkBuffer distance, VkDeviceSize distance_pitch,
            const Eigen::Isometry3d& motion, VkCommandBuffer commands) {
  ws::VulkanMatcher matcher(handles, rig, options);
  ws::VulkanTexture images[] = {{left}, {right}};
  ws::VulkanViewMaps maps[2];
  maps[0].distance = {distance, 0, distance_pitch};
  ws::VulkanBindings bindings = matcher.bind(images, maps);
  matcher.record(commands, bindings);
  matcher.record_next(commands, bindings, {motion});
}

}  // namespace readme
