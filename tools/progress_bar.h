// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
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

 private:
  using Clock = std::chrono::steady_clock;
  std::string label_;
  bool terminal_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point last_{};
};
