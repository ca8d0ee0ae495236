// SPDX-License-Identifier: MIT
// How much of a match was accepted, and what it means.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "widestereo/matcher.h"

/// The share of the pixels that have a ray, of those that are not 0 in `pixels`, in [0, 1].
double share_of_usable(const widestereo::ViewResult& view, const cv::Mat& pixels);
/// How much of a view's lens was accepted, in [0, 1].
double accepted_share(const widestereo::ViewResult& view);
/// The mean of the views.
double accepted_share(const std::vector<widestereo::ViewResult>& views);
/// Likewise what another view sees, with texture, within the range of distances, which alone can be
/// accepted.
double overlap_share(const std::vector<widestereo::ViewResult>& views);
/// Of one number in the records of results.
double mean_in(const nlohmann::ordered_json& records, const char* key);
/// How much of what can be accepted is.
double accepted_of_overlap(double accepted, double overlap);

/// Says, on standard error, what to check where so little is accepted of all views that the images
/// hardly fit their calibration, and where it is little because other views see little of it.
void report_little_accepted(double accepted, double overlap, const std::string& first_cause);

/// Says so, on standard error, where much of what was accepted lies at the nearest distance that
/// was looked for.
void report_nearest(const std::vector<widestereo::ViewResult>& views, double min_distance);
