// SPDX-License-Identifier: MIT
#include "cuda/cuda_backend.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "cuda/launch.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

std::size_t area(cv::Size size) {
  return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
}

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

/// Ends a capture that an exception left open, so that the stream is usable again.
class Capture {
 public:
  explicit Capture(cudaStream_t stream) : stream_(stream) {}
  ~Capture() {
    if (stream_ != nullptr) end();
  }
  Capture(const Capture&) = delete;
  Capture& operator=(const Capture&) = delete;
  cudaError_t begin() {
    const cudaError_t result = cudaStreamBeginCapture(stream_, cudaStreamCaptureModeThreadLocal);
    if (result != cudaSuccess) stream_ = nullptr;
    return result;
  }
  CudaGraph end() {
    cudaGraph_t graph = nullptr;
    result_ = cudaStreamEndCapture(std::exchange(stream_, nullptr), &graph);
    return CudaGraph(graph);
  }
  cudaError_t result() const { return result_; }

 private:
  cudaStream_t stream_;
  cudaError_t result_ = cudaSuccess;
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
  cudaStream_t stream = nullptr;
  check(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking), "make a stream");
  stream_.reset(stream);
  make_maps();
  context_.camera_model = constants.camera_model;
  context_.window_radius = constants.window_radius;
  context_.warp = constants.warp;
  context_.pattern = constants.pattern;
  context_.weighted = constants.weighted;
  context_.filter = constants.filter;
  context_.source_count = constants.source_count;
  // The maps were cleared on the default stream, which the others do not wait for.
  check(cudaDeviceSynchronize(), "clear the maps");
}

CudaBackend::~CudaBackend() {
  try {
    const CurrentDevice current = make_current();
    cudaStreamSynchronize(stream_.get());
    prepared_.clear();
    of_run_ = {};
    events_.clear();
    maps_.clear();
    transfer_nearest_ = {};
    transfer_winner_ = {};
    stream_.reset();
  } catch (const Error&) {  // the device is lost and its memory with it
  }
}

void CudaBackend::check(cudaError_t result, const char* action) const {
  widestereo::check(result, target_.name, action);
}

void CudaBackend::make_maps() {
  std::size_t largest = 0;
  for (const cv::Size& size : sizes_) {
    const std::size_t pixels = area(size);
    const std::string& name = target_.name;
    ViewMaps& maps = maps_.emplace_back();
    maps.rays = DeviceArray<float4>(pixels, name, "the viewing rays");
    maps.intensities = DeviceImage(with_apron(size), APRON, name);
    maps.half_pixels = DeviceImage(size_of_half_pixels(size), HALF_PIXEL_APRON, name);
    maps.texture = maps.half_pixels.make_texture(name);
    maps.hypotheses = DeviceArray<float4>(pixels, name, "the planes");
    maps.checks = DeviceArray<float4>(pixels, name, "the consistency maps");
    maps.priors = DeviceArray<float4>(pixels, name, "the planes' priors");
    context_.views[maps_.size() - 1] = {maps.rays.get(),           maps.intensities.get(),
                                        maps.half_pixels.get(),    maps.texture.get(),
                                        maps.hypotheses.get(),     maps.checks.get(),
                                        maps.priors.get(),         size.width,
                                        maps.intensities.stride(), maps.half_pixels.stride()};
    largest = std::max(largest, pixels);
  }
  transfer_nearest_ = DeviceArray<unsigned>(largest, target_.name, "a transfer buffer");
  transfer_winner_ = DeviceArray<unsigned>(largest, target_.name, "a transfer buffer");
  of_run_.parameters = DeviceArray<kernel::MatchParameters>(1, target_.name, "the parameters");
  context_.transfer_nearest = transfer_nearest_.get();
  context_.transfer_winner = transfer_winner_.get();
}

std::size_t CudaBackend::device_bytes() const {
  std::size_t bytes =
      transfer_nearest_.bytes() + transfer_winner_.bytes() + of_run_.parameters.bytes();
  for (const Prepared& prepared : prepared_) bytes += prepared.parameters.bytes();
  for (const ViewMaps& maps : maps_) {
    bytes += maps.rays.bytes() + maps.intensities.bytes() + maps.half_pixels.bytes() +
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
  cv::Mat map(size(view), CV_32FC4);
  check(cudaMemcpyAsync(map.data, memory, map.total() * map.elemSize(), cudaMemcpyDeviceToHost,
                        stream_.get()),
        "send a map");
  check(cudaStreamSynchronize(stream_.get()), "send a map");
  return map;
}

void CudaBackend::set_rays(int view, const cv::Mat& rays) {
  upload(maps_.at(static_cast<std::size_t>(view)).rays.get(), size(view).width, view, rays,
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

void CudaBackend::launch(const Prepared& prepared, const Band& band, cudaStream_t stream) const {
  const Dispatch& dispatch = *band.dispatch;
  kernel::cuda::Context context = context_;
  context.parameters = prepared.parameters.get();
  context.pass = dispatch.pass;
  context.pass.first_row = band.first_row;
  context.pass.last_row = band.last_row;
  const LaunchGrid grid =
      launch_grid(dispatch.width, band.last_row - band.first_row, dispatch.pass.colour);
  std::array<void*, 1> arguments = {&context};
  check(cudaLaunchKernel(kernel_function(dispatch.kernel, constants_),
                         dim3(grid.columns, grid.rows, static_cast<unsigned>(dispatch.views)),
                         dim3(kernel::cuda::block_width, kernel::cuda::block_height),
                         arguments.data(), 0, stream),
        (std::string("launch the kernel ") + to_string(dispatch.kernel)).c_str());
}

std::vector<Band> CudaBackend::bands_of(const Schedule& schedule) const {
  return split_into_bands(schedule, target_.max_samples > 0
                                        ? target_.max_samples
                                        : std::numeric_limits<long long>::max());
}

std::vector<CudaBackend::Stretch> CudaBackend::launch_all(const Prepared& prepared,
                                                          std::span<const Band> bands,
                                                          Events events, unsigned record_flags) {
  std::vector<Stretch> stretches;
  const auto record = [&] {
    if (events == Events::none) return;
    check(cudaEventRecordWithFlags(events_.at(stretches.size()).get(), stream_.get(), record_flags),
          "record an event");
  };
  for (const Band& band : bands) {
    const Kernel kernel = band.dispatch->kernel;
    if (stretches.empty() || stretches.back().kernel != kernel ||
        events == Events::between_launches) {
      record();
      stretches.push_back({kernel, 0, 0});
    }
    if (band.first_row == 0) ++stretches.back().dispatches;
    stretches.back().samples += band.samples;
    launch(prepared, band, stream_.get());
  }
  record();
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

void CudaBackend::make_graph(Prepared& prepared, Events events) {
  prepared.graph.reset();
  const std::vector<Band> bands = bands_of(prepared.schedule);
  // Nothing but launches while capturing.
  load_kernels(prepared.schedule, events == Events::none ? 0 : bands.size() + 1);
  Capture capture(stream_.get());
  check(capture.begin(), "begin a graph");
  // External: a node of the graph, so that each launch of the graph takes the time anew.
  prepared.stretches = launch_all(prepared, bands, events, cudaEventRecordExternal);
  const CudaGraph graph = capture.end();
  check(capture.result(), "capture a graph");
  cudaGraphExec_t exec = nullptr;
  check(cudaGraphInstantiateWithFlags(&exec, graph.get(), 0), "make a graph");
  prepared.graph.reset(exec);
}

void CudaBackend::run(const Schedule& schedule, const Matcher::Progress& progress) {
  const CurrentDevice current = make_current();
  times_.clear();
  set_parameters(of_run_, schedule);
  if (progress) {
    const std::vector<Band> bands = bands_of(schedule);
    load_kernels(schedule, bands.size() + 1);
    collect(launch_all(of_run_, bands, Events::between_launches, cudaEventRecordDefault), schedule,
            progress);
  } else {
    if (of_run_.graph == nullptr || !same_launches(of_run_.schedule, schedule)) {
      of_run_.graph.reset();
      of_run_.schedule = schedule;
      make_graph(of_run_, Events::between_kernels);
    }
    check(cudaGraphLaunch(of_run_.graph.get(), stream_.get()), "launch a match");
    collect(of_run_.stretches, schedule, progress);
  }
}

void CudaBackend::collect(std::span<const Stretch> stretches, const Schedule& schedule,
                          const Matcher::Progress& progress) {
  ScheduleProgress done(schedule, progress);
  if (!progress) check(cudaStreamSynchronize(stream_.get()), "match");
  for (std::size_t i = 0; i < stretches.size(); ++i) {
    const Stretch& stretch = stretches[i];
    check(cudaEventSynchronize(events_[i + 1].get()), "match");
    float milliseconds = 0;
    check(cudaEventElapsedTime(&milliseconds, events_[i].get(), events_[i + 1].get()),
          "read the time");
    times_.add(stretch.kernel, stretch.dispatches, static_cast<double>(milliseconds));
    done.advance(stretch.samples);
  }
}

std::size_t CudaBackend::prepare(const Schedule& schedule) {
  const CurrentDevice current = make_current();
  Prepared prepared;
  prepared.schedule = schedule;
  prepared.parameters = DeviceArray<kernel::MatchParameters>(1, target_.name, "the parameters");
  // They were cleared on the default stream, which the others do not wait for.
  check(cudaDeviceSynchronize(), "prepare a match");
  set_parameters(prepared, schedule);
  make_graph(prepared, Events::none);
  check(cudaStreamSynchronize(stream_.get()), "prepare a match");
  prepared_.push_back(std::move(prepared));
  return prepared_.size() - 1;
}

void CudaBackend::enqueue(std::size_t prepared, cudaStream_t stream) {
  const CurrentDevice current = make_current();
  const Prepared& match = prepared_.at(prepared);
  cudaStreamCaptureStatus status = cudaStreamCaptureStatusNone;
  // The default stream cannot capture, and must not be asked while another one does.
  if (stream != nullptr) check(cudaStreamIsCapturing(stream, &status), "be asked for captures");
  if (status == cudaStreamCaptureStatusNone) {
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
