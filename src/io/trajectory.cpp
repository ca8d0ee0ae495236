// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "widestereo/error.h"
#include "widestereo/sequence.h"

namespace widestereo {
namespace {

StampedPose pose_of_line(const std::string& line, const std::string& where) {
  std::istringstream stream(line);
  std::array<double, 8> v{};
  std::string word;
  std::size_t count = 0;
  while (stream >> word) {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (*end != '\0' || !std::isfinite(value) || count == v.size()) {
      throw Error(where + " is no \"seconds tx ty tz qx qy qz qw\" of eight finite numbers.");
    }
    v[count++] = value;
  }
  if (count != v.size()) {
    throw Error(where + " has " + std::to_string(count) +
                " numbers; a pose is \"seconds tx ty tz qx qy qz qw\".");
  }
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  if (std::abs(rotation.norm() - 1) > 1e-2) {
    throw Error(where + " has a quaternion of length " + std::to_string(rotation.norm()) +
                " instead of 1; the order is qx qy qz qw.");
  }
  StampedPose pose;
  pose.seconds = v[0];
  pose.world_from_rig = Eigen::Translation3d(v[1], v[2], v[3]) * rotation.normalized();
  return pose;
}

}  // namespace

std::vector<StampedPose> read_trajectory(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error("Cannot read the poses " + path.string() + "; check the path.");
  std::vector<StampedPose> poses;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    poses.push_back(pose_of_line(line, path.string() + " line " + std::to_string(number)));
  }
  if (poses.empty()) throw Error("There are no poses in " + path.string() + ".");
  std::stable_sort(poses.begin(), poses.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.seconds < b.seconds;
  });
  return poses;
}

std::vector<Eigen::Isometry3d> poses_of_frames(const std::vector<SequenceFrame>& frames,
                                               const std::vector<StampedPose>& trajectory,
                                               double tolerance, const std::string& name) {
  const bool have_times = std::all_of(frames.begin(), frames.end(), [](const SequenceFrame& frame) {
    return frame.nanoseconds.has_value();
  });
  std::vector<Eigen::Isometry3d> poses;
  if (!have_times) {
    if (trajectory.size() != frames.size()) {
      throw Error(name + " has " + std::to_string(trajectory.size()) + " poses for " +
                  std::to_string(frames.size()) +
                  " frames without time stamps; give one pose for each frame.");
    }
    for (const StampedPose& pose : trajectory) poses.push_back(pose.world_from_rig);
    return poses;
  }
  for (const SequenceFrame& frame : frames) {
    const double seconds = static_cast<double>(*frame.nanoseconds) * 1e-9;
    const auto apart = [seconds](const StampedPose& pose) {
      return std::abs(pose.seconds - seconds);
    };
    auto nearest =
        std::lower_bound(trajectory.begin(), trajectory.end(), seconds,
                         [](const StampedPose& pose, double time) { return pose.seconds < time; });
    if (nearest == trajectory.end() ||
        (nearest != trajectory.begin() && apart(*(nearest - 1)) < apart(*nearest))) {
      --nearest;
    }
    if (!(apart(*nearest) <= tolerance)) {
      throw Error(name + " has no pose within " + std::to_string(tolerance) + " s of the frame " +
                  frame.name + " (the nearest is " + std::to_string(apart(*nearest)) +
                  " s away); check the clocks, choose frames or raise the tolerance.");
    }
    poses.push_back(nearest->world_from_rig);
  }
  return poses;
}

}  // namespace widestereo
