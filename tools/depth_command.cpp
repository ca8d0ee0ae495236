// SPDX-License-Identifier: MIT
#include <filesystem>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "commands.h"
#include "match_settings.h"
#include "matching_run.h"
#include "result_folder.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;

namespace {

struct DepthArguments {
  std::vector<std::string> images;
  std::string calibration;
  std::string output;
  std::vector<int> views;
  std::vector<std::string> masks;
  double max_theta = 0;  // degrees, 0 = as calibrated
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

/// The calibrated views that the images belong to, in the images' order, with masks.
ws::Rig rig_for_images(const DepthArguments& arguments, const std::vector<cv::Mat>& images) {
  const ws::Rig all = ws::read_calibration(arguments.calibration, images.front().size()).rig;
  std::vector<int> chosen = arguments.views;
  if (chosen.empty()) {
    for (int i = 0; i < static_cast<int>(images.size()); ++i) chosen.push_back(i);
  }
  if (chosen.size() != images.size()) {
    throw ws::Error("--views names " + std::to_string(chosen.size()) + " cameras for " +
                    std::to_string(images.size()) + " images; name one for each image.");
  }
  ws::Rig rig;
  for (const int view : chosen) {
    if (view < 0 || view >= static_cast<int>(all.views.size())) {
      throw ws::Error(arguments.calibration + " has " + std::to_string(all.views.size()) +
                      " camera(s); there is no camera " + std::to_string(view) +
                      ". Give one image for each camera, or choose cameras with --views.");
    }
    rig.views.push_back(all.views[view]);
  }
  if (arguments.masks.size() > 1 && arguments.masks.size() != images.size()) {
    throw ws::Error("--mask was given " + std::to_string(arguments.masks.size()) + " times for " +
                    std::to_string(images.size()) + " images; give one for all or one for each.");
  }
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    ws::View& view = rig.views[i];
    if (arguments.max_theta > 0) {
      view.camera.max_theta = arguments.max_theta * std::numbers::pi / 180;
    }
    if (!arguments.masks.empty()) {
      const std::string& file = arguments.masks[arguments.masks.size() == 1 ? 0 : i];
      view.mask = ws::to_intensity(ws::read_image(file), file) > 0;
    }
  }
  return rig;
}

void run_depth(const DepthArguments& arguments) {
  std::vector<cv::Mat> images;
  for (const std::string& file : arguments.images) images.push_back(ws::read_image(file));
  const ws::Rig rig = rig_for_images(arguments, images);
  ws::prepare_output_folder(arguments.output);

  const MatchingRun run = match_images(arguments.settings, rig, images);
  FolderContents contents{.rig = rig, .images = images, .run = run};
  contents.origin = {{"images", arguments.images}, {"calibration", arguments.calibration}};
  report(write_result_folder(arguments.output, contents, arguments.format), arguments.output,
         arguments.as_json);
}

}  // namespace

void add_depth_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "depth", "Distance, normals, cost and confidence of calibrated images, and a point cloud");
  auto arguments = std::make_shared<DepthArguments>();
  command->add_option("images", arguments->images, "LEFT RIGHT (or more views of one rig)")
      ->required()
      ->expected(2, 8);
  command
      ->add_option("-c,--calibration", arguments->calibration,
                   "Kalibr camchain, Basalt JSON or OpenCV file")
      ->required();
  command->add_option("-o,--output", arguments->output, "Folder for the results")->required();
  command->add_option("--views", arguments->views, "Cameras of the calibration, one for each image")
      ->delimiter(',');
  command->add_option("--mask", arguments->masks,
                      "Image, 0 = ignore the pixel; once for all views or once for each");
  command
      ->add_option("--max-theta", arguments->max_theta,
                   "Half angle of the lens's field of view, degrees")
      ->check(CLI::Range(1.0, 180.0));
  arguments->format.add_to(*command);
  command->add_flag("--json", arguments->as_json, "Print the run's record as JSON");
  arguments->settings.add_to(*command);
  command->callback([arguments] { run_depth(*arguments); });
}
