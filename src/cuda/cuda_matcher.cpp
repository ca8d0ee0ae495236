// SPDX-License-Identifier: MIT
#include <cuda_runtime_api.h>

#include <string>

#include "cuda/convert_maps.h"
#include "cuda/cuda_backend.h"
#include "matching/device_rows.h"
#include "matching/match_setup.h"
#include "widestereo/cuda.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

void require_data_rows(const void* data, std::size_t pitch, std::size_t element, std::size_t row,
                       const std::string& what) {
  if (data == nullptr) throw Error(what + " has no data; give a device pointer.");
  require_rows({reinterpret_cast<std::uintptr_t>(data), pitch, element, row, "pointer"}, what);
}

template <class T>
void require_map(const CudaMap<T>& map, std::size_t values, const std::string& what) {
  if (map.data == nullptr) return;
  require_data_rows(map.data, map.pitch, sizeof(T), values * sizeof(T), what);
}

void require_aligned(const double* motion) {
  if (reinterpret_cast<std::uintptr_t>(motion) % alignof(double) == 0) return;
  throw Error("The pointer to the motion is no multiple of " + std::to_string(alignof(double)) +
              " bytes, as the device needs it; align it.");
}

DeviceInfo cuda_device() {
  DeviceInfo info;
  info.kind = DeviceKind::cuda;
  info.filters_intensities = true;
  return info;
}

CudaTarget target_of(int device) {
  int index = device;
  if (device == CudaMatcher::current_device && cudaGetDevice(&index) != cudaSuccess) {
    cudaGetLastError();
    index = 0;  // which then says why there is none
  }
  CudaTarget target = cuda_target(index, {});
  target.ordinal = device;
  return target;
}

}  // namespace

class CudaMatcher::Implementation {
 public:
  Implementation(const Rig& rig, const Options& options, int device)
      : rig_(rig),
        setup_(rig, options, cuda_device()),
        backend_(target_of(device), setup_.sizes, setup_.schedule.constants) {
    setup_.set_rays(backend_);
    cold_ = backend_.prepare(setup_.schedule);
    warm_ = backend_.prepare(setup_.warm_schedule);
    const CudaTarget& target = backend_.target();
    const CurrentDevice current = make_current();
    check(load_conversions(), target.name, "load its kernels");
  }

  void enqueue(std::span<const CudaImage> images, std::span<const CudaViewMaps> maps,
               cudaStream_t stream) {
    require_fitting(images, maps);
    const CurrentDevice current = make_current();
    // Before anything is enqueued that would end another one's capture.
    const bool captured = backend_.captures(stream);
    enqueue_prepared(cold_, images, maps, stream, captured);
    holds_planes_ = true;
  }

  void enqueue_next(std::span<const CudaImage> images, std::span<const CudaViewMaps> maps,
                    cudaStream_t stream, const CudaWarmStart& start) {
    require_planes(holds_planes_, "enqueue one without a warm start before.");
    require_fitting(images, maps);
    require_aligned(start.device_now_from_previous);
    const CurrentDevice current = make_current();
    const bool captured = backend_.captures(stream);
    const CudaTarget& target = backend_.target();
    check(start_frame(frame_start(start), backend_.parameters(warm_), stream), target.name,
          "start a frame");
    enqueue_prepared(warm_, images, maps, stream, captured);
  }

  Filter filter() const { return setup_.filter(); }
  std::size_t device_bytes() const { return backend_.device_bytes(); }

 private:
  CurrentDevice make_current() const { return {backend_.target().ordinal, backend_.target().name}; }

  void enqueue_prepared(std::size_t prepared, std::span<const CudaImage> images,
                        std::span<const CudaViewMaps> maps, cudaStream_t stream, bool captured) {
    const CudaTarget& target = backend_.target();
    for (std::size_t i = 0; i < images.size(); ++i) {
      const int view = static_cast<int>(i);
      check(import_image(images[i], backend_.memory(view), backend_.size(view).height, stream),
            target.name, "read an image");
    }
    backend_.enqueue(prepared, stream, captured);
    for (std::size_t i = 0; i < maps.size(); ++i) {
      const int view = static_cast<int>(i);
      check(export_maps(backend_.memory(view), maps[i], backend_.size(view).height, stream),
            target.name, "write the maps");
    }
  }

  FrameStart frame_start(const CudaWarmStart& start) {
    set_motion(setup_.warm_schedule, rig_,
               start.now_from_previous.value_or(Eigen::Isometry3d::Identity()),
               start.frame.value_or(0));
    FrameStart result{};
    result.views = static_cast<int>(rig_.views.size());
    result.frame = start.frame.value_or(0);
    result.counted = !start.frame.has_value();
    result.now_from_previous = start.device_now_from_previous;
    for (int i = 0; i < result.views; ++i) {
      result.pairs[i] = setup_.warm_schedule.parameters.pairs[i * MAX_IMAGES + i];
      Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(result.rig_from_camera[i]) =
          rig_.views[static_cast<std::size_t>(i)].world_from_camera.matrix().topRows<3>();
    }
    return result;
  }

  void require_fitting(std::span<const CudaImage> images,
                       std::span<const CudaViewMaps> maps) const {
    const std::size_t views = rig_.views.size();
    require_one_for_each_view(views, images.size(), maps.size());
    for (std::size_t i = 0; i < views; ++i) {
      const std::string of_view = " of " + rig_.views[i].name;
      const auto width = static_cast<std::size_t>(rig_.views[i].camera.width);
      const std::size_t pixel = bytes_of(images[i].pixel);
      require_data_rows(images[i].data, images[i].pitch, pixel, width * pixel,
                        "The image" + of_view);
      require_map(maps[i].distance, width, "The distance map" + of_view);
      require_map(maps[i].normals, 3 * width, "The normal map" + of_view);
      require_map(maps[i].cost, width, "The cost map" + of_view);
      require_map(maps[i].confidence, width, "The confidence map" + of_view);
      require_map(maps[i].reasons, width, "The reason map" + of_view);
    }
  }

  Rig rig_;
  MatchSetup setup_;
  CudaBackend backend_;
  std::size_t cold_ = 0;  // prepared
  std::size_t warm_ = 0;
  bool holds_planes_ = false;
};

CudaMatcher::CudaMatcher(const Rig& rig, const Options& options, int device)
    : implementation_(std::make_unique<Implementation>(rig, options, device)) {}
CudaMatcher::~CudaMatcher() = default;
CudaMatcher::CudaMatcher(CudaMatcher&&) noexcept = default;
CudaMatcher& CudaMatcher::operator=(CudaMatcher&&) noexcept = default;

void CudaMatcher::enqueue(std::span<const CudaImage> images, std::span<const CudaViewMaps> maps,
                          CUstream_st* stream) {
  implementation_->enqueue(images, maps, stream);
}
void CudaMatcher::enqueue_next(std::span<const CudaImage> images,
                               std::span<const CudaViewMaps> maps, CUstream_st* stream,
                               const CudaWarmStart& start) {
  implementation_->enqueue_next(images, maps, stream, start);
}
Filter CudaMatcher::filter() const { return implementation_->filter(); }
std::size_t CudaMatcher::device_bytes() const { return implementation_->device_bytes(); }

}  // namespace widestereo
