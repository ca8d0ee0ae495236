// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace widestereo {

/// The images that a rig took at one time.
struct SequenceFrame {
  std::string name;                           ///< the files' name without extension
  std::vector<std::filesystem::path> images;  ///< one for each camera asked for
  std::optional<std::int64_t> nanoseconds;    ///< time stamp, where the data set has them
};

/// Frames of a data set in the order of time, for these cameras. Layouts: FOLDER/camN/ with images,
/// frames being those of equal names, in numerical (or alphabetical) order; or EuRoC and TUM VI:
/// FOLDER[/mav0]/camN/data/ with camN/data.csv (`#timestamp [ns],filename`), frames being those of
/// equal times. Images named by 16 digits or more are taken to be named by nanoseconds. Throws
/// Error for missing folders, no images, or a frame that some camera lacks unless those are to be
/// skipped.
std::vector<SequenceFrame> read_sequence(const std::filesystem::path& folder,
                                         const std::vector<int>& cameras,
                                         bool skip_incomplete = false);

/// Pose of the rig at a time.
struct StampedPose {
  double seconds = 0;
  Eigen::Isometry3d world_from_rig = Eigen::Isometry3d::Identity();  ///< metres
};

/// Reads a TUM trajectory: lines `seconds tx ty tz qx qy qz qw`, # comments. Throws Error naming
/// the line for anything but eight finite numbers and a quaternion of length 1.
std::vector<StampedPose> read_trajectory(const std::filesystem::path& path);

/// The pose of every frame: the one nearest in time, within `tolerance` seconds, where frames have
/// times; else in their order, where there are as many. Throws Error otherwise; `name` (of the
/// file) begins the message.
std::vector<Eigen::Isometry3d> poses_of_frames(const std::vector<SequenceFrame>& frames,
                                               const std::vector<StampedPose>& trajectory,
                                               double tolerance, const std::string& name);

}  // namespace widestereo
