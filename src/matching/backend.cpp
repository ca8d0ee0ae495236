// SPDX-License-Identifier: MIT
#include "matching/backend.h"

#include <algorithm>

namespace widestereo {

void KernelTimes::add(Kernel kernel, int dispatches, double milliseconds) {
  const char* name = to_string(kernel);
  auto entry = std::find_if(times_.begin(), times_.end(),
                            [name](const KernelTime& time) { return time.kernel == name; });
  if (entry == times_.end()) entry = times_.insert(entry, KernelTime{.kernel = name});
  entry->dispatches += dispatches;
  entry->milliseconds += milliseconds;
}

ScheduleProgress::ScheduleProgress(const Schedule& schedule, const Matcher::Progress& progress)
    : progress_(progress) {
  for (const Dispatch& dispatch : schedule.dispatches) total_ += dispatch.samples;
}

void ScheduleProgress::advance(long long samples) {
  done_ += samples;
  if (progress_ && samples > 0) {
    progress_(static_cast<double>(done_) / static_cast<double>(total_));
  }
}

}  // namespace widestereo
