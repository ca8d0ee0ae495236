// SPDX-License-Identifier: MIT
#include <memory>
#include <string>
#include <vector>

#include "commands.h"
#include "match_settings.h"
#include "matching_run.h"
#include "pose_settings.h"
#include "result_folder.h"
#include "rig_settings.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;

namespace {

struct DepthArguments {
  std::vector<std::string> images;
  std::string output;
  RigSettings rig;
  PoseSettings poses;
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

void run_depth(const DepthArguments& arguments) {
  std::vector<cv::Mat> images;
  for (const std::string& file : arguments.images) images.push_back(ws::read_image(file));
  const ws::Rig rig =
      rig_of_images(arguments.rig, arguments.poses, arguments.images, images.front().size());
  ws::prepare_output_folder(arguments.output);

  const MatchingRun run = match_images(arguments.settings, rig, images);
  FolderContents contents{.rig = rig, .images = images, .run = run};
  contents.origin = {{"images", arguments.images}, {"calibration", arguments.rig.calibration}};
  if (arguments.poses.given()) contents.origin["poses"] = arguments.poses.file;
  report(write_result_folder(arguments.output, contents, arguments.format), arguments.output,
         arguments.as_json);
}

}  // namespace

void add_depth_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "depth", "Distance, normals, cost and confidence of calibrated images, and a point cloud");
  auto arguments = std::make_shared<DepthArguments>();
  command
      ->add_option("images", arguments->images,
                   "LEFT RIGHT (or more views of one rig, or of a moving one)")
      ->required()
      ->expected(2, 8);
  arguments->rig.add_to(*command);
  arguments->poses.add_to(*command);
  command->add_option("-o,--output", arguments->output, "Folder for the results")->required();
  arguments->format.add_to(*command);
  command->add_flag("--json", arguments->as_json, "Print the run's record as JSON");
  arguments->settings.add_to(*command);
  command->callback([arguments] { run_depth(*arguments); });
}
