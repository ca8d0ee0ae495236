// SPDX-License-Identifier: MIT
#include "calibration/yaml_camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "text/number.h"

namespace widestereo::calibration {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// yaml-cpp refuses OpenCV's header line, which OpenVINS files begin with.
std::string without_directive(std::string text) {
  const std::size_t at = text.find("%YAML:1.0");
  if (at != std::string::npos && text.find_first_not_of(" \t\r\n") == at) text.erase(0, at + 9);
  return text;
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

}  // namespace

void read_yaml(const Document& document, const std::function<void(const YAML::Node& root)>& read) {
  try {
    const YAML::Node root = YAML::Load(without_directive(document.text));
    if (!root.IsMap()) {
      document.fail(
          "It holds no keys such as cam0 or camera_model; give a Kalibr camchain, EuRoC's "
          "sensor.yaml, a CamOdoCal camera or a VINS-Fusion configuration.");
    }
    require_single_keys(document, root, "");
    read(root);
  } catch (const YAML::Exception& error) {
    document.fail(std::string("It is not valid YAML (") + error.what() + ").");
  }
}

YamlCamera::YamlCamera(const Document& document, const std::string& name, const YAML::Node& node)
    : document_(document), name_(name), node_(node) {
  if (!node.IsMap()) fail("It must hold keys such as camera_model and intrinsics.");
  require_single_keys(document, node, name + ": ");
}

void YamlCamera::fail(const std::string& what) const { document_.fail(name_ + ": " + what); }

bool YamlCamera::has(const char* key) const { return static_cast<bool>(node_[key]); }

std::string YamlCamera::text(const char* key, const char* otherwise) const {
  if (!has(key) && otherwise != nullptr) return otherwise;
  if (!has(key) || !node_[key].IsScalar()) fail(std::string("The key ") + key + " is missing.");
  return node_[key].Scalar();
}

double YamlCamera::number(const char* key) const {
  if (!has(key)) fail(std::string("The key ") + key + " is missing.");
  return number(node_[key], key);
}

int YamlCamera::side(double value, const char* key) const {
  if (value < 1 || value > 1e6 || value != std::floor(value)) {
    fail(std::string("The key ") + key + " must hold whole numbers of pixels.");
  }
  return static_cast<int>(value);
}

int YamlCamera::side(const char* key) const { return side(number(key), key); }

double YamlCamera::number(const YAML::Node& node, const char* key) const {
  // yaml-cpp would read and write numbers by the locale.
  const std::optional<double> value =
      node.IsScalar() ? number_of(node.Scalar()) : std::optional<double>();
  if (!value) {
    fail(std::string("The key ") + key + " holds something that is not a finite number.");
  }
  return *value;
}

std::vector<double> YamlCamera::numbers(const YAML::Node& list, const char* key) const {
  std::vector<double> values;
  for (const YAML::Node& value : list) values.push_back(number(value, key));
  return values;
}

std::vector<double> YamlCamera::numbers(const char* key, std::size_t count) const {
  const YAML::Node list = node_[key];
  if (count == 0 && list && list.IsNull()) return {};
  if (!list || !list.IsSequence() || list.size() < count) {
    fail(std::string("The key ") + key + " must list " + std::to_string(count) + " numbers.");
  }
  std::vector<double> values = numbers(list, key);
  if (std::any_of(values.begin() + static_cast<long>(count), values.end(),
                  [](double value) { return value != 0; })) {
    fail(std::string("The key ") + key + " lists " + std::to_string(values.size()) +
         " numbers, but with these models it has " + std::to_string(count) +
         "; correct the numbers or the models.");
  }
  values.resize(count);
  return values;
}

Eigen::Isometry3d YamlCamera::motion(const char* key) const {
  const YAML::Node node = node_[key];
  std::vector<double> values;
  if (node && node.IsMap() && node["data"] && node["data"].IsSequence()) {
    values = numbers(node["data"], key);
  } else if (node && node.IsSequence() && node.size() >= 3) {
    for (const YAML::Node& row : node) {
      if (!row.IsSequence() || row.size() != 4) {
        fail(std::string("The key ") + key + " must be a 4x4 matrix.");
      }
      const std::vector<double> of_row = numbers(row, key);
      values.insert(values.end(), of_row.begin(), of_row.end());
    }
  } else {
    fail(std::string("The key ") + key + " (4x4 matrix, four rows) is missing.");
  }
  if (values.size() != 12 && values.size() != 16) {
    fail(std::string("The key ") + key + " must be a 4x4 matrix.");
  }
  const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> matrix(values.data());
  return rigid(document_, name_ + ": " + key, matrix.leftCols<3>(), matrix.col(3));
}

View YamlCamera::view() const {
  View view;
  view.name = name_;
  set_projection(view.camera);
  set_distortion(view.camera);
  set_resolution(view.camera);
  if (has("max_theta_deg")) {
    view.camera.max_theta = number(node_["max_theta_deg"], "max_theta_deg") * degree;
  }
  return view;
}

void YamlCamera::set_projection(Camera& camera) const {
  const std::string model = text("camera_model");
  const auto intrinsics = [&](std::size_t before) {
    const std::vector<double> values = numbers("intrinsics", before + 4);
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
  } else if (model == "equirectangular") {
    set_resolution(camera);
    camera = whole_sphere(camera.width, camera.height);
    if (has("intrinsics")) intrinsics(0);
  } else {
    fail("The camera_model \"" + model +
         "\" is unknown; use pinhole, omni, eucm, ds or equirectangular.");
  }
}

void YamlCamera::set_distortion(Camera& camera) const {
  const std::string name = text("distortion_model", "none");
  // As EuRoC's data sets call it.
  const std::string model = name == "radial-tangential" ? "radtan" : name;
  const char* coefficients =
      has("distortion_coefficients") ? "distortion_coefficients" : "distortion_coeffs";
  const bool pinhole = camera.model == CameraModel::pinhole;
  if (model == "none") {
    if (has(coefficients)) numbers(coefficients, 0);
    return;
  }
  const auto unsupported = [&] {
    fail("The distortion_model \"" + model + "\" does not go with camera_model \"" +
         text("camera_model") +
         "\" here; use radtan, equidistant, fov or none with "
         "pinhole, radtan or none with omni, and none with eucm, ds and equirectangular.");
  };
  if (model == "radtan" && (pinhole || camera.model == CameraModel::unified)) {
    const std::vector<double> d = numbers(coefficients, 4);
    camera.k1 = d[0];
    camera.k2 = d[1];
    camera.p1 = d[2];
    camera.p2 = d[3];
    camera.model = pinhole ? CameraModel::pinhole_radtan : CameraModel::mei;
  } else if (model == "equidistant" && pinhole) {
    const std::vector<double> d = numbers(coefficients, 4);
    camera.k1 = d[0];
    camera.k2 = d[1];
    camera.k3 = d[2];
    camera.k4 = d[3];
    camera.model = CameraModel::kannala_brandt;
  } else if (model == "fov" && pinhole) {
    camera.omega = numbers(coefficients, 1)[0];
    camera.model = CameraModel::field_of_view;
  } else {
    unsupported();
  }
}

void YamlCamera::set_resolution(Camera& camera) const {
  const std::vector<double> resolution = numbers("resolution", 2);
  camera.width = side(resolution[0], "resolution");
  camera.height = side(resolution[1], "resolution");
}

}  // namespace widestereo::calibration
