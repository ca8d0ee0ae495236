// SPDX-License-Identifier: MIT
#include "calibration_output.h"

#include "widestereo/calibration.h"

namespace ws = widestereo;

void CalibrationOutput::add_format_to(CLI::App& command) {
  command.add_option("--to", format, "kalibr or basalt")
      ->check(CLI::IsMember({"kalibr", "basalt"}))
      ->capture_default_str();
}

void CalibrationOutput::write(const ws::Rig& rig) const {
  if (format == "kalibr") {
    ws::write_kalibr(file, rig);
  } else {
    ws::write_basalt(file, rig);
  }
}
