// SPDX-License-Identifier: MIT
#include "pose_settings.h"

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
      .add_option("--poses-of", of,
                  "What the poses are of: camera (0 of the calibration) or imu (the calibration "
                  "has T_cam_imu or T_imu_cam); by default as the file's layout says")
      ->check(CLI::IsMember({camera, imu}))
      ->needs("--poses")
      ->group(group);
  command
      .add_option("--poses-tolerance", tolerance,
                  "Largest difference of time between image and pose, seconds")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str()
      ->group(group);
}

RigPoses PoseSettings::read(const ws::Rig& rig, const std::string& calibration,
                            const std::vector<ws::SequenceFrame>& frames,
                            const std::vector<std::size_t>& chosen) const {
  ws::Trajectory trajectory = ws::read_trajectory(file);
  const std::string by_layout = trajectory.body == ws::Body::imu ? imu : camera;
  RigPoses read{.poses = {}, .of = of.empty() ? by_layout : of};
  if (read.of == imu) {
    if (!rig.world_from_imu) {
      throw ws::Error(file + " holds poses of the IMU, but " + calibration +
                      " does not say where that is; add its T_cam_imu (Kalibr) or T_imu_cam "
                      "(Basalt), or give --poses-of camera if they are of camera 0.");
    }
    trajectory.poses = ws::poses_of_camera(std::move(trajectory.poses), *rig.world_from_imu);
  }
  read.poses = ws::poses_of_frames(frames, chosen, trajectory.poses, tolerance, file);
  return read;
}
