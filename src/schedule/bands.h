// SPDX-License-Identifier: MIT
// Cutting a schedule into pieces short enough for the watchdogs of drivers and operating systems.
#pragma once

#include <span>
#include <vector>

#include "schedule/schedule.h"

namespace widestereo {

/// Some rows of a dispatch.
struct Band {
  const Dispatch* dispatch = nullptr;
  int first_row = 0;
  int last_row = 0;       ///< one past the last
  long long samples = 0;  ///< its part of the dispatch's patch samples
  long long work = 0;     ///< with what else it does at most, in samples that take as long
};

/// Bands of at most `max_work` (but at least one row) in the schedule's order. They point into
/// `schedule`. The bands of one dispatch do not depend on each other.
std::vector<Band> split_into_bands(const Schedule& schedule, long long max_work);

/// Groups consecutive bands for submission: at most `max_work` (but at least one band) and at most
/// `max_bands` bands in each.
std::vector<std::span<const Band>> group_for_submission(std::span<const Band> bands,
                                                        long long max_work, std::size_t max_bands);

/// `groups` groups of consecutive bands of about the same work, of which some may be empty.
std::vector<std::span<const Band>> share_out(std::span<const Band> bands, std::size_t groups);

}  // namespace widestereo
