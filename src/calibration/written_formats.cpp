// SPDX-License-Identifier: MIT
#include <string>

#include "calibration/formats.h"

namespace widestereo::calibration {

std::string no_form(const View& view, CalibrationFormat format, const std::string& more) {
  struct Written {
    CalibrationFormat format;
    const char* name;
    bool (*has_form)(const Camera& camera);
  };
  static constexpr Written all[] = {{CalibrationFormat::kalibr, "Kalibr's", has_kalibr_form},
                                    {CalibrationFormat::basalt, "Basalt's", has_basalt_form},
                                    {CalibrationFormat::opencv, "OpenCV's", has_opencv_form}};
  std::string name, others;
  for (const Written& written : all) {
    if (written.format == format) {
      name = written.name;
    } else if (written.has_form(view.camera)) {
      others += (others.empty() ? "" : " or ") + std::string(written.name);
    }
  }
  return view.name + " (" + to_string(view.camera.model) + (more.empty() ? "" : " with " + more) +
         ") has no form in " + name + " format; " +
         (others.empty() ? "no other that is written has one, so keep the file that it is from."
                         : "choose " + others + ".");
}

}  // namespace widestereo::calibration
