// SPDX-License-Identifier: MIT
// The command line's options of a calibration that is written.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "widestereo/rig.h"

struct CalibrationOutput {
  std::string file, format;

  /// Adds --to.
  void add_format_to(CLI::App& command);
  /// Throws Error where write() would for the rig, not for the file.
  void require_form(const widestereo::Rig& rig) const;
  /// As write_kalibr(), write_basalt() or write_opencv() does.
  void write(const widestereo::Rig& rig) const;

 private:
  std::string text(const widestereo::Rig& rig) const;
};
