// SPDX-License-Identifier: MIT
// One function for each subcommand: adds its options, and a callback that runs it and throws Error.
#pragma once

#include <CLI/CLI.hpp>

void add_demo_command(CLI::App& app);
void add_depth_command(CLI::App& app);
void add_sequence_command(CLI::App& app);
void add_reconstruct_command(CLI::App& app);
void add_evaluate_command(CLI::App& app);
void add_view_synthesis_command(CLI::App& app);
void add_calibration_command(CLI::App& app);
void add_devices_command(CLI::App& app);
void add_benchmark_command(CLI::App& app);
