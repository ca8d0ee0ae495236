// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "roofline.h"

/// One configuration's times, all for one depth map.
struct PlotBar {
  std::string label;
  double wall = 0, wall_min = 0, wall_max = 0;  ///< milliseconds, the first a median
  double device = 0;                            ///< milliseconds, 0 where not known
  Roofline roofline;
};

/// An SVG picture of horizontal bars, from zero or, where times differ much, on a logarithmic axis.
std::string benchmark_plot(const std::vector<PlotBar>& bars);
