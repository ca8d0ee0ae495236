// SPDX-License-Identifier: MIT
#include <filesystem>
#include <iostream>
#include <memory>
#include <string>

#include "commands.h"
#include "folder_format.h"
#include "match_settings.h"
#include "matching_run.h"
#include "result_folder.h"
#include "widestereo/evaluation.h"
#include "widestereo/image_io.h"
#include "widestereo/synthesis.h"

namespace ws = widestereo;

namespace {

struct DemoArguments {
  std::string output = "demo";
  int size = 384;
  bool panorama = false;
  bool surround = false;
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

ws::RenderedPair render(const DemoArguments& arguments) {
  ws::Rig rig =
      arguments.surround ? ws::surround_rig(arguments.size) : ws::demo_rig(arguments.size);
  if (arguments.panorama) {
    for (ws::View& view : rig.views) {
      view.camera = ws::whole_sphere(2 * arguments.size, arguments.size);
    }
  }
  return ws::render_demo_room(rig);
}

void run_demo(DemoArguments arguments) {
  const auto [nearest, farthest] = ws::demo_distance_range();
  if (!arguments.settings.min_distance) arguments.settings.min_distance = nearest;
  if (!arguments.settings.max_distance) arguments.settings.max_distance = farthest;
  const ws::Options options = arguments.settings.options();
  arguments.format.require_room_for(options.min_distance, options.max_distance);

  const ws::RenderedPair pair = render(arguments);
  std::vector<cv::Mat> images;
  std::vector<ws::GroundTruth> truths;
  for (const ws::RenderedView& view : pair.views) {
    images.push_back(view.image);
    truths.push_back(view.truth);
  }
  const MatchingRun run = match_images(arguments.settings, pair.rig, images, arguments.output);
  FolderContents contents{.rig = pair.rig, .images = images, .run = run};
  contents.truths = truths;
  contents.origin = {{"scene", "demo"},
                     {"size", arguments.size},
                     {"panorama", arguments.panorama},
                     {"surround", arguments.surround}};
  contents.scores = ws::evaluate(run.result.views[0].distance, run.result.views[0].normals,
                                 truths[0], pair.rig.views[0], pair.rig.views[1]);
  report(write_result_folder(arguments.output, contents, arguments.format), arguments.output,
         arguments.as_json);
  if (!arguments.as_json) {
    std::cout << "\nView 0 against exact ground truth, before any rejection:\n"
              << ws::to_table(contents.scores);
  }
}

}  // namespace

void add_demo_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "demo", "Render a synthetic fisheye pair with exact ground truth, match it and score it");
  auto arguments = std::make_shared<DemoArguments>();
  command->add_option("-o,--output", arguments->output, "Folder for the results")
      ->capture_default_str();
  command
      ->add_option("--size", arguments->size,
                   "Side of the square images, pixels; of panoramas, height")
      ->check(CLI::Range(ws::least_demo_size, ws::largest_demo_size))
      ->capture_default_str();
  command->add_flag("--panorama", arguments->panorama,
                    "See the whole sphere in equirectangular images, in place of two fisheyes");
  command
      ->add_flag("--surround", arguments->surround,
                 "Look around by four fisheyes, in place of two that look ahead")
      ->excludes("--panorama");
  arguments->format.add_to(*command);
  command->add_flag("--json", arguments->as_json, "Print the run's record and the scores as JSON");
  arguments->settings.add_to(*command);
  command->callback([arguments] { run_demo(*arguments); });
}
