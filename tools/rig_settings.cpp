// SPDX-License-Identifier: MIT
#include "rig_settings.h"

#include <algorithm>
#include <filesystem>
#include <numbers>
#include <opencv2/core.hpp>

#include "geometry/angle.h"
#include "say.h"
#include "text/formatted.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"
#include "widestereo/lens.h"

namespace ws = widestereo;
namespace fs = std::filesystem;

namespace {

/// 255 where a pixel has a ray and the mask, which may be empty, does not exclude it, else 0.
cv::Mat field_of_view(const ws::Camera& camera, const cv::Mat& mask) {
  cv::Mat usable;
  cv::extractChannel(ws::ray_image(camera, mask), usable, 3);
  return usable != 0;
}

/// How a calibration that has one camera becomes one of the rig.
const char* way_to_rig(ws::CalibrationFormat format) {
  using enum ws::CalibrationFormat;
  switch (format) {
    case camodocal:
      return "Name the cameras' files in one of VINS-Fusion (cam0_calib, cam1_calib, body_T_cam0, "
             "body_T_cam1)";
    case ocam:
      return "Put the cameras into a config.yaml of OmniMVS, with their poses";
    case multicol:
      return "Give the MultiCamSys_Calibration.yaml of the rig";
    case woodscape:
      return "No rig that can be read has cameras of WoodScape: calibrate with another model";
    case orb_slam:
      return "Put the cameras into one file, as Camera1 and Camera2 with Stereo.T_c1_c2";
    case opencv:
      return "Put the cameras into one file, as K1, D1, K2, D2, R and T";
    default:
      return "Put the cameras into one Kalibr camchain, cam1 with T_cn_cnm1";
  }
}

/// What to do where images are of more cameras than these.
std::string remedy_of_cameras(const ws::Calibration& calibration) {
  if (calibration.rig.views.size() > 1) {
    return "Give one image for each camera, choose cameras with --views, or give the --poses of a "
           "camera that moved.";
  }
  // These have one file for each camera.
  if (calibration.files.size() == 1 && (calibration.format == ws::CalibrationFormat::euroc ||
                                        calibration.format == ws::CalibrationFormat::ros)) {
    return "Give the folder that has the files of all cameras.";
  }
  return std::string(way_to_rig(calibration.format)) +
         ", or give the --poses of a camera that moved.";
}

/// Whether a mask leaves out most of what lies farther off the axis, so that it knows the rim: one
/// may be of a vehicle's bonnet alone.
bool mask_leaves_out(const ws::View& view, double theta) {
  if (view.mask.empty()) return false;
  ws::Camera within = view.camera;
  within.max_theta = theta;
  const cv::Mat beyond = field_of_view(view.camera, {}) & ~field_of_view(within, {});
  return 2 * cv::countNonZero(beyond & (view.mask != 0)) < cv::countNonZero(beyond);
}

}  // namespace

void RigSettings::add_whole_rig_to(CLI::App& command, const std::string& or_other) {
  command.add_option("-c,--calibration", calibration, calibration_formats + or_other)->required();
  add_fields_of_view_to(command);
}

void RigSettings::add_fields_of_view_to(CLI::App& command) {
  command
      .add_option(
          "--mask", masks,
          "Image, 0 = ignore the pixel (of a JPEG, below 128); one for all views or one for "
          "each (by comma)")
      ->delimiter(',');
  command
      .add_option(
          "--max-theta", max_theta,
          "Half angle of the lens's field of view, degrees; by default as calibrated, else, where "
          "distances are matched, up to where images turn black, if they do")
      ->check(CLI::Range(1.0, 180.0));
}

void RigSettings::add_mask_folder_to(CLI::App& command) {
  command.add_option(
      "--masks", mask_folder,
      "Folder of masks as COLMAP takes them: NAME.png for the image NAME, 0 = ignore "
      "the pixel");
}

void RigSettings::add_to(CLI::App& command, const std::string& or_other, const std::string& which) {
  add_whole_rig_to(command, or_other);
  command.add_option("--views", views, "Cameras of the calibration, from 0 (by comma)" + which)
      ->delimiter(',');
}

ws::Rig RigSettings::rig_for_images(std::size_t image_count, cv::Size size) const {
  const ws::Calibration read = ws::read_calibration(calibration, size);
  const ws::Rig& all = read.rig;
  std::vector<int> chosen = views;
  if (chosen.empty()) {
    for (std::size_t i = 0; i < image_count; ++i) chosen.push_back(static_cast<int>(i));
  }
  if (chosen.size() != image_count) {
    throw ws::Error("--views names " + std::to_string(chosen.size()) + " cameras for " +
                    std::to_string(image_count) + " images; name one for each image.");
  }
  ws::Rig rig;
  rig.world_from_imu = all.world_from_imu;
  for (const int view : chosen) {
    if (view < 0 || view >= static_cast<int>(all.views.size())) {
      throw ws::Error(calibration + " has " + std::to_string(all.views.size()) +
                      " camera(s); there is no camera " + std::to_string(view) + ". " +
                      remedy_of_cameras(read));
    }
    rig.views.push_back(all.views[static_cast<std::size_t>(view)]);
  }
  if (views.empty() && image_count < all.views.size()) {
    say("The images are taken to be of the first " + std::to_string(image_count) + " of the " +
        std::to_string(all.views.size()) + " cameras in " + calibration +
        "; --views chooses others.");
  }
  limit_fields_of_view(rig);
  return rig;
}

std::optional<ws::SfmModel> RigSettings::sfm_model() const {
  if (!ws::is_sfm_model(calibration)) return std::nullopt;
  return ws::SfmModel(calibration);
}

ws::CalibratedImages RigSettings::images_of(const ws::SfmModel& model,
                                            const std::vector<std::string>& files) const {
  if (!views.empty()) {
    throw ws::Error("--views has no meaning with a COLMAP model or transforms.json (" +
                    calibration + "), which names the camera of each image; leave it out.");
  }
  ws::CalibratedImages images = model.calibrated_files({files.begin(), files.end()});
  limit_fields_of_view(images.rig);
  apply_mask_folder(images.rig.views);
  return images;
}

cv::Mat stretched_within_view(const cv::Mat& image, const ws::View& view, const std::string& name) {
  ws::require_calibrated_size(image, view, name);
  return ws::to_stretched_grey_levels(image, name, field_of_view(view.camera, view.mask));
}

void add_mask(ws::View& view, const cv::Mat& mask, const std::string& name) {
  ws::require_mask_size(mask, view, name);
  // Not &=, as other views may share the pixels.
  view.mask = view.mask.empty() ? mask : cv::Mat(view.mask & mask);
}

void RigSettings::limit_fields_of_view(ws::Rig& rig) const {
  if (masks.size() > 1 && masks.size() != rig.views.size()) {
    throw ws::Error("--mask names " + std::to_string(masks.size()) + " images for " +
                    std::to_string(rig.views.size()) +
                    " views; give one for all or one for each (by comma).");
  }
  std::vector<cv::Mat> read;  // one for all views stays one in memory
  for (const std::string& file : masks) {
    read.push_back(ws::read_mask(file));
    if (cv::countNonZero(read.back()) > 0) continue;
    throw ws::Error("The mask " + file +
                    " is 0 everywhere, so that no pixel is left; 0 means to ignore the pixel.");
  }
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    ws::View& view = rig.views[i];
    if (max_theta > 0) view.camera.max_theta = max_theta * ws::radians_per_degree;
    if (read.empty()) continue;
    const std::size_t mask = read.size() == 1 ? 0 : i;
    add_mask(view, read[mask], masks[mask]);
  }
}

std::vector<bool> RigSettings::apply_mask_folder(std::vector<ws::View>& posed) const {
  std::vector<bool> masked(posed.size());
  if (mask_folder.empty()) return masked;
  if (!fs::is_directory(mask_folder)) {
    throw ws::Error(mask_folder +
                    " is no folder; give the one that holds NAME.png for the image NAME.");
  }
  const auto mask_of = [this](const ws::View& view) {
    return fs::path(mask_folder) / (view.name + ".png");
  };
  for (std::size_t i = 0; i < posed.size(); ++i) {
    ws::View& view = posed[i];
    const fs::path mask = mask_of(view);
    if (!fs::exists(mask)) continue;
    masked[i] = true;
    add_mask(view, ws::read_mask(mask), mask.string());
    if (cv::countNonZero(view.mask) == 0) {
      say(mask.string() + " leaves no pixel of " + view.name + ", of which nothing is matched.");
    }
  }
  const bool found = std::find(masked.begin(), masked.end(), true) != masked.end();
  if (!found && !posed.empty()) {
    throw ws::Error(mask_folder + " holds no mask of any image; there should be " +
                    mask_of(posed.front()).string() + ", for example.");
  }
  return masked;
}

bool RigSettings::looks_for_rim_of(const ws::Camera& camera) const {
  return max_theta == 0 && camera.max_theta >= std::numbers::pi && ws::may_show_rim(camera);
}

void RigSettings::leave_out_dark_rims(ws::Rig& rig, const std::vector<cv::Mat>& images) const {
  const std::vector<ws::View> calibrated = rig.views;
  std::vector<bool> done(calibrated.size());
  for (std::size_t i = 0; i < calibrated.size(); ++i) {
    const ws::Camera& camera = calibrated[i].camera;
    if (done[i] || !looks_for_rim_of(camera)) continue;
    // One camera may have taken several views, or cameras of one kind share their calibration.
    std::vector<ws::View*> of_camera;
    std::vector<cv::Mat> seen;
    for (std::size_t j = i; j < calibrated.size(); ++j) {
      if (!(calibrated[j].camera == camera)) continue;
      done[j] = true;
      of_camera.push_back(&rig.views[j]);
      seen.push_back(images[j]);
    }
    leave_out_dark_rim(of_camera, seen);
  }
}

void RigSettings::leave_out_dark_rim(const std::vector<ws::View*>& views,
                                     const std::vector<cv::Mat>& images) {
  const ws::Camera camera = views.front()->camera;
  std::vector<cv::Mat> of_its_size;
  for (const cv::Mat& image : images) {
    if (image.size() == cv::Size(camera.width, camera.height)) of_its_size.push_back(image);
  }
  const auto rim = ws::find_lens_rim(camera, of_its_size);
  if (!rim) return;
  std::vector<const ws::View*> limited;
  for (ws::View* view : views) {
    if (mask_leaves_out(*view, rim->dark)) continue;
    view->camera.max_theta = rim->usable;
    limited.push_back(view);
  }
  if (limited.empty()) return;
  const std::string others = limited.size() == views.size()
                                 ? "all images"
                                 : std::to_string(limited.size() - 1) + " other image(s)";
  say(limited.front()->name +
      (limited.size() > 1 ? ", like " + others + " that are calibrated alike," : "") +
      ws::formatted(" is black from %.1f degrees off the axis on and matched up to %.1f "
                    "(--max-theta 180 matches all).",
                    rim->dark * ws::degrees_per_radian, rim->usable * ws::degrees_per_radian));
}
