// SPDX-License-Identifier: MIT
// What the words that options take must be like.
#pragma once

#include <CLI/CLI.hpp>

/// CLI11's own checks let NaN pass and name limits of 309 digits.
CLI::Validator positive_number();
CLI::Validator non_negative_number();

/// Makes every option, of subcommands too, refuse an empty word, and where it takes numbers NaN and
/// infinity, and read whole numbers by their decimal digits.
void check_words_of(CLI::App& app);
