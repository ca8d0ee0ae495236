// SPDX-License-Identifier: MIT
#include <cuda_runtime_api.h>

#include <string>

#include "cuda/convert_maps.h"
#include "cuda/cuda_backend.h"
#include "matching/match_setup.h"
#include "widestereo/cuda.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

std::size_t bytes_of(CudaPixel pixel) {
  switch (pixel) {
    case CudaPixel::grey8:
      return 1;
    case CudaPixel::grey16:
      return 2;
    case CudaPixel::intensity:
      return 4;
  }
  throw Error("There is no pixel type " + std::to_string(static_cast<int>(pixel)) +
              "; use one of CudaPixel.");
}

/// Rows of `width` elements must fit, and every element be aligned.
void require_rows(const void* data, std::size_t pitch, std::size_t element, std::size_t row,
                  const std::string& what) {
  if (data == nullptr) throw Error(what + " has no data; give a device pointer.");
  if (pitch < row || pitch % element != 0 ||
      reinterpret_cast<std::uintptr_t>(data) % element != 0) {
    throw Error(what + " has a pitch of " + std::to_string(pitch) +
                " bytes; its pointer and pitch must be multiples of " + std::to_string(element) +
                " and rows have " + std::to_string(row) + " bytes.");
  }
}

template <class T>
void require_map(const CudaMap<T>& map, std::size_t values, const std::string& what) {
  if (map.data == nullptr) return;
  require_rows(map.data, map.pitch, sizeof(T), values * sizeof(T), what);
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
        setup_(rig, options, DeviceKind::cuda),
        backend_(target_of(device), setup_.sizes, setup_.schedule.constants) {
    setup_.set_rays(backend_);
    backend_.prepare(setup_.schedule);
  }

  void enqueue(std::span<const CudaImage> images, std::span<const CudaViewMaps> maps,
               cudaStream_t stream) {
    require_fitting(images, maps);
    const CudaTarget& target = backend_.target();
    const CurrentDevice current(target.ordinal, target.name);
    for (std::size_t i = 0; i < images.size(); ++i) {
      const int view = static_cast<int>(i);
      check(import_image(images[i], backend_.memory(view), backend_.size(view).height, stream),
            target.name, "read an image");
    }
    backend_.enqueue(stream);
    for (std::size_t i = 0; i < maps.size(); ++i) {
      const int view = static_cast<int>(i);
      check(export_maps(backend_.memory(view), maps[i], backend_.size(view).height, stream),
            target.name, "write the maps");
    }
  }

  std::size_t device_bytes() const { return backend_.device_bytes(); }

 private:
  void require_fitting(std::span<const CudaImage> images,
                       std::span<const CudaViewMaps> maps) const {
    const std::size_t views = rig_.views.size();
    if (images.size() != views || maps.size() != views) {
      throw Error("The rig has " + std::to_string(views) + " views, but " +
                  std::to_string(images.size()) + " image(s) and maps for " +
                  std::to_string(maps.size()) + " view(s) were given.");
    }
    for (std::size_t i = 0; i < views; ++i) {
      const std::string of_view = " of " + rig_.views[i].name;
      const auto width = static_cast<std::size_t>(rig_.views[i].camera.width);
      const std::size_t pixel = bytes_of(images[i].pixel);
      require_rows(images[i].data, images[i].pitch, pixel, width * pixel, "The image" + of_view);
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
std::size_t CudaMatcher::device_bytes() const { return implementation_->device_bytes(); }

}  // namespace widestereo
