// SPDX-License-Identifier: MIT
// The words for the options' enumerators: those of records and of the command line.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "widestereo/options.h"

namespace widestereo {

template <class Enumeration>
using EnumeratorNames = std::vector<std::pair<std::string, Enumeration>>;

inline const EnumeratorNames<PatchWarp> warp_names = {{"exact", PatchWarp::exact},
                                                      {"affine", PatchWarp::affine},
                                                      {"quadratic", PatchWarp::quadratic}};
inline const EnumeratorNames<DistanceSampling> sampling_names = {
    {"uniform", DistanceSampling::uniform}, {"inverse", DistanceSampling::inverse}};
inline const EnumeratorNames<PatchPattern> pattern_names = {
    {"dense", PatchPattern::dense}, {"checkerboard", PatchPattern::checkerboard}};
inline const EnumeratorNames<Interpolation> interpolation_names = {
    {"linear", Interpolation::linear}, {"cubic", Interpolation::cubic}};
inline const EnumeratorNames<Filter> filter_names = {{"exact", Filter::exact},
                                                     {"device", Filter::device}};
inline const EnumeratorNames<SearchMethod> search_names = {{"random", SearchMethod::random},
                                                           {"pyramid", SearchMethod::pyramid}};
inline const EnumeratorNames<Propagation> propagation_names = {
    {"checkerboard", Propagation::checkerboard}, {"raster", Propagation::raster}};

/// Empty for what is no enumerator.
template <class Enumeration>
std::string name_of(Enumeration value, const EnumeratorNames<Enumeration>& names) {
  for (const auto& [name, enumerator] : names) {
    if (enumerator == value) return name;
  }
  return "";
}

}  // namespace widestereo
