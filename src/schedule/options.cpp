// SPDX-License-Identifier: MIT
#include "widestereo/options.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <type_traits>

#include "schedule/option_names.h"
#include "text/json_text.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

/// JSON has neither NaN nor infinity.
std::string text(double number) {
  if (std::isnan(number)) return "NaN (not a number)";
  if (std::isinf(number)) return number > 0 ? "infinity" : "minus infinity";
  return nlohmann::json(number).dump();
}

std::string text(int number) { return std::to_string(number); }

template <class Number>
void require_between(Number value, std::type_identity_t<Number> low,
                     std::type_identity_t<Number> high, const std::string& name) {
  if (value >= low && value <= high) return;  // false for NaN
  throw Error("The option " + name + " is " + text(value) + "; it must lie between " + text(low) +
              " and " + text(high) + ".");
}

template <class Enumeration>
void require_known(Enumeration value, const EnumeratorNames<Enumeration>& names,
                   const std::string& option) {
  if (!name_of(value, names).empty()) return;
  throw Error("The option " + option + " is " + text(static_cast<int>(value)) +
              ", which no enumerator has; choose one of those in widestereo/options.h.");
}

}  // namespace

Options Options::preset_named(const std::string& name) {
  Options options;
  options.preset = name;
  if (name == "paper") return options;
  options.search = SearchMethod::pyramid;
  options.warp = PatchWarp::affine;
  options.sampling = DistanceSampling::inverse;
  options.window_radius = 3;
  options.interpolation = Interpolation::cubic;
  options.min_texture = 0;
  // What matches badly is judged by its confidence, which knows noise.
  options.max_cost = 2;
  options.min_confidence = 0.7;
  options.far_preference = 0.08;
  options.max_gain = usual_max_gain;
  options.warm_iterations = 1;
  options.pattern = PatchPattern::checkerboard;
  options.alternate_strips = true;
  if (name == "fast") {
    options.sweep_steps = 16;
    options.source_planes = false;
    options.coarse_planes = 2;
    options.regression_steps = 3;
    return options;
  }
  if (name == "quality") {
    options.sweep_steps = 128;
    options.regression_radius = 48;
    options.regression_steps = 8;
    return options;
  }
  std::string known;
  for (const std::string& preset : preset_names()) known += " \"" + preset + "\"";
  throw Error("There is no preset \"" + name + "\"; choose one of" + known + ".");
}

std::vector<std::string> Options::preset_names() { return {"fast", "quality", "paper"}; }

void validate(const Options& o) {
  constexpr double least_ratio = 1 + 1e-5;  // single precision still has both
  if (!(o.min_distance >= Options::least_distance &&
        o.min_distance * least_ratio <= o.max_distance &&
        o.max_distance <= Options::most_distance)) {
    throw Error("The distance range from " + text(o.min_distance) + " to " + text(o.max_distance) +
                " m is not usable: give a nearest distance and a larger "
                "farthest one between " +
                text(Options::least_distance) + " and " + text(Options::most_distance) + " m.");
  }
  require_known(o.search, search_names, "search");
  require_known(o.warp, warp_names, "warp");
  require_known(o.sampling, sampling_names, "sampling");
  require_known(o.propagation, propagation_names, "propagation");
  require_known(o.pattern, pattern_names, "pattern");
  require_known(o.interpolation, interpolation_names, "interpolation");
  require_known(o.filter, filter_names, "filter");
  require_between(o.window_radius, 1, Options::largest_window_radius, "window radius");
  require_between(o.first_iterations, 1, 100000, "first iterations");
  require_between(o.second_iterations, 0, 100000, "second iterations");
  require_between(o.refinements, 0, 16, "refinements");
  if (o.propagation == Propagation::raster && o.search == SearchMethod::pyramid) {
    throw Error(
        "Raster-order propagation belongs to the random search; choose checkerboard propagation, "
        "or the preset \"paper\".");
  }
  require_between(o.best_sources, 1, 8, "best sources");
  require_between(o.weight_scale, 0, 10000, "weight scale");
  require_between(o.levels, 0, Options::most_levels, "levels");
  require_between(o.sweep_steps, 1, 10000, "sweep steps");
  require_between(o.coarse_planes, 1, 4, "coarse planes");
  for (const auto& [values, name] : {std::pair(&o.level_iterations, "level iterations"),
                                     std::pair(&o.level_regressions, "level regressions")}) {
    const int most = o.levels > 0 ? o.levels : Options::most_levels;
    if (values->empty() || values->size() > static_cast<std::size_t>(most)) {
      throw Error(std::string("The option ") + name + " has " + std::to_string(values->size()) +
                  " numbers; give 1 to " + std::to_string(most) +
                  ", that of the finest level last.");
    }
    for (const int value : *values) require_between(value, 0, 1000, name);
  }
  require_between(o.regression_radius, 2, 64, "regression radius");
  require_between(o.regression_steps, 1, 16, "regression steps");
  require_between(o.regression_scale, 0.1, 10000, "regression scale");
  require_between(o.regression_precision, 1e-6, 1000, "regression precision");
  require_between(o.step_pixels, 0, 1000, "step pixels");
  require_between(o.step_normal, 0, 2, "step normal");
  require_between(o.warm_iterations, 0, 100000, "warm iterations");
  require_between(o.warm_regressions, 0, 1000, "warm regressions");
  require_between(o.max_gain, 1, 1000, "max gain");
  require_between(o.min_texture, 0, 255, "min texture");
  require_between(o.min_visible, 0.01, 1, "min visible");
  require_between(o.consistency_relative, 0, 999, "consistency (relative)");
  require_between(o.consistency_pixels, 0, 999, "consistency (pixels)");
  require_between(o.max_cost, 0, 2, "max cost");
  require_between(o.min_parallax, 0, 10000, "min parallax");
  require_between(o.max_tilt, 0, 90, "max tilt");
  require_between(o.min_support, 0, 1, "min support");
  require_between(o.min_confidence, 0, 1, "min confidence");
  require_between(o.ambiguity_margin, 0, 2, "ambiguity margin");
  require_between(o.far_preference, 0, 1, "far preference");
  require_between(o.vote_radius, 0, 64, "vote radius");
  require_between(o.repair_radius, 0, 10000, "repair radius");
  require_between(o.fill_radius, 0, 10000, "fill radius");
}

std::string to_string(Filter filter) { return name_of(filter, filter_names); }

std::string to_json(const Options& o) {
  const nlohmann::ordered_json json = {
      {"preset", o.preset},
      {"min_distance", o.min_distance},
      {"max_distance", o.max_distance},
      {"seed", o.seed},
      {"search", name_of(o.search, search_names)},
      {"window_radius", o.window_radius},
      {"pattern", name_of(o.pattern, pattern_names)},
      {"weight_scale", o.weight_scale},
      {"interpolation", name_of(o.interpolation, interpolation_names)},
      {"filter", name_of(o.filter, filter_names)},
      {"levels", o.levels},
      {"sweep_steps", o.sweep_steps},
      {"level_iterations", o.level_iterations},
      {"level_regressions", o.level_regressions},
      {"regression_radius", o.regression_radius},
      {"regression_steps", o.regression_steps},
      {"regression_scale", o.regression_scale},
      {"regression_precision", o.regression_precision},
      {"subpixel_match", o.subpixel_match},
      {"vote_radius", o.vote_radius},
      {"merge_views", o.merge_views},
      {"normal_vote", o.normal_vote},
      {"repair_radius", o.repair_radius},
      {"far_preference", o.far_preference},
      {"step_pixels", o.step_pixels},
      {"step_normal", o.step_normal},
      {"source_planes", o.source_planes},
      {"coarse_planes", o.coarse_planes},
      {"alternate_strips", o.alternate_strips},
      {"warp", name_of(o.warp, warp_names)},
      {"sampling", name_of(o.sampling, sampling_names)},
      {"propagation", name_of(o.propagation, propagation_names)},
      {"first_iterations", o.first_iterations},
      {"second_iterations", o.second_iterations},
      {"refinements", o.refinements},
      {"best_sources", o.best_sources},
      {"warm_iterations", o.warm_iterations},
      {"warm_regressions", o.warm_regressions},
      {"max_gain", o.max_gain},
      {"min_texture", o.min_texture},
      {"min_visible", o.min_visible},
      {"consistency_relative", o.consistency_relative},
      {"consistency_pixels", o.consistency_pixels},
      {"max_cost", o.max_cost},
      {"min_parallax", o.min_parallax},
      {"max_tilt", o.max_tilt},
      {"min_support", o.min_support},
      {"min_confidence", o.min_confidence},
      {"ambiguity_margin", o.ambiguity_margin},
      {"fill_radius", o.fill_radius}};
  return to_text(json);
}

}  // namespace widestereo
