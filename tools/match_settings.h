// SPDX-License-Identifier: MIT
// The command line's options of matching, shared by all commands that match.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/device.h"
#include "widestereo/options.h"

/// Turn the names of an option into its values.
CLI::Validator warp_names();
CLI::Validator filter_names();

/// Values given on the command line; the rest comes from the preset.
struct MatchSettings {
  std::string preset = "quality";
  widestereo::DeviceRequest device;
  std::optional<double> min_distance, max_distance;
  std::optional<int> window_radius, first_iterations, second_iterations, refinements, best_sources;
  std::optional<std::uint32_t> seed;
  std::optional<double> min_texture, min_visible, max_cost, min_parallax, max_tilt, min_support,
      ambiguity_margin, far_preference;
  std::optional<int> vote_radius, repair_radius, fill_radius;
  std::optional<double> consistency_relative, consistency_pixels;
  std::optional<int> levels, sweep_steps, regression_radius, regression_steps, warm_iterations,
      warm_regressions;
  std::optional<double> weight_scale, regression_scale, regression_precision, step_pixels,
      step_normal;
  std::optional<bool> subpixel_match, source_planes;
  std::optional<std::vector<int>> level_iterations, level_regressions;
  std::optional<widestereo::PatchPattern> pattern;
  std::optional<widestereo::PatchWarp> warp;
  std::optional<widestereo::Interpolation> interpolation;
  std::optional<widestereo::Filter> filter;
  std::optional<widestereo::DistanceSampling> sampling;
  std::optional<widestereo::Propagation> propagation;

  /// Adds --preset, --device and one option for each parameter.
  void add_to(CLI::App& command);
  /// The same and those of frames started from the previous one.
  void add_for_sequences_to(CLI::App& command);
  /// The preset with the given values in place.
  widestereo::Options options() const;

 private:
  /// Throws Error where a given option is not one of the preset's search.
  void require_effect(const widestereo::Options& options) const;
};
