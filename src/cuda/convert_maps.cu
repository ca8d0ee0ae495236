// SPDX-License-Identifier: MIT
// Compiled without fused multiply-add, so that values equal the host's.
#include <cuda_runtime.h>

#include <initializer_list>
#include <type_traits>

#include "cuda/convert_maps.h"
#include "kernel/maps.h"

namespace widestereo {
namespace {

using namespace kernel;
using kernel::cuda::ViewMemory;

constexpr int block_width = 32;
constexpr int block_height = 8;

template <class T>
__device__ T* at(T* data, std::size_t pitch, int x, int y, int channels = 1) {
  using Byte = std::conditional_t<std::is_const_v<T>, const char, char>;
  Byte* row = reinterpret_cast<Byte*>(data) + static_cast<std::size_t>(y) * pitch;
  return reinterpret_cast<T*>(row) + static_cast<std::size_t>(x) * channels;
}

template <class T>
__device__ T read(const CudaImage& image, int x, int y) {
  return *at(static_cast<const T*>(image.data), image.pitch, x, y);
}

__device__ bool thread_pixel(int width, int height, int& x, int& y) {
  x = static_cast<int>(blockIdx.x * block_width + threadIdx.x);
  y = static_cast<int>(blockIdx.y * block_height + threadIdx.y);
  return x < width && y < height;
}

__global__ void import_pixel(CudaImage image, ViewMemory view, int height) {
  int x;
  int y;
  if (!thread_pixel(view.width, height, x, y)) return;
  float intensity;
  if (image.pixel == PixelType::grey8) {
    intensity = static_cast<float>(read<std::uint8_t>(image, x, y)) * SCALE_OF_8_BITS;
  } else if (image.pixel == PixelType::grey16) {
    intensity = static_cast<float>(read<std::uint16_t>(image, x, y)) * SCALE_OF_16_BITS;
  } else {
    intensity = intensity_or_masked(read<float>(image, x, y));
  }
  if (view.rays[y * view.width + x].w == 0) intensity = MASKED_INTENSITY;
  view.intensities[y * view.stride + x] = intensity;
}

__global__ void export_pixel(ViewMemory view, CudaViewMaps maps, int height) {
  int x;
  int y;
  if (!thread_pixel(view.width, height, x, y)) return;
  const int index = y * view.width + x;
  const float4 h = view.hypotheses[index];
  const float4 r = view.rays[index];
  const float4 checked = view.checks[index];
  const vec4 hypothesis(h.x, h.y, h.z, h.w);
  const vec4 ray(r.x, r.y, r.z, r.w);
  if (maps.distance.data != nullptr) {
    *at(maps.distance.data, maps.distance.pitch, x, y) = plane_distance(hypothesis, ray);
  }
  if (maps.normals.data != nullptr) {
    const vec3 normal = plane_normal(hypothesis, ray);
    float* xyz = at(maps.normals.data, maps.normals.pitch, x, y, 3);
    xyz[0] = normal.x;
    xyz[1] = normal.y;
    xyz[2] = normal.z;
  }
  if (maps.cost.data != nullptr) *at(maps.cost.data, maps.cost.pitch, x, y) = h.w;
  if (maps.confidence.data != nullptr) {
    *at(maps.confidence.data, maps.confidence.pitch, x, y) = checked.z;
  }
  if (maps.reasons.data != nullptr) {
    *at(maps.reasons.data, maps.reasons.pitch, x, y) = static_cast<std::uint16_t>(checked.w);
  }
}

/// Row i of the product a b of two rigid transforms, 3x4 row-major.
__device__ void multiply_row(const double* a, const double* b, int i, double* row) {
  for (int j = 0; j < 4; ++j) {
    row[j] = a[4 * i] * b[j] + a[4 * i + 1] * b[4 + j] + a[4 * i + 2] * b[8 + j];
  }
  row[3] += a[4 * i + 3];
}

/// The motion of a camera of a rig that moves.
__device__ ViewPair pair_of(const double* now_from_previous, const double* rig_from_camera) {
  double moved[12];
  for (int i = 0; i < 3; ++i) multiply_row(now_from_previous, rig_from_camera, i, moved + 4 * i);
  const double* r = rig_from_camera;
  for (int i = 0; i < 3; ++i) moved[4 * i + 3] -= r[4 * i + 3];
  // camera_from_rig: the transposed rotation of the difference from the camera's centre.
  const double camera_from_rig[12] = {r[0], r[4], r[8], 0,    r[1],  r[5],
                                      r[9], 0,    r[2], r[6], r[10], 0};
  vec4 rows[3];
  for (int i = 0; i < 3; ++i) {
    double row[4];
    multiply_row(camera_from_rig, moved, i, row);
    rows[i] = vec4(static_cast<float>(row[0]), static_cast<float>(row[1]),
                   static_cast<float>(row[2]), static_cast<float>(row[3]));
  }
  return {rows[0], rows[1], rows[2]};
}

/// One thread for each view.
__global__ void start_views(FrameStart start, MatchParameters* parameters) {
  const int view = static_cast<int>(threadIdx.x);
  if (view >= start.views) return;
  if (view == 0) parameters->frame.x = start.counted ? parameters->frame.x + 1 : start.frame;
  parameters->pairs[view * MAX_IMAGES + view] =
      start.now_from_previous != nullptr
          ? pair_of(start.now_from_previous, start.rig_from_camera[view])
          : start.pairs[view];
}

dim3 grid_of(int width, int height) {
  return dim3(static_cast<unsigned>((width + block_width - 1) / block_width),
              static_cast<unsigned>((height + block_height - 1) / block_height));
}

}  // namespace

// Not <<<>>>, whose errors mix with earlier ones of the application's.
cudaError_t import_image(const CudaImage& image, const ViewMemory& view, int height,
                         cudaStream_t stream) {
  CudaImage image_argument = image;
  ViewMemory view_argument = view;
  void* arguments[] = {&image_argument, &view_argument, &height};
  return cudaLaunchKernel(reinterpret_cast<const void*>(&import_pixel), grid_of(view.width, height),
                          dim3(block_width, block_height), arguments, 0, stream);
}

cudaError_t export_maps(const ViewMemory& view, const CudaViewMaps& maps, int height,
                        cudaStream_t stream) {
  ViewMemory view_argument = view;
  CudaViewMaps maps_argument = maps;
  void* arguments[] = {&view_argument, &maps_argument, &height};
  return cudaLaunchKernel(reinterpret_cast<const void*>(&export_pixel), grid_of(view.width, height),
                          dim3(block_width, block_height), arguments, 0, stream);
}

cudaError_t start_frame(const FrameStart& start, MatchParameters* parameters, cudaStream_t stream) {
  FrameStart start_argument = start;
  void* arguments[] = {&start_argument, &parameters};
  return cudaLaunchKernel(reinterpret_cast<const void*>(&start_views), dim3(1), dim3(MAX_IMAGES),
                          arguments, 0, stream);
}

cudaError_t load_conversions() {
  cudaFuncAttributes attributes{};
  for (const void* kernel :
       {reinterpret_cast<const void*>(&import_pixel), reinterpret_cast<const void*>(&export_pixel),
        reinterpret_cast<const void*>(&start_views)}) {
    const cudaError_t result = cudaFuncGetAttributes(&attributes, kernel);
    if (result != cudaSuccess) return result;
  }
  return cudaSuccess;
}

}  // namespace widestereo
