// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

namespace widestereo {

/// The value that `share` (in [0, 1]) of the others are not above; 0 of none. Reorders the values.
template <class T>
T percentile(std::vector<T>& values, double share) {
  if (values.empty()) return 0;
  const auto nth =
      values.begin() + static_cast<long>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// The mean of the two middle values of an even number, as scores are usually given; percentile()
/// takes the lower. NaN of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

}  // namespace widestereo
