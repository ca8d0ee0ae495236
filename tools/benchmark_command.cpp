// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "progress_bar.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"
#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

namespace ws = widestereo;
using Json = nlohmann::ordered_json;

namespace {

struct BenchmarkArguments {
  std::vector<std::string> devices;
  std::vector<std::string> presets = {"fast", "quality"};
  std::vector<int> sizes = {256};
  std::vector<int> window_radii = {5};
  int runs = 3;
  std::string output;
  bool as_json = false;
};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

double device_milliseconds(const ws::StereoResult& result) {
  double sum = 0;
  for (const ws::KernelTime& time : result.times) sum += time.milliseconds;
  return sum;
}

/// Everything measured of one configuration; all figures are per depth map, a pair giving two.
Json measure(ws::Device& device, const ws::RenderedPair& pair, const ws::Options& options,
             int runs) {
  const std::vector<cv::Mat> images = {pair.views[0].image, pair.views[1].image};
  ws::Matcher matcher(device, pair.rig, options);
  ws::StereoResult result = matcher.match(images);  // warm-up: compiles pipelines
  std::vector<double> wall;
  std::vector<double> on_device;
  const double maps = static_cast<double>(result.views.size());
  for (int run = 0; run < runs; ++run) {
    result = matcher.match(images);
    wall.push_back(result.milliseconds / maps);
    on_device.push_back(device_milliseconds(result) / maps);
  }
  const double samples = static_cast<double>(result.samples) / maps;
  const double pixels = static_cast<double>(result.views[0].cost.total());
  Json kernels;
  for (const ws::KernelTime& time : result.times) kernels[time.kernel] = time.milliseconds / maps;
  return {{"device", device.info().id},
          {"name", device.info().name},
          {"preset", options.preset},
          {"size", pair.rig.views[0].camera.width},
          {"window_radius", options.window_radius},
          {"milliseconds", median(wall)},
          {"milliseconds_min", *std::min_element(wall.begin(), wall.end())},
          {"milliseconds_max", *std::max_element(wall.begin(), wall.end())},
          {"device_milliseconds", median(on_device)},
          {"samples_per_pixel", samples / pixels},
          {"million_samples_per_second", samples / median(on_device) / 1000},
          {"source_texels", 4 * samples},
          {"device_bytes", result.device_bytes},
          {"kernel_milliseconds", kernels}};
}

void print_row(const Json& row) {
  std::printf("%-10s %-8s %5d %4d  %9.1f [%9.1f %9.1f]  %9.1f  %8.0f  %8.1f  %7.1f\n",
              row["device"].get<std::string>().c_str(), row["preset"].get<std::string>().c_str(),
              row["size"].get<int>(), row["window_radius"].get<int>(),
              row["milliseconds"].get<double>(), row["milliseconds_min"].get<double>(),
              row["milliseconds_max"].get<double>(), row["device_milliseconds"].get<double>(),
              row["samples_per_pixel"].get<double>(),
              row["million_samples_per_second"].get<double>(),
              row["device_bytes"].get<double>() / (1 << 20));
  std::string shares;
  double total = 0;  // of the run that the kernels' times are from
  for (const auto& [kernel, time] : row["kernel_milliseconds"].items()) total += time.get<double>();
  for (const auto& [kernel, time] : row["kernel_milliseconds"].items()) {
    char text[64];
    std::snprintf(text, sizeof text, " %s %.0f %%", kernel.c_str(),
                  100 * time.get<double>() / total);
    shares += text;
  }
  std::printf("           %s\n", shares.c_str());
  std::fflush(stdout);
}

void run_benchmark(BenchmarkArguments a) {
  if (a.devices.empty()) {
    for (const ws::DeviceInfo& device : ws::Device::list()) {
      if (device.unusable.empty()) a.devices.push_back(device.id);
    }
  }
  Json rows = Json::array();
  if (!a.as_json) {
    std::printf(
        "Per depth map, on the demo scene: wall time (median [min max] of %d runs after one to "
        "warm "
        "up, transfers\nincluded) and device time in ms; patch samples at full windows.\n"
        "device     preset    size    r       wall                              device  samples/px "
        "Msamples/s  MiB\n",
        a.runs);
  }
  for (const int size : a.sizes) {
    const ws::RenderedPair pair = ws::render_demo(size);
    for (const std::string& preset : a.presets) {
      for (const int radius : a.window_radii) {
        for (const std::string& name : a.devices) {
          ws::Options options = ws::Options::preset_named(preset);
          std::tie(options.min_distance, options.max_distance) = ws::demo_distance_range();
          options.window_radius = radius;
          ws::Device device = ws::Device::open(name);
          rows.push_back(measure(device, pair, options, a.runs));
          if (!a.as_json) print_row(rows.back());
        }
      }
    }
  }
  if (a.as_json) std::cout << rows.dump(2) << "\n";
  if (!a.output.empty()) ws::write_text(a.output, rows.dump(2) + "\n");
}

}  // namespace

void add_benchmark_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("benchmark", "Time presets on devices, side by side in one run");
  auto a = std::make_shared<BenchmarkArguments>();
  command->add_option("--devices", a->devices, "Devices, all usable ones by default")
      ->delimiter(',');
  command->add_option("--presets", a->presets, "Presets")
      ->delimiter(',')
      ->check(CLI::IsMember(ws::Options::preset_names()))
      ->capture_default_str();
  command->add_option("--sizes", a->sizes, "Sides of the square images, pixels")
      ->delimiter(',')
      ->check(CLI::Range(64, 4096))
      ->capture_default_str();
  command->add_option("--window-radii", a->window_radii, "Patches of (2 r + 1)^2 pixels")
      ->delimiter(',')
      ->check(CLI::Range(1, 15))
      ->capture_default_str();
  command->add_option("--runs", a->runs, "Timed runs of each")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command->add_option("-o,--output", a->output, "JSON file to write");
  command->add_flag("--json", a->as_json, "Print JSON");
  command->callback([a] { run_benchmark(*a); });
}
