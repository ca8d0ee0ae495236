// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/eigen_layout.h"
#include "widestereo/error.h"

namespace widestereo {

/// The images that a rig took at one time.
struct SequenceFrame {
  std::string name;                           ///< the files' name without extension
  std::vector<std::filesystem::path> images;  ///< of each camera asked for; empty = it has none
  std::optional<std::int64_t> nanoseconds;    ///< time stamp, where the data set has them
};

/// Nanoseconds since 1970 that the number at the end of a file's name without extension stands for,
/// by its digits (before a point): seconds (10), milliseconds (13), microseconds (16) or
/// nanoseconds (19). Nothing for other numbers, nor for counters, which start with 0, nor where
/// something follows the number. `of_any_clock`: a number of fewer digits before a point is
/// seconds, too, as of a simulator's clock, which starts at 0.
std::optional<std::int64_t> time_in_name(const std::string& name, bool of_any_clock = false);

/// Whether the names of a set of images are of such a clock: all have a point in their last number
/// and as many digits after it, or as many as these need, for 1.9 and 1.10 are something else.
bool end_in_seconds(const std::vector<std::string>& names);

/// Frames of a data set in the order of time, for these cameras. Layouts: FOLDER/camN/ with images,
/// frames being those of equal names, in alphabetical order but for numbers within names, which
/// count as numbers; or EuRoC and TUM VI: FOLDER[/mav0]/camN/data/ with camN/data.csv (`#timestamp
/// [ns],filename`), frames being those of equal times. Without that list frames have the time in
/// their names. Where no name is in all folders, the numbers in names that differ within a folder
/// tell frames apart (left_07 and right_07), and `time_tolerance` (seconds) makes one frame of
/// images that are that near to each other. Throws Error for missing folders, two cameras with one
/// folder, no images, or a frame that some camera lacks, also a file that is listed, unless there
/// may be such frames; all of them may not.
std::vector<SequenceFrame> read_sequence(const std::filesystem::path& folder,
                                         const std::vector<int>& cameras,
                                         bool allow_incomplete = false, double time_tolerance = 0);

/// The same of cameras whose images are in these folders, at least one: each holds images, or data/
/// with images and perhaps data.csv.
std::vector<SequenceFrame> read_sequence(const std::vector<std::filesystem::path>& camera_folders,
                                         bool allow_incomplete = false, double time_tolerance = 0);

/// Whether all cameras have an image of the frame.
bool is_complete(const SequenceFrame& frame);

/// What poses are of: camera 0 of the calibration, whose frame is the rig's, or the IMU (the body).
enum class Body { camera, imu };

/// Pose of a body at a time.
struct StampedPose {
  double seconds = 0;
  Eigen::Isometry3d world_from_body = Eigen::Isometry3d::Identity();  ///< metres
  int line = 0;  ///< of the file, from 1; 0 where it is of none
};

struct Trajectory {
  std::vector<StampedPose> poses;  ///< in the file's order
  Body body = Body::camera;        ///< what files of this layout hold
};

/// Reads a TUM trajectory (of the camera): lines `seconds tx ty tz qx qy qz qw`, or with
/// nanoseconds since 1970 (1e17 and more), as ORB-SLAM3 writes; or the ground truth of EuRoC
/// (mav0/state_groundtruth_estimate0/data.csv) and TUM VI (mav0/mocap0/data.csv) (of the IMU):
/// lines `nanoseconds,px,py,pz,qw,qx,qy,qz`, further columns ignored. The first line that is no #
/// comment tells them apart. Throws Error naming the line for anything but finite numbers, whole
/// nanoseconds, as many columns in every line and a quaternion of length 1.
Trajectory read_trajectory(const std::filesystem::path& path);

/// The poses of the camera, at times of its images, from those of the IMU; with
/// Rig::world_from_imu, those of the rig. `imu_time_offset`: the view's, seconds.
std::vector<StampedPose> poses_of_camera(std::vector<StampedPose> poses_of_imu,
                                         const Eigen::Isometry3d& camera_from_imu,
                                         double imu_time_offset);

/// Those of the chosen ones among all frames (by index) for which poses_of_frames() has a pose near
/// enough in time; all of them where frames have no times.
std::vector<std::size_t> frames_with_poses(const std::vector<SequenceFrame>& frames,
                                           const std::vector<std::size_t>& chosen,
                                           std::vector<StampedPose> trajectory, double tolerance);

/// The poses of the chosen ones among all frames (by index). Where frames have times: interpolated
/// between the poses before and after, of which the nearer one, or the trajectory's end, lies
/// within `tolerance` seconds; no two poses of one time may differ. Else the poses in their order,
/// where there are as many and their times do not go back. Throws Error otherwise; `name` (of the
/// file) begins the message.
std::vector<Eigen::Isometry3d> poses_of_frames(const std::vector<SequenceFrame>& frames,
                                               const std::vector<std::size_t>& chosen,
                                               std::vector<StampedPose> trajectory,
                                               double tolerance, const std::string& name);

}  // namespace widestereo
