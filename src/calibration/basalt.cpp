// SPDX-License-Identifier: MIT
#include <Eigen/Dense>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "calibration/camera_forms.h"
#include "calibration/formats.h"
#include "calibration/json_document.h"
#include "geometry/angle.h"
#include "geometry/validation.h"
#include "text/json_text.h"
#include "widestereo/error.h"
#include "widestereo/files.h"

namespace widestereo {
namespace calibration {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* time_offset_key = "cam_time_offset_ns";
constexpr double nanoseconds_per_second = 1e9;

/// As headsets of Windows Mixed Reality have it.
constexpr const char* radtan8 = "pinhole-radtan8";
constexpr std::pair<const char*, double Camera::*> radtan8_coefficients[] = {
    {"k1", &Camera::k1}, {"k2", &Camera::k2}, {"p1", &Camera::p1}, {"p2", &Camera::p2},
    {"k3", &Camera::k3}, {"k4", &Camera::k4}, {"k5", &Camera::k5}, {"k6", &Camera::k6}};
constexpr const char* largest_radius_key = "rpmax";

/// What Basalt does not start without, of the IMU and of vignetting: its own defaults, as none of
/// it is known.
void add_defaults(Json& value) {
  const auto three = [](double each) { return Json{each, each, each}; };
  value["calib_accel_bias"] = std::vector<double>(9);
  value["calib_gyro_bias"] = std::vector<double>(12);
  value["imu_update_rate"] = 200.0;
  value["accel_noise_std"] = three(0.016);
  value["gyro_noise_std"] = three(0.000282);
  value["accel_bias_std"] = three(0.001);
  value["gyro_bias_std"] = three(0.0001);
  value["vignette"] = Json::array();
}

/// `where`: what has it, for messages.
double number(const Document& document, const std::string& where, const Json& object,
              const std::string& key) {
  if (!object.is_object() || !object.contains(key) || !object.at(key).is_number()) {
    document.fail(where + ": The number \"" + key + "\" is missing", "add it");
  }
  return object.at(key).get<double>();
}

const Json& list(const Document& document, const Json& object, const char* key) {
  if (!object.is_object() || !object.contains(key) || !object.at(key).is_array()) {
    document.fail(std::string("The list \"") + key + "\" of a Basalt calibration is missing",
                  "add it, or give another format");
  }
  return object.at(key);
}

Camera read_camera(const Document& document, const std::string& name, const Json& entry) {
  if (!entry.is_object() || !entry.contains("camera_type") ||
      !entry.at("camera_type").is_string() || !entry.contains("intrinsics")) {
    document.fail(name + ": It lacks \"camera_type\" or \"intrinsics\"", "add what is missing");
  }
  const std::string type = entry.at("camera_type").get<std::string>();
  const Json& values = entry.at("intrinsics");
  const auto value = [&](const char* key) { return number(document, name, values, key); };
  Camera camera;
  camera.fx = value("fx");
  camera.fy = value("fy");
  camera.cx = value("cx");
  camera.cy = value("cy");
  if (type == "ds") {
    camera.model = CameraModel::double_sphere;
    camera.xi = value("xi");
    camera.alpha = value("alpha");
  } else if (type == "eucm") {
    camera.model = CameraModel::extended_unified;
    camera.alpha = value("alpha");
    camera.beta = value("beta");
  } else if (type == "ucm") {
    const double alpha = value("alpha");
    if (!(alpha >= 0 && alpha < 1)) {
      document.fail(name + ": The alpha of a ucm camera must lie in [0, 1)", "correct it");
    }
    set_unified_from_alpha(camera, alpha);
  } else if (type == "kb4") {
    camera.model = CameraModel::kannala_brandt;
    camera.k1 = value("k1");
    camera.k2 = value("k2");
    camera.k3 = value("k3");
    camera.k4 = value("k4");
  } else if (type == "fov") {
    camera.model = CameraModel::field_of_view;
    camera.omega = value("w");
  } else if (type == "pinhole") {
    camera.model = CameraModel::pinhole;
  } else if (type == radtan8) {
    camera.model = CameraModel::pinhole_rational;
    for (const auto& [key, member] : radtan8_coefficients) camera.*member = value(key);
    // Of points on the normalised plane; 0: none.
    const double largest_radius = value(largest_radius_key);
    if (largest_radius > 0) camera.max_theta = std::atan(largest_radius);
  } else {
    document.fail(name + ": The camera_type \"" + type + "\" is unknown",
                  std::string("use ds, eucm, ucm, kb4, fov, pinhole or ") + radtan8);
  }
  return simplified(camera);
}

Eigen::Isometry3d read_pose(const Document& document, const std::string& name, const Json& entry) {
  const std::string what = name + ": T_imu_cam";
  const auto value = [&](const char* key) { return number(document, what, entry, key); };
  const Eigen::Quaterniond rotation =
      require_unit({value("qw"), value("qx"), value("qy"), value("qz")},
                   document.path.string() + ": " + what, "scale qx, qy, qz and qw alike");
  return rigid(document, what, rotation.toRotationMatrix(),
               {value("px"), value("py"), value("pz")});
}

cv::Size size_of(const Document& document, const std::string& name, const Json& value) {
  const auto side = [&value](std::size_t i) -> std::optional<int> {
    if (!value.is_array() || value.size() != 2 || !value[i].is_number()) return std::nullopt;
    return whole_number(value[i].get<double>());
  };
  const std::optional<int> width = side(0);
  const std::optional<int> height = side(1);
  if (!width || !height) {
    document.fail(name + ": \"resolution\" must hold pairs of whole numbers of pixels",
                  "correct it");
  }
  return {*width, *height};
}

/// None where Basalt lacks the model.
std::optional<Json> form_of(const Camera& c) {
  const double f = c.model == CameraModel::unified ? 1 / (1 + c.xi) : 1;
  Json values = {{"fx", c.fx * f}, {"fy", c.fy * f}, {"cx", c.cx}, {"cy", c.cy}};
  const bool has_form = c.skew == 0 && c.s1 == 0 && c.s2 == 0 && c.s3 == 0 && c.s4 == 0;
  std::string type;
  switch (has_form ? c.model : CameraModel::mei) {
    case CameraModel::double_sphere:
      type = "ds";
      values["xi"] = c.xi;
      values["alpha"] = c.alpha;
      break;
    case CameraModel::extended_unified:
      type = "eucm";
      values["alpha"] = c.alpha;
      values["beta"] = c.beta;
      break;
    case CameraModel::unified:
      type = "ucm";
      values["alpha"] = unified_alpha(c);
      break;
    case CameraModel::kannala_brandt:
      type = "kb4";
      values["k1"] = c.k1;
      values["k2"] = c.k2;
      values["k3"] = c.k3;
      values["k4"] = c.k4;
      break;
    case CameraModel::field_of_view:
      type = "fov";
      values["w"] = c.omega;
      break;
    case CameraModel::pinhole:
      type = "pinhole";
      break;
    case CameraModel::pinhole_radtan:
    case CameraModel::pinhole_rational:
      type = radtan8;
      for (const auto& [key, member] : radtan8_coefficients) values[key] = c.*member;
      values[largest_radius_key] = c.max_theta < std::numbers::pi / 2 ? std::tan(c.max_theta) : 0;
      break;
    default:
      return std::nullopt;
  }
  return Json{{"camera_type", type}, {"intrinsics", values}};
}

Json basalt_form(const View& view, const std::filesystem::path& path) {
  const Camera& c = view.camera;
  const std::optional<Json> form = form_of(c);
  if (!form) {
    throw Error("Cannot write " + path.string() + ": " +
                no_form(view, CalibrationFormat::basalt, c.skew != 0 ? "skew" : ""));
  }
  return *form;
}

/// Basalt has one for all cameras, each of which Kalibr estimates by itself.
long long time_offset_form(const Rig& rig, const std::filesystem::path& path) {
  constexpr double same = 1e-3;  // seconds
  const double offset = rig.views.front().imu_time_offset;
  for (const View& view : rig.views) {
    if (std::abs(view.imu_time_offset - offset) <= same) continue;
    throw Error("Cannot write " + path.string() + ": the IMU's clock is ahead of " +
                rig.views.front().name + " and " + view.name +
                " by times that differ by more than a millisecond, which Basalt's format cannot "
                "hold; Kalibr's does.");
  }
  return std::llround(offset * nanoseconds_per_second);
}

}  // namespace

bool has_basalt_form(const Camera& camera) { return form_of(camera).has_value(); }

Rig read_basalt(const Document& document) {
  try {
    const Json root = parsed_json<Json>(document);
    if (!root.contains("value0")) {
      document.fail("It has no \"value0\" as a Basalt calibration has",
                    "give one, or one of the other formats");
    }
    const Json& value = root.at("value0");
    const Json& cameras = list(document, value, "intrinsics");
    const Json& poses = list(document, value, "T_imu_cam");
    const Json& sizes = list(document, value, "resolution");
    if (cameras.empty() || cameras.size() != poses.size() || cameras.size() != sizes.size()) {
      document.fail("\"intrinsics\", \"T_imu_cam\" and \"resolution\" must be lists of one length",
                    "add what is missing");
    }
    Rig rig;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      View& view = rig.views.emplace_back();
      view.name = "cam" + std::to_string(i);
      view.camera = read_camera(document, view.name, cameras[i]);
      const cv::Size size = size_of(document, view.name, sizes[i]);
      view.camera.width = size.width;
      view.camera.height = size.height;
      view.world_from_camera = read_pose(document, view.name, poses[i]);
      if (value.contains(max_theta_key)) {
        const Json& limits = list(document, value, max_theta_key);
        if (limits.size() != cameras.size() || !limits[i].is_number()) {
          document.fail(
              std::string("\"") + max_theta_key + "\" must hold one number for each camera",
              "correct it");
        }
        view.camera.max_theta = limits[i].get<double>() * radians_per_degree;
      }
    }
    if (value.contains(time_offset_key)) {
      const double offset =
          number(document, "value0", value, time_offset_key) / nanoseconds_per_second;
      for (View& view : rig.views) view.imu_time_offset = offset;
    }
    const Eigen::Isometry3d first_from_imu = rig.views.front().world_from_camera.inverse();
    for (View& view : rig.views) view.world_from_camera = first_from_imu * view.world_from_camera;
    // basalt_calibrate leaves the identity where no IMU was calibrated, as write_basalt() does.
    if (!first_from_imu.isApprox(Eigen::Isometry3d::Identity(), 1e-9)) {
      rig.world_from_imu = first_from_imu;
    }
    return rig;
  } catch (const Json::parse_error& error) {
    document.fail(std::string("It is not valid JSON (") + error.what() + ")", "correct it there");
  } catch (const Json::exception& error) {
    document.fail(
        std::string("It is not valid JSON of a Basalt calibration (") + error.what() + ")",
        "correct it there");
  }
}

}  // namespace calibration

std::string basalt_text(const std::filesystem::path& path, const Rig& rig) {
  using calibration::Json;
  validate(rig, "Cannot write " + path.string() + ": the rig");
  Json value;
  value["T_imu_cam"] = Json::array();
  value["intrinsics"] = Json::array();
  value["resolution"] = Json::array();
  Json limits = Json::array();
  bool limited = false;
  const Eigen::Isometry3d imu_from_world =
      (rig.world_from_imu ? *rig.world_from_imu : rig.views.front().world_from_camera).inverse();
  for (const View& view : rig.views) {
    const Eigen::Isometry3d imu_from_camera = imu_from_world * view.world_from_camera;
    const Eigen::Quaterniond q(imu_from_camera.linear());
    const Eigen::Vector3d p = imu_from_camera.translation();
    value["T_imu_cam"].push_back({{"px", p.x()},
                                  {"py", p.y()},
                                  {"pz", p.z()},
                                  {"qx", q.x()},
                                  {"qy", q.y()},
                                  {"qz", q.z()},
                                  {"qw", q.w()}});
    value["intrinsics"].push_back(calibration::basalt_form(view, path));
    value["resolution"].push_back({view.camera.width, view.camera.height});
    limits.push_back(view.camera.max_theta * degrees_per_radian);
    limited = limited || view.camera.max_theta < std::numbers::pi;
  }
  calibration::add_defaults(value);
  value[calibration::time_offset_key] = calibration::time_offset_form(rig, path);
  if (limited) value[calibration::max_theta_key] = limits;
  return to_text(Json{{"value0", value}}) + "\n";
}

void write_basalt(const std::filesystem::path& path, const Rig& rig) {
  write_text(path, basalt_text(path, rig));
}

}  // namespace widestereo
