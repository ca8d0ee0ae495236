// SPDX-License-Identifier: MIT
#include "match_settings.h"

#include <algorithm>
#include <type_traits>

#include "option_checks.h"
#include "schedule/option_names.h"
#include "text/number.h"
#include "widestereo/error.h"

using widestereo::Options;
using widestereo::SearchMethod;

namespace {

/// Keeps the numbers of the finest levels.
void fit_to_levels(std::vector<int>& finest_last, int levels) {
  const std::ptrdiff_t more = std::ssize(finest_last) - levels;
  if (levels > 0 && more > 0) finest_last.erase(finest_last.begin(), finest_last.begin() + more);
}

}  // namespace

void MatchSettings::add_to(CLI::App& command, CLI::Option* no_warm_start) {
  const std::string devices = "Device";
  command
      .add_option("--device", device.device,
                  "auto, cpu, cuda or vulkan, either of these two also with :INDEX, :NAME PART or "
                  ":UUID")
      ->capture_default_str()
      ->group(devices);
  command.add_flag("--validation", device.validation, "Vulkan: run with validation layers")
      ->group(devices);
  command
      .add_option("--pipeline-cache", device.pipeline_cache,
                  "Vulkan: file that keeps compiled pipelines between runs")
      ->group(devices);
  command
      .add_option("--max-samples-per-dispatch", device.max_samples_per_dispatch,
                  "GPUs: longest dispatch in patch samples, 0 = by device")
      ->check(CLI::Range(0L, 1'000'000'000'000L))
      ->group(devices);

  const std::string matching = "Matching";
  command.add_option("--preset", preset, "Parameters to start from")
      ->check(CLI::IsMember(Options::preset_names()))
      ->capture_default_str()
      ->group(matching);
  const auto otherwise = [](double distance) {
    return "; " + widestereo::text_of(distance) +
           " unless the points of a COLMAP model or the demo's scene tell it";
  };
  command
      .add_option("--min-distance", min_distance,
                  "Nearest distance along the ray, metres" + otherwise(Options().min_distance))
      ->group(matching);
  command
      .add_option("--max-distance", max_distance,
                  "Farthest distance along the ray, metres" + otherwise(Options().max_distance))
      ->group(matching);
  // Of parameters that one method of search alone has, or all.
  const auto adder = [&](const std::string& group, std::optional<SearchMethod> search = {}) {
    return [=, this, &command]<class T>(const std::string& name, T Options::*parameter,
                                        const std::string& help) {
      const auto take = [=, this](const T& value) {
        given_.push_back({name, search, [=](Options& options) { options.*parameter = value; }});
      };
      CLI::Option* option = command.add_option_function<T>(name, take, help)->group(group);
      return std::is_enum_v<T> ? option->type_name("TEXT") : option;
    };
  };
  const auto add = adder(matching);
  const auto add_random = adder(matching, SearchMethod::random);
  const auto add_pyramid = adder(matching, SearchMethod::pyramid);
  add("--seed", &Options::seed, "Seed of the random numbers");
  add("--window-radius", &Options::window_radius, "Patch of (2 r + 1)^2 pixels");
  add("--warp", &Options::warp, "How a patch is mapped")
      ->transform(name_among(widestereo::warp_names));
  add_random("--sampling", &Options::sampling, "How distances are drawn")
      ->transform(name_among(widestereo::sampling_names));
  add("--propagation", &Options::propagation, "Order of pixels; raster on the CPU only")
      ->transform(name_among(widestereo::propagation_names));
  add_random("--iterations", &Options::first_iterations,
             "Preset paper: iterations of the first view");
  add_random("--second-iterations", &Options::second_iterations,
             "Preset paper: iterations of every further view");
  add_random("--refinements", &Options::refinements,
             "Preset paper: random perturbations per pixel and iteration");
  add("--pattern", &Options::pattern, "Pixels of a patch that are compared")
      ->transform(name_among(widestereo::pattern_names));
  add("--weight-scale", &Options::weight_scale,
      "Intensity scale of patch weights, grey levels; 0 = none");
  add("--interpolation", &Options::interpolation, "Intensities halfway between a source's pixels")
      ->transform(name_among(widestereo::interpolation_names));
  add("--filter", &Options::filter, "Bilinear samples of those; device: by a GPU's texture units")
      ->transform(name_among(widestereo::filter_names));
  add_pyramid("--levels", &Options::levels,
              "Levels of the image pyramid; 0 = by the size of the images");
  add_pyramid("--sweep-steps", &Options::sweep_steps,
              "Inverse distances tried at the coarsest level");
  add_pyramid("--level-iterations", &Options::level_iterations,
              "Iterations of each level, finest last, the first also of coarser ones (by comma)")
      ->delimiter(',');
  add_pyramid("--level-regressions", &Options::level_regressions,
              "Plane regressions of each level, likewise (by comma)")
      ->delimiter(',');
  add_pyramid("--regression-radius", &Options::regression_radius,
              "Radius of the plane regression, pixels");
  add_pyramid("--regression-steps", &Options::regression_steps,
              "Steps in that radius of the grid of neighbours that count");
  add_pyramid("--regression-scale", &Options::regression_scale,
              "Intensity scale of the regression, grey levels");
  add_pyramid(
      "--regression-precision", &Options::regression_precision,
      "Precision that lets the regression do with a smaller neighbourhood, pixels; falls from "
      "round to round");
  add_pyramid("--subpixel-match", &Options::subpixel_match,
              "The first regression of a level averages sub-pixel matches: true or false");
  add_pyramid(
      "--repair-radius", &Options::repair_radius,
      "Rejected pixels try planes up to this many pixels away after each regression; 0 = do not");
  add_pyramid(
      "--vote-radius", &Options::vote_radius,
      "Then pixels take the plane for which planes up to this many pixels away and the other "
      "view's intensities speak most; 0 = do not");
  add_pyramid("--merge-views", &Options::merge_views,
              "Then planes of different views that agree are averaged: true or false");
  add_pyramid(
      "--normal-vote", &Options::normal_vote,
      "At the end pixels take the normal that most planes around agree with: true or false");
  add("--far-preference", &Options::far_preference,
      "Share of its cost by which the nearest planes must match better than the farthest, which "
      "keeps sky far");
  add_pyramid("--step-pixels", &Options::step_pixels, "First perturbation in the source, pixels");
  add_pyramid("--step-normal", &Options::step_normal,
              "First perturbation of a unit normal, at the coarsest level");
  add_pyramid("--source-planes", &Options::source_planes,
              "Try the source views' own planes in the last iteration: true or false");
  add_pyramid("--coarse-planes", &Options::coarse_planes,
              "Planes of coarser pixels that a finer one starts from the best of, 1 to 4");
  add_pyramid("--alternate-strips", &Options::alternate_strips,
              "Iterations try far and near pixels' planes by turns, not both: true or false");
  if (no_warm_start != nullptr) {
    add("--warm-iterations", &Options::warm_iterations,
        "Iterations of a frame started from the previous one")
        ->excludes(no_warm_start);
    add_pyramid("--warm-regressions", &Options::warm_regressions,
                "Plane regressions of such a frame")
        ->excludes(no_warm_start);
  }
  add("--best-sources", &Options::best_sources, "Cost = mean over this many best source views");
  add("--max-gain", &Options::max_gain,
      "Largest factor by which images of little contrast, as dark ones, are stretched; 1 = none");
  add("--min-texture", &Options::min_texture,
      "Smallest standard deviation of a patch, grey levels of 255");
  add("--min-visible", &Options::min_visible, "Share of a patch that must be seen in the source");

  const auto add_check = adder("Checks");
  add_check("--consistency-relative", &Options::consistency_relative,
            "Left-right check: largest relative difference of distance");
  add_check("--consistency-pixels", &Options::consistency_pixels,
            "Left-right check: largest displacement, pixels");
  add_check("--max-cost", &Options::max_cost, "Largest matching cost 1 - ZNCC");
  add_check("--min-parallax", &Options::min_parallax,
            "Smallest parallax over the distance range, pixels");
  add_check("--max-tilt", &Options::max_tilt,
            "Largest angle between normal and viewing ray, degrees");
  add_check("--min-support", &Options::min_support,
            "Share of the planes around that must support a pixel's own; fewer are a speckle");
  add_check("--min-confidence", &Options::min_confidence,
            "Smallest probability to lie within 2 px of the true place");
  add_check("--ambiguity-margin", &Options::ambiguity_margin,
            "Reject where another place costs less by more than this; 0 = not checked");
  add_check("--fill-radius", &Options::fill_radius,
            "Fill rejected pixels from accepted ones up to this many pixels away; 0 = do not");
}

bool MatchSettings::is_given(const std::string& name) const {
  return std::any_of(given_.begin(), given_.end(),
                     [&name](const Parameter& parameter) { return parameter.name == name; });
}

void MatchSettings::require_effect(const Options& options) const {
  const auto refuse = [&options](const std::string& option) {
    throw widestereo::Error(
        option + " has no effect with the preset " + options.preset +
        "; leave it out, or choose --preset " +
        (options.search == SearchMethod::pyramid ? "paper." : "fast or quality."));
  };
  for (const Parameter& parameter : given_) {
    if (parameter.search && parameter.search != options.search) refuse(parameter.name);
  }
}

Options MatchSettings::options() const {
  Options options = Options::preset_named(preset);
  if (min_distance) options.min_distance = *min_distance;
  if (max_distance) options.max_distance = *max_distance;
  for (const Parameter& parameter : given_) parameter.set(options);
  for (const auto& [name, of_levels] :
       {std::pair("--level-iterations", &options.level_iterations),
        std::pair("--level-regressions", &options.level_regressions)}) {
    if (!is_given(name)) fit_to_levels(*of_levels, options.levels);
  }
  require_effect(options);
  validate(options);
  return options;
}

bool MatchSettings::asks_for_device_filter() const {
  Options options;
  options.filter = widestereo::Filter::exact;
  for (const Parameter& parameter : given_) parameter.set(options);
  return options.filter == widestereo::Filter::device;
}
