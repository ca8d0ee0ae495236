// SPDX-License-Identifier: MIT
#include "emulated_runtime.h"

#include <cuda_runtime.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <iterator>
#include <map>
#include <opencv2/core/utility.hpp>
#include <set>
#include <thread>
#include <vector>

using widestereo::test::emulation;
using Work = std::function<void()>;
using Clock = std::chrono::steady_clock;

__thread dim3 blockIdx;
__thread dim3 threadIdx;
__thread bool stops_at_barrier;

struct CUgraphNode_st {
  Work work;
  CUevent_st* event = nullptr;      // which it records
  std::vector<std::size_t> before;  // numbers of the nodes that it follows
};
struct CUgraph_st {
  std::deque<CUgraphNode_st> nodes;
};
struct CUgraphExec_st {
  std::deque<CUgraphNode_st> nodes;
};
struct CUstream_st {
  std::deque<Work> queue;
  bool blocking = true;
  CUgraph_st* capturing = nullptr;
  bool capture_is_lost = false;
  std::thread::id capturing_thread;
  cudaStreamCaptureMode mode = cudaStreamCaptureModeGlobal;  // of that capture
};
struct CUevent_st {
  CUstream_st* stream = nullptr;  // of the last record or of the launch of the graph with it
  bool recorded = false;
  Clock::time_point time;
};

namespace {

std::map<void*, std::size_t>& allocations() {
  static std::map<void*, std::size_t> map;
  return map;
}
/// Bytes of pinned host memory, by where it begins.
std::map<void*, std::size_t>& pinned_memory() {
  static std::map<void*, std::size_t> map;
  return map;
}
bool is_pinned(void* memory) {
  const auto after = pinned_memory().upper_bound(memory);
  if (after == pinned_memory().begin()) return false;
  const auto& [begin, bytes] = *std::prev(after);
  return static_cast<char*>(memory) < static_cast<char*>(begin) + bytes;
}
std::set<CUstream_st*>& streams() {
  static std::set<CUstream_st*> set;
  return set;
}
CUstream_st& default_stream() {
  static CUstream_st stream;
  return stream;
}
CUstream_st* resolve(cudaStream_t stream) { return stream ? stream : &default_stream(); }

void run_all(CUstream_st& stream) {
  while (!stream.queue.empty()) {
    const Work work = std::move(stream.queue.front());
    stream.queue.pop_front();
    work();
  }
}
void run_everything() {
  run_all(default_stream());
  for (CUstream_st* stream : streams()) run_all(*stream);
}

template <class Condition>
bool any_capture(Condition condition) {
  for (const CUstream_st* stream : streams()) {
    if (stream->capturing != nullptr && condition(*stream)) return true;
  }
  return false;
}
bool this_thread_captures() {
  return any_capture([](const CUstream_st& stream) {
    return stream.capturing_thread == std::this_thread::get_id();
  });
}
thread_local cudaStreamCaptureMode mode_of_thread = cudaStreamCaptureModeGlobal;
/// Of other threads: the real runtime refuses allocations and the like then, unless told otherwise.
bool captures_forbid_this_thread() {
  return mode_of_thread == cudaStreamCaptureModeGlobal &&
         any_capture(
             [](const CUstream_st& stream) { return stream.mode == cudaStreamCaptureModeGlobal; });
}
/// Streams that wait for the default stream must not capture while it is used.
bool a_blocking_stream_captures() {
  return any_capture([](const CUstream_st& stream) { return stream.blocking; });
}

/// The result of a call that can fail.
cudaError_t step() {
  auto& e = emulation();
  const long call = e.calls++;
  const bool fails =
      e.failing_call >= 0 && (call == e.failing_call || (e.sticky && call > e.failing_call));
  return fails ? e.failure : cudaSuccess;
}
/// Likewise, of one that must not be made while this thread captures, in whichever mode: the back
/// end does nothing but launch then.
cudaError_t step_outside_capture() {
  return this_thread_captures() || captures_forbid_this_thread() ? cudaErrorStreamCaptureUnsupported
                                                                 : step();
}
/// Ends all captures on blocking streams where the default stream is used meanwhile.
cudaError_t end_captures_for(cudaStream_t stream) {
  if (stream != nullptr || !a_blocking_stream_captures()) return cudaSuccess;
  for (CUstream_st* other : streams()) {
    if (other->blocking && other->capturing != nullptr) other->capture_is_lost = true;
  }
  return cudaErrorStreamCaptureImplicit;
}
/// Likewise, of one that uses the default stream.
cudaError_t step_on(cudaStream_t stream) {
  const cudaError_t lost = end_captures_for(stream);
  return lost != cudaSuccess ? lost : step_outside_capture();
}

void enqueue(cudaStream_t stream, Work work) {
  CUstream_st* target = resolve(stream);
  if (target->capturing != nullptr) {
    CUgraph_st& graph = *target->capturing;
    std::vector<std::size_t> before;
    if (!graph.nodes.empty()) before.push_back(graph.nodes.size() - 1);
    graph.nodes.push_back({std::move(work), nullptr, before});
  } else {
    target->queue.push_back(std::move(work));
  }
}

void copy_rows(void* to, std::size_t to_pitch, const void* from, std::size_t from_pitch,
               std::size_t width, std::size_t height) {
  for (std::size_t y = 0; y < height; ++y) {
    std::memcpy(static_cast<char*>(to) + y * to_pitch,
                static_cast<const char*>(from) + y * from_pitch, width);
  }
}

/// What a launch will do, with copies of its arguments.
cudaError_t bind_launch(const void* function, dim3 grid, dim3 block, void** arguments, Work& work) {
  constexpr unsigned largest_grid_height = 65535;  // and depth
  constexpr unsigned largest_block = 1024;
  const bool legal = grid.x > 0 && grid.y > 0 && grid.z > 0 && grid.y <= largest_grid_height &&
                     grid.z <= largest_grid_height && block.z == 1 && block.x * block.y > 0 &&
                     block.x * block.y <= largest_block;
  if (!legal) return cudaErrorInvalidValue;
  const widestereo::test::ThreadFunction thread =
      widestereo::test::bind_kernel(function, arguments);
  if (!thread) return cudaErrorInvalidDeviceFunction;
  if (const cudaError_t error = step()) return error;
  work = [=] {
    ++emulation().kernels_run;
    const bool backwards = emulation().backwards;
    const auto place = [backwards](unsigned i, unsigned count) {
      return backwards ? count - 1 - i : i;
    };
    const unsigned all_rows = grid.y * grid.z;
    const unsigned threads = block.x * block.y;
    // How many stopped at a barrier.
    const auto run_threads = [&] {
      unsigned stopped = 0;
      for (unsigned i = 0; i < threads; ++i) {
        const unsigned thread_of_block = place(i, threads);
        threadIdx = dim3(thread_of_block % block.x, thread_of_block / block.x);
        try {
          thread();
        } catch (const BlockBarrier&) {
          ++stopped;
        }
      }
      return stopped;
    };
    cv::parallel_for_(cv::Range(0, static_cast<int>(all_rows)), [&](const cv::Range& rows) {
      for (int row = rows.start; row < rows.end; ++row) {
        const unsigned y = place(static_cast<unsigned>(row), all_rows);
        for (unsigned x = 0; x < grid.x; ++x) {
          blockIdx = dim3(place(x, grid.x), y % grid.y, y / grid.y);
          stops_at_barrier = true;
          const unsigned stopped = run_threads();
          stops_at_barrier = false;
          CV_Assert(stopped == 0 || stopped == threads);
          if (stopped > 0) run_threads();
        }
      }
    });
  };
  return cudaSuccess;
}

Work record_of(CUevent_st* event) {
  return [event] {
    event->recorded = true;
    event->time = Clock::now();
  };
}
void await_record(CUevent_st& event, cudaStream_t stream) {
  event.stream = resolve(stream);
  event.recorded = false;
}

/// Numbers of a new node's predecessors; false where one is named twice or is not of the graph.
bool find_nodes(const CUgraph_st& graph, const cudaGraphNode_t* before, std::size_t count,
                std::vector<std::size_t>& numbers) {
  for (std::size_t i = 0; i < count; ++i) {
    const auto node = std::find_if(graph.nodes.begin(), graph.nodes.end(),
                                   [&](const auto& one) { return &one == before[i]; });
    const auto number = static_cast<std::size_t>(node - graph.nodes.begin());
    const bool known = std::find(numbers.begin(), numbers.end(), number) != numbers.end();
    if (node == graph.nodes.end() || known) return false;
    numbers.push_back(number);
  }
  return true;
}

/// An order in which nodes may run: as they were added, or with the last one first that may run.
std::vector<std::size_t> order_of(const std::deque<CUgraphNode_st>& nodes, bool backwards) {
  std::vector<std::size_t> order;
  std::vector<bool> done(nodes.size());
  while (order.size() < nodes.size()) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const std::size_t number = backwards ? nodes.size() - 1 - i : i;
      const std::vector<std::size_t>& before = nodes[number].before;
      if (done[number]) continue;
      if (!std::all_of(before.begin(), before.end(), [&](auto one) { return done[one]; })) continue;
      done[number] = true;
      order.push_back(number);
      break;
    }
  }
  return order;
}

}  // namespace

namespace widestereo::test {

Emulation& emulation() {
  static Emulation state;
  return state;
}

namespace {
void restore() {
  Emulation fresh;
  fresh.allocated = emulation().allocated;
  fresh.live_objects = emulation().live_objects;
  emulation() = fresh;
}
}  // namespace

EmulationScope::EmulationScope() { restore(); }
EmulationScope::~EmulationScope() { restore(); }

}  // namespace widestereo::test

const char* cudaGetErrorName(cudaError_t) { return "cudaErrorEmulated"; }
const char* cudaGetErrorString(cudaError_t) { return "emulated error"; }
cudaError_t cudaGetLastError() { return cudaSuccess; }

cudaError_t cudaDriverGetVersion(int* version) {
  *version = emulation().driver_version;
  return cudaSuccess;
}
cudaError_t cudaGetDeviceCount(int* count) {
  *count = emulation().devices;
  if (emulation().count_error != cudaSuccess) return emulation().count_error;
  return *count > 0 ? step() : cudaErrorNoDevice;
}
cudaError_t cudaGetDeviceProperties(cudaDeviceProp* properties, int device) {
  if (device < 0 || device >= emulation().devices) return cudaErrorInvalidDevice;
  if (const cudaError_t error = step()) return error;
  *properties = {};
  std::strncpy(properties->name, emulation().name, sizeof properties->name - 1);
  for (int i = 0; i < 16; ++i) properties->uuid.bytes[i] = static_cast<char>(0xf0 - i + device);
  properties->major = emulation().major;
  return cudaSuccess;
}
cudaError_t cudaDeviceGetAttribute(int* value, cudaDeviceAttr attribute, int) {
  *value = 0;
  // An H200's.
  if (attribute == cudaDevAttrClockRate) *value = 1980000;
  if (attribute == cudaDevAttrMultiProcessorCount) *value = 132;
  if (attribute == cudaDevAttrMemoryClockRate) *value = 3201000;
  if (attribute == cudaDevAttrGlobalMemoryBusWidth) *value = 6144;
  if (attribute == cudaDevAttrComputeMode) *value = emulation().compute_mode;
  if (attribute == cudaDevAttrKernelExecTimeout) *value = emulation().time_limit ? 1 : 0;
  return cudaSuccess;
}
cudaError_t cudaGetDevice(int* device) {
  *device = emulation().current_device;
  return emulation().devices > 0 ? step() : cudaErrorNoDevice;
}
cudaError_t cudaSetDevice(int device) {
  if (device < 0 || device >= emulation().devices) return cudaErrorInvalidDevice;
  emulation().current_device = device;
  return step();
}
cudaError_t cudaDeviceSynchronize() {
  // In whichever thread and mode.
  if (any_capture([](const CUstream_st&) { return true; })) {
    return cudaErrorStreamCaptureUnsupported;
  }
  if (const cudaError_t error = step()) return error;
  run_everything();
  return cudaSuccess;
}

cudaError_t cudaMemGetInfo(std::size_t* available, std::size_t* total) {
  *total = emulation().memory;
  *available = emulation().memory - emulation().allocated;
  return cudaSuccess;
}
cudaError_t cudaMalloc(void** memory, std::size_t bytes) {
  if (const cudaError_t error = step_outside_capture()) return error;
  constexpr std::size_t alignment = 256;
  const std::size_t rounded = (bytes + alignment - 1) / alignment * alignment;
  if (emulation().allocated + rounded > emulation().memory) return cudaErrorMemoryAllocation;
  *memory = std::aligned_alloc(alignment, rounded);
  std::memset(*memory, 0xcd, rounded);  // what was not cleared is seen
  allocations()[*memory] = rounded;
  emulation().allocated += rounded;
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaMallocPitch(void** memory, std::size_t* pitch, std::size_t width,
                            std::size_t height) {
  *pitch = (width / 512 + 1) * 512;
  return cudaMalloc(memory, *pitch * height);
}
cudaError_t cudaFree(void* memory) {
  if (memory == nullptr) return step();
  run_everything();  // as the real one waits
  emulation().allocated -= allocations().at(memory);
  allocations().erase(memory);
  --emulation().live_objects;
  std::free(memory);
  return cudaSuccess;
}
cudaError_t cudaMallocHost(void** memory, std::size_t bytes) {
  if (const cudaError_t error = step_outside_capture()) return error;
  if (!emulation().can_pin) return cudaErrorMemoryAllocation;
  *memory = std::malloc(bytes);
  std::memset(*memory, 0xcd, bytes);
  pinned_memory()[*memory] = bytes;
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaFreeHost(void* memory) {
  if (memory == nullptr) return step();
  run_everything();
  pinned_memory().erase(memory);
  --emulation().live_objects;
  std::free(memory);
  return cudaSuccess;
}
cudaError_t cudaMemsetAsync(void* memory, int value, std::size_t bytes, cudaStream_t stream) {
  if (const cudaError_t error = step_on(stream)) return error;
  enqueue(stream, [=] { std::memset(memory, value, bytes); });
  return cudaSuccess;
}
cudaError_t cudaMemcpyAsync(void* to, const void* from, std::size_t bytes, cudaMemcpyKind kind,
                            cudaStream_t stream) {
  return cudaMemcpy2DAsync(to, bytes, from, bytes, bytes, 1, kind, stream);
}
cudaError_t cudaMemcpy2DAsync(void* to, std::size_t to_pitch, const void* from,
                              std::size_t from_pitch, std::size_t width, std::size_t height,
                              cudaMemcpyKind kind, cudaStream_t stream) {
  if (const cudaError_t error = step_on(stream)) return error;
  if (width > to_pitch || width > from_pitch) return cudaErrorInvalidValue;
  if (kind == cudaMemcpyDeviceToHost && is_pinned(to)) {
    enqueue(stream, [=] { copy_rows(to, to_pitch, from, from_pitch, width, height); });
    return cudaSuccess;
  }
  // Ordinary host memory is filled, or staged, before the call returns.
  if (kind == cudaMemcpyDeviceToHost) {
    run_all(*resolve(stream));
    copy_rows(to, to_pitch, from, from_pitch, width, height);
    return cudaSuccess;
  }
  std::vector<char> staged(width * height);
  copy_rows(staged.data(), width, from, from_pitch, width, height);
  enqueue(stream, [=, staged = std::move(staged)] {
    copy_rows(to, to_pitch, staged.data(), width, width, height);
  });
  return cudaSuccess;
}
cudaError_t cudaMemcpy2D(void* to, std::size_t to_pitch, const void* from, std::size_t from_pitch,
                         std::size_t width, std::size_t height, cudaMemcpyKind kind) {
  const cudaError_t error =
      cudaMemcpy2DAsync(to, to_pitch, from, from_pitch, width, height, kind, nullptr);
  run_all(default_stream());
  return error;
}

cudaChannelFormatDesc cudaCreateChannelDesc(int x, int y, int z, int w,
                                            cudaChannelFormatKind kind) {
  return {x, y, z, w, kind};
}
cudaError_t cudaCreateTextureObject(cudaTextureObject_t* texture, const cudaResourceDesc* resource,
                                    const cudaTextureDesc* how, const cudaResourceViewDesc*) {
  if (const cudaError_t error = step_outside_capture()) return error;
  constexpr std::size_t pitch_alignment = 32;
  const auto& memory = resource->res.pitch2D;
  const int texel_bytes = memory.desc.x / 8;
  const bool is_float = (texel_bytes == 4 || texel_bytes == 2) && memory.desc.y == 0 &&
                        memory.desc.z == 0 && memory.desc.w == 0 &&
                        memory.desc.f == cudaChannelFormatKindFloat;
  const bool emulated = resource->resType == cudaResourceTypePitch2D && is_float &&
                        how->filterMode == cudaFilterModeLinear && how->normalizedCoords == 0 &&
                        how->addressMode[0] == cudaAddressModeClamp &&
                        how->addressMode[1] == cudaAddressModeClamp;
  const auto allocation = allocations().find(memory.devPtr);
  const bool fits = allocation != allocations().end() &&
                    memory.pitchInBytes % pitch_alignment == 0 &&
                    memory.width * static_cast<std::size_t>(texel_bytes) <= memory.pitchInBytes &&
                    memory.pitchInBytes * memory.height <= allocation->second;
  if (!emulated || !fits) return cudaErrorInvalidValue;
  *texture = reinterpret_cast<cudaTextureObject_t>(new EmulatedTexture{
      memory.devPtr, texel_bytes, static_cast<int>(memory.width), static_cast<int>(memory.height),
      static_cast<int>(memory.pitchInBytes) / texel_bytes});
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaDestroyTextureObject(cudaTextureObject_t texture) {
  run_everything();  // the queues may read it
  delete reinterpret_cast<EmulatedTexture*>(texture);
  --emulation().live_objects;
  return cudaSuccess;
}

cudaError_t cudaStreamCreate(cudaStream_t* stream) { return cudaStreamCreateWithFlags(stream, 0); }
cudaError_t cudaStreamCreateWithFlags(cudaStream_t* stream, unsigned flags) {
  if (const cudaError_t error = step_outside_capture()) return error;
  *stream = new CUstream_st;
  (*stream)->blocking = flags != cudaStreamNonBlocking;
  streams().insert(*stream);
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaStreamDestroy(cudaStream_t stream) {
  run_all(*stream);
  streams().erase(stream);
  delete stream;
  --emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaStreamSynchronize(cudaStream_t stream) {
  if (const cudaError_t error = step_outside_capture()) return error;
  run_all(*resolve(stream));
  return cudaSuccess;
}
cudaError_t cudaThreadExchangeStreamCaptureMode(cudaStreamCaptureMode* mode) {
  std::swap(*mode, mode_of_thread);
  return cudaSuccess;
}
cudaError_t cudaStreamBeginCapture(cudaStream_t stream, cudaStreamCaptureMode mode) {
  if (stream == nullptr || stream->capturing != nullptr) return cudaErrorInvalidValue;
  if (const cudaError_t error = step()) return error;
  stream->capturing = new CUgraph_st;
  stream->capturing_thread = std::this_thread::get_id();
  stream->mode = mode;
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaStreamIsCapturing(cudaStream_t stream, cudaStreamCaptureStatus* status) {
  if (stream == nullptr && a_blocking_stream_captures()) return cudaErrorStreamCaptureImplicit;
  *status = stream != nullptr && stream->capturing != nullptr ? cudaStreamCaptureStatusActive
                                                              : cudaStreamCaptureStatusNone;
  return step();
}
cudaError_t cudaStreamEndCapture(cudaStream_t stream, cudaGraph_t* graph) {
  *graph = std::exchange(stream->capturing, nullptr);
  if (*graph == nullptr) return cudaErrorInvalidValue;
  cudaError_t error = step();
  if (std::exchange(stream->capture_is_lost, false)) error = cudaErrorStreamCaptureInvalidated;
  if (error != cudaSuccess) {
    cudaGraphDestroy(std::exchange(*graph, nullptr));
    return error;
  }
  return cudaSuccess;
}
cudaError_t cudaGraphCreate(cudaGraph_t* graph, unsigned flags) {
  if (flags != 0) return cudaErrorInvalidValue;
  if (const cudaError_t error = step()) return error;
  *graph = new CUgraph_st;
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaGraphAddKernelNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                   const cudaGraphNode_t* before, std::size_t count,
                                   const cudaKernelNodeParams* launch) {
  std::vector<std::size_t> numbers;
  if (!find_nodes(*graph, before, count, numbers)) return cudaErrorInvalidValue;
  Work work;
  if (const cudaError_t error = bind_launch(launch->func, launch->gridDim, launch->blockDim,
                                            launch->kernelParams, work)) {
    return error;
  }
  graph->nodes.push_back({std::move(work), nullptr, numbers});
  *node = &graph->nodes.back();
  return cudaSuccess;
}
cudaError_t cudaGraphAddEventRecordNode(cudaGraphNode_t* node, cudaGraph_t graph,
                                        const cudaGraphNode_t* before, std::size_t count,
                                        cudaEvent_t event) {
  std::vector<std::size_t> numbers;
  if (!find_nodes(*graph, before, count, numbers)) return cudaErrorInvalidValue;
  if (const cudaError_t error = step()) return error;
  graph->nodes.push_back({record_of(event), event, numbers});
  *node = &graph->nodes.back();
  return cudaSuccess;
}
cudaError_t cudaGraphDestroy(cudaGraph_t graph) {
  delete graph;
  --emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaGraphInstantiateWithFlags(cudaGraphExec_t* exec, cudaGraph_t graph,
                                          unsigned long long) {
  if (const cudaError_t error = step_outside_capture()) return error;
  *exec = new CUgraphExec_st{graph->nodes};
  ++emulation().live_objects;
  ++emulation().graphs_made;
  return cudaSuccess;
}
cudaError_t cudaGraphUpload(cudaGraphExec_t, cudaStream_t stream) { return step_on(stream); }
cudaError_t cudaGraphLaunch(cudaGraphExec_t exec, cudaStream_t stream) {
  if (resolve(stream)->capturing != nullptr) return cudaErrorStreamCaptureUnsupported;
  if (const cudaError_t lost = end_captures_for(stream)) return lost;
  if (const cudaError_t error = step()) return error;
  for (const std::size_t number : order_of(exec->nodes, emulation().backwards)) {
    const CUgraphNode_st& node = exec->nodes[number];
    if (node.event != nullptr) await_record(*node.event, stream);
    enqueue(stream, node.work);
  }
  return cudaSuccess;
}
cudaError_t cudaGraphExecDestroy(cudaGraphExec_t exec) {
  delete exec;
  --emulation().live_objects;
  return cudaSuccess;
}

cudaError_t cudaEventCreate(cudaEvent_t* event) {
  if (const cudaError_t error = step_outside_capture()) return error;
  *event = new CUevent_st;
  ++emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaEventDestroy(cudaEvent_t event) {
  run_everything();  // the queues may record it
  delete event;
  --emulation().live_objects;
  return cudaSuccess;
}
cudaError_t cudaEventRecord(cudaEvent_t event, cudaStream_t stream) {
  // It would be a dependency of the capture, not a node of the graph.
  if (resolve(stream)->capturing != nullptr) return cudaErrorInvalidValue;
  if (const cudaError_t error = step()) return error;
  await_record(*event, stream);
  enqueue(stream, record_of(event));
  return cudaSuccess;
}
cudaError_t cudaEventSynchronize(cudaEvent_t event) {
  if (const cudaError_t error = step_outside_capture()) return error;
  if (event->stream == nullptr) return cudaSuccess;
  while (!event->recorded && !event->stream->queue.empty()) {
    const Work work = std::move(event->stream->queue.front());
    event->stream->queue.pop_front();
    work();
  }
  return cudaSuccess;
}
cudaError_t cudaEventElapsedTime(float* milliseconds, cudaEvent_t start, cudaEvent_t end) {
  if (const cudaError_t error = step()) return error;
  if (!start->recorded || !end->recorded) return cudaErrorNotReady;
  *milliseconds = std::chrono::duration<float, std::milli>(end->time - start->time).count();
  return cudaSuccess;
}

cudaError_t cudaFuncGetAttributes(cudaFuncAttributes*, const void*) {
  if (!emulation().has_kernels) return cudaErrorNoKernelImageForDevice;
  return step_outside_capture();
}
cudaError_t cudaLaunchKernel(const void* function, dim3 grid, dim3 block, void** arguments,
                             std::size_t, cudaStream_t stream) {
  Work work;
  if (const cudaError_t lost = end_captures_for(stream)) return lost;
  if (const cudaError_t error = bind_launch(function, grid, block, arguments, work)) return error;
  enqueue(stream, std::move(work));
  return cudaSuccess;
}
