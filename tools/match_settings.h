// SPDX-License-Identifier: MIT
// The command line's options of matching, shared by all commands that match.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/device.h"
#include "widestereo/options.h"

/// Values given on the command line; the rest comes from the preset.
struct MatchSettings {
  std::string preset = "quality";
  widestereo::DeviceRequest device;
  std::optional<double> min_distance, max_distance;

  /// Adds --preset, --device and one option for each parameter; those of frames started from the
  /// previous one where there is an option that excludes them, `no_warm_start`. These settings must
  /// stay where they are until the command line is parsed.
  void add_to(CLI::App& command, CLI::Option* no_warm_start = nullptr);
  /// The preset with the given values in place.
  widestereo::Options options() const;
  /// --filter device was given, rather than left to the preset.
  bool asks_for_device_filter() const;

 private:
  struct Parameter {
    std::string name;                                ///< of the option
    std::optional<widestereo::SearchMethod> search;  ///< the only one that has it
    std::function<void(widestereo::Options&)> set;
  };

  bool is_given(const std::string& name) const;
  /// Throws Error where a given option is not one of the preset's search.
  void require_effect(const widestereo::Options& options) const;

  std::vector<Parameter> given_;
};
