// SPDX-License-Identifier: MIT
#include "benchmark_measurement.h"

#include <algorithm>

#include "roofline.h"
#include "statistics/percentile.h"

namespace ws = widestereo;
using Json = nlohmann::ordered_json;

namespace {

std::vector<ws::StereoResult> results_of(ws::Matcher& matcher, const std::vector<cv::Mat>& images,
                                         bool warm, int runs) {
  int frame = 0;
  const auto match = [&] {
    if (!warm) return matcher.match(images);
    return matcher.match_next(
        images, {.now_from_previous = Eigen::Isometry3d::Identity(), .frame = ++frame});
  };
  if (warm) matcher.match(images);
  match();  // compiles pipelines
  std::vector<ws::StereoResult> results;
  for (int run = 0; run < runs; ++run) {
    results.push_back(match());
    results.back().views.clear();  // the maps are not needed
  }
  return results;
}

/// The result of median device time.
const ws::StereoResult& median_of(std::vector<ws::StereoResult>& results) {
  const auto middle = results.begin() + static_cast<std::ptrdiff_t>(results.size() / 2);
  std::nth_element(results.begin(), middle, results.end(), [](const auto& a, const auto& b) {
    return a.device_milliseconds < b.device_milliseconds;
  });
  return *middle;
}

std::vector<ws::KernelTime> per_map(std::vector<ws::KernelTime> kernels, std::size_t maps) {
  const double share = 1.0 / static_cast<double>(maps);
  for (ws::KernelTime& kernel : kernels) {
    kernel.milliseconds *= share;
    kernel.work *= share;
  }
  return kernels;
}

/// Work, what was reached of it in a second, and the share of the roofline, null where unknown.
Json json_of(const ws::KernelWork& work, double milliseconds, const Roofline& least) {
  const auto giga_per_second = [milliseconds](double amount) {
    return milliseconds > 0 ? 1e-6 * amount / milliseconds : 0;
  };
  Json json = {{"milliseconds", milliseconds},
               {"samples", work.samples},
               {"operations", work.operations},
               {"texels", work.texels},
               {"bytes", work.bytes},
               {"gflops", giga_per_second(work.operations)},
               {"gtexels", giga_per_second(work.texels)},
               {"gbps", giga_per_second(work.bytes)},
               {"roofline_milliseconds", nullptr},
               {"roofline_bound", nullptr},
               {"roofline_share", nullptr}};
  if (const auto share = least.share_of(milliseconds)) {
    json["roofline_milliseconds"] = least.milliseconds;
    json["roofline_bound"] = least.bound;
    json["roofline_share"] = *share;
  }
  return json;
}

}  // namespace

ws::KernelWork sum_of(const std::vector<ws::KernelTime>& kernels) {
  ws::KernelWork sum;
  for (const ws::KernelTime& kernel : kernels) sum += kernel.work;
  return sum;
}

Measurement measure(ws::Device& device, const ws::RenderedPair& pair, const ws::Options& options,
                    bool warm, int runs) {
  const std::vector<cv::Mat> images = {pair.views[0].image, pair.views[1].image};
  ws::Matcher matcher(device, pair.rig, options);
  std::vector<ws::StereoResult> timed = results_of(matcher, images, warm, runs);
  std::vector<ws::StereoResult> results = timed;
  if (device.info().type != "cpu") {
    // Where kernels need not be timed, the device need not finish each before the next.
    matcher.time_kernels(false);
    results = results_of(matcher, images, warm, runs);
  }
  const auto maps = images.size();
  std::vector<double> wall;
  for (const ws::StereoResult& result : results) {
    wall.push_back(result.milliseconds / static_cast<double>(maps));
  }
  Measurement m;
  m.device = device.info();
  m.preset = options.preset;
  m.warm = warm;
  m.size = pair.rig.views[0].camera.width;
  m.window_radius = options.window_radius;
  m.options = ws::to_json(options);
  m.filter = results.front().filter;
  m.wall_min = *std::min_element(wall.begin(), wall.end());
  m.wall_max = *std::max_element(wall.begin(), wall.end());
  m.wall = ws::median(std::move(wall));
  m.kernels = per_map(median_of(timed).times, maps);
  m.on_device = median_of(results).device_milliseconds / static_cast<double>(maps);
  m.device_bytes = results.front().device_bytes;
  return m;
}

Json json_of(const Measurement& m) {
  const ws::DevicePeaks& peaks = m.device.peaks;
  const ws::KernelWork work = sum_of(m.kernels);
  Json kernels;
  for (const ws::KernelTime& kernel : m.kernels) {
    kernels[kernel.kernel] =
        json_of(kernel.work, kernel.milliseconds, roofline(kernel.work, peaks));
    kernels[kernel.kernel]["dispatches"] = kernel.dispatches;
  }
  return {{"device", m.device.id},
          {"name", m.device.name},
          {"driver", m.device.driver},
          {"preset", m.preset},
          {"start", m.start()},
          {"size", m.size},
          {"window_radius", m.window_radius},
          {"options", Json::parse(m.options)},
          {"filter_used", ws::to_string(m.filter)},
          {"milliseconds", m.wall},
          {"milliseconds_min", m.wall_min},
          {"milliseconds_max", m.wall_max},
          {"samples_per_pixel", work.samples / m.pixels()},
          {"million_samples_per_second", m.per_second(1e-6 * work.samples)},
          {"device_bytes", m.device_bytes},
          {"peaks", to_json(peaks)},
          {"on_device", json_of(work, m.on_device, roofline(m.kernels, peaks))},
          {"kernels", kernels}};
}
