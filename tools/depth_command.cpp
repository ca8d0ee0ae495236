// SPDX-License-Identifier: MIT
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "acceptance.h"
#include "calibration_fit.h"
#include "commands.h"
#include "folder_format.h"
#include "image_checks.h"
#include "match_settings.h"
#include "matching_run.h"
#include "option_checks.h"
#include "pose_settings.h"
#include "result_folder.h"
#include "rig_settings.h"
#include "sharpness_settings.h"
#include "size_settings.h"
#include "white_level.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;

namespace {

constexpr int default_sources = 2;

struct DepthArguments {
  std::vector<std::string> images;
  std::optional<int> sources;
  std::string output;
  RigSettings rig;
  PoseSettings poses;
  SizeSettings size;
  WhiteLevel white_level;
  SharpnessSettings sharpness;
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

/// What joins an image of a model, by the points that they share, or else by the range.
std::vector<std::filesystem::path> sources_of(const DepthArguments& arguments,
                                              const ws::SfmModel& model, const std::string& image) {
  const auto count = static_cast<std::size_t>(arguments.sources.value_or(default_sources));
  if (model.has_points()) return model.source_files(image, count);
  const ws::CalibratedImages without_points{.rig = {}, .in_metres = false};
  const ws::Options options =
      with_range(arguments.settings, without_points, arguments.rig.calibration).options();
  return model.source_files(image, count,
                            {.nearest = options.min_distance, .farthest = options.max_distance});
}

/// One image is joined by the best ones of its model.
std::vector<std::string> files_of(const DepthArguments& arguments,
                                  const std::optional<ws::SfmModel>& model) {
  std::vector<std::string> files = arguments.images;
  for (const std::string& file : files) {
    std::error_code ignored;
    if (!std::filesystem::is_directory(file, ignored)) continue;
    throw ws::Error(file +
                    " is a folder; give images, or have those of folders matched by `sequence` or "
                    "`reconstruct`.");
  }
  if (files.size() > 1) {
    if (!arguments.sources) return files;
    throw ws::Error("--sources chooses what joins one image, but " + std::to_string(files.size()) +
                    " were given; leave it out or give one.");
  }
  if (!model) {
    // Of what is missing, or neither an image nor a calibration, these say so.
    const cv::Size size = ws::read_image(files.front()).size();
    ws::read_calibration(arguments.rig.calibration, size);
    throw ws::Error(
        "One image is not enough, unless --calibration is a COLMAP model or transforms.json to "
        "choose others from; give two or more.");
  }
  const auto sources = sources_of(arguments, *model, files.front());
  if (sources.empty()) {
    throw ws::Error(arguments.rig.calibration + " has no image that sees the same as " +
                    files.front() + "; give two or more images.");
  }
  for (const auto& source : sources) files.push_back(source.string());
  return files;
}

void run_depth(const DepthArguments& arguments) {
  const std::optional<ws::SfmModel> model = arguments.rig.sfm_model();
  const std::vector<std::string> files = files_of(arguments, model);
  require_different_images({files.begin(), files.end()});
  std::vector<cv::Mat> images;
  for (const std::string& file : files) images.push_back(arguments.white_level.read(file));
  ws::CalibratedImages calibrated =
      calibrated_images(arguments.rig, arguments.poses, files, images.front().size(), model);
  const ws::Rig& rig = calibrated.rig;
  for (std::size_t i = 0; i < files.size(); ++i) {
    ws::View& view = calibrated.rig.views[i];
    images[i] = arguments.size.reduced(images[i], view, files[i]);
    view = arguments.size.reduced(view);
  }
  const Eigen::Vector3d world_origin = move_near_origin(calibrated.rig.views);
  arguments.rig.leave_out_dark_rims(calibrated.rig, images);
  const MatchSettings settings =
      with_range(arguments.settings, calibrated, arguments.rig.calibration);
  const ws::Options options = settings.options();
  arguments.format.require_room_for(options.min_distance, options.max_distance);

  const std::vector<MatchedViews> pairs = match_with_first(rig, images, options);
  const std::vector<double> blurs = arguments.sharpness.blurs(rig, images, pairs);
  report_calibration_errors(pairs, model || arguments.poses.given());
  const bool is_unit_doubtful =
      calibrated.in_metres && !arguments.poses.given() && report_long_baseline(rig);
  report_features_out_of_range(pairs, calibrated.in_metres ? " m" : "", is_unit_doubtful);
  const MatchingRun run = match_images(settings, rig, blurred(images, blurs), arguments.output);
  FolderContents contents{
      .rig = rig, .images = images, .run = run, .in_metres = calibrated.in_metres, .blurs = blurs};
  contents.world_origin = world_origin;
  contents.origin = {{"images", files}, {"calibration", arguments.rig.calibration}};
  if (arguments.poses.given()) contents.origin["poses"] = arguments.poses.file;
  contents.origin["white_level"] = arguments.white_level.value();
  if (!arguments.rig.masks.empty()) contents.origin["masks"] = arguments.rig.masks;
  if (!arguments.rig.mask_folder.empty()) {
    contents.origin["mask_folder"] = arguments.rig.mask_folder;
  }
  const auto record = write_result_folder(arguments.output, contents, arguments.format);
  report_little_accepted(accepted_share(run.result.views), overlap_share(run.result.views),
                         "the order of the images");
  report_nearest(run.result.views, options.min_distance);
  report(record, arguments.output, arguments.as_json);
}

}  // namespace

void add_depth_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "depth", "Distance, normals, cost and confidence of calibrated images, and a point cloud");
  auto arguments = std::make_shared<DepthArguments>();
  command
      ->add_option("images", arguments->images,
                   "LEFT RIGHT (or more views of one rig, or of a moving one); or one image of a "
                   "COLMAP model or transforms.json, which others join")
      ->required();
  add_image_options(*command, arguments->rig, arguments->poses);
  command
      ->add_option("--sources", arguments->sources,
                   "How many others of the model join one image, best first (default " +
                       std::to_string(default_sources) + ")")
      ->check(CLI::Range(1, ws::Matcher::most_views - 1));
  arguments->size.add_to(*command);
  arguments->white_level.add_to(*command);
  arguments->sharpness.add_to(*command);
  command->add_option("-o,--output", arguments->output, "Folder for the results")->required();
  arguments->format.add_to(*command);
  command->add_flag("--json", arguments->as_json, "Print the run's record as JSON");
  arguments->settings.add_to(*command);
  command->callback([arguments] { run_depth(*arguments); });
}
