// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "commands.h"
#include "match_settings.h"
#include "matching_run.h"
#include "pose_settings.h"
#include "result_folder.h"
#include "rig_settings.h"
#include "widestereo/image_io.h"
#include "widestereo/sequence.h"

namespace ws = widestereo;
namespace fs = std::filesystem;

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

/// The views of images that one rig, or one camera, took at different times: the rig's frame is
/// that of the first image.
ws::Rig rig_at_poses(const DepthArguments& arguments, cv::Size size) {
  RigSettings settings = arguments.rig;
  if (settings.views.empty()) settings.views.assign(arguments.images.size(), 0);
  ws::Rig rig = settings.rig_for_images(arguments.images.size(), size);
  std::vector<ws::SequenceFrame> frames;
  for (const fs::path file : arguments.images) {
    frames.push_back({file.stem().string(), {file}, ws::time_in_name(file.stem().string())});
  }
  std::vector<std::size_t> all(frames.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<Eigen::Isometry3d> poses =
      arguments.poses.read(rig, settings.calibration, frames, all).poses;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ws::View& view = rig.views[i];
    view.name = frames[i].name;
    view.world_from_camera = poses.front().inverse() * poses[i] * view.world_from_camera;
  }
  return rig;
}

void run_depth(const DepthArguments& arguments) {
  std::vector<cv::Mat> images;
  for (const std::string& file : arguments.images) images.push_back(ws::read_image(file));
  const cv::Size size = images.front().size();
  const ws::Rig rig = arguments.poses.given() ? rig_at_poses(arguments, size)
                                              : arguments.rig.rig_for_images(images.size(), size);
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
  arguments->poses.add_to(*command,
                          "of images taken one after the other, all by camera 0 unless --views "
                          "names others; by time, or one for each in their order",
                          "Moving cameras");
  command->add_option("-o,--output", arguments->output, "Folder for the results")->required();
  arguments->format.add_to(*command);
  command->add_flag("--json", arguments->as_json, "Print the run's record as JSON");
  arguments->settings.add_to(*command);
  command->callback([arguments] { run_depth(*arguments); });
}
