// SPDX-License-Identifier: MIT
#include <yaml-cpp/yaml.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "calibration/formats.h"
#include "text/number.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace calibration {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// One cam<n> block with messages that name file and camera.
class Block {
 public:
  Block(const Document& document, std::string name, const YAML::Node& node)
      : document_(document), name_(std::move(name)), node_(node) {}

  [[noreturn]] void fail(const std::string& what) const { document_.fail(name_ + ": " + what); }
  bool has(const char* key) const { return static_cast<bool>(node_[key]); }

  std::string text(const char* key, const char* otherwise = nullptr) const {
    if (!has(key) && otherwise != nullptr) return otherwise;
    if (!has(key) || !node_[key].IsScalar()) fail(std::string("The key ") + key + " is missing.");
    return node_[key].Scalar();
  }

  /// Surplus numbers may only be zeros: what another one means would be lost.
  std::vector<double> numbers(const char* key, std::size_t count) const {
    const YAML::Node list = node_[key];
    if (count == 0 && list && list.IsNull()) return {};
    if (!list || !list.IsSequence() || list.size() < count) {
      fail(std::string("The key ") + key + " must list " + std::to_string(count) + " numbers.");
    }
    std::vector<double> values;
    for (const YAML::Node& value : list) values.push_back(number(value, key));
    if (std::any_of(values.begin() + static_cast<long>(count), values.end(),
                    [](double value) { return value != 0; })) {
      fail(std::string("The key ") + key + " lists " + std::to_string(values.size()) +
           " numbers, but with these models it has " + std::to_string(count) +
           "; correct the numbers or the models.");
    }
    values.resize(count);
    return values;
  }

  double number(const YAML::Node& node, const char* key) const {
    // yaml-cpp would read and write numbers by the locale.
    const std::optional<double> value =
        node.IsScalar() ? number_of(node.Scalar()) : std::optional<double>();
    if (!value) {
      fail(std::string("The key ") + key + " holds something that is not a finite number.");
    }
    return *value;
  }

  double number(const char* key) const { return number(node_[key], key); }

  Eigen::Isometry3d motion(const char* key) const {
    const YAML::Node rows = node_[key];
    if (!rows || !rows.IsSequence() || rows.size() < 3) {
      fail(std::string("The key ") + key + " (4x4 matrix, four rows) is missing.");
    }
    Eigen::Matrix<double, 3, 4> matrix;
    for (std::size_t i = 0; i < 3; ++i) {
      if (!rows[i].IsSequence() || rows[i].size() != 4) {
        fail(std::string("The key ") + key + " must be a 4x4 matrix.");
      }
      for (std::size_t j = 0; j < 4; ++j) {
        matrix(static_cast<long>(i), static_cast<long>(j)) = number(rows[i][j], key);
      }
    }
    return rigid(document_, name_ + ": " + key, matrix.leftCols<3>(), matrix.col(3));
  }

 private:
  const Document& document_;
  std::string name_;
  YAML::Node node_;
};

void set_projection(const Block& block, Camera& camera) {
  const std::string model = block.text("camera_model");
  const auto intrinsics = [&](std::size_t before) {
    const std::vector<double> values = block.numbers("intrinsics", before + 4);
    camera.fx = values[before];
    camera.fy = values[before + 1];
    camera.cx = values[before + 2];
    camera.cy = values[before + 3];
    return values;
  };
  if (model == "pinhole") {
    camera.model = CameraModel::pinhole;
    intrinsics(0);
  } else if (model == "omni") {
    camera.model = CameraModel::unified;
    camera.xi = intrinsics(1)[0];
  } else if (model == "eucm") {
    camera.model = CameraModel::extended_unified;
    const std::vector<double> values = intrinsics(2);
    camera.alpha = values[0];
    camera.beta = values[1];
  } else if (model == "ds") {
    camera.model = CameraModel::double_sphere;
    const std::vector<double> values = intrinsics(2);
    camera.xi = values[0];
    camera.alpha = values[1];
  } else {
    block.fail("The camera_model \"" + model + "\" is unknown; use pinhole, omni, eucm or ds.");
  }
}

void set_distortion(const Block& block, Camera& camera) {
  const std::string model = block.text("distortion_model", "none");
  const bool pinhole = camera.model == CameraModel::pinhole;
  if (model == "none") {
    if (block.has("distortion_coeffs")) block.numbers("distortion_coeffs", 0);
    return;
  }
  const auto unsupported = [&] {
    block.fail("The distortion_model \"" + model + "\" does not go with camera_model \"" +
               block.text("camera_model") +
               "\" here; use radtan, equidistant, fov or none with "
               "pinhole, radtan or none with omni, and none with eucm and ds.");
  };
  if (model == "radtan" && (pinhole || camera.model == CameraModel::unified)) {
    const std::vector<double> d = block.numbers("distortion_coeffs", 4);
    camera.k1 = d[0];
    camera.k2 = d[1];
    camera.p1 = d[2];
    camera.p2 = d[3];
    camera.model = pinhole ? CameraModel::pinhole_radtan : CameraModel::mei;
  } else if (model == "equidistant" && pinhole) {
    const std::vector<double> d = block.numbers("distortion_coeffs", 4);
    camera.k1 = d[0];
    camera.k2 = d[1];
    camera.k3 = d[2];
    camera.k4 = d[3];
    camera.model = CameraModel::kannala_brandt;
  } else if (model == "fov" && pinhole) {
    camera.omega = block.numbers("distortion_coeffs", 1)[0];
    camera.model = CameraModel::field_of_view;
  } else {
    unsupported();
  }
}

/// The parser keeps all of equal keys, of which a look-up finds one.
void require_single_keys(const Document& document, const YAML::Node& map,
                         const std::string& where) {
  std::set<std::string> keys;
  for (const auto& entry : map) {
    const YAML::Node& key = entry.first;
    if (!key.IsScalar() || keys.insert(key.Scalar()).second) continue;
    document.fail(where + "The key " + key.Scalar() + " is there twice; leave one.");
  }
}

View read_view(const Document& document, const std::string& name, const YAML::Node& node) {
  const Block block(document, name, node);
  if (!node.IsMap()) block.fail("It must hold keys such as camera_model and intrinsics.");
  require_single_keys(document, node, name + ": ");
  View view;
  view.name = name;
  set_projection(block, view.camera);
  set_distortion(block, view.camera);
  const std::vector<double> resolution = block.numbers("resolution", 2);
  for (const double side : resolution) {
    if (side < 1 || side > 1e6 || side != std::floor(side)) {
      block.fail("The key resolution must hold two whole numbers of pixels.");
    }
  }
  view.camera.width = static_cast<int>(resolution[0]);
  view.camera.height = static_cast<int>(resolution[1]);
  if (block.has("max_theta_deg")) view.camera.max_theta = block.number("max_theta_deg") * degree;
  return view;
}

/// Where the IMU is, by Kalibr's key or by OpenVINS's; none where the camera has neither.
std::optional<Eigen::Isometry3d> camera_from_imu(const Block& block) {
  if (block.has("T_cam_imu")) return block.motion("T_cam_imu");
  if (block.has("T_imu_cam")) return block.motion("T_imu_cam").inverse();
  return std::nullopt;
}

/// yaml-cpp refuses OpenCV's header line, which OpenVINS files begin with.
std::string without_directive(std::string text) {
  const std::size_t at = text.find("%YAML:1.0");
  if (at != std::string::npos && text.find_first_not_of(" \t\r\n") == at) text.erase(0, at + 9);
  return text;
}

/// No camera may be left out.
void require_all_cameras(const Document& document, const YAML::Node& root, const Rig& rig) {
  for (const auto& entry : root) {
    const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : "";
    const std::string number = name.starts_with("cam") ? name.substr(3) : "";
    if (number.empty() || number.find_first_not_of("0123456789") != std::string::npos) continue;
    if (std::none_of(rig.views.begin(), rig.views.end(),
                     [&name](const View& view) { return view.name == name; })) {
      document.fail("It has " + name + " but no cam" + std::to_string(rig.views.size()) +
                    "; number the cameras from cam0 without gaps.");
    }
  }
}

}  // namespace

Rig read_kalibr(const Document& document) {
  try {
    const YAML::Node root = YAML::Load(without_directive(document.text));
    if (!root.IsMap())
      document.fail("It holds no cameras; a Kalibr camchain has keys cam0, cam1, ...");
    require_single_keys(document, root, "");
    Rig rig;
    for (int i = 0; i < 1000; ++i) {
      const std::string name = "cam" + std::to_string(i);
      if (!root[name]) break;
      View view = read_view(document, name, root[name]);
      const Block block(document, name, root[name]);
      const std::optional<Eigen::Isometry3d> from_imu = camera_from_imu(block);
      if (i > 0 && from_imu && rig.world_from_imu && !block.has("T_cn_cnm1")) {
        view.world_from_camera = *rig.world_from_imu * from_imu->inverse();
      } else if (i > 0) {
        view.world_from_camera =
            rig.views.back().world_from_camera * block.motion("T_cn_cnm1").inverse();
      }
      if (from_imu && !rig.world_from_imu) rig.world_from_imu = view.world_from_camera * *from_imu;
      rig.views.push_back(view);
    }
    require_all_cameras(document, root, rig);
    if (rig.views.empty()) {
      document.fail("It holds no cameras; a Kalibr camchain has keys cam0, cam1, ...");
    }
    return rig;
  } catch (const YAML::Exception& error) {
    document.fail(std::string("It is not valid YAML (") + error.what() + ").");
  }
}

namespace {

/// What a camera is in a Kalibr camchain.
struct KalibrForm {
  const char* camera_model;
  std::vector<double> intrinsics;
  const char* distortion_model;
  std::vector<double> coefficients;
};

template <class T>
std::vector<std::string> texts_of(const std::vector<T>& numbers) {
  std::vector<std::string> texts;
  for (const T number : numbers) texts.push_back(text_of(number));
  return texts;
}

KalibrForm kalibr_form(const View& view, const std::filesystem::path& path) {
  const Camera& c = view.camera;
  if (c.skew != 0 ||
      ((c.model == CameraModel::pinhole_radtan || c.model == CameraModel::mei) && c.k3 != 0)) {
    throw Error("Cannot write " + path.string() + ": " + view.name +
                " has a skew or a k3, which Kalibr's format cannot hold.");
  }
  const std::vector<double> f = {c.fx, c.fy, c.cx, c.cy};
  const auto with = [&f](std::vector<double> first) {
    first.insert(first.end(), f.begin(), f.end());
    return first;
  };
  const std::vector<double> radtan = {c.k1, c.k2, c.p1, c.p2};
  switch (c.model) {
    case CameraModel::pinhole:
      return {"pinhole", f, "none", {}};
    case CameraModel::pinhole_radtan:
      return {"pinhole", f, "radtan", radtan};
    case CameraModel::kannala_brandt:
      return {"pinhole", f, "equidistant", {c.k1, c.k2, c.k3, c.k4}};
    case CameraModel::double_sphere:
      return {"ds", with({c.xi, c.alpha}), "none", {}};
    case CameraModel::unified:
      return {"omni", with({c.xi}), "none", {}};
    case CameraModel::extended_unified:
      return {"eucm", with({c.alpha, c.beta}), "none", {}};
    case CameraModel::field_of_view:
      return {"pinhole", f, "fov", {c.omega}};
    case CameraModel::mei:
      return {"omni", with({c.xi}), "radtan", radtan};
  }
  throw Error("Cannot write " + path.string() + ": unknown camera model.");
}

}  // namespace
}  // namespace calibration

void write_kalibr(const std::filesystem::path& path, const Rig& rig) {
  YAML::Emitter out;
  out << YAML::BeginMap;
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
        << calibration::texts_of<int>({view.camera.width, view.camera.height});
    if (view.camera.max_theta < std::numbers::pi) {
      out << YAML::Key << "max_theta_deg" << YAML::Value
          << text_of(view.camera.max_theta * 180 / std::numbers::pi);
    }
    const auto motion = [&out](const char* key, const Eigen::Matrix4d& t) {
      out << YAML::Key << key << YAML::Value << YAML::BeginSeq;
      for (int row = 0; row < 4; ++row) {
        out << YAML::Flow
            << calibration::texts_of<double>({t(row, 0), t(row, 1), t(row, 2), t(row, 3)});
      }
      out << YAML::EndSeq;
    };
    if (rig.world_from_imu) {
      motion("T_cam_imu", (view.world_from_camera.inverse() * *rig.world_from_imu).matrix());
    }
    if (i > 0) motion("T_cn_cnm1", source_from_reference(view, rig.views[i - 1]).matrix());
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
  write_text(path, std::string(out.c_str()) + "\n");
}

}  // namespace widestereo
