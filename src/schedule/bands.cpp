// SPDX-License-Identifier: MIT
#include "schedule/bands.h"

#include <algorithm>

namespace widestereo {
namespace {

constexpr long long rows_of_workgroup = 8;

/// Samples of a dispatch; a kernel without patches may still look at every pixel's window.
long long estimated_work(const Dispatch& dispatch, const KernelConstants& constants) {
  if (dispatch.samples > 0) return dispatch.samples;
  const long long window = 2 * constants.window_radius + 1;
  return window * window * dispatch.pixels;
}

}  // namespace

std::vector<Band> split_into_bands(const Schedule& schedule, long long max_work) {
  std::vector<Band> bands;
  for (const Dispatch& dispatch : schedule.dispatches) {
    const long long work = estimated_work(dispatch, schedule.constants);
    const long long height = dispatch.height;
    const long long work_of_row = (work + height - 1) / height;
    long long rows = std::clamp(max_work / std::max(work_of_row, 1LL), 1LL, height);
    if (rows < height && rows > rows_of_workgroup) rows -= rows % rows_of_workgroup;
    for (long long first = 0; first < height; first += rows) {
      const long long last = std::min(first + rows, height);
      // Differences of running totals, so that the parts add up to the whole.
      const auto part = [&](long long total) {
        return total * last / height - total * first / height;
      };
      bands.push_back({&dispatch, static_cast<int>(first), static_cast<int>(last),
                       part(dispatch.samples), part(work)});
    }
  }
  return bands;
}

std::vector<std::span<const Band>> group_for_submission(std::span<const Band> bands,
                                                        long long max_work, std::size_t max_bands) {
  std::vector<std::span<const Band>> groups;
  std::size_t first = 0;
  long long work = 0;
  for (std::size_t i = 0; i < bands.size(); ++i) {
    if (i > first && (work + bands[i].work > max_work || i - first >= max_bands)) {
      groups.push_back(bands.subspan(first, i - first));
      first = i;
      work = 0;
    }
    work += bands[i].work;
  }
  if (first < bands.size()) groups.push_back(bands.subspan(first));
  return groups;
}

}  // namespace widestereo
