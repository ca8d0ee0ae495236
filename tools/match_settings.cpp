// SPDX-License-Identifier: MIT
#include "match_settings.h"

#include <initializer_list>
#include <map>
#include <utility>

#include "widestereo/error.h"

using widestereo::DistanceSampling;
using widestereo::Filter;
using widestereo::Interpolation;
using widestereo::Options;
using widestereo::PatchPattern;
using widestereo::PatchWarp;
using widestereo::Propagation;

namespace {

constexpr const char* matching = "Matching";

template <class T>
void take(T& target, const std::optional<T>& given) {
  if (given) target = *given;
}

}  // namespace

CLI::Validator warp_names() {
  return CLI::CheckedTransformer(
      std::map<std::string, PatchWarp>{{"exact", PatchWarp::exact},
                                       {"affine", PatchWarp::affine},
                                       {"quadratic", PatchWarp::quadratic}});
}

CLI::Validator filter_names() {
  return CLI::CheckedTransformer(
      std::map<std::string, Filter>{{"exact", Filter::exact}, {"device", Filter::device}});
}

void MatchSettings::add_to(CLI::App& command) {
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

  const auto add = [&](const std::string& name, auto& target, const std::string& help) {
    return command.add_option(name, target, help)->group(matching);
  };
  command.add_option("--preset", preset, "Parameters to start from")
      ->check(CLI::IsMember(Options::preset_names()))
      ->capture_default_str()
      ->group(matching);
  add("--min-distance", min_distance, "Nearest distance along the ray, metres");
  add("--max-distance", max_distance, "Farthest distance along the ray, metres");
  add("--seed", seed, "Seed of the random numbers");
  add("--window-radius", window_radius, "Patch of (2 r + 1)^2 pixels");
  add("--warp", warp, "How a patch is mapped: exact, affine or quadratic")->transform(warp_names());
  add("--sampling", sampling, "How distances are drawn: uniform or inverse")
      ->transform(CLI::CheckedTransformer(std::map<std::string, DistanceSampling>{
          {"uniform", DistanceSampling::uniform}, {"inverse", DistanceSampling::inverse}}));
  add("--propagation", propagation, "Order of pixels: checkerboard, or raster (CPU only)")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Propagation>{
          {"checkerboard", Propagation::checkerboard}, {"raster", Propagation::raster}}));
  add("--iterations", first_iterations, "Preset paper: iterations of the first view");
  add("--second-iterations", second_iterations, "Preset paper: iterations of every further view");
  add("--refinements", refinements, "Preset paper: random perturbations per pixel and iteration");
  add("--pattern", pattern, "Pixels of a patch that are compared: dense or checkerboard")
      ->transform(CLI::CheckedTransformer(std::map<std::string, PatchPattern>{
          {"dense", PatchPattern::dense}, {"checkerboard", PatchPattern::checkerboard}}));
  add("--weight-scale", weight_scale, "Intensity scale of patch weights, grey levels; 0 = none");
  add("--interpolation", interpolation,
      "Intensities halfway between a source's pixels: linear or cubic")
      ->transform(CLI::CheckedTransformer(std::map<std::string, Interpolation>{
          {"linear", Interpolation::linear}, {"cubic", Interpolation::cubic}}));
  add("--filter", filter, "Bilinear samples of those: exact, or device (texture units of a GPU)")
      ->transform(filter_names());
  add("--levels", levels, "Levels of the image pyramid");
  add("--sweep-steps", sweep_steps, "Inverse distances tried at the coarsest level");
  add("--level-iterations", level_iterations, "Iterations of each level, coarsest first")
      ->delimiter(',');
  add("--level-regressions", level_regressions, "Plane regressions of each level, coarsest first")
      ->delimiter(',');
  add("--regression-radius", regression_radius, "Radius of the plane regression, pixels");
  add("--regression-steps", regression_steps,
      "Steps in that radius of the grid of neighbours that count");
  add("--regression-scale", regression_scale, "Intensity scale of the regression, grey levels");
  add("--regression-precision", regression_precision,
      "Precision that lets the regression do with a smaller neighbourhood, pixels; falls from "
      "round to round");
  add("--subpixel-match", subpixel_match,
      "The first regression of a level averages sub-pixel matches: true or false");
  add("--repair-radius", repair_radius,
      "Rejected pixels try planes up to this many pixels away after each regression; 0 = do not");
  add("--vote-radius", vote_radius,
      "Then pixels take the plane for which planes up to this many pixels away and the other "
      "view's intensities speak most; 0 = do not");
  add("--far-preference", far_preference,
      "Share of its cost by which the nearest planes must match better than the farthest, which "
      "keeps sky far");
  add("--step-pixels", step_pixels, "First perturbation in the source, pixels");
  add("--step-normal", step_normal, "First perturbation of a unit normal, at the coarsest level");
  add("--source-planes", source_planes, "Try the source views' own planes: true or false");
  add("--best-sources", best_sources, "Cost = mean over this many best source views");
  add("--min-texture", min_texture, "Smallest standard deviation of a patch, grey levels of 255");
  add("--min-visible", min_visible, "Share of a patch that must be seen in the source");

  const std::string checks = "Checks";
  const auto add_check = [&](const std::string& name, auto& target, const std::string& help) {
    command.add_option(name, target, help)->group(checks);
  };
  add_check("--consistency-relative", consistency_relative,
            "Left-right check: largest relative difference of distance");
  add_check("--consistency-pixels", consistency_pixels,
            "Left-right check: largest displacement, pixels");
  add_check("--max-cost", max_cost, "Largest matching cost 1 - ZNCC");
  add_check("--min-parallax", min_parallax, "Smallest parallax over the distance range, pixels");
  add_check("--max-tilt", max_tilt, "Largest angle between normal and viewing ray, degrees");
  add_check("--min-support", min_support,
            "Share of the planes around that must support a pixel's own; fewer are a speckle");
  add_check("--ambiguity-margin", ambiguity_margin,
            "Reject where another place costs less by more than this; 0 = not checked");
  add_check("--fill-radius", fill_radius,
            "Fill rejected pixels from accepted ones up to this many pixels away; 0 = do not");
}

void MatchSettings::add_for_sequences_to(CLI::App& command) {
  add_to(command);
  command
      .add_option("--warm-iterations", warm_iterations,
                  "Iterations of a frame started from the previous one")
      ->group(matching);
  command.add_option("--warm-regressions", warm_regressions, "Plane regressions of such a frame")
      ->group(matching);
}

void MatchSettings::require_effect(const Options& options) const {
  using Given = std::initializer_list<std::pair<const char*, bool>>;
  const Given of_random = {{"--iterations", first_iterations.has_value()},
                           {"--second-iterations", second_iterations.has_value()},
                           {"--refinements", refinements.has_value()},
                           {"--sampling", sampling.has_value()},
                           {"--propagation raster", options.propagation == Propagation::raster}};
  const Given of_pyramid = {{"--levels", levels.has_value()},
                            {"--sweep-steps", sweep_steps.has_value()},
                            {"--level-iterations", level_iterations.has_value()},
                            {"--level-regressions", level_regressions.has_value()},
                            {"--regression-radius", regression_radius.has_value()},
                            {"--regression-steps", regression_steps.has_value()},
                            {"--regression-scale", regression_scale.has_value()},
                            {"--regression-precision", regression_precision.has_value()},
                            {"--subpixel-match", subpixel_match.has_value()},
                            {"--repair-radius", repair_radius.has_value()},
                            {"--vote-radius", vote_radius.has_value()},
                            {"--step-pixels", step_pixels.has_value()},
                            {"--step-normal", step_normal.has_value()},
                            {"--source-planes", source_planes.has_value()},
                            {"--warm-regressions", warm_regressions.has_value()}};
  const bool is_pyramid = options.search == widestereo::SearchMethod::pyramid;
  for (const auto& [name, given] : is_pyramid ? of_random : of_pyramid) {
    if (!given) continue;
    throw widestereo::Error(std::string(name) + " has no effect with the preset " + options.preset +
                            "; leave it out, or choose --preset " +
                            (is_pyramid ? "paper." : "fast or quality."));
  }
}

Options MatchSettings::options() const {
  Options options = Options::preset_named(preset);
  take(options.min_distance, min_distance);
  take(options.max_distance, max_distance);
  take(options.seed, seed);
  take(options.window_radius, window_radius);
  take(options.warp, warp);
  take(options.sampling, sampling);
  take(options.propagation, propagation);
  take(options.first_iterations, first_iterations);
  take(options.second_iterations, second_iterations);
  take(options.refinements, refinements);
  take(options.pattern, pattern);
  take(options.weight_scale, weight_scale);
  take(options.interpolation, interpolation);
  take(options.filter, filter);
  take(options.levels, levels);
  take(options.sweep_steps, sweep_steps);
  take(options.level_iterations, level_iterations);
  take(options.level_regressions, level_regressions);
  take(options.regression_radius, regression_radius);
  take(options.regression_steps, regression_steps);
  take(options.regression_scale, regression_scale);
  take(options.regression_precision, regression_precision);
  take(options.subpixel_match, subpixel_match);
  take(options.vote_radius, vote_radius);
  take(options.repair_radius, repair_radius);
  take(options.far_preference, far_preference);
  take(options.step_pixels, step_pixels);
  take(options.step_normal, step_normal);
  take(options.source_planes, source_planes);
  take(options.warm_iterations, warm_iterations);
  take(options.warm_regressions, warm_regressions);
  take(options.best_sources, best_sources);
  take(options.min_texture, min_texture);
  take(options.min_visible, min_visible);
  take(options.max_cost, max_cost);
  take(options.min_parallax, min_parallax);
  take(options.max_tilt, max_tilt);
  take(options.min_support, min_support);
  take(options.ambiguity_margin, ambiguity_margin);
  take(options.fill_radius, fill_radius);
  take(options.consistency_relative, consistency_relative);
  take(options.consistency_pixels, consistency_pixels);
  require_effect(options);
  validate(options);
  return options;
}
