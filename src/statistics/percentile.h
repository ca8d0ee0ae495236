// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
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

}  // namespace widestereo
