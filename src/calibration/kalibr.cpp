// SPDX-License-Identifier: MIT
#include <yaml-cpp/yaml.h>

#include <Eigen/Dense>
#include <algorithm>
#include <numbers>
#include <optional>

#include "calibration/formats.h"
#include "calibration/yaml_camera.h"
#include "geometry/angle.h"
#include "text/number.h"
#include "widestereo/error.h"
#include "widestereo/files.h"

namespace widestereo {
namespace calibration {
namespace {

constexpr const char* time_offset_key = "timeshift_cam_imu";

/// Where the IMU is, by Kalibr's key or by OpenVINS's; none where the camera has neither.
std::optional<Eigen::Isometry3d> camera_from_imu(const YamlCamera& camera) {
  if (camera.has("T_cam_imu")) return camera.motion("T_cam_imu");
  if (camera.has("T_imu_cam")) return camera.motion("T_imu_cam").inverse();
  return std::nullopt;
}

/// No camera may be left out.
void require_all_cameras(const Document& document, const YAML::Node& root, const Rig& rig) {
  for (const auto& entry : root) {
    const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : "";
    const std::string number = name.starts_with("cam") ? name.substr(3) : "";
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::none_of(rig.views.begin(), rig.views.end(),
                     [&name](const View& view) { return view.name == name; })) {
      document.fail("It has " + name + " but no cam" + std::to_string(rig.views.size()),
                    "number the cameras from cam0 without gaps");
    }
  }
}

}  // namespace

Rig read_kalibr(const Document& document) {
  Rig rig;
  read_yaml(document, [&](const YAML::Node& root) {
    std::vector<std::optional<double>> time_offsets;
    for (int i = 0; i < 1000; ++i) {
      const std::string name = "cam" + std::to_string(i);
      if (!root[name]) break;
      const YamlCamera camera(document, name, root[name]);
      View view = camera.view();
      const std::optional<Eigen::Isometry3d> from_imu = camera_from_imu(camera);
      if (i > 0 && from_imu && rig.world_from_imu && !camera.has("T_cn_cnm1")) {
        view.world_from_camera = *rig.world_from_imu * from_imu->inverse();
      } else if (i > 0) {
        view.world_from_camera =
            rig.views.back().world_from_camera * camera.motion("T_cn_cnm1").inverse();
      }
      time_offsets.emplace_back();
      if (camera.has(time_offset_key)) time_offsets.back() = camera.number(time_offset_key);
      if (from_imu && !rig.world_from_imu) rig.world_from_imu = view.world_from_camera * *from_imu;
      rig.views.push_back(view);
    }
    // Cameras that are triggered together need but one.
    const auto first = std::find_if(time_offsets.begin(), time_offsets.end(),
                                    [](const auto& offset) { return offset.has_value(); });
    for (std::size_t i = 0; first != time_offsets.end() && i < rig.views.size(); ++i) {
      rig.views[i].imu_time_offset = time_offsets[i].value_or(**first);
    }
    require_all_cameras(document, root, rig);
    if (rig.views.empty()) {
      document.fail("It holds no cameras", "a Kalibr camchain has keys cam0, cam1, and so on");
    }
  });
  return rig;
}

namespace {

/// What a camera is in a Kalibr camchain.
struct KalibrForm {
  const char* camera_model;
  std::vector<double> intrinsics;
  const char* distortion_model;
  std::vector<double> coefficients;
};

/// With a point before an exponent, without which YAML 1.1, and so Kalibr's reader, takes it for a
/// word.
std::string yaml_text(double number) {
  std::string text = text_of(number);
  const std::size_t exponent = text.find('e');
  if (exponent != std::string::npos && text.find('.') == std::string::npos) {
    text.insert(exponent, ".0");
  }
  return text;
}

std::vector<std::string> texts_of(const std::vector<double>& numbers) {
  std::vector<std::string> texts;
  for (const double number : numbers) texts.push_back(yaml_text(number));
  return texts;
}

/// A number beyond those of Kalibr's form of the model.
bool has_skew_or_k3(const Camera& c) {
  const bool third_of_radtan =
      c.model == CameraModel::pinhole_radtan || c.model == CameraModel::mei;
  return c.skew != 0 || (third_of_radtan && c.k3 != 0);
}

/// None where Kalibr lacks the model.
std::optional<KalibrForm> form_of(const Camera& c) {
  const std::vector<double> f = {c.fx, c.fy, c.cx, c.cy};
  const auto with = [&f](std::vector<double> first) {
    first.insert(first.end(), f.begin(), f.end());
    return first;
  };
  const std::vector<double> radtan = {c.k1, c.k2, c.p1, c.p2};
  switch (c.model) {
    case CameraModel::pinhole:
      return KalibrForm{"pinhole", f, "none", {}};
    case CameraModel::pinhole_radtan:
      return KalibrForm{"pinhole", f, "radtan", radtan};
    case CameraModel::kannala_brandt:
      return KalibrForm{"pinhole", f, "equidistant", {c.k1, c.k2, c.k3, c.k4}};
    case CameraModel::double_sphere:
      return KalibrForm{"ds", with({c.xi, c.alpha}), "none", {}};
    case CameraModel::unified:
      return KalibrForm{"omni", with({c.xi}), "none", {}};
    case CameraModel::extended_unified:
      return KalibrForm{"eucm", with({c.alpha, c.beta}), "none", {}};
    case CameraModel::field_of_view:
      return KalibrForm{"pinhole", f, "fov", {c.omega}};
    case CameraModel::mei:
      return KalibrForm{"omni", with({c.xi}), "radtan", radtan};
    case CameraModel::equirectangular:
      return KalibrForm{"equirectangular", f, "none", {}};
    case CameraModel::pinhole_rational:
    case CameraModel::thin_prism_fisheye:
    case CameraModel::rad_tan_thin_prism_fisheye:
    case CameraModel::polynomial_fisheye:
      break;
  }
  return std::nullopt;
}

KalibrForm kalibr_form(const View& view, const std::filesystem::path& path) {
  const Camera& c = view.camera;
  const std::optional<KalibrForm> form = form_of(c);
  if (!form || has_skew_or_k3(c)) {
    throw Error("Cannot write " + path.string() + ": " +
                no_form(view, CalibrationFormat::kalibr,
                        !form         ? ""
                        : c.skew != 0 ? "a skew"
                                      : "a k3"));
  }
  return *form;
}

}  // namespace

bool has_kalibr_form(const Camera& camera) {
  return form_of(camera).has_value() && !has_skew_or_k3(camera);
}

}  // namespace calibration

std::string kalibr_text(const std::filesystem::path& path, const Rig& rig) {
  validate(rig, "Cannot write " + path.string() + ": the rig");
  YAML::Emitter out;
  out << YAML::BeginMap;
  const bool has_time_offsets =
      std::any_of(rig.views.begin(), rig.views.end(),
                  [](const View& view) { return view.imu_time_offset != 0; });
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    const View& view = rig.views[i];
    const calibration::KalibrForm form = calibration::kalibr_form(view, path);
    out << YAML::Key << "cam" + std::to_string(i) << YAML::Value << YAML::BeginMap;
    out << YAML::Key << "camera_model" << YAML::Value << form.camera_model;
    out << YAML::Key << "intrinsics" << YAML::Value << YAML::Flow
        << calibration::texts_of(form.intrinsics);
    out << YAML::Key << "distortion_model" << YAML::Value << form.distortion_model;
    out << YAML::Key << "distortion_coeffs" << YAML::Value << YAML::Flow
        << calibration::texts_of(form.coefficients);
    out << YAML::Key << "resolution" << YAML::Value << YAML::Flow
        << std::vector<int>{view.camera.width, view.camera.height};
    if (view.camera.max_theta < std::numbers::pi) {
      out << YAML::Key << calibration::max_theta_key << YAML::Value
          << calibration::yaml_text(view.camera.max_theta * degrees_per_radian);
    }
    const auto motion = [&out](const char* key, const Eigen::Matrix4d& t) {
      out << YAML::Key << key << YAML::Value << YAML::BeginSeq;
      for (int row = 0; row < 4; ++row) {
        out << YAML::Flow << calibration::texts_of({t(row, 0), t(row, 1), t(row, 2), t(row, 3)});
      }
      out << YAML::EndSeq;
    };
    if (rig.world_from_imu) {
      motion("T_cam_imu", (view.world_from_camera.inverse() * *rig.world_from_imu).matrix());
    }
    if (has_time_offsets) {
      out << YAML::Key << calibration::time_offset_key << YAML::Value
          << calibration::yaml_text(view.imu_time_offset);
    }
    if (i > 0) motion("T_cn_cnm1", source_from_reference(view, rig.views[i - 1]).matrix());
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

void write_kalibr(const std::filesystem::path& path, const Rig& rig) {
  write_text(path, kalibr_text(path, rig));
}

}  // namespace widestereo
