// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "calibration_commands.h"
#include "calibration_fit.h"
#include "geometry/angle.h"
#include "rig_settings.h"
#include "say.h"
#include "text/formatted.h"
#include "text/json_text.h"
#include "widestereo/calibration.h"

namespace ws = widestereo;

namespace {

struct ShowArguments {
  std::string file;
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
    case ws::CalibrationFormat::ros:
      return "ROS";
  }
  return "";
}

/// Full angle between the outermost usable rays of a line of pixels through the principal point, or
/// through the pixel nearest to it where the image has been cut off before it.
double field_of_view(const ws::Camera& camera, const Eigen::Vector2d& direction) {
  const Eigen::Vector2d centre(std::clamp(camera.cx, 0.0, camera.width - 1.0),
                               std::clamp(camera.cy, 0.0, camera.height - 1.0));
  Eigen::Vector3d axis;
  const ws::PreparedCamera prepared(camera);
  if (!prepared.unproject(centre, axis)) return 0;
  double angle = 0;
  for (const double sign : {-1.0, 1.0}) {
    double reached = 0;
    for (double step = 0; step < camera.width + camera.height; step += 1) {
      const Eigen::Vector2d pixel = centre + sign * step * direction;
      Eigen::Vector3d ray;
      const bool inside = pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= camera.width - 1 &&
                          pixel.y() <= camera.height - 1;
      if (!inside || !prepared.unproject(pixel, ray)) break;
      reached = std::atan2(axis.cross(ray).norm(), axis.dot(ray));
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

/// Where the IMU is in the frame of view 0, and what its clock is ahead of that view's images.
nlohmann::ordered_json describe_imu(const Eigen::Isometry3d& first_from_imu, double time_offset) {
  const Eigen::Vector3d position = first_from_imu.translation();
  return {{"position_in_first_metres", {position.x(), position.y(), position.z()}},
          {"rotation_degrees",
           Eigen::AngleAxisd(first_from_imu.linear()).angle() * ws::degrees_per_radian},
          {"time_offset_seconds", time_offset}};
}

/// Most formats do not say where the lens ends.
std::string limit_of_lens(double max_theta_degrees) {
  if (max_theta_degrees >= 180) return "lens not limited";
  return ws::formatted("%.1f (lens)", max_theta_degrees);
}

/// Says of what is hardly ever so but in a damaged or mistyped calibration. `view` as described.
void report_unusual(const nlohmann::ordered_json& view) {
  constexpr double narrow = 5;       // degrees
  constexpr double stretched = 1.5;  // pixels of one side, as a multiple of the other's
  const auto number = [&view](const char* key) { return view[key].get<double>(); };
  const std::string name = view["name"].get<std::string>();
  const double ratio = number("fx") / number("fy");
  if (std::max(ratio, 1 / ratio) > stretched) {
    say(name + ws::formatted(": fx is %.3g times fy; are its pixels that far from square?", ratio));
  }
  const auto is_outside = [](double centre, double side) {
    return centre < -0.5 || centre > side - 0.5;
  };
  if (is_outside(number("cx"), number("width")) || is_outside(number("cy"), number("height"))) {
    say(name + ws::formatted(": the principal point (%.1f, %.1f) lies outside the image of %g x %g "
                             "pixels; is it of a crop?",
                             number("cx"), number("cy"), number("width"), number("height")));
  }
  const double widest = std::max({number("horizontal_field_of_view_degrees"),
                                  number("vertical_field_of_view_degrees"),
                                  number("diagonal_field_of_view_degrees")});
  if (widest < narrow) {
    say(name + ws::formatted(": the field of view is %.2g degrees at most; is the focal length in "
                             "pixels?",
                             widest));
  }
}

void show(const ShowArguments& arguments) {
  const ws::Calibration calibration = ws::read_calibration(arguments.file);
  const std::vector<ws::View>& views = calibration.rig.views;
  report_long_baseline(calibration.rig);
  nlohmann::ordered_json json = {{"file", arguments.file}, {"format", name_of(calibration.format)}};
  for (const ws::View& view : views) json["views"].push_back(describe(view));
  for (const auto& view : json["views"]) report_unusual(view);
  json["pairs"] = nlohmann::json::array();
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      json["pairs"].push_back(describe(views[i], views[j]));
    }
  }
  if (const auto& imu = calibration.rig.world_from_imu) {
    json["imu"] = describe_imu(*imu, views.front().imu_time_offset);
  }
  if (arguments.as_json) {
    std::cout << ws::to_text(json) << "\n";
    return;
  }
  std::printf("%s: %s\n", arguments.file.c_str(), name_of(calibration.format));
  for (const auto& v : json["views"]) {
    std::printf(
        "  %s  %s  %d x %d px  f %.2f %.2f  c %.2f %.2f px\n"
        "        field of view: horizontal %.1f, vertical %.1f, diagonal %.1f degrees; theta up to "
        "%.1f (model), %s\n",
        v["name"].get<std::string>().c_str(), v["model"].get<std::string>().c_str(),
        v["width"].get<int>(), v["height"].get<int>(), v["fx"].get<double>(), v["fy"].get<double>(),
        v["cx"].get<double>(), v["cy"].get<double>(),
        v["horizontal_field_of_view_degrees"].get<double>(),
        v["vertical_field_of_view_degrees"].get<double>(),
        v["diagonal_field_of_view_degrees"].get<double>(),
        v["model_max_theta_degrees"].get<double>(),
        limit_of_lens(v["max_theta_degrees"].get<double>()).c_str());
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
    std::printf(
        "  IMU in the frame of %s  %.4f %.4f %.4f m  rotation %.3f degrees  clock ahead by %.6f "
        "s\n",
        views.front().name.c_str(), position[0].get<double>(), position[1].get<double>(),
        position[2].get<double>(), json["imu"]["rotation_degrees"].get<double>(),
        json["imu"]["time_offset_seconds"].get<double>());
  }
}

}  // namespace

void add_calibration_show_command(CLI::App& group) {
  CLI::App* command =
      group.add_subcommand("show", "Print models, fields of view, baselines and rotations");
  auto arguments = std::make_shared<ShowArguments>();
  command->add_option("file", arguments->file, RigSettings::calibration_formats)->required();
  command->add_flag("--json", arguments->as_json, "Print JSON");
  command->callback([arguments] { show(*arguments); });
}
