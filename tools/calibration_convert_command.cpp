// SPDX-License-Identifier: MIT
#include <algorithm>
#include <memory>
#include <opencv2/core.hpp>
#include <string>

#include "calibration_commands.h"
#include "calibration_output.h"
#include "option_checks.h"
#include "rig_settings.h"
#include "say.h"
#include "widestereo/calibration.h"

namespace ws = widestereo;

namespace {

struct ConvertArguments {
  std::string input;
  CalibrationOutput output;
  double scale = 1;
};

/// The rig's, of images reduced, or enlarged, to that share of their width and height.
ws::Rig scaled(ws::Rig rig, double scale) {
  for (ws::View& view : rig.views) {
    const auto side = [scale](int pixels) { return std::max(cvRound(scale * pixels), 1); };
    view = ws::resized(view, side(view.camera.width), side(view.camera.height));
  }
  return rig;
}

void convert(const ConvertArguments& arguments) {
  const ws::Calibration calibration = ws::read_calibration(arguments.input);
  require_other_file(arguments.output.file, calibration.files);
  arguments.output.write(scaled(calibration.rig, arguments.scale));
  say("Wrote " + arguments.output.file + ".");
}

}  // namespace

void add_calibration_convert_command(CLI::App& group) {
  CLI::App* command = group.add_subcommand("convert", "Write another format");
  auto arguments = std::make_shared<ConvertArguments>();
  command->add_option("input", arguments->input, RigSettings::calibration_formats)->required();
  command->add_option("output", arguments->output.file, "File to write")->required();
  arguments->output.add_format_to(*command);
  command
      ->add_option("--scale", arguments->scale,
                   "For images reduced (by averaging) to this share of their width and height, as "
                   "0.5 of binned ones")
      ->check(positive_number())
      ->capture_default_str();
  command->callback([arguments] { convert(*arguments); });
}
