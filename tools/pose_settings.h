// SPDX-License-Identifier: MIT
// The command line's options of known poses, shared by the commands for images of a moving rig.
#pragma once

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "rig_settings.h"
#include "widestereo/rig.h"
#include "widestereo/sequence.h"

/// Poses of the rig, to world.
struct RigPoses {
  std::vector<Eigen::Isometry3d> poses;
  std::string of;                   ///< what the file holds, camera or imu; empty without poses
  std::vector<std::size_t> frames;  ///< that these are of
};

struct PoseSettings {
  static constexpr const char* camera = "camera";
  static constexpr const char* imu = "imu";

  std::string file;         ///< empty: none
  std::string of;           ///< camera or imu; empty: as the file's layout says
  double tolerance = 0.01;  ///< seconds

  /// Adds --poses, --poses-of and --poses-tolerance.
  void add_to(CLI::App& command, const std::string& purpose, const std::string& group);
  bool given() const { return !file.empty(); }
  /// The poses at the `chosen` ones of all frames; `calibration` names the file of the rig.
  /// `skip_frames`: those that have none are left out, and a line says so.
  RigPoses read(const widestereo::Rig& rig, const std::string& calibration,
                const std::vector<widestereo::SequenceFrame>& frames,
                const std::vector<std::size_t>& chosen, bool skip_frames) const;
};

/// Moves the views of a model that lies far from its origin, as in a national grid, to where single
/// precision does for their points, and says so. Returns what their positions are relative to then.
Eigen::Vector3d move_near_origin(std::vector<widestereo::View>& views);

/// A view of a rig at one of its poses, named after the frame.
widestereo::View posed_view(const widestereo::View& view, const Eigen::Isometry3d& world_from_rig,
                            const std::string& frame);

/// Adds the options that calibrated_images() takes.
void add_image_options(CLI::App& command, RigSettings& rig, PoseSettings& poses);

/// The calibrated views of images as RigSettings gives them; with poses, of images that a rig, or
/// one camera, took at different times: then all are of camera 0 unless `rig` names others, and the
/// rig's frame is that of the first image. `model`: as RigSettings::sfm_model() gives it.
widestereo::CalibratedImages calibrated_images(const RigSettings& rig, const PoseSettings& poses,
                                               const std::vector<std::string>& files, cv::Size size,
                                               const std::optional<widestereo::SfmModel>& model);
