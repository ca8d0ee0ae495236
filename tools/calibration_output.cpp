// SPDX-License-Identifier: MIT
#include "calibration_output.h"

#include "text/lower_case.h"
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
          "kalibr, basalt or opencv; by default basalt where the file ends in .json, opencv where "
          "it ends in .xml, else kalibr")
      ->check(CLI::IsMember({kalibr, basalt, opencv}));
}

void CalibrationOutput::require_form(const ws::Rig& rig) const { (void)text(rig); }

void CalibrationOutput::write(const ws::Rig& rig) const { ws::write_text(file, text(rig)); }

std::string CalibrationOutput::text(const ws::Rig& rig) const {
  const std::string extension = ws::extension_of(file);
  const std::string of_file = extension == ".json" ? basalt : extension == ".xml" ? opencv : kalibr;
  const std::string& used = format.empty() ? of_file : format;
  if (used == opencv) return ws::opencv_text(file, rig);
  return used == kalibr ? ws::kalibr_text(file, rig) : ws::basalt_text(file, rig);
}
