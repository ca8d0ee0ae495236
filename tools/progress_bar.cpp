// SPDX-License-Identifier: MIT
#include "progress_bar.h"

#include <unistd.h>

#include <cstdio>
#include <utility>

ProgressBar::ProgressBar(std::string label)
    : label_(std::move(label)), terminal_(isatty(STDERR_FILENO) != 0) {}

ProgressBar::~ProgressBar() {
  if (terminal_) std::fprintf(stderr, "\r\033[K");
}

void ProgressBar::show(double share) {
  const auto now = Clock::now();
  if (!terminal_ || now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double left = share > 0 ? elapsed * (1 - share) / share : 0;
  constexpr int width = 30;
  const int filled = static_cast<int>(share * width);
  std::fprintf(stderr, "\r\033[K%s [%s%s] %3.0f %%  %.0f s left", label_.c_str(),
               std::string(filled, '#').c_str(), std::string(width - filled, '.').c_str(),
               100 * share, left);
}

std::function<void(double)> ProgressBar::part(std::size_t done, std::size_t count) {
  if (!visible()) return {};
  return [this, done, count](double share) {
    show((static_cast<double>(done) + share) / static_cast<double>(count));
  };
}
