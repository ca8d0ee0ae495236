// SPDX-License-Identifier: MIT
#include "posed_images.h"

#include <algorithm>
#include <map>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <tuple>
#include <utility>

#include "calibration_fit.h"
#include "matching_run.h"
#include "option_checks.h"
#include "progress_bar.h"
#include "say.h"
#include "text/lower_case.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;
namespace fs = std::filesystem;

namespace {

// Of a camera, to see where its lens ends.
constexpr std::size_t rim_images = 8;

std::vector<Eigen::Vector3d> centres_of(const std::vector<ws::View>& views) {
  std::vector<Eigen::Vector3d> centres;
  for (const ws::View& view : views) centres.push_back(view.world_from_camera.translation());
  return centres;
}

}  // namespace

cv::Mat PosedImages::read(std::size_t image) const {
  return size.reduced(white_level.read_of_many(files[image]), calibrated[image],
                      files[image].string());
}

void PosedImageSettings::add_to(CLI::App& command) {
  command
      .add_option("images", images,
                  std::string("Folder that the paths of the images in a COLMAP model or "
                              "transforms.json begin in; or a data "
                              "set: ") +
                      FrameSettings::layouts)
      ->required();
  rig.add_to(command, RigSettings::or_model, "; by default all, or as many as --folders names");
  rig.add_mask_folder_to(command);
  poses.add_to(command, "data sets of more than one frame need it", "Data sets");
  frames.add_to(command, ", and a model's images that are missing");
  size.add_to(command);
  white_level.add_to(command);
}

PosedImages PosedImageSettings::read(const MatchSettings& settings) const {
  PosedImages posed = ws::is_sfm_model(rig.calibration) ? of_model() : of_trajectory();
  // Before images are read, as the range may be missing.
  std::optional<ws::Options> without_points;
  if (posed.selection == nullptr) {
    const ws::CalibratedImages images_alone{.rig = {}, .in_metres = posed.in_metres};
    without_points = with_range(settings, images_alone, rig.calibration).options();
  }
  const std::vector<bool> masked = rig.apply_mask_folder(posed.calibrated);
  posed.size = size;
  posed.white_level = white_level;
  // One mask of many images stays one in memory.
  std::map<std::tuple<const uchar*, int, int>, cv::Mat> reduced_masks;
  for (const ws::View& view : posed.calibrated) {
    ws::View& reduced = posed.views.emplace_back(size.reduced(view));
    cv::Mat& mask = reduced_masks[{view.mask.data, reduced.camera.width, reduced.camera.height}];
    if (mask.empty()) mask = reduced.mask;
    reduced.mask = mask;
  }
  leave_out_dark_rims(posed, masked);
  if (without_points) {
    ProgressBar bar("Looking for images that see the same");
    posed.selection = std::make_shared<const ws::ViewSelection>(
        centres_of(posed.views),
        ws::assumed_points(posed.views, without_points->min_distance, without_points->max_distance,
                           [&bar](double share) { bar.show(share); }));
  }
  return posed;
}

std::shared_ptr<const ws::SfmModel> PosedImageSettings::model_of_images() const {
  const auto model = std::make_shared<ws::SfmModel>(rig.calibration);
  const std::size_t all = model->names().size();
  Images missing;
  for (std::size_t i = 0; i < all; ++i) {
    if (!fs::exists(model->file_of(i, images))) missing.push_back(i);
  }
  if (missing.empty()) return model;
  const std::string first = model->file_of(missing.front(), images).string();
  const std::string count = std::to_string(missing.size()) + " of " + std::to_string(all);
  if (missing.size() == all || !frames.skip_incomplete) {
    throw ws::Error(first + " is missing (" + count + " images in " + rig.calibration +
                    " are); give the folder that their paths begin in" +
                    (missing.size() == all ? "." : ", or leave them out by --skip-incomplete."));
  }
  say(count + " images in " + rig.calibration + " are missing and left out; the first is " + first +
      ".");
  model->leave_out(missing);
  return model;
}

PosedImages PosedImageSettings::of_model() const {
  if (poses.given() || frames.are_chosen() || !rig.views.empty()) {
    throw ws::Error(
        "--poses, --views and the options of frames are for data sets, but " + rig.calibration +
        " is a COLMAP model or transforms.json, which has images and poses; leave them out.");
  }
  if (rig.masks.size() > 1) {
    throw ws::Error("--mask is for all images of " + rig.calibration +
                    "; give one, or a folder of masks by --masks.");
  }
  const std::shared_ptr<const ws::SfmModel> model = model_of_images();
  PosedImages posed;
  posed.in_metres = false;
  Images all;
  ws::Rig rig_of_all;
  for (std::size_t i = 0; i < model->names().size(); ++i) {
    posed.files.push_back(model->file_of(i, images));
    rig_of_all.views.push_back(model->view(i));
    all.push_back(i);
  }
  rig.limit_fields_of_view(rig_of_all);
  posed.calibrated = std::move(rig_of_all.views);
  posed.origin = move_near_origin(posed.calibrated);
  if (model->has_points()) posed.selection = {model, &model->selection()};
  using Distances = std::optional<ws::DistanceRange>;
  posed.distances = [model, all, of_all = std::optional<Distances>()](const Images& some) mutable {
    const Distances distances = model->distances(some);
    if (distances) return distances;
    // Many groups may have few points, and all images have many.
    if (!of_all) of_all = model->distances(all);
    return *of_all;
  };
  return posed;
}

PosedImages PosedImageSettings::of_trajectory() const {
  if (!poses.given() && frames.count != 1) {
    // Of a model that is missing, lacks a file or is damaged, and of its files, reading says so.
    const fs::path calibration = rig.calibration;
    const std::string extension = ws::extension_of(calibration);
    if (!fs::exists(calibration) || fs::is_directory(calibration) || extension == ".json" ||
        extension == ".txt" || extension == ".bin") {
      ws::read_calibration(calibration);
    }
    throw ws::Error(rig.calibration +
                    " is no COLMAP model or transforms.json, so that the poses of the frames are "
                    "not known; give --poses, or take one frame (--count 1).");
  }
  const int first = rig.views.empty() ? 0 : rig.views.front();
  const cv::Size of_image = ws::read_image(frames.example(images, first)).size();
  std::vector<int> cameras = rig.views;
  if (cameras.empty()) {
    cameras.resize(frames.folders.empty()
                       ? ws::read_calibration(rig.calibration, of_image).rig.views.size()
                       : frames.folders.size());
    std::iota(cameras.begin(), cameras.end(), 0);
  }
  require_different_cameras(cameras);
  const ChosenFrames chosen = frames.choose(images, cameras);
  const ws::Rig of_frame = rig.rig_for_images(cameras.size(), of_image);
  RigPoses known{.poses = {Eigen::Isometry3d::Identity()}, .of = {}, .frames = chosen.chosen};
  if (poses.given()) {
    known =
        poses.read(of_frame, rig.calibration, chosen.all, chosen.chosen, frames.skip_incomplete);
  }
  const std::vector<Eigen::Isometry3d>& world_from_rig = known.poses;
  PosedImages posed;
  posed.is_unit_doubtful = report_long_baseline(of_frame);
  posed.are_of_one_frame = known.frames.size() == 1;
  for (std::size_t k = 0; k < known.frames.size(); ++k) {
    const ws::SequenceFrame& frame = chosen.all[known.frames[k]];
    for (std::size_t i = 0; i < of_frame.views.size(); ++i) {
      posed.calibrated.push_back(posed_view(of_frame.views[i], world_from_rig[k], frame.name));
      posed.files.push_back(frame.images[i]);
    }
  }
  posed.origin = move_near_origin(posed.calibrated);
  posed.distances = [](const Images&) { return std::nullopt; };
  return posed;
}

void PosedImageSettings::leave_out_dark_rims(PosedImages& posed,
                                             const std::vector<bool>& masked) const {
  std::vector<bool> done = masked;
  ProgressBar bar("Looking for dark rims");
  for (std::size_t first = 0; first < posed.views.size(); ++first) {
    if (done[first]) continue;
    const ws::Camera camera = posed.views[first].camera;
    if (!rig.looks_for_rim_of(camera)) continue;
    bar.show(static_cast<double>(first) / static_cast<double>(posed.views.size()));
    Images of_camera;
    for (std::size_t i = first; i < posed.views.size(); ++i) {
      if (!masked[i] && posed.views[i].camera == camera) of_camera.push_back(i);
    }
    std::vector<cv::Mat> seen;
    const std::size_t count = std::min(rim_images, of_camera.size());
    for (std::size_t i = 0; i < count; ++i) {
      seen.push_back(posed.read(of_camera[i * of_camera.size() / count]));
    }
    std::vector<ws::View*> views;
    for (const std::size_t i : of_camera) {
      done[i] = true;
      views.push_back(&posed.views[i]);
    }
    RigSettings::leave_out_dark_rim(views, seen);
  }
}
