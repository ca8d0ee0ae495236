// SPDX-License-Identifier: MIT
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>

#include "commands.h"
#include "option_checks.h"
#include "widestereo/error.h"

namespace {

/// Options of several values take one word each, so that they may stand before images.
void end_options_after_a_word(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (!option->get_positional()) option->allow_extra_args(false);
  }
  for (CLI::App* command : app.get_subcommands(nullptr)) end_options_after_a_word(*command);
}

/// What is wrong with the word in place of a command, empty if nothing is.
std::string unknown_command(const CLI::App& app) {
  const std::vector<CLI::App*> parsed = app.get_subcommands();
  if (!parsed.empty()) return unknown_command(*parsed.front());
  if (app.get_require_subcommand_min() == 0 || app.remaining().empty()) return "";
  std::string path;
  for (const CLI::App* group = &app; group->get_parent() != nullptr; group = group->get_parent()) {
    path = " " + group->get_name() + path;
  }
  return app.remaining().front() + " is no command; `widestereo" + path + " --help` lists them.";
}

int report_lack_of_memory() {
  std::cerr << "widestereo: Not enough memory; use smaller images.\n";
  return 1;
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
  } catch (const CLI::RequiredError& error) {
    const std::string unknown = unknown_command(app);
    if (unknown.empty()) return app.exit(error);
    std::cerr << "widestereo: " << unknown << "\n";
    return error.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const widestereo::Error& error) {
    std::cerr << "widestereo: " << error.what() << "\n";
    return 1;
  } catch (const std::bad_alloc&) {
    return report_lack_of_memory();
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) return report_lack_of_memory();
    std::cerr << "widestereo: Internal error: " << error.what() << "\n";
    return 1;
  } catch (const std::filesystem::filesystem_error& error) {
    std::cerr << "widestereo: Cannot use " << error.path1().string() << ": "
              << error.code().message() << "; check its permissions.\n";
    return 1;
  } catch (const std::exception& error) {
    std::cerr << "widestereo: Internal error: " << error.what() << "\n";
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
  // What OpenCV logs of broken images, the command says in a sentence.
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  const int exit_code = run(argc, argv);
  if (flush_standard_output() || exit_code != 0) return exit_code;
  std::cerr << "widestereo: Cannot write to standard output; make room where it goes, or write "
               "elsewhere.\n";
  return 1;
}
