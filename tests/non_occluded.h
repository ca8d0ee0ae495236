// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "widestereo/evaluation.h"

namespace widestereo::test {

/// The scores of the pixels that the source sees; none, and a failure, where these are not known.
inline RegionScores non_occluded(const std::vector<RegionScores>& scores) {
  const auto found = std::find_if(scores.begin(), scores.end(), [](const RegionScores& region) {
    return region.region == "non-occluded";
  });
  if (found != scores.end()) return *found;
  ADD_FAILURE() << "Nothing tells which pixels the source sees.";
  return {};
}

}  // namespace widestereo::test
