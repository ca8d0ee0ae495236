// SPDX-License-Identifier: MIT
#pragma once

#include <span>
#include <string>
#include <vector>

#include "cuda/cuda_target.h"
#include "cuda/device_image.h"
#include "cuda/handle.h"
#include "cuda/kernels.h"
#include "matching/backend.h"
#include "schedule/bands.h"

namespace widestereo {

/// Device memory and kernels for matches of fixed sizes. Not thread-safe. Work goes to a stream of
/// its own, except for enqueue().
class CudaBackend final : public Backend {
 public:
  /// Throws Error naming the device and what it lacks.
  CudaBackend(CudaTarget target, const std::vector<cv::Size>& sizes,
              const KernelConstants& constants);
  ~CudaBackend() override;

  void set_rays(int view, const cv::Mat& rays) override;
  void set_intensity(int view, const cv::Mat& intensity) override;
  /// Without a progress function the schedule is launched as one graph, which is kept for further
  /// runs of the same schedule; with one, kernel by kernel. Neither waits between kernels. Kernels
  /// of different views overlap in graphs unless each is timed.
  void run(const Schedule& schedule, const Matcher::Progress& progress) override;
  cv::Mat hypotheses(int view) override;
  void set_hypotheses(int view, const cv::Mat& hypotheses) override;
  cv::Mat checks(int view) override;
  std::vector<KernelTime> times() const override { return times_.list(); }
  void time_kernels(bool each) override;
  double device_milliseconds() const override { return milliseconds_; }
  std::size_t device_bytes() const override;

  /// Makes a schedule ready for enqueue(), with parameters of its own; waits. Returns its number.
  std::size_t prepare(const Schedule& schedule);
  /// Whether the stream captures; throws Error where it must not be used, as the default stream
  /// while another one captures: work enqueued there would end that capture.
  bool captures(cudaStream_t stream) const;
  /// Enqueues a prepared schedule; waits for nothing and allocates no device memory. Where the
  /// stream captures, as captures() says, the kernels become nodes of what it captures.
  void enqueue(std::size_t prepared, cudaStream_t stream, bool captured);
  /// Its parameters in device memory, for kernels that change them on the same stream.
  kernel::MatchParameters* parameters(std::size_t prepared) const;
  /// Device memory of a view, for kernels that fill and read the maps on the same stream.
  const kernel::cuda::ViewMemory& memory(int view) const { return context_.views[view]; }
  cv::Size size(int view) const { return sizes_.at(static_cast<std::size_t>(view)); }
  const CudaTarget& target() const { return target_; }

 private:
  struct ViewMaps {
    DeviceArray<float4> rays, hypotheses, checks, priors;
    DeviceImage intensities, texels;
    CudaTexture texture;  // of the texels; destroyed before them
  };
  /// Consecutive launches of a kernel; the i-th of a run lies between events_ i and i + 1.
  struct Stretch {
    Kernel kernel = Kernel::initialise;
    int dispatches = 0;
    long long samples = 0;
  };
  struct Launch {
    const void* kernel;
    dim3 blocks;
    kernel::cuda::Context context;  // its argument
  };
  /// A schedule's launches as one graph, which read parameters that may change.
  struct Prepared {
    Schedule schedule;
    DeviceArray<kernel::MatchParameters> parameters;
    CudaGraphExec graph;
    std::vector<Stretch> stretches;  // of the graph
    bool each_is_timed = false;      // kernels then follow each other
  };

  CurrentDevice make_current() const { return CurrentDevice(target_.ordinal, target_.name); }
  void check(cudaError_t result, const char* action) const;
  void make_maps();
  DeviceArray<kernel::MatchParameters> make_parameters() const;
  void release();
  /// `stride`: pixels of the memory from row to row.
  void upload(void* memory, int stride, int view, const cv::Mat& map, int type);
  cv::Mat download(const void* memory, int view);
  void set_parameters(Prepared& prepared, const Schedule& schedule);
  std::vector<Band> bands_of(const Schedule& schedule) const;
  void load_kernels(const Schedule& schedule, std::size_t events);
  /// Calls `on_band` for each band, and `on_event` with the number of each stretch before it and
  /// once more after the last. `each_band` is a stretch, or all of a kernel that follow each other.
  template <class OnBand, class OnEvent>
  std::vector<Stretch> in_stretches(std::span<const Band> bands, bool each_band,
                                    const OnBand& on_band, const OnEvent& on_event) const;
  Launch launch_of(const Prepared& prepared, const Band& band) const;
  /// The same for one view of the dispatch.
  Launch launch_of_view(const Prepared& prepared, const Band& band, int view) const;
  void launch(const Prepared& prepared, const Band& band, cudaStream_t stream) const;
  /// Events that a graph records: none, around all kernels, or between them as well.
  enum class Timing { none, of_all, of_each };
  void make_graph(Prepared& prepared, Timing timing);
  /// Waits for a run and notes its times.
  void collect(std::span<const Stretch> stretches, const Schedule& schedule,
               const Matcher::Progress& progress, bool each_is_timed);

  CudaTarget target_;
  std::vector<cv::Size> sizes_;
  KernelConstants constants_;
  CudaStream stream_;
  std::vector<ViewMaps> maps_;
  DeviceArray<unsigned> transfer_nearest_;
  DeviceArray<unsigned> transfer_winner_;
  kernel::cuda::Context context_{};  // all but what differs by launch: pass and parameters
  std::vector<CudaEvent> events_;
  TransferMemory staging_;  // of one map
  Prepared of_run_;         // the last schedule of run()
  std::vector<Prepared> prepared_;
  bool time_each_ = true;
  KernelTimes times_;
  double milliseconds_ = 0;  // of the last run
};

}  // namespace widestereo
