// SPDX-License-Identifier: MIT
#pragma once

namespace widestereo {

/// A normal distribution's standard deviation in median absolute deviations.
constexpr double deviations_per_median = 1.4826;

/// Geman and McClure's estimator: a residual, of things with this standard deviation, counts with
/// 1 / doubt^2 in a normal equation and costs residual^2 / doubt, so that outliers count for
/// little.
inline double doubt_of(double residual, double deviation) {
  return 1 + residual * residual / (4 * deviation * deviation);
}

}  // namespace widestereo
