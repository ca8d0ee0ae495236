// SPDX-License-Identifier: MIT
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "benchmark_measurement.h"
#include "benchmark_plot.h"
#include "commands.h"
#include "match_settings.h"
#include "matching_run.h"
#include "option_checks.h"
#include "result_folders.h"
#include "roofline.h"
#include "say.h"
#include "schedule/option_names.h"
#include "text/formatted.h"
#include "text/json_text.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/matcher.h"
#include "widestereo/synthesis.h"

namespace ws = widestereo;
using Json = nlohmann::ordered_json;

namespace {

struct BenchmarkArguments {
  std::vector<std::string> devices;
  std::vector<std::string> presets = {"fast", "quality"};
  std::vector<std::string> starts = {"cold"};
  std::vector<int> sizes = {256};
  std::vector<int> window_radii;
  std::optional<ws::PatchWarp> warp;
  std::optional<ws::Filter> filter;
  int runs = 3;
  ws::DevicePeaks peaks;
  std::string output;
  std::string plot;
  bool as_json = false;
};

void print_header(int runs) {
  std::printf(
      "Per depth map, on the demo scene: wall time (median [min max] of %d runs after one to warm "
      "up, transfers\n"
      "included) and device time in ms (kernels one by one below it, as shares of their sum; GPUs "
      "need not finish\n"
      "each before the next otherwise); work counted at full windows: samples of patches a pixel, "
      "million samples,\n"
      "10^9 FP32 operations of patches and regressions, 10^9 source texels and 10^9 bytes of\n"
      "maps a second of device time.\n"
      "roofline: the time that each kernel's operations, texels or bytes take at the device's "
      "peak, whichever is\n"
      "longest, summed: its share of the device time, and which it mostly is; - where no peak is "
      "known\n"
      "(CUDA devices state them; --peak-gflops, --peak-gtexels and --peak-gbps give others).\n"
      "device     preset   start  size    r       wall                              device  "
      "samples/px "
      "Msamples/s  Gflop/s  Gtexel/s   GB/s  roofline              MiB\n",
      runs);
}

void print_row(const Measurement& m) {
  const ws::KernelWork work = sum_of(m.kernels);
  const Roofline least = roofline(m.kernels, m.device.peaks);
  const auto share = least.share_of(m.on_device);
  const std::string of_roofline =
      share ? ws::formatted("%.1f %% of %s", 100 * *share, least.bound.c_str()) : "-";
  std::printf(
      "%-10s %-8s %-5s %5d %4d  %9.1f [%9.1f %9.1f]  %9.1f  %8.0f  %8.1f  %8.1f  %8.2f %6.1f  "
      "%-18s "
      "%6.1f\n",
      m.device.id.c_str(), m.preset.c_str(), m.start(), m.size, m.window_radius, m.wall, m.wall_min,
      m.wall_max, m.on_device, work.samples / m.pixels(), m.per_second(1e-6 * work.samples),
      m.per_second(1e-9 * work.operations), m.per_second(1e-9 * work.texels),
      m.per_second(1e-9 * work.bytes), of_roofline.c_str(),
      static_cast<double>(m.device_bytes) / (1 << 20));
  std::string shares;
  double one_by_one = 0;
  for (const ws::KernelTime& kernel : m.kernels) one_by_one += kernel.milliseconds;
  for (const ws::KernelTime& kernel : m.kernels) {
    shares += ws::formatted(" %s %.0f %%", kernel.kernel.c_str(),
                            one_by_one > 0 ? 100 * kernel.milliseconds / one_by_one : 0);
  }
  std::printf("           %s\n", shares.c_str());
  std::fflush(stdout);
}

PlotBar bar_of(const Measurement& m) {
  return {m.device.id + "  " + m.preset + (m.warm ? "  warm  " : "  ") + std::to_string(m.size) +
              " x " + std::to_string(m.size),
          m.wall,
          m.wall_min,
          m.wall_max,
          m.on_device,
          roofline(m.kernels, m.device.peaks)};
}

/// Given peaks are one device's.
void require_one_device(const BenchmarkArguments& a) {
  const ws::DevicePeaks& given = a.peaks;
  if (given.gflops <= 0 && given.gtexels <= 0 && given.gbps <= 0) return;
  if (a.devices.size() == 1) return;
  throw ws::Error("Peaks are those of one device; name it with --devices.");
}

void replace(ws::DevicePeaks& peaks, const ws::DevicePeaks& given) {
  if (given.gflops > 0) peaks.gflops = given.gflops;
  if (given.gtexels > 0) peaks.gtexels = given.gtexels;
  if (given.gbps > 0) peaks.gbps = given.gbps;
}

/// Those that were named, or all usable ones but, which it says, what does not open. What cannot be
/// measured is refused before others take their time.
std::vector<std::string> devices_to_measure(const BenchmarkArguments& a) {
  std::vector<std::string> names = a.devices;
  if (names.empty()) {
    for (const ws::DeviceInfo& device : ws::Device::list()) {
      if (device.unusable.empty()) names.push_back(device.id);
    }
  }
  std::erase_if(names, [&a](const std::string& name) {
    std::optional<ws::Device> device;
    try {
      device = ws::Device::open(name);
    } catch (const ws::Error& error) {
      if (!a.devices.empty()) throw;
      say(name + " is left out: " + error.what());
      return true;
    }
    if (a.filter == ws::Filter::device) require_device_filter(device->info());
    return false;
  });
  return names;
}

void run_benchmark(BenchmarkArguments a) {
  require_one_device(a);
  if (!a.output.empty() && !a.plot.empty() && absolute_path(a.output) == absolute_path(a.plot)) {
    throw ws::Error("--output and --plot both name " + a.output + "; give each a file of its own.");
  }
  for (const std::string& file : {a.output, a.plot}) {
    if (!file.empty()) ws::require_writable(file);
  }
  a.devices = devices_to_measure(a);
  Json rows = Json::array();
  std::vector<PlotBar> bars;
  if (!a.as_json) print_header(a.runs);
  for (const int size : a.sizes) {
    const ws::RenderedPair pair = ws::render_demo(size);
    for (const std::string& preset : a.presets) {
      ws::Options options = ws::Options::preset_named(preset);
      std::tie(options.min_distance, options.max_distance) = ws::demo_distance_range();
      options.warp = a.warp.value_or(options.warp);
      options.filter = a.filter.value_or(options.filter);
      const std::vector<int> own = {options.window_radius};
      for (const int radius : a.window_radii.empty() ? own : a.window_radii) {
        options.window_radius = radius;
        for (const std::string& name : a.devices) {
          ws::Device device = ws::Device::open(name);
          for (const std::string& start : a.starts) {
            Measurement measured = measure(device, pair, options, start == "warm", a.runs);
            replace(measured.device.peaks, a.peaks);
            if (!a.as_json) print_row(measured);
            rows.push_back(json_of(measured));
            bars.push_back(bar_of(measured));
          }
        }
      }
    }
  }
  if (a.as_json) std::cout << ws::to_text(rows) << "\n";
  if (!a.output.empty()) ws::write_text(a.output, ws::to_text(rows) + "\n");
  if (!a.plot.empty()) ws::write_text(a.plot, benchmark_plot(bars));
}

}  // namespace

void add_benchmark_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("benchmark", "Time presets on devices, side by side in one run");
  auto a = std::make_shared<BenchmarkArguments>();
  command
      ->add_option("--devices", a->devices,
                   "Devices (several by comma), all usable ones by default")
      ->delimiter(',');
  command->add_option("--presets", a->presets, "Presets (several by comma)")
      ->delimiter(',')
      ->check(CLI::IsMember(ws::Options::preset_names()))
      ->capture_default_str();
  command
      ->add_option(
          "--starts", a->starts,
          "Frames by themselves (cold), or from the planes of the frame before, as `sequence` "
          "matches them, of a rig that rests (warm; both: cold,warm)")
      ->delimiter(',')
      ->check(CLI::IsMember({"cold", "warm"}))
      ->capture_default_str();
  command->add_option("--sizes", a->sizes, "Sides of the square images, pixels (several by comma)")
      ->delimiter(',')
      ->check(CLI::Range(ws::least_demo_size, ws::largest_demo_size))
      ->capture_default_str();
  command
      ->add_option("--window-radii", a->window_radii,
                   "Patches of (2 r + 1)^2 pixels (several by comma), the presets' own by default")
      ->delimiter(',')
      ->check(CLI::Range(1, ws::Options::largest_window_radius));
  command->add_option("--warp", a->warp, "Instead of the presets' own")
      ->transform(name_among(ws::warp_names))
      ->type_name("TEXT");
  command->add_option("--filter", a->filter, "Instead of the presets' own")
      ->transform(name_among(ws::filter_names))
      ->type_name("TEXT");
  command->add_option("--runs", a->runs, "Timed runs of each")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  command
      ->add_option("--peak-gflops", a->peaks.gflops,
                   "The device's peak, 10^9 FP32 operations a second, a multiply-add being two")
      ->check(positive_number());
  command
      ->add_option("--peak-gtexels", a->peaks.gtexels,
                   "The device's peak, 10^9 texels of four bytes a second")
      ->check(positive_number());
  command
      ->add_option("--peak-gbps", a->peaks.gbps,
                   "The device's peak, 10^9 bytes a second to and from its memory")
      ->check(positive_number());
  command->add_option("-o,--output", a->output, "JSON file to write");
  command->add_option("--plot", a->plot, "Picture to write, .svg")
      ->check([](const std::string& name) -> std::string {
        return name.ends_with(".svg") ? "" : "the picture is SVG; give a name that ends in .svg";
      });
  command->add_flag("--json", a->as_json, "Print JSON");
  command->callback([a] { run_benchmark(*a); });
}
