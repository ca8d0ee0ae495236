// SPDX-License-Identifier: MIT
#include "cuda/cuda_backend.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "cuda/launch.h"
#include "schedule/work.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr dim3 threads_of_block(kernel::cuda::block_width, kernel::cuda::block_height);

/// Parameters may differ: launches read them from device memory.
bool same_launches(const Schedule& a, const Schedule& b) {
  return a.constants == b.constants &&
         std::equal(a.dispatches.begin(), a.dispatches.end(), b.dispatches.begin(),
                    b.dispatches.end(), [](const Dispatch& x, const Dispatch& y) {
                      return x.kernel == y.kernel && x.views == y.views && x.width == y.width &&
                             x.height == y.height &&
                             std::memcmp(&x.pass, &y.pass, sizeof x.pass) == 0;
                    });
}

/// A graph of launches. Those of one view follow each other; what is of all views follows, and
/// comes before, everything. It is built rather than captured: a wait for the device, in whichever
/// thread, ends a capture.
class LaunchGraph {
 public:
  explicit LaunchGraph(int views) : last_(static_cast<std::size_t>(views)) {}

  cudaError_t create() {
    cudaGraph_t graph = nullptr;
    const cudaError_t result = cudaGraphCreate(&graph, 0);
    graph_.reset(graph);
    return result;
  }
  cudaError_t add(const cudaKernelNodeParams& launch) {
    const std::vector<cudaGraphNode_t> before = last_of_all();
    cudaGraphNode_t node = nullptr;
    const cudaError_t result =
        cudaGraphAddKernelNode(&node, graph_.get(), before.data(), before.size(), &launch);
    std::fill(last_.begin(), last_.end(), node);
    return result;
  }
  cudaError_t add(const cudaKernelNodeParams& launch, int view) {
    cudaGraphNode_t& last = last_.at(static_cast<std::size_t>(view));
    const cudaGraphNode_t before = last;
    return cudaGraphAddKernelNode(&last, graph_.get(), &before, before != nullptr ? 1 : 0, &launch);
  }
  cudaError_t add(cudaEvent_t event) {
    const std::vector<cudaGraphNode_t> before = last_of_all();
    cudaGraphNode_t node = nullptr;
    const cudaError_t result =
        cudaGraphAddEventRecordNode(&node, graph_.get(), before.data(), before.size(), event);
    std::fill(last_.begin(), last_.end(), node);
    return result;
  }
  cudaGraph_t get() const { return graph_.get(); }

 private:
  std::vector<cudaGraphNode_t> last_of_all() const {
    std::vector<cudaGraphNode_t> nodes;
    for (const cudaGraphNode_t node : last_) {
      const bool known = std::find(nodes.begin(), nodes.end(), node) != nodes.end();
      if (node != nullptr && !known) nodes.push_back(node);
    }
    return nodes;
  }

  CudaGraph graph_;
  std::vector<cudaGraphNode_t> last_;  // of each view
};

}  // namespace

CudaBackend::CudaBackend(CudaTarget target, const std::vector<cv::Size>& sizes,
                         const KernelConstants& constants)
    : target_(std::move(target)), sizes_(sizes), constants_(constants) {
  if (sizes.size() > MAX_VIEWS) {
    throw Error("A match has " + std::to_string(sizes.size()) + " views; at most " +
                std::to_string(MAX_VIEWS) + " are possible.");
  }
  const CurrentDevice current = make_current();
  try {
    cudaStream_t stream = nullptr;
    check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "make a stream");
    stream_.reset(stream);
    make_maps();
    check(cudaStreamSynchronize(stream), "clear the maps");
  } catch (...) {
    release();  // while the device is current
    throw;
  }
  context_.camera_model = constants.camera_model;
  context_.window_radius = constants.window_radius;
  context_.warp = constants.warp;
  context_.pattern = constants.pattern;
  context_.weighted = constants.weighted;
  context_.filter = constants.filter;
  context_.texels_per_pixel = constants.texels_per_pixel;
  context_.source_count = constants.source_count;
}

CudaBackend::~CudaBackend() {
  try {
    const CurrentDevice current = make_current();
    cudaStreamSynchronize(stream_.get());
    release();
  } catch (const Error&) {  // the device is lost and its memory with it
  }
}

void CudaBackend::release() {
  prepared_.clear();
  of_run_ = {};
  events_.clear();
  maps_.clear();
  transfer_nearest_ = {};
  transfer_winner_ = {};
  staging_ = {};
  stream_.reset();
}

void CudaBackend::check(cudaError_t result, const char* action) const {
  widestereo::check(result, target_.name, action);
}

void CudaBackend::make_maps() {
  for (const cv::Size& size : sizes_) {
    const std::size_t pixels = area(size);
    const std::string& name = target_.name;
    const cudaStream_t stream = stream_.get();
    ViewMaps& maps = maps_.emplace_back();
    // Read so far before the first and after the last row.
    maps.rays = DeviceArray<float4>(pixels + 2 * APRON, stream, name, "the viewing rays");
    maps.intensities = DeviceImage(with_apron(size), APRON, sizeof(float), stream, name);
    maps.texels = DeviceImage(size_of_texels(size, constants_), constants_.texels_per_pixel * APRON,
                              bytes_of_texel(constants_), stream, name);
    maps.texture = maps.texels.make_texture(name);
    maps.hypotheses = DeviceArray<float4>(pixels, stream, name, "the planes");
    maps.checks = DeviceArray<float4>(pixels, stream, name, "the consistency maps");
    maps.priors = DeviceArray<float4>(pixels, stream, name, "the planes' priors");
    context_.views[maps_.size() - 1] = {
        maps.rays.get() + APRON,   static_cast<float*>(maps.intensities.get()),
        maps.texels.get(),         maps.texture.get(),
        maps.hypotheses.get(),     maps.checks.get(),
        maps.priors.get(),         size.width,
        maps.intensities.stride(), maps.texels.stride()};
  }
  const std::size_t largest = largest_area(sizes_);
  transfer_nearest_ =
      DeviceArray<unsigned>(largest, stream_.get(), target_.name, "a transfer buffer");
  transfer_winner_ =
      DeviceArray<unsigned>(largest, stream_.get(), target_.name, "a transfer buffer");
  of_run_.parameters = make_parameters();
  context_.transfer_nearest = transfer_nearest_.get();
  context_.transfer_winner = transfer_winner_.get();
}

std::size_t CudaBackend::device_bytes() const {
  std::size_t bytes =
      transfer_nearest_.bytes() + transfer_winner_.bytes() + of_run_.parameters.bytes();
  for (const Prepared& prepared : prepared_) bytes += prepared.parameters.bytes();
  for (const ViewMaps& maps : maps_) {
    bytes += maps.rays.bytes() + maps.intensities.bytes() + maps.texels.bytes() +
             maps.hypotheses.bytes() + maps.checks.bytes() + maps.priors.bytes();
  }
  return bytes;
}

void CudaBackend::upload(void* memory, int stride, int view, const cv::Mat& map, int type) {
  require_map(map, view, size(view), type);
  const CurrentDevice current = make_current();
  const std::size_t pitch = static_cast<std::size_t>(stride) * map.elemSize();
  const std::size_t row = static_cast<std::size_t>(map.cols) * map.elemSize();
  check(
      cudaMemcpy2DAsync(memory, pitch, map.data, map.step[0], row,
                        static_cast<std::size_t>(map.rows), cudaMemcpyHostToDevice, stream_.get()),
      "receive a map");
  check(cudaStreamSynchronize(stream_.get()), "receive a map");
}

cv::Mat CudaBackend::download(const void* memory, int view) {
  const CurrentDevice current = make_current();
  // Applications that have their maps on the device have no use for it.
  if (staging_.get() == nullptr) {
    staging_ = TransferMemory(largest_area(sizes_) * sizeof(cv::Vec4f), target_.name);
  }
  const cv::Mat map(size(view), CV_32FC4, staging_.get());
  check(cudaMemcpyAsync(map.data, memory, map.total() * map.elemSize(), cudaMemcpyDeviceToHost,
                        stream_.get()),
        "send a map");
  check(cudaStreamSynchronize(stream_.get()), "send a map");
  return map;
}

void CudaBackend::set_rays(int view, const cv::Mat& rays) {
  upload(maps_.at(static_cast<std::size_t>(view)).rays.get() + APRON, size(view).width, view, rays,
         CV_32FC4);
}
void CudaBackend::set_intensity(int view, const cv::Mat& intensity) {
  const DeviceImage& image = maps_.at(static_cast<std::size_t>(view)).intensities;
  upload(image.get(), image.stride(), view, intensity, CV_32FC1);
}
void CudaBackend::set_hypotheses(int view, const cv::Mat& hypotheses) {
  upload(maps_.at(static_cast<std::size_t>(view)).hypotheses.get(), size(view).width, view,
         hypotheses, CV_32FC4);
}
cv::Mat CudaBackend::hypotheses(int view) {
  return download(maps_.at(static_cast<std::size_t>(view)).hypotheses.get(), view);
}
cv::Mat CudaBackend::checks(int view) {
  return download(maps_.at(static_cast<std::size_t>(view)).checks.get(), view);
}

void CudaBackend::set_parameters(Prepared& prepared, const Schedule& schedule) {
  require_constants(schedule, constants_);
  check(cudaMemcpyAsync(prepared.parameters.get(), &schedule.parameters, sizeof schedule.parameters,
                        cudaMemcpyHostToDevice, stream_.get()),
        "receive the parameters");
}

DeviceArray<kernel::MatchParameters> CudaBackend::make_parameters() const {
  return {1, stream_.get(), target_.name, "the parameters"};
}

CudaBackend::Launch CudaBackend::launch_of(const Prepared& prepared, const Band& band) const {
  const Dispatch& dispatch = *band.dispatch;
  Launch launch{kernel_function(dispatch.kernel, constants_), {}, context_};
  launch.context.parameters = prepared.parameters.get();
  launch.context.pass = dispatch.pass;
  launch.context.pass.first_row = band.first_row;
  launch.context.pass.last_row = band.last_row;
  const LaunchGrid grid =
      launch_grid(dispatch.width, band.last_row - band.first_row, dispatch.pass.colour);
  launch.blocks = dim3(grid.columns, grid.rows, static_cast<unsigned>(dispatch.views));
  return launch;
}

CudaBackend::Launch CudaBackend::launch_of_view(const Prepared& prepared, const Band& band,
                                                int view) const {
  Launch launch = launch_of(prepared, band);
  launch.context.pass.reference += view;
  launch.context.pass.other += view;
  launch.blocks.z = 1;
  return launch;
}

void CudaBackend::launch(const Prepared& prepared, const Band& band, cudaStream_t stream) const {
  Launch launch = launch_of(prepared, band);
  std::array<void*, 1> arguments = {&launch.context};
  check(
      cudaLaunchKernel(launch.kernel, launch.blocks, threads_of_block, arguments.data(), 0, stream),
      (std::string("launch the kernel ") + to_string(band.dispatch->kernel)).c_str());
}

std::vector<Band> CudaBackend::bands_of(const Schedule& schedule) const {
  return split_into_bands(schedule, target_.max_samples > 0
                                        ? target_.max_samples
                                        : std::numeric_limits<long long>::max());
}

template <class OnBand, class OnEvent>
std::vector<CudaBackend::Stretch> CudaBackend::in_stretches(std::span<const Band> bands,
                                                            bool each_band, const OnBand& on_band,
                                                            const OnEvent& on_event) const {
  std::vector<Stretch> stretches;
  for (const Band& band : bands) {
    const Kernel kernel = band.dispatch->kernel;
    if (stretches.empty() || stretches.back().kernel != kernel || each_band) {
      on_event(stretches.size());
      stretches.push_back({kernel, 0, 0});
    }
    if (band.first_row == 0) ++stretches.back().dispatches;
    stretches.back().samples += band.samples;
    on_band(band);
  }
  on_event(stretches.size());
  return stretches;
}

void CudaBackend::load_kernels(const Schedule& schedule, std::size_t events) {
  for (const Dispatch& dispatch : schedule.dispatches) {
    cudaFuncAttributes attributes{};
    check(cudaFuncGetAttributes(&attributes, kernel_function(dispatch.kernel, schedule.constants)),
          "load its kernels");
  }
  while (events_.size() < events) {
    cudaEvent_t event = nullptr;
    check(cudaEventCreate(&event), "make an event");
    events_.emplace_back(event);
  }
}

void CudaBackend::make_graph(Prepared& prepared, Timing timing) {
  prepared.graph.reset();
  const std::vector<Band> bands = bands_of(prepared.schedule);
  const int views = prepared.schedule.constants.source_count + 1;
  prepared.each_is_timed = timing == Timing::of_each;
  const std::size_t events = timing == Timing::none     ? 0
                             : timing == Timing::of_all ? 2
                                                        : bands.size() + 1;
  load_kernels(prepared.schedule, events);
  LaunchGraph graph(views);
  check(graph.create(), "begin a graph");
  const auto node_of = [](Launch& launch, std::array<void*, 1>& arguments) {
    arguments = {&launch.context};
    cudaKernelNodeParams node{};
    node.func = const_cast<void*>(launch.kernel);
    node.gridDim = launch.blocks;
    node.blockDim = threads_of_block;
    node.kernelParams = arguments.data();
    return node;
  };
  std::array<void*, 1> arguments{};
  const auto add_kernel = [&](const Band& band) {
    // What one view leaves idle at the end of its launch, another one's next can use.
    if (!prepared.each_is_timed && views_are_independent(prepared.schedule, *band.dispatch)) {
      for (int view = 0; view < views; ++view) {
        Launch launch = launch_of_view(prepared, band, view);
        check(graph.add(node_of(launch, arguments), view), "add a kernel to a graph");
      }
      return;
    }
    Launch launch = launch_of(prepared, band);
    check(graph.add(node_of(launch, arguments)), "add a kernel to a graph");
  };
  const auto add_event = [&](std::size_t i) {
    check(graph.add(events_.at(i).get()), "add an event to a graph");
  };
  if (timing == Timing::of_all) add_event(0);
  prepared.stretches = in_stretches(bands, false, add_kernel, [&](std::size_t i) {
    if (prepared.each_is_timed) add_event(i);
  });
  if (timing == Timing::of_all) add_event(1);
  cudaGraphExec_t exec = nullptr;
  check(cudaGraphInstantiateWithFlags(&exec, graph.get(), 0), "make a graph");
  prepared.graph.reset(exec);
}

void CudaBackend::time_kernels(bool each) { time_each_ = each; }

void CudaBackend::run(const Schedule& schedule, const Matcher::Progress& progress) {
  const CurrentDevice current = make_current();
  times_.clear();
  milliseconds_ = 0;
  set_parameters(of_run_, schedule);
  if (progress) {
    const std::vector<Band> bands = bands_of(schedule);
    load_kernels(schedule, bands.size() + 1);
    const auto launch_band = [&](const Band& band) { launch(of_run_, band, stream_.get()); };
    const auto record = [&](std::size_t i) {
      check(cudaEventRecord(events_.at(i).get(), stream_.get()), "record an event");
    };
    collect(in_stretches(bands, true, launch_band, record), schedule, progress, true);
  } else {
    if (of_run_.graph == nullptr || of_run_.each_is_timed != time_each_ ||
        !same_launches(of_run_.schedule, schedule)) {
      of_run_.graph.reset();
      of_run_.schedule = schedule;
      make_graph(of_run_, time_each_ ? Timing::of_each : Timing::of_all);
    }
    check(cudaGraphLaunch(of_run_.graph.get(), stream_.get()), "launch a match");
    collect(of_run_.stretches, schedule, progress, time_each_);
  }
}

void CudaBackend::collect(std::span<const Stretch> stretches, const Schedule& schedule,
                          const Matcher::Progress& progress, bool each_is_timed) {
  ScheduleProgress done(schedule, progress);
  if (!progress) check(cudaStreamSynchronize(stream_.get()), "match");
  const auto milliseconds_of = [this](std::size_t i) {
    check(cudaEventSynchronize(events_[i + 1].get()), "match");
    float milliseconds = 0;
    check(cudaEventElapsedTime(&milliseconds, events_[i].get(), events_[i + 1].get()),
          "read the time");
    milliseconds_ += static_cast<double>(milliseconds);
    return static_cast<double>(milliseconds);
  };
  if (!each_is_timed) milliseconds_of(0);
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const Stretch& stretch = stretches[i];
    times_.add(stretch.kernel, stretch.dispatches, each_is_timed ? milliseconds_of(i) : 0);
    done.advance(stretch.samples);
  }
}

std::size_t CudaBackend::prepare(const Schedule& schedule) {
  const CurrentDevice current = make_current();
  Prepared prepared;
  prepared.schedule = schedule;
  prepared.parameters = make_parameters();
  set_parameters(prepared, schedule);
  make_graph(prepared, Timing::none);
  // Or the first launch would, and might allocate for it.
  check(cudaGraphUpload(prepared.graph.get(), stream_.get()), "prepare a match");
  check(cudaStreamSynchronize(stream_.get()), "prepare a match");
  prepared_.push_back(std::move(prepared));
  return prepared_.size() - 1;
}

bool CudaBackend::captures(cudaStream_t stream) const {
  cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;
  check(cudaStreamIsCapturing(stream, &status), "use the stream");
  return status != cudaStreamCaptureStatusNone;
}

void CudaBackend::enqueue(std::size_t prepared, cudaStream_t stream, bool captured) {
  const CurrentDevice current = make_current();
  const Prepared& match = prepared_.at(prepared);
  if (!captured) {
    check(cudaGraphLaunch(match.graph.get(), stream), "launch a match");
    return;
  }
  // Launches of graphs cannot be captured, launches of kernels can.
  for (const Band& band : bands_of(match.schedule)) launch(match, band, stream);
}

kernel::MatchParameters* CudaBackend::parameters(std::size_t prepared) const {
  return prepared_.at(prepared).parameters.get();
}

}  // namespace widestereo
