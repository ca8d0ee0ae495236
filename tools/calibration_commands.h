// SPDX-License-Identifier: MIT
// The commands of `widestereo calibration`, as in commands.h.
#pragma once

#include <CLI/CLI.hpp>

void add_calibration_show_command(CLI::App& group);
void add_calibration_convert_command(CLI::App& group);
void add_calibration_check_command(CLI::App& group);
void add_calibration_refine_command(CLI::App& group);
