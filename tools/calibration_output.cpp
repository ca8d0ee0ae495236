// SPDX-License-Identifier: MIT
#include "calibration_output.h"

#include <filesystem>

#include "widestereo/calibration.h"
#include "widestereo/files.h"

namespace ws = widestereo;

namespace {

constexpr const char* kalibr = "kalibr";
constexpr const char* basalt = "basalt";
constexpr const char* opencv = "opencv";

}  // namespace

void CalibrationOutput::add_format_to(CLI::App& command) {
  command
      .add_option(
          "--to", format,
          "kalibr, basalt or opencv; by default basalt where the file ends in .json, else kalibr")
      ->check(CLI::IsMember({kalibr, basalt, opencv}));
}

void CalibrationOutput::require_form(const ws::Rig& rig) const { (void)text(rig); }

void CalibrationOutput::write(const ws::Rig& rig) const { ws::write_text(file, text(rig)); }

std::string CalibrationOutput::text(const ws::Rig& rig) const {
  const bool ends_in_json = std::filesystem::path(file).extension() == ".json";
  const std::string used = !format.empty() ? format : ends_in_json ? basalt : kalibr;
  if (used == opencv) return ws::opencv_text(file, rig);
  return used == kalibr ? ws::kalibr_text(file, rig) : ws::basalt_text(file, rig);
}
