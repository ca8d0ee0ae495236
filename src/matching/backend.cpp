// SPDX-License-Identifier: MIT
#include "matching/backend.h"

#include <algorithm>
#include <string>

#include "geometry/validation.h"
#include "widestereo/error.h"

namespace widestereo {

void KernelTimes::add(Kernel kernel, int dispatches, double milliseconds) {
  const char* name = to_string(kernel);
  auto entry = std::find_if(times_.begin(), times_.end(),
                            [name](const KernelTime& time) { return time.kernel == name; });
  if (entry == times_.end()) entry = times_.insert(entry, KernelTime{.kernel = name});
  entry->dispatches += dispatches;
  entry->milliseconds += milliseconds;
}

double Backend::device_milliseconds() const {
  double sum = 0;
  for (const KernelTime& time : times()) sum += time.milliseconds;
  return sum;
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

std::size_t largest_area(const std::vector<cv::Size>& sizes) {
  std::size_t largest = 0;
  for (const cv::Size& size : sizes) largest = std::max(largest, area(size));
  return largest;
}

void require_map(const cv::Mat& map, int view, cv::Size size, int type) {
  require_map(map, size, type, "The map for view " + std::to_string(view));
}

void require_constants(const Schedule& schedule, const KernelConstants& constants) {
  if (schedule.constants == constants) return;
  throw Error(
      "The schedule was made for other kernel constants than this matcher; make a new one.");
}

}  // namespace widestereo
