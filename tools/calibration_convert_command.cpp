// SPDX-License-Identifier: MIT
#include <memory>
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

void convert(const ConvertArguments& arguments) {
  ws::Calibration calibration = ws::read_calibration(arguments.input);
  require_other_file(arguments.output.file, calibration.files);
  for (ws::View& view : calibration.rig.views) {
    view.camera = ws::scaled(view.camera, arguments.scale);
  }
  arguments.output.write(calibration.rig);
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
                   "For images reduced (by averaging) by exactly this factor, as 0.5 of binned "
                   "ones, or 2 where those calibrated were binned; the size is rounded")
      ->check(positive_number())
      ->capture_default_str();
  command->callback([arguments] { convert(*arguments); });
}
