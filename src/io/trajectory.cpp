// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "geometry/validation.h"
#include "io/frame_times.h"
#include "text/lower_case.h"
#include "text/number.h"
#include "text/text_input.h"
#include "widestereo/error.h"
#include "widestereo/sequence.h"

namespace widestereo {
namespace {

constexpr std::size_t numbers_of_pose = 8;  // time, position, quaternion
constexpr std::size_t first_of_quaternion = 4;
constexpr const char* space = " \t\r";

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(space);
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(space) + 1 - first);
}

std::vector<std::string> words_of(const std::string& line, bool comma_separated) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  std::string word;
  if (comma_separated) {
    while (std::getline(stream, word, ',')) words.push_back(trimmed(word));
  } else {
    while (stream >> word) words.push_back(word);
  }
  return words;
}

/// A comma follows the first number.
bool is_comma_separated(const std::string& line) {
  const std::size_t after = line.find_first_not_of(space, line.find_first_of(" \t\r,"));
  return after != std::string::npos && line[after] == ',';
}

/// Whether a line begins with a letter and none of its words is a number, not even NaN.
bool names_columns(const std::string& line) {
  const std::vector<std::string> words = words_of(line, line.find(',') != std::string::npos);
  return std::isalpha(static_cast<unsigned char>(line.front())) != 0 &&
         std::none_of(words.begin(), words.end(), [](const std::string& word) {
           char* end = nullptr;
           std::strtod(word.c_str(), &end);
           return *end == '\0';
         });
}

/// The last letters of the columns' names, before their units, in lower case.
std::string last_letters(const std::vector<std::string>& names) {
  std::string letters;
  for (const std::string& name : names) {
    const std::string word = trimmed(name.substr(0, name.find('[')));
    letters += word.empty() ? ' ' : word.back();
  }
  return lower_case(letters);
}

/// Throws Error where a comment names the quaternion's w in another place than it is looked for.
void require_order_of(const std::string& comment, bool w_first, const std::string& name) {
  const std::size_t begin = comment.find_first_not_of("# \t\r");
  if (begin == std::string::npos) return;
  const bool by_commas = comment.find(',') != std::string::npos;
  const std::string letters = last_letters(words_of(comment.substr(begin), by_commas));
  const auto names = [&letters](const char* quaternion) {
    return letters.compare(std::min(first_of_quaternion, letters.size()), 4, quaternion) == 0;
  };
  if (w_first && names("xyzw")) {
    throw Error(name + " names the quaternion's w last; write qw,qx,qy,qz.");
  }
  if (!w_first && names("wxyz")) {
    throw Error(name + " names the quaternion's w first; write qx qy qz qw.");
  }
}

/// ORB-SLAM3's trajectories in EuRoC's form have nanoseconds between blanks.
double seconds(double time) {
  constexpr double earliest_nanosecond = 1e17;  // of 1973
  return time < earliest_nanosecond ? time : time * seconds_per_nanosecond;
}

/// How all lines of a file hold poses, told by its first one.
class PoseLine {
 public:
  explicit PoseLine(const std::string& first)
      : comma_separated_(is_comma_separated(first)),
        form_(comma_separated_ ? "\"nanoseconds,px,py,pz,qw,qx,qy,qz\""
                               : "\"seconds tx ty tz qx qy qz qw\""),
        columns_(comma_separated_
                     ? std::max(words_of(first, comma_separated_).size(), numbers_of_pose)
                     : numbers_of_pose) {}

  bool comma_separated() const { return comma_separated_; }

  StampedPose pose(const std::string& line, const std::string& where) const {
    const std::vector<std::string> words = words_of(line, comma_separated_);
    if (words.size() != columns_) {
      throw Error(where + " has " + std::to_string(words.size()) + " value(s) instead of " +
                  std::to_string(columns_) + "; a pose is " + form_ + ".");
    }
    std::array<double, numbers_of_pose> v{};
    for (std::size_t i = 0; i < v.size(); ++i) v[i] = number(words[i], where);
    const Eigen::Quaterniond rotation = comma_separated_
                                            ? Eigen::Quaterniond(v[4], v[5], v[6], v[7])
                                            : Eigen::Quaterniond(v[7], v[4], v[5], v[6]);
    StampedPose pose;
    pose.seconds = comma_separated_ ? seconds_of_nanoseconds(words[0], where) : seconds(v[0]);
    pose.world_from_body = Eigen::Translation3d(v[1], v[2], v[3]) *
                           require_unit(rotation, where, "a pose is " + form_);
    return pose;
  }

 private:
  double number(const std::string& word, const std::string& where) const {
    const std::optional<double> value = number_of(word);
    if (!value) throw Error(where + " is no " + form_ + " of finite numbers.");
    return *value;
  }

  double seconds_of_nanoseconds(const std::string& word, const std::string& where) const {
    std::int64_t nanoseconds = 0;
    const char* end = word.data() + word.size();
    const auto result = std::from_chars(word.data(), end, nanoseconds);
    if (result.ec != std::errc() || result.ptr != end) {
      throw Error(where + " has the time " + word +
                  ", which is no whole number of nanoseconds; a pose is " + form_ + ".");
    }
    return static_cast<double>(nanoseconds) * seconds_per_nanosecond;
  }

  bool comma_separated_;
  std::string form_;
  std::size_t columns_;
};

/// Of two that differ, which one is right nobody could tell.
void require_one_pose_a_time(const std::vector<StampedPose>& sorted, const std::string& name) {
  const auto first = std::adjacent_find(
      sorted.begin(), sorted.end(), [](const StampedPose& a, const StampedPose& b) {
        return a.seconds == b.seconds && a.world_from_body.matrix() != b.world_from_body.matrix();
      });
  if (first == sorted.end()) return;
  const StampedPose& second = *(first + 1);
  const bool are_of_lines = first->line > 0 && second.line > 0;
  throw Error(name + " has two poses of the time " + text_of(first->seconds) +
              (are_of_lines ? ", in line " + std::to_string(first->line) + " and in line " +
                                  std::to_string(second.line)
                            : "") +
              "; leave one.");
}

bool is_earlier(const StampedPose& a, const StampedPose& b) { return a.seconds < b.seconds; }

/// Nothing where they differ by the rounding of seconds since 1970 alone.
double apart(const StampedPose& pose, double seconds) {
  constexpr double rounding = 1e-6;
  const double apart = std::abs(pose.seconds - seconds);
  return apart > rounding ? apart : 0;
}

double seconds_of(const SequenceFrame& frame) {
  return static_cast<double>(*frame.nanoseconds) * seconds_per_nanosecond;
}

/// The first pose at that time or later, of poses in the order of their times.
std::vector<StampedPose>::const_iterator first_from(const std::vector<StampedPose>& trajectory,
                                                    double seconds) {
  return std::lower_bound(trajectory.begin(), trajectory.end(), seconds,
                          [](const StampedPose& pose, double time) { return pose.seconds < time; });
}

/// Of poses in the order of their times, at least one.
const StampedPose& nearest_in_time(const std::vector<StampedPose>& trajectory, double seconds) {
  auto nearest = first_from(trajectory, seconds);
  if (nearest == trajectory.end() || (nearest != trajectory.begin() &&
                                      apart(*(nearest - 1), seconds) < apart(*nearest, seconds))) {
    --nearest;
  }
  return *nearest;
}

/// Where the body was at that time: between the poses before and after, as if it moved uniformly
/// from one to the other; the first or last one's place beyond. Poses in the order of their times.
Eigen::Isometry3d pose_at(const std::vector<StampedPose>& trajectory, double seconds) {
  const auto after = first_from(trajectory, seconds);
  if (after == trajectory.end()) return trajectory.back().world_from_body;
  if (after == trajectory.begin() || after->seconds == seconds) return after->world_from_body;
  const StampedPose& before = *(after - 1);
  const double share = (seconds - before.seconds) / (after->seconds - before.seconds);
  const Eigen::Isometry3d& from = before.world_from_body;
  const Eigen::Isometry3d& to = after->world_from_body;
  const Eigen::Quaterniond rotation =
      Eigen::Quaterniond(from.linear()).slerp(share, Eigen::Quaterniond(to.linear()));
  return Eigen::Translation3d((1 - share) * from.translation() + share * to.translation()) *
         rotation.normalized();
}

/// Which frame has no time though others have one, empty if none has.
std::string without_time(const std::vector<SequenceFrame>& frames) {
  const auto first = std::find_if_not(frames.begin(), frames.end(), has_time);
  if (first == frames.end() || std::none_of(frames.begin(), frames.end(), has_time)) return "";
  return " (the first is " + first->name + ")";
}

}  // namespace

Trajectory read_trajectory(const std::filesystem::path& path) {
  std::error_code ignored;  // a file that cannot be opened is refused next
  if (std::filesystem::is_directory(path, ignored)) {
    throw Error("The poses " + path.string() + " are a folder; give the file in it.");
  }
  TextInput file(path);
  Trajectory trajectory;
  std::optional<PoseLine> layout;
  std::vector<std::string> comments;
  std::string line;
  for (int number = 1; file.next_line(line); ++number) {
    const std::size_t first = line.find_first_not_of(space);
    if (first == std::string::npos) continue;
    // Tables of other programs name their columns without it.
    if (line[first] == '#' || (!layout && names_columns(line.substr(first)))) {
      if (!layout) comments.push_back(line);
      continue;
    }
    if (!layout) {
      layout.emplace(line.substr(first));
      for (const std::string& comment : comments) {
        require_order_of(comment, layout->comma_separated(), path.string());
      }
    }
    trajectory.poses.push_back(
        layout->pose(line, path.string() + " line " + std::to_string(number)));
    trajectory.poses.back().line = number;
  }
  if (!layout) {
    throw Error("There are no poses in " + path.string() +
                "; give a TUM trajectory, or the data.csv of EuRoC's or TUM VI's ground truth.");
  }
  if (layout->comma_separated()) trajectory.body = Body::imu;
  return trajectory;
}

std::vector<StampedPose> poses_of_camera(std::vector<StampedPose> poses_of_imu,
                                         const Eigen::Isometry3d& camera_from_imu,
                                         double imu_time_offset) {
  const Eigen::Isometry3d imu_from_camera = camera_from_imu.inverse();
  for (StampedPose& pose : poses_of_imu) {
    pose.world_from_body = pose.world_from_body * imu_from_camera;
    pose.seconds -= imu_time_offset;
  }
  return poses_of_imu;
}

std::vector<std::size_t> frames_with_poses(const std::vector<SequenceFrame>& frames,
                                           const std::vector<std::size_t>& chosen,
                                           std::vector<StampedPose> trajectory, double tolerance) {
  const bool all_finite =
      std::all_of(trajectory.begin(), trajectory.end(),
                  [](const StampedPose& pose) { return std::isfinite(pose.seconds); });
  if (!have_times(frames) || trajectory.empty() || !all_finite) return chosen;
  std::stable_sort(trajectory.begin(), trajectory.end(), is_earlier);
  std::vector<std::size_t> found;
  for (const std::size_t i : chosen) {
    require_number(i, frames.size(), "frame", "The sequence");
    const double seconds = seconds_of(frames[i]);
    if (apart(nearest_in_time(trajectory, seconds), seconds) <= tolerance) found.push_back(i);
  }
  return found;
}

std::vector<Eigen::Isometry3d> poses_of_frames(const std::vector<SequenceFrame>& frames,
                                               const std::vector<std::size_t>& chosen,
                                               std::vector<StampedPose> trajectory,
                                               double tolerance, const std::string& name) {
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (std::isfinite(trajectory[i].seconds)) continue;
    throw Error(name + ": pose " + std::to_string(i + 1) + " has no finite time; give it one.");
  }
  std::vector<Eigen::Isometry3d> poses;
  if (!have_times(frames)) {
    if (trajectory.size() != frames.size()) {
      throw Error(name + " has " + std::to_string(trajectory.size()) + " poses for " +
                  std::to_string(frames.size()) + " frames without time stamps" +
                  without_time(frames) +
                  "; give one pose for each frame, or name images by their times.");
    }
    // Whether frame k's is the k-th of the file or the k-th in time, nobody could tell.
    const auto late = std::is_sorted_until(trajectory.begin(), trajectory.end(), is_earlier);
    if (late != trajectory.end()) {
      throw Error(name + ": pose " + std::to_string(late - trajectory.begin() + 1) +
                  " is earlier than the one before it, but frames without time stamps take poses "
                  "in their order; sort the file by time.");
    }
    for (const std::size_t i : chosen) {
      require_number(i, frames.size(), "frame", "The sequence");
      poses.push_back(trajectory[i].world_from_body);
    }
    return poses;
  }
  if (trajectory.empty()) throw Error("There are no poses in " + name + ".");
  std::stable_sort(trajectory.begin(), trajectory.end(), is_earlier);
  require_one_pose_a_time(trajectory, name);
  for (const std::size_t i : chosen) {
    require_number(i, frames.size(), "frame", "The sequence");
    const SequenceFrame& frame = frames[i];
    const double seconds = seconds_of(frame);
    const StampedPose& nearest = nearest_in_time(trajectory, seconds);
    if (!(apart(nearest, seconds) <= tolerance)) {
      // Single precision has no digits of the subtraction's rounding.
      throw Error(name + " has no pose within " + text_of(tolerance) + " s of the frame " +
                  frame.name + " (the nearest is " +
                  text_of(static_cast<float>(apart(nearest, seconds))) +
                  " s away); check the clocks, choose or skip frames, or raise the tolerance.");
    }
    poses.push_back(pose_at(trajectory, seconds));
  }
  return poses;
}

}  // namespace widestereo
