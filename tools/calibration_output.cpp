// SPDX-License-Identifier: MIT
#include "calibration_output.h"

#include "widestereo/calibration.h"
#include "widestereo/files.h"

namespace ws = widestereo;

void CalibrationOutput::add_format_to(CLI::App& command) {
  command.add_option("--to", format, "kalibr or basalt")
      ->check(CLI::IsMember({"kalibr", "basalt"}))
      ->capture_default_str();
}

void CalibrationOutput::require_form(const ws::Rig& rig) const { (void)text(rig); }

void CalibrationOutput::write(const ws::Rig& rig) const { ws::write_text(file, text(rig)); }

std::string CalibrationOutput::text(const ws::Rig& rig) const {
  return format == "kalibr" ? ws::kalibr_text(file, rig) : ws::basalt_text(file, rig);
}
