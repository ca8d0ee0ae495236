// SPDX-License-Identifier: MIT
#include "roofline.h"

#include <map>

namespace ws = widestereo;

std::optional<double> Roofline::share_of(double time) const {
  if (milliseconds > 0 && time > 0) return milliseconds / time;
  return std::nullopt;
}

Roofline roofline(const ws::KernelWork& work, const ws::DevicePeaks& peaks) {
  Roofline longest;
  const auto consider = [&longest](double amount, double giga_per_second, const char* bound) {
    if (giga_per_second <= 0) return;
    const double milliseconds = 1e-6 * amount / giga_per_second;
    if (milliseconds > longest.milliseconds) longest = {milliseconds, bound};
  };
  consider(work.operations, peaks.gflops, "operations");
  consider(work.texels, peaks.gtexels, "texels");
  consider(work.bytes, peaks.gbps, "bytes");
  return longest;
}

Roofline roofline(const std::vector<ws::KernelTime>& kernels, const ws::DevicePeaks& peaks) {
  Roofline sum;
  std::map<std::string, double> by_bound;
  for (const ws::KernelTime& kernel : kernels) {
    const Roofline of_kernel = roofline(kernel.work, peaks);
    sum.milliseconds += of_kernel.milliseconds;
    by_bound[of_kernel.bound] += of_kernel.milliseconds;
  }
  double most = 0;
  for (const auto& [bound, milliseconds] : by_bound) {
    if (milliseconds <= most) continue;
    most = milliseconds;
    sum.bound = bound;
  }
  return sum;
}

nlohmann::ordered_json to_json(const ws::DevicePeaks& peaks) {
  const auto or_null = [](double peak) {
    return peak > 0 ? nlohmann::ordered_json(peak) : nlohmann::ordered_json(nullptr);
  };
  return {{"gflops", or_null(peaks.gflops)},
          {"gtexels", or_null(peaks.gtexels)},
          {"gbps", or_null(peaks.gbps)}};
}
