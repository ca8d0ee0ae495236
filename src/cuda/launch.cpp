// SPDX-License-Identifier: MIT
#include "cuda/launch.h"

#include <string_view>

#include "widestereo/error.h"

namespace widestereo {
namespace {

using namespace kernel::cuda;

const void* find(const KernelTable& table, std::string_view name) {
  for (int i = 0; i < table.count; ++i) {
    if (table.entries[i].name == name) return table.entries[i].function;
  }
  return nullptr;
}

KernelTable specialised_kernels(const KernelConstants& c) {
  const auto is = [&c](int radius, PatchWarp warp, PatchPattern pattern, int texels_per_pixel) {
    return c.filter == static_cast<int>(Filter::device) && c.window_radius == radius &&
           c.warp == static_cast<int>(warp) && c.pattern == static_cast<int>(pattern) &&
           c.weighted == 0 && c.texels_per_pixel == texels_per_pixel;
  };
  if (is(paper_window_radius, PatchWarp::exact, PatchPattern::dense, 1))
    return paper_kernels(c.camera_model, c.source_count);
  if (is(paper_window_radius, PatchWarp::affine, PatchPattern::dense, 1))
    return affine_paper_kernels(c.camera_model, c.source_count);
  if (is(pyramid_window_radius, PatchWarp::affine, PatchPattern::checkerboard, 2))
    return pyramid_kernels(c.camera_model, c.source_count);
  return {nullptr, 0};
}

}  // namespace

LaunchGrid launch_grid(int width, int rows, int colour) {
  const int columns = columns_of(width, colour);
  return {static_cast<unsigned>((columns + block_width - 1) / block_width),
          static_cast<unsigned>((rows + block_height - 1) / block_height)};
}

const void* kernel_function(Kernel kernel, const KernelConstants& constants) {
  const char* name = to_string(kernel);
  const void* function = find(specialised_kernels(constants), name);
  if (function == nullptr) function = find(generic_kernels(), name);
  if (function == nullptr) {
    throw Error(std::string("The CUDA back end has no kernel ") + name + "; use another device.");
  }
  return function;
}

}  // namespace widestereo
