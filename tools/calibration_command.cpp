// SPDX-License-Identifier: MIT
#include "calibration_commands.h"
#include "commands.h"

void add_calibration_command(CLI::App& app) {
  CLI::App* group =
      app.add_subcommand("calibration", "Show, convert, check or refine calibration files");
  group->require_subcommand(1);
  add_calibration_show_command(*group);
  add_calibration_convert_command(*group);
  add_calibration_check_command(*group);
  add_calibration_refine_command(*group);
}
