// SPDX-License-Identifier: MIT
#include <cstdio>
#include <iostream>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>

#include "calibration_commands.h"
#include "calibration_fit.h"
#include "image_checks.h"
#include "option_checks.h"
#include "pose_settings.h"
#include "rig_settings.h"
#include "text/formatted.h"
#include "white_level.h"
#include "widestereo/epipolar.h"
#include "widestereo/error.h"
#include "widestereo/sharpness.h"

namespace ws = widestereo;

namespace {

struct CheckArguments {
  std::string left, right;
  RigSettings rig;
  PoseSettings poses;
  WhiteLevel white_level;
  bool as_json = false;
};

/// The median epipolar error, of points before the cameras; infinite where they are not.
double error_before_cameras(const ws::View& first, const ws::View& second,
                            const std::vector<ws::PixelMatch>& matches) {
  constexpr double none = std::numeric_limits<double>::infinity();
  try {
    const ws::EpipolarReport report = check_epipolar(first, second, matches);
    return lie_behind(report) ? none : report.median_pixels;
  } catch (const ws::Error&) {
    return none;  // too few features left
  }
}

Eigen::Vector2d last_pixel(const ws::View& view) {
  return {view.camera.width - 1, view.camera.height - 1};
}

/// The second view where its coordinates are R x + T of the first one's.
ws::View view_at(const ws::View& second, const ws::View& first, const Eigen::Matrix3d& rotation,
                 const Eigen::Vector3d& translation) {
  Eigen::Isometry3d second_from_first = Eigen::Isometry3d::Identity();
  second_from_first.linear() = rotation;
  second_from_first.translation() = translation;
  ws::View there = second;
  there.world_from_camera = first.world_from_camera * second_from_first.inverse();
  return there;
}

constexpr double as_good = 1.5;  // where errors hardly differ, nobody could tell

/// What was mistaken for what, where that explains the matches better than anything else and leaves
/// less than `limit` of their median error.
std::string mistake(const ws::View& first, const ws::View& second,
                    const std::vector<ws::PixelMatch>& matches, double limit, bool has_poses) {
  std::vector<ws::PixelMatch> swapped = matches;
  for (ws::PixelMatch& match : swapped) std::swap(match.first, match.second);
  std::vector<ws::PixelMatch> turned = matches;
  for (ws::PixelMatch& match : turned) {
    match.first = last_pixel(first) - match.first;
    match.second = last_pixel(second) - match.second;
  }
  ws::View first_there = first;
  ws::View second_there = second;
  std::swap(first_there.world_from_camera, second_there.world_from_camera);
  ws::View opposite = second;
  opposite.world_from_camera.translation() =
      2 * first.world_from_camera.translation() - second.world_from_camera.translation();
  std::vector<std::pair<const char*, double>> remedies = {
      {"swap the images", error_before_cameras(first, second, swapped)},
      {"invert the poses", error_before_cameras(first_there, second_there, matches)},
      {"turn the baseline round (-T)", error_before_cameras(first, opposite, matches)},
      {"turn both images by 180 degrees", error_before_cameras(first, second, turned)}};
  if (!has_poses) {
    const Eigen::Isometry3d motion = source_from_reference(second, first);
    const Eigen::Matrix3d r = motion.linear();
    const Eigen::Vector3d t = motion.translation();
    const Eigen::Matrix3d flip = Eigen::Vector3d(1, -1, -1).asDiagonal();
    const auto error_at = [&](const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
      return error_before_cameras(first, view_at(second, first, rotation, translation), matches);
    };
    remedies.emplace_back("transpose R", error_at(r.transpose(), t));
    remedies.emplace_back("turn the y and z axes of R and T round, which are OpenGL's",
                          error_at(flip * r * flip, flip * t));
    // Of cameras that hardly turn it is -T.
    const double of_centre = error_at(r, -(r * t));
    if (as_good * of_centre < remedies[2].second) {
      remedies.emplace_back("take -R T for T, which is where the camera is", of_centre);
    }
  }
  double least = limit;
  for (const auto& remedy : remedies) least = std::min(least, remedy.second);
  std::string words;
  for (const auto& [words_of_it, error] : remedies) {
    if (!(error < limit) || error > as_good * least) continue;
    words += (words.empty() ? "" : ", or ") + std::string(words_of_it);
  }
  return words;
}

std::string verdict_of(const ws::EpipolarReport& report, const ws::View& first,
                       const ws::View& second, const std::vector<ws::PixelMatch>& matches,
                       const CheckArguments& arguments, bool has_poses) {
  if (will_do(report)) {
    return report.median_pixels < 0.5 ? "good" : "usable, expect errors where texture is fine";
  }
  constexpr double much_less = 1.0 / 3;
  const double limit = lie_behind(report)
                           ? of_these_cameras
                           : std::min(of_these_cameras, much_less * report.median_pixels);
  const std::string remedy = mistake(first, second, matches, limit, has_poses);
  if (!remedy.empty()) return "wrong way round: " + remedy;
  if (!lie_behind(report) && report.median_pixels < of_these_cameras) {
    return has_poses ? "too inaccurate for stereo: calibrate again, or get better poses"
                     : "too inaccurate for stereo: calibrate again";
  }
  if (!has_poses) {
    return "does not fit: are the images of one moment, and of these cameras? Then calibrate again";
  }
  return std::string("does not fit: are the poses those of these images, to world") +
         (arguments.poses.given() ? ", with quaternions in their file's order?" : "?");
}

std::string distances_of(const ws::EpipolarReport& report, const char* unit) {
  if (lie_behind(report)) {
    return ws::formatted("%.0f %% of the features lie behind the cameras", 100 * report.behind);
  }
  if (!(report.nearest > 0)) return "no feature is near enough and matched well enough to tell";
  const auto text = [unit](double distance) {
    return ws::formatted(distance < 0.1 ? "%.2g" : "%.2f", distance) + unit;
  };
  return "5 % below " + text(report.nearest) + ", half below " + text(report.typical) +
         ", 95 % below " + text(report.farthest);
}

/// Whether the calibration will do for stereo.
bool check(const CheckArguments& arguments) {
  require_different_images({arguments.left, arguments.right});
  const cv::Mat left = arguments.white_level.read(arguments.left);
  const cv::Mat right = arguments.white_level.read(arguments.right);
  const std::optional<ws::SfmModel> model = arguments.rig.sfm_model();
  const ws::CalibratedImages images = calibrated_images(
      arguments.rig, arguments.poses, {arguments.left, arguments.right}, left.size(), model);
  const ws::View& first = images.rig.views[0];
  const ws::View& second = images.rig.views[1];
  ws::require_calibrated_size(left, first, arguments.left);
  ws::require_calibrated_size(right, second, arguments.right);
  require_different_pictures(images.rig, {left, right});
  const std::vector<ws::PixelMatch> matches = ws::match_features(left, right);
  const ws::EpipolarReport r = check_epipolar(first, second, matches);
  const auto sharpness = ws::compare_sharpness(first, second, left, right, matches);
  // Negative where the second image is the sharper one.
  const double blur = !sharpness ? 0 : sharpness->sharper == 0 ? sharpness->blur : -sharpness->blur;
  const std::string verdict =
      verdict_of(r, first, second, matches, arguments, model || arguments.poses.given());
  if (images.in_metres && !arguments.poses.given()) report_long_baseline(images.rig);
  if (arguments.as_json) {
    // 0: there is none
    const auto distance = [](double value) {
      return value > 0 ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
    };
    std::cout << nlohmann::ordered_json({{"matches", r.matches},
                                         {"median_pixels", r.median_pixels},
                                         {"median_degrees", r.median_degrees},
                                         {"below_1_pixel", r.below_1_pixel},
                                         {"below_5_pixels", r.below_5_pixels},
                                         {"behind", r.behind},
                                         {"distance_p5", distance(r.nearest)},
                                         {"distance_p50", distance(r.typical)},
                                         {"distance_p95", distance(r.farthest)},
                                         {"first_sharper_by_pixels", blur},
                                         {"baseline", baseline(first, second)},
                                         {"verdict", verdict}})
                     .dump(2)
              << "\n";
    return will_do(r);
  }
  std::printf(
      "%d matched features\n"
      "epipolar error: median %.2f px, %.3f degrees; %.0f %% below 1 px, %.0f %% below 5 px\n"
      "distances: %s\n"
      "calibration: %s\n",
      r.matches, r.median_pixels, r.median_degrees, 100 * r.below_1_pixel, 100 * r.below_5_pixels,
      distances_of(r, images.in_metres ? " m" : "").c_str(), verdict.c_str());
  if (sharpness) {
    std::printf("sharpness: %s is as sharp as %s blurred by %.2f px; see to the focus\n",
                (blur > 0 ? second : first).name.c_str(), (blur > 0 ? first : second).name.c_str(),
                sharpness->blur);
  }
  return will_do(r);
}

}  // namespace

void add_calibration_check_command(CLI::App& group) {
  CLI::App* command = group.add_subcommand(
      "check",
      "Measure the epipolar error of features matched between two images; ends with 0 where the "
      "calibration will do for stereo, with 2 where it will not");
  auto arguments = std::make_shared<CheckArguments>();
  command->add_option("left", arguments->left, "Image of the first camera")->required();
  command->add_option("right", arguments->right, "Image of the second camera")->required();
  add_image_options(*command, arguments->rig, arguments->poses);
  arguments->white_level.add_to(*command);
  command->add_flag("--json", arguments->as_json, "Print JSON");
  command->callback([arguments] {
    constexpr int will_not_do = 2;  // 1 is that of errors
    if (!check(*arguments)) throw CLI::RuntimeError(will_not_do);
  });
}
