// SPDX-License-Identifier: MIT
#include "cpu/cpu_device.h"

#include <array>
#include <chrono>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "cpu/kernels.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

using kernel::ivec2;
using kernel::cpu::Context;
using PixelFunction = void (*)(const Context&, ivec2);

/// Entry points by Kernel.
constexpr std::array<PixelFunction, kernel_count> pixel_functions = {
#define KERNEL(name, view) kernel::cpu::name##_pixel,
#include "kernel_list.h"
    kernel::cpu::iterate_pixel};  // iterate_raster differs only in the order of pixels

class CpuBackend final : public Backend {
 public:
  CpuBackend(const std::vector<cv::Size>& sizes, const KernelConstants& constants)
      : constants_(constants), views_(sizes.size()) {
    cv::Size largest;
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      views_[i].set_size(sizes[i], constants);
      bytes_ += static_cast<std::size_t>(sizes[i].area()) * 4 * sizeof(cv::Vec4f) +
                (views_[i].intensities.total() + views_[i].texels.total()) * sizeof(float);
      largest = {std::max(largest.width, sizes[i].width),
                 std::max(largest.height, sizes[i].height)};
    }
    transfer_nearest_.create(largest);
    transfer_winner_.create(largest);
    bytes_ += static_cast<std::size_t>(largest.area()) * 2 * sizeof(int);
  }

  void set_rays(int view, const cv::Mat& rays) override { rays.copyTo(views_[view].rays); }
  void set_intensity(int view, const cv::Mat& intensity) override {
    intensity.copyTo(views_[view].image());
  }
  cv::Mat hypotheses(int view) override { return views_[view].hypotheses; }
  void set_hypotheses(int view, const cv::Mat& hypotheses) override {
    hypotheses.copyTo(views_[view].hypotheses);
  }
  cv::Mat checks(int view) override { return views_[view].checks; }
  std::vector<KernelTime> times() const override { return times_.list(); }
  std::size_t device_bytes() const override { return bytes_; }

  void run(const Schedule& schedule, const Matcher::Progress& progress) override {
    require_constants(schedule, constants_);
    times_.clear();
    ScheduleProgress done(schedule, progress);
    for (const Dispatch& dispatch : schedule.dispatches) {
      const auto start = std::chrono::steady_clock::now();
      launch(schedule, dispatch);
      const std::chrono::duration<double, std::milli> time =
          std::chrono::steady_clock::now() - start;
      times_.add(dispatch.kernel, 1, time.count());
      done.advance(dispatch.samples);
    }
  }

 private:
  void launch(const Schedule& schedule, const Dispatch& dispatch) {
    for (int view = 0; view < dispatch.views; ++view) launch(schedule, dispatch, view);
  }

  /// `view`: counted from the launch's first one.
  void launch(const Schedule& schedule, const Dispatch& dispatch, int view) {
    const Context context{
        schedule.parameters, dispatch.pass, schedule.constants, views_.data(), transfer_nearest_,
        transfer_winner_,    view};
    const PixelFunction function = pixel_functions[static_cast<std::size_t>(dispatch.kernel)];
    const cv::Size size = views_[static_cast<std::size_t>(dispatch.over + view)].rays.size();
    if (dispatch.kernel == Kernel::iterate_raster) {
      launch_in_order(context, size, function);
      return;
    }
    const int colour = dispatch.pass.colour;
    const int step = colour < 0 ? 1 : 2;
    cv::parallel_for_(cv::Range(0, size.height), [&](const cv::Range& rows) {
      for (int y = rows.start; y < rows.end; ++y) {
        const int first = colour < 0 ? 0 : (y + colour) % 2;
        for (int x = first; x < size.width; x += step) {
          function(context, ivec2(x, y));
        }
      }
    });
  }

  /// Forwards when propagating from left and above, backwards when from right and below.
  static void launch_in_order(const Context& context, cv::Size size, PixelFunction function) {
    const int pixels = size.area();
    const bool forwards = (context.pass.neighbours & NEIGHBOUR_LEFT) != 0;
    for (int i = 0; i < pixels; ++i) {
      const int index = forwards ? i : pixels - 1 - i;
      function(context, ivec2(index % size.width, index / size.width));
    }
  }

  KernelConstants constants_;
  std::vector<kernel::cpu::ViewMemory> views_;
  cv::Mat_<int> transfer_nearest_;
  cv::Mat_<int> transfer_winner_;
  KernelTimes times_;
  std::size_t bytes_ = 0;
};

class CpuDevice final : public Device::Implementation {
 public:
  CpuDevice() { info = cpu_device_info(); }
  std::unique_ptr<Backend> make_backend(const std::vector<cv::Size>& sizes,
                                        const KernelConstants& constants) override {
    try {
      return std::make_unique<CpuBackend>(sizes, constants);
    } catch (const std::exception&) {  // std::bad_alloc or cv::Exception
      throw Error("Not enough memory for the maps of these image sizes; use smaller images.");
    }
  }
};

}  // namespace

DeviceInfo cpu_device_info() {
  DeviceInfo info;
  info.kind = DeviceKind::cpu;
  info.id = "cpu";
  info.name = "CPU reference";
  info.type = "cpu";
  info.driver = std::to_string(cv::getNumThreads()) + " threads";
  return info;
}

std::unique_ptr<Device::Implementation> open_cpu_device() { return std::make_unique<CpuDevice>(); }

}  // namespace widestereo
