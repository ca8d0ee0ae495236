// SPDX-License-Identifier: MIT
#include "schedule/bands.h"

#include <algorithm>

#include "schedule/work.h"

namespace widestereo {
namespace {

constexpr long long rows_of_workgroup = 16;  // a multiple of every back end's

/// Samples of the search that take as long as a neighbour of a regression, or one whose plane votes
/// for the candidates, by their operations; fewer do on software Vulkan.
constexpr long long samples_of_neighbour = 4;
constexpr long long samples_of_voter = 6;

/// Neighbours of a pixel that no neighbourhood determines, which is asked in every round.
long long neighbours_of_regression(const kernel::PassParameters& pass) {
  const long long side = side_of_fit(pass.radius, pass.steps);
  return side * side * (pass.deviation > 0 ? REGRESSION_ROUNDS : NORMAL_ROUNDS);
}

/// Of a pixel, for which a grid of this radius and these steps votes, in samples.
long long work_of_voters(long long radius, long long step, long long row_step) {
  return samples_of_voter * (2 * radius / step + 1) * (2 * radius / row_step + 1);
}

/// Those that a pixel passes to the edge of the image or of the radius, which none may be accepted
/// in.
long long pixels_on_eight_rays(const Dispatch& dispatch) {
  return 8LL * std::min(dispatch.pass.radius, std::max(dispatch.width, dispatch.height));
}

/// Of a dispatch, in samples; a kernel without patches may still look at every pixel's window.
long long estimated_work(const Dispatch& dispatch, const KernelConstants& constants) {
  const long long side = 2 * constants.window_radius + 1;
  const long long of_windows = side * side * dispatch.pixels;
  switch (dispatch.kernel) {
    case Kernel::regress:
      return samples_of_neighbour * neighbours_of_regression(dispatch.pass) * dispatch.pixels;
    case Kernel::vote:
      return dispatch.samples +
             work_of_voters(dispatch.pass.radius, VOTE_STEP, VOTE_ROW_STEP) * dispatch.pixels;
    case Kernel::vote_normal:
      return work_of_voters(NORMAL_VOTE_RADIUS, NORMAL_VOTE_STEP, NORMAL_VOTE_STEP) *
             dispatch.pixels;
    case Kernel::check:
    case Kernel::check_for_vote:
      return dispatch.samples + of_windows;
    case Kernel::fill:
      return of_windows + pixels_on_eight_rays(dispatch) * dispatch.pixels;
    default:
      return dispatch.samples > 0 ? dispatch.samples : of_windows;
  }
}

/// total * rows / height, whose product may be more than the type holds.
long long share_of(long long total, long long rows, long long height) {
  return total / height * rows + total % height * rows / height;
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
        return share_of(total, last, height) - share_of(total, first, height);
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

std::vector<std::span<const Band>> share_out(std::span<const Band> bands, std::size_t groups) {
  long long left = 0;
  for (const Band& band : bands) left += band.work;
  std::vector<std::span<const Band>> parts;
  for (; groups > 0; --groups) {
    // The last group takes the rest, and so do bands that lie for the most part in this one.
    const long long share = left / static_cast<long long>(groups);
    long long work = 0;
    std::size_t count = 0;
    while (count < bands.size() && (groups == 1 || work + bands[count].work / 2 < share)) {
      work += bands[count++].work;
    }
    parts.push_back(bands.first(count));
    bands = bands.subspan(count);
    left -= work;
  }
  return parts;
}

}  // namespace widestereo
