// SPDX-License-Identifier: MIT
#include "pose_settings.h"

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <utility>

#include "frame_settings.h"
#include "option_checks.h"
#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"

namespace ws = widestereo;

void PoseSettings::add_to(CLI::App& command, const std::string& purpose, const std::string& group) {
  command
      .add_option("--poses", file,
                  "TUM trajectory of camera 0 of the calibration, or ground truth of EuRoC or TUM "
                  "VI (data.csv, of the IMU), to world; " +
                      purpose)
      ->group(group);
  command
      .add_option(
          "--poses-of", of,
          "What the poses are of: camera (0 of the calibration) or imu (the calibration says where "
          "it is); by default as the file's layout says")
      ->check(CLI::IsMember({camera, imu}))
      ->needs("--poses")
      ->group(group);
  command
      .add_option("--poses-tolerance", tolerance,
                  "Largest time between an image and the nearest pose, seconds; images between two "
                  "poses get what lies between these")
      ->check(non_negative_number())
      ->needs("--poses")
      ->capture_default_str()
      ->group(group);
}

RigPoses PoseSettings::read(const ws::Rig& rig, const std::string& calibration,
                            const std::vector<ws::SequenceFrame>& frames,
                            const std::vector<std::size_t>& chosen, bool skip_frames) const {
  ws::Trajectory trajectory = ws::read_trajectory(file);
  const std::string by_layout = trajectory.body == ws::Body::imu ? imu : camera;
  RigPoses read{.poses = {}, .of = of.empty() ? by_layout : of, .frames = chosen};
  if (read.of == imu) {
    if (!rig.world_from_imu) {
      throw ws::Error(file + " holds poses of the IMU, but " + calibration +
                      " does not say where that is; add its T_cam_imu (Kalibr) or T_imu_cam "
                      "(Basalt), or give --poses-of camera if they are of camera 0.");
    }
    const double ahead = rig.views.front().imu_time_offset;
    trajectory.poses = ws::poses_of_camera(std::move(trajectory.poses), *rig.world_from_imu, ahead);
    if (ahead != 0) {
      say(ws::formatted(
          "The IMU's poses are those at the times of the images plus %.6f s, as %s says.", ahead,
          calibration.c_str()));
    }
  }
  if (skip_frames) {
    const auto found = ws::frames_with_poses(frames, chosen, trajectory.poses, tolerance);
    // Where there is none at all, poses_of_frames() says what is wrong.
    if (!found.empty() && found.size() < chosen.size()) {
      const auto first = std::mismatch(found.begin(), found.end(), chosen.begin()).second;
      report_left_out(chosen.size() - found.size(), chosen.size(),
                      "as " + file + " has no pose of their time", frames[*first].name);
      read.frames = found;
    }
  }
  read.poses =
      ws::poses_of_frames(frames, read.frames, std::move(trajectory.poses), tolerance, file);
  return read;
}

Eigen::Vector3d move_near_origin(std::vector<ws::View>& views) {
  if (views.empty()) return Eigen::Vector3d::Zero();
  const Eigen::Vector3d origin = ws::local_origin(views.front());
  if (origin.isZero()) return origin;
  for (ws::View& view : views) view.world_from_camera.translation() -= origin;
  say(
      ws::formatted("Poses and clouds are relative to (%.0f, %.0f, %.0f), as the model or "
                    "trajectory lies far from its origin.",
                    origin.x(), origin.y(), origin.z()));
  return origin;
}

ws::View posed_view(const ws::View& view, const Eigen::Isometry3d& world_from_rig,
                    const std::string& frame) {
  ws::View posed = view;
  posed.name = frame + "/" + view.name;
  posed.world_from_camera = world_from_rig * view.world_from_camera;
  return posed;
}

void add_image_options(CLI::App& command, RigSettings& rig, PoseSettings& poses) {
  rig.add_to(command, RigSettings::or_model);
  rig.add_mask_folder_to(command);
  poses.add_to(
      command,
      "of images taken one after the other, all by camera 0 unless --views names others; by time, "
      "or one for each in their order, sorted by time",
      "Moving cameras");
}

ws::CalibratedImages calibrated_images(const RigSettings& rig_settings,
                                       const PoseSettings& pose_settings,
                                       const std::vector<std::string>& files, cv::Size size,
                                       const std::optional<ws::SfmModel>& model) {
  if (model) {
    if (pose_settings.given()) {
      throw ws::Error("--poses has no meaning with a COLMAP model or transforms.json (" +
                      rig_settings.calibration + "), which holds the poses; leave it out.");
    }
    return rig_settings.images_of(*model, files);
  }
  if (!rig_settings.mask_folder.empty()) {
    throw ws::Error("--masks is for images of a COLMAP model or transforms.json, which " +
                    rig_settings.calibration +
                    " is not; give --mask, one for all images or one for each.");
  }
  if (!pose_settings.given()) {
    require_different_cameras(rig_settings.views,
                              "from one place; name another, or give --poses if it has moved");
    return {rig_settings.rig_for_images(files.size(), size)};
  }
  RigSettings settings = rig_settings;
  if (settings.views.empty()) settings.views.assign(files.size(), 0);
  ws::Rig rig = settings.rig_for_images(files.size(), size);
  std::vector<std::string> names;
  for (const std::filesystem::path file : files) names.push_back(file.stem().string());
  const bool of_any_clock = ws::end_in_seconds(names);
  std::vector<ws::SequenceFrame> frames;
  for (std::size_t i = 0; i < files.size(); ++i) {
    frames.push_back({names[i], {files[i]}, ws::time_in_name(names[i], of_any_clock)});
  }
  std::vector<std::size_t> all(frames.size());
  std::iota(all.begin(), all.end(), 0);
  const std::vector<Eigen::Isometry3d> poses =
      pose_settings.read(rig, settings.calibration, frames, all, false).poses;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    ws::View& view = rig.views[i];
    // Cameras may have taken their images at the same time, under the same name.
    view.name = rig_settings.views.empty() ? frames[i].name : frames[i].name + "/" + view.name;
    view.world_from_camera = poses.front().inverse() * poses[i] * view.world_from_camera;
  }
  ws::validate(rig, pose_settings.file);
  return {rig};
}
