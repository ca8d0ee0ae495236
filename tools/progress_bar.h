// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <string>

/// A line on standard error with the share done and the time left; silent unless that is a
/// terminal.
class ProgressBar {
 public:
  explicit ProgressBar(std::string label);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;
  /// Whether anyone sees it.
  bool visible() const { return terminal_; }
  /// `share` in [0, 1].
  void show(double share);
  /// Shows the share done of the one after `done` of `count` equal parts. Empty where nobody sees
  /// it: a device need not wait between kernels then.
  std::function<void(double)> part(std::size_t done, std::size_t count);

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  bool terminal_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_{};
};
