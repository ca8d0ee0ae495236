// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <string>
#include <vector>

#include "commands.h"
#include "option_checks.h"
#include "say.h"
#include "widestereo/error.h"

namespace {

/// Options of several values take one word each, so that they may stand before images.
void end_options_after_a_word(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) option->allow_extra_args(false);
  }
  for (CLI::App* command : app.get_subcommands(nullptr)) end_options_after_a_word(*command);
}

/// The command that the words name, or the group that one should be of.
const CLI::App& parsed_command(const CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  return parsed.empty() ? app : parsed_command(*parsed.front());
}

std::string help_of(const CLI::App& command) {
  std::string path;
  for (const CLI::App* group = &command; group->get_parent() != nullptr;
       group = group->get_parent()) {
    path = " " + group->get_name() + path;
  }
  return "`widestereo" + path + " --help`";
}

/// What is wrong with the first word that is neither a command nor an option nor its value; empty
/// if nothing is.
std::string unknown_word(const CLI::App& app) {
  const CLI::App& command = parsed_command(app);
  const std::vector<std::string> words = command.remaining();
  if (words.empty()) return "";
  const auto is_option = [](const std::string& word) { return word.starts_with('-'); };
  if (command.get_require_subcommand_min() > 0 && !is_option(words.front())) {
    return words.front() + " is no command; " + help_of(command) + " lists them.";
  }
  const auto option = std::ranges::find_if(words, is_option);
  if (option != words.end()) {
    return *option + " is no option; " + help_of(command) + " lists them.";
  }
  return words.front() + " is a word too many; leave it out.";
}

/// The option that was given more than once though it takes one word, empty if none was.
std::string repeated_option(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_items_expected_max() == 1 && option->count() > 1) return option->get_name();
  }
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  return parsed.empty() ? "" : repeated_option(*parsed.front());
}

int report_lack_of_memory() {
  say("Not enough memory; use smaller images.");
  return 1;
}

int report(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error, std::cout);
  const std::string unknown = unknown_word(app);
  say(unknown.empty() ? error.what() + ("; " + help_of(parsed_command(app)) + " tells more.")
                      : unknown);
  return error.get_exit_code();
}

int run(int argc, char** argv) {
  CLI::App app{
      "widestereo: dense stereo directly on ultra-wide-angle (fisheye) images, without "
      "rectification"};
  app.require_subcommand(1);
  app.set_version_flag("--version", WIDESTEREO_VERSION);
  add_demo_command(app);
  add_depth_command(app);
  add_sequence_command(app);
  add_reconstruct_command(app);
  add_evaluate_command(app);
  add_view_synthesis_command(app);
  add_calibration_command(app);
  add_devices_command(app);
  add_benchmark_command(app);
  end_options_after_a_word(app);
  check_words_of(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ArgumentMismatch& error) {
    const std::string repeated = repeated_option(app);
    if (repeated.empty()) return report(app, error);
    say(repeated + " is given more than once; give it once.");
    return error.get_exit_code();
  } catch (const CLI::ConversionError& error) {
    // Words have been found to be such numbers, or true or false: just a number's range is left.
    say(std::string(error.what()) + "; it is too large, or negative where it may not be.");
    return error.get_exit_code();
  } catch (const CLI::RuntimeError& error) {
    return error.get_exit_code();  // of a command that has said why
  } catch (const CLI::ParseError& error) {
    return report(app, error);
  } catch (const widestereo::Error& error) {
    say(error.what());
    return 1;
  } catch (const std::bad_alloc&) {
    return report_lack_of_memory();
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) return report_lack_of_memory();
    say(std::string("Internal error: ") + error.what());
    return 1;
  } catch (const std::filesystem::filesystem_error& error) {
    say("Cannot use " + error.path1().string() + ": " + error.code().message() +
        "; check its permissions.");
    return 1;
  } catch (const std::exception& error) {
    say(std::string("Internal error: ") + error.what());
    return 1;
  }
  return 0;
}

/// What was printed is kept back until it is a block: a full disk may show only here.
bool flush_standard_output() {
  std::cout.flush();
  return std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.good();
}

}  // namespace

int main(int argc, char** argv) {
  // A file that grows beyond a limit is an error of writing, as on a full disk.
  std::signal(SIGXFSZ, SIG_IGN);
  // What OpenCV logs and prints of broken images, the command says in a sentence.
  std::cerr.rdbuf(nullptr);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  const int exit_code = run(argc, argv);
  if (flush_standard_output() || exit_code != 0) return exit_code;
  say("Cannot write to standard output; make room where it goes, or write elsewhere.");
  return 1;
}
