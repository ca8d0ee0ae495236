// SPDX-License-Identifier: MIT
// Calls kernels by their address, as a launch does.
#include <tuple>
#include <utility>

#include "cuda/convert_maps.cu"
#include "emulated_runtime.h"

namespace widestereo::test {
namespace {

using kernel::cuda::Context;
using kernel::cuda::KernelTable;

template <class... Arguments, std::size_t... i>
ThreadFunction bind_all(void (*kernel)(Arguments...), void** arguments, std::index_sequence<i...>) {
  return [kernel, copied = std::tuple(*static_cast<Arguments*>(arguments[i])...)] {
    std::apply(kernel, copied);
  };
}
template <class... Arguments>
ThreadFunction bind(void (*kernel)(Arguments...), void** arguments) {
  return bind_all(kernel, arguments, std::index_sequence_for<Arguments...>());
}

bool contains(const KernelTable& table, const void* function) {
  for (int i = 0; i < table.count; ++i) {
    if (table.entries[i].function == function) return true;
  }
  return false;
}

bool is_kernel_of_the_schedule(const void* function) {
  if (contains(kernel::cuda::generic_kernels(), function)) return true;
  for (const int model : {CAMERA_KANNALA_BRANDT, CAMERA_DOUBLE_SPHERE, -1}) {
    for (const auto& get : {kernel::cuda::paper_kernels, kernel::cuda::affine_paper_kernels,
                            kernel::cuda::pyramid_kernels}) {
      for (const int sources : {1, 2}) {
        if (contains(get(model, sources), function)) return true;
      }
    }
  }
  return false;
}

}  // namespace

ThreadFunction bind_kernel(const void* function, void** arguments) {
  if (function == reinterpret_cast<const void*>(&import_pixel)) {
    return bind(&import_pixel, arguments);
  }
  if (function == reinterpret_cast<const void*>(&export_pixel)) {
    return bind(&export_pixel, arguments);
  }
  if (function == reinterpret_cast<const void*>(&start_views)) {
    return bind(&start_views, arguments);
  }
  if (!is_kernel_of_the_schedule(function)) return {};
  using Kernel = void (*)(Context);
  return bind(reinterpret_cast<Kernel>(reinterpret_cast<std::uintptr_t>(function)), arguments);
}

}  // namespace widestereo::test
