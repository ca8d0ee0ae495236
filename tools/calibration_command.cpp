// SPDX-License-Identifier: MIT
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "commands.h"
#include "geometry/angle.h"
#include "json_text.h"
#include "pose_settings.h"
#include "rig_settings.h"
#include "white_level.h"
#include "widestereo/calibration.h"
#include "widestereo/epipolar.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/image_io.h"
#include "widestereo/rig_refinement.h"
#include "widestereo/sharpness.h"

namespace ws = widestereo;

namespace {

struct CalibrationArguments {
  std::string file, output, format = "kalibr";
  std::string left, right;
  std::vector<std::string> images;
  bool intrinsics = false;
  RigSettings rig;
  PoseSettings poses;
  WhiteLevel white_level;
  bool as_json = false;
};

const char* name_of(ws::CalibrationFormat format) {
  switch (format) {
    case ws::CalibrationFormat::kalibr:
      return "Kalibr";
    case ws::CalibrationFormat::basalt:
      return "Basalt";
    case ws::CalibrationFormat::opencv:
      return "OpenCV";
    case ws::CalibrationFormat::euroc:
      return "EuRoC";
    case ws::CalibrationFormat::camodocal:
      return "CamOdoCal";
    case ws::CalibrationFormat::vins:
      return "VINS-Fusion";
    case ws::CalibrationFormat::ocam:
      return "OCam";
    case ws::CalibrationFormat::omnimvs:
      return "OmniMVS";
    case ws::CalibrationFormat::multicol:
      return "MultiCol-SLAM";
    case ws::CalibrationFormat::woodscape:
      return "WoodScape";
    case ws::CalibrationFormat::orb_slam:
      return "ORB-SLAM3";
    case ws::CalibrationFormat::depthai:
      return "DepthAI";
  }
  return "";
}

/// Full angle between the outermost usable rays of a line of pixels through the image centre.
double field_of_view(const ws::Camera& camera, const Eigen::Vector2d& direction) {
  const Eigen::Vector2d centre(camera.cx, camera.cy);
  double angle = 0;
  for (const double sign : {-1.0, 1.0}) {
    double reached = 0;
    for (double step = 0; step < camera.width + camera.height; step += 1) {
      const Eigen::Vector2d pixel = centre + sign * step * direction;
      Eigen::Vector3d ray;
      const bool inside = pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width - 1 &&
                          pixel.y() <= camera.height - 1;
      if (!inside || !unproject(camera, pixel, ray)) break;
      reached = std::atan2(ray.head<2>().norm(), ray.z());
    }
    angle += reached;
  }
  return angle * ws::degrees_per_radian;
}

nlohmann::ordered_json describe(const ws::View& view) {
  const ws::Camera& c = view.camera;
  const Eigen::Vector2d diagonal = Eigen::Vector2d(c.width, c.height).normalized();
  return {{"name", view.name},
          {"model", to_string(c.model)},
          {"width", c.width},
          {"height", c.height},
          {"fx", c.fx},
          {"fy", c.fy},
          {"cx", c.cx},
          {"cy", c.cy},
          {"horizontal_field_of_view_degrees", field_of_view(c, Eigen::Vector2d::UnitX())},
          {"vertical_field_of_view_degrees", field_of_view(c, Eigen::Vector2d::UnitY())},
          {"diagonal_field_of_view_degrees", field_of_view(c, diagonal)},
          {"model_max_theta_degrees", model_max_theta(c) * ws::degrees_per_radian},
          {"max_theta_degrees", c.max_theta * ws::degrees_per_radian}};
}

nlohmann::ordered_json describe(const ws::View& first, const ws::View& second) {
  const Eigen::Isometry3d motion = source_from_reference(second, first);
  const Eigen::Vector3d centre = motion.inverse().translation();
  const Eigen::Vector3d direction = centre.normalized();
  return {{"first", first.name},
          {"second", second.name},
          {"baseline_metres", centre.norm()},
          {"rotation_degrees", Eigen::AngleAxisd(motion.linear()).angle() * ws::degrees_per_radian},
          {"direction_in_first", {direction.x(), direction.y(), direction.z()}}};
}

/// Where the IMU is in the frame of view 0.
nlohmann::ordered_json describe_imu(const Eigen::Isometry3d& first_from_imu) {
  const Eigen::Vector3d position = first_from_imu.translation();
  return {{"position_in_first_metres", {position.x(), position.y(), position.z()}},
          {"rotation_degrees",
           Eigen::AngleAxisd(first_from_imu.linear()).angle() * ws::degrees_per_radian}};
}

void show(const CalibrationArguments& arguments) {
  const ws::Calibration calibration = ws::read_calibration(arguments.file);
  const std::vector<ws::View>& views = calibration.rig.views;
  nlohmann::ordered_json json = {{"file", arguments.file}, {"format", name_of(calibration.format)}};
  for (const ws::View& view : views) json["views"].push_back(describe(view));
  json["pairs"] = nlohmann::json::array();
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      json["pairs"].push_back(describe(views[i], views[j]));
    }
  }
  if (const auto& imu = calibration.rig.world_from_imu) json["imu"] = describe_imu(*imu);
  if (arguments.as_json) {
    std::cout << to_text(json) << "\n";
    return;
  }
  std::printf("%s: %s\n", arguments.file.c_str(), name_of(calibration.format));
  for (const auto& v : json["views"]) {
    std::printf(
        "  %s  %s  %d x %d px  f %.2f %.2f  c %.2f %.2f px\n"
        "        field of view: horizontal %.1f, vertical %.1f, diagonal %.1f degrees; theta up to "
        "%.1f (model), %.1f (lens)\n",
        v["name"].get<std::string>().c_str(), v["model"].get<std::string>().c_str(),
        v["width"].get<int>(), v["height"].get<int>(), v["fx"].get<double>(), v["fy"].get<double>(),
        v["cx"].get<double>(), v["cy"].get<double>(),
        v["horizontal_field_of_view_degrees"].get<double>(),
        v["vertical_field_of_view_degrees"].get<double>(),
        v["diagonal_field_of_view_degrees"].get<double>(),
        v["model_max_theta_degrees"].get<double>(), v["max_theta_degrees"].get<double>());
  }
  for (const auto& p : json["pairs"]) {
    std::printf("  %s - %s  baseline %.5f m  rotation %.3f degrees  direction %.3f %.3f %.3f\n",
                p["first"].get<std::string>().c_str(), p["second"].get<std::string>().c_str(),
                p["baseline_metres"].get<double>(), p["rotation_degrees"].get<double>(),
                p["direction_in_first"][0].get<double>(), p["direction_in_first"][1].get<double>(),
                p["direction_in_first"][2].get<double>());
  }
  if (json.contains("imu")) {
    const auto& position = json["imu"]["position_in_first_metres"];
    std::printf("  IMU in the frame of %s  %.4f %.4f %.4f m  rotation %.3f degrees\n",
                views.front().name.c_str(), position[0].get<double>(), position[1].get<double>(),
                position[2].get<double>(), json["imu"]["rotation_degrees"].get<double>());
  }
}

void write(const CalibrationArguments& arguments, const ws::Rig& rig) {
  if (arguments.format == "kalibr") {
    ws::write_kalibr(arguments.output, rig);
  } else {
    ws::write_basalt(arguments.output, rig);
  }
}

void convert(const CalibrationArguments& arguments) {
  write(arguments, ws::read_calibration(arguments.file).rig);
  std::cout << "Wrote " << arguments.output << "\n";
}

std::string distances_of(const ws::EpipolarReport& report, const char* unit) {
  char text[160];
  if (report.behind > 0.5) {
    std::snprintf(text, sizeof text,
                  "%.0f %% of the features lie behind the cameras; are the images in the order of "
                  "the cameras?",
                  100 * report.behind);
  } else if (!(report.nearest > 0)) {
    return "no feature is near enough and matched well enough to tell";
  } else {
    std::snprintf(text, sizeof text, "5 %% below %.2f%s, half below %.2f%s, 95 %% below %.2f%s",
                  report.nearest, unit, report.typical, unit, report.farthest, unit);
  }
  return text;
}

void check(const CalibrationArguments& arguments) {
  const cv::Mat left = arguments.white_level.read(arguments.left);
  const cv::Mat right = arguments.white_level.read(arguments.right);
  const ws::CalibratedImages images =
      calibrated_images(arguments.rig, arguments.poses, {arguments.left, arguments.right},
                        left.size(), arguments.rig.sfm_model());
  const ws::View& first = images.rig.views[0];
  const ws::View& second = images.rig.views[1];
  ws::require_calibrated_size(left, first, arguments.left);
  ws::require_calibrated_size(right, second, arguments.right);
  const std::vector<ws::PixelMatch> matches = ws::match_features(left, right);
  const ws::EpipolarReport r = check_epipolar(first, second, matches);
  const auto sharpness = ws::compare_sharpness(first, second, left, right, matches);
  // Negative where the second image is the sharper one.
  const double blur = !sharpness ? 0 : sharpness->sharper == 0 ? sharpness->blur : -sharpness->blur;
  const char* verdict = r.median_pixels < 0.5   ? "good"
                        : r.median_pixels < 1.0 ? "usable, expect errors where texture is fine"
                                                : "too inaccurate for stereo: calibrate again";
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
                                         {"verdict", verdict}})
                     .dump(2)
              << "\n";
    return;
  }
  std::printf(
      "%d matched features\n"
      "epipolar error: median %.2f px, %.3f degrees; %.0f %% below 1 px, %.0f %% below 5 px\n"
      "distances: %s\n"
      "calibration: %s\n",
      r.matches, r.median_pixels, r.median_degrees, 100 * r.below_1_pixel, 100 * r.below_5_pixels,
      distances_of(r, images.in_metres ? " m" : "").c_str(), verdict);
  if (!sharpness) return;
  std::printf("sharpness: %s is as sharp as %s blurred by %.2f px; see to the focus\n",
              (blur > 0 ? second : first).name.c_str(), (blur > 0 ? first : second).name.c_str(),
              sharpness->blur);
}

/// Matches between all pairs of views, those of all frames together.
std::vector<ws::ViewMatches> match_frames(const ws::Rig& rig, const std::vector<std::string>& files,
                                          const WhiteLevel& white_level) {
  const std::size_t count = rig.views.size();
  std::vector<ws::ViewMatches> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) pairs.push_back({i, j, {}});
  }
  for (std::size_t frame = 0; frame < files.size(); frame += count) {
    std::vector<cv::Mat> images;
    for (std::size_t i = 0; i < count; ++i) {
      images.push_back(white_level.read(files[frame + i]));
      ws::require_calibrated_size(images[i], rig.views[i], files[frame + i]);
    }
    for (ws::ViewMatches& pair : pairs) {
      const auto found = ws::match_features(images[pair.first], images[pair.second]);
      pair.matches.insert(pair.matches.end(), found.begin(), found.end());
    }
  }
  return pairs;
}

nlohmann::ordered_json describe(const ws::RefinedValue& value) {
  return {{"change", value.change}, {"deviation", value.deviation}};
}

nlohmann::ordered_json to_json(const ws::RigRefinement& refined,
                               const std::vector<ws::ViewMatches>& pairs) {
  const std::vector<ws::View>& views = refined.rig.views;
  nlohmann::ordered_json json;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    json["pairs"].push_back({{"first", views[pairs[i].first].name},
                             {"second", views[pairs[i].second].name},
                             {"matches", refined.before[i].matches},
                             {"median_pixels_before", refined.before[i].median_pixels},
                             {"median_pixels_after", refined.after[i].median_pixels}});
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ws::ViewRefinement& view = refined.views[i];
    json["views"].push_back({{"name", views[i].name},
                             {"rotation_degrees", describe(view.rotation)},
                             {"direction_degrees", describe(view.direction)},
                             {"focal_length_percent", describe(view.focal_length)},
                             {"principal_point_pixels", describe(view.principal_point)}});
  }
  return json;
}

void print(const ws::RigRefinement& refined, const std::vector<ws::ViewMatches>& pairs,
           bool intrinsics) {
  const std::vector<ws::View>& views = refined.rig.views;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    std::printf("%s - %s  %d matched features  epipolar error: median %.2f px -> %.2f px\n",
                views[pairs[i].first].name.c_str(), views[pairs[i].second].name.c_str(),
                refined.before[i].matches, refined.before[i].median_pixels,
                refined.after[i].median_pixels);
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ws::ViewRefinement& view = refined.views[i];
    const char* name = views[i].name.c_str();
    if (i > 0) {
      std::printf(
          "%s  turned by %.3f (+- %.3f) degrees, its direction from %s by %.2f (+- %.2f) degrees\n",
          name, view.rotation.change, view.rotation.deviation, views[0].name.c_str(),
          view.direction.change, view.direction.deviation);
    }
    if (intrinsics) {
      std::printf("%s  f by %.2f (+- %.2f) %%, c by %.1f (+- %.1f) px\n", name,
                  view.focal_length.change, view.focal_length.deviation,
                  view.principal_point.change, view.principal_point.deviation);
    }
  }
}

void refine(const CalibrationArguments& arguments) {
  const ws::Rig rig = arguments.rig.whole_rig(ws::read_image(arguments.images.front()).size());
  const std::size_t count = rig.views.size();
  if (count < 2 || arguments.images.size() % count != 0) {
    throw ws::Error(arguments.rig.calibration + " has " + std::to_string(count) +
                    " camera(s), but there are " + std::to_string(arguments.images.size()) +
                    " image(s); give one image of each camera, frame after frame, of two cameras "
                    "or more.");
  }
  ws::require_writable(arguments.output);
  const std::vector<ws::ViewMatches> pairs =
      match_frames(rig, arguments.images, arguments.white_level);
  const ws::RigRefinement refined = ws::refine_rig(rig, pairs, arguments.intrinsics);
  write(arguments, refined.rig);
  if (arguments.as_json) {
    nlohmann::ordered_json json = {{"frames", arguments.images.size() / count}};
    json.update(to_json(refined, pairs));
    std::cout << to_text(json) << "\n";
    return;
  }
  print(refined, pairs, arguments.intrinsics);
  std::cout << "Wrote " << arguments.output << "\n";
}

}  // namespace

void add_calibration_command(CLI::App& app) {
  CLI::App* group =
      app.add_subcommand("calibration", "Show, convert, check or refine calibration files");
  group->require_subcommand(1);
  auto arguments = std::make_shared<CalibrationArguments>();

  CLI::App* show_command =
      group->add_subcommand("show", "Print models, fields of view, baselines and rotations");
  show_command->add_option("file", arguments->file, RigSettings::calibration_formats)->required();
  show_command->add_flag("--json", arguments->as_json, "Print JSON");
  show_command->callback([arguments] { show(*arguments); });

  CLI::App* convert_command = group->add_subcommand("convert", "Write another format");
  convert_command->add_option("input", arguments->file, RigSettings::calibration_formats)
      ->required();
  convert_command->add_option("output", arguments->output, "File to write")->required();
  const auto add_format = [&arguments](CLI::App& command) {
    command.add_option("--to", arguments->format, "kalibr or basalt")
        ->check(CLI::IsMember({"kalibr", "basalt"}))
        ->capture_default_str();
  };
  add_format(*convert_command);
  convert_command->callback([arguments] { convert(*arguments); });

  CLI::App* check_command = group->add_subcommand(
      "check", "Measure the epipolar error of features matched between two images");
  check_command->add_option("left", arguments->left, "Image of the first camera")->required();
  check_command->add_option("right", arguments->right, "Image of the second camera")->required();
  add_image_options(*check_command, arguments->rig, arguments->poses);
  arguments->white_level.add_to(*check_command);
  check_command->add_flag("--json", arguments->as_json, "Print JSON");
  check_command->callback([arguments] { check(*arguments); });

  CLI::App* refine_command = group->add_subcommand(
      "refine", "Mend how the cameras of a rig stand to each other, from matched features");
  refine_command
      ->add_option("images", arguments->images,
                   "One image of each camera, then those of the next frame, and so on: the more "
                   "frames, the better")
      ->required();
  arguments->rig.add_whole_rig_to(*refine_command);
  arguments->white_level.add_to(*refine_command);
  refine_command->add_option("-o,--output", arguments->output, "File to write")->required();
  add_format(*refine_command);
  refine_command->add_flag("--intrinsics", arguments->intrinsics,
                           "Refine focal lengths and principal points, too; needs near and far "
                           "features all over the images");
  refine_command->add_flag("--json", arguments->as_json, "Print JSON");
  refine_command->callback([arguments] { refine(*arguments); });
}
