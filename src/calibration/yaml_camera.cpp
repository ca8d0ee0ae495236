// SPDX-License-Identifier: MIT
#include "calibration/yaml_camera.h"

#include <algorithm>
#include <optional>
#include <set>
#include <sstream>

#include "calibration/camera_forms.h"
#include "geometry/angle.h"
#include "text/number.h"

namespace widestereo::calibration {
namespace {

/// What OpenCV's own YAML, told by its header line, may have that yaml-cpp refuses: that line (in
/// OpenVINS's files) and keys without a space before their value (in ORB-SLAM's).
std::string as_yaml(const std::string& text) {
  const std::string header = "%YAML:1.0";
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos || text.compare(begin, header.size(), header) != 0) return text;
  std::istringstream lines(text.substr(begin + header.size()));
  std::string result;
  for (std::string line; std::getline(lines, line);) {
    const std::size_t key = line.find_first_not_of(' ');
    const std::size_t colon = line.find_first_of(":#\"'[{, ", key);
    if (colon != std::string::npos && line[colon] == ':') line.insert(colon + 1, 1, ' ');
    result.append(line).push_back('\n');
  }
  return result;
}

/// The parser keeps all of equal keys, of which a look-up finds one.
void require_single_keys(const Document& document, const YAML::Node& map,
                         const std::string& where) {
  std::set<std::string> keys;
  for (const auto& entry : map) {
    const YAML::Node& key = entry.first;
    if (!key.IsScalar() || keys.insert(key.Scalar()).second) continue;
    document.fail(where + "The key " + key.Scalar() + " is there twice", "leave one");
  }
}

}  // namespace

void read_yaml(const Document& document, const std::function<void(const YAML::Node& root)>& read) {
  try {
    std::vector<YAML::Node> documents = YAML::LoadAll(as_yaml(document.text));
    std::erase_if(documents, [](const YAML::Node& node) { return node.IsNull(); });
    if (documents.size() > 1) {
      document.fail(std::to_string(documents.size()) +
                        " YAML documents are in it, of which one would be read",
                    "join them");
    }
    const YAML::Node root = documents.empty() ? YAML::Node() : documents.front();
    if (!root.IsMap()) {
      document.fail("It holds no keys such as cam0 or camera_model", "give a calibration");
    }
    require_single_keys(document, root, "");
    read(root);
  } catch (const YAML::Exception& error) {
    document.fail(std::string("It is not valid YAML (") + error.what() + ")", "correct it there");
  }
}

YamlCamera::YamlCamera(const Document& document, const std::string& name, const YAML::Node& node)
    : document_(document), name_(name), node_(node) {
  if (!node || !node.IsMap())
    fail("It must hold keys such as camera_model and intrinsics", "add them");
  require_single_keys(document, node, name + ": ");
}

void YamlCamera::fail(const std::string& finding, const std::string& remedy) const {
  document_.fail(name_ + ": " + finding, remedy);
}

void YamlCamera::fail_without(const std::string& key) const {
  fail("The key " + key + " is missing", "add it");
}

bool YamlCamera::has(const char* key) const { return static_cast<bool>(node_[key]); }

std::string YamlCamera::text(const char* key, const char* otherwise) const {
  if (!has(key) && otherwise != nullptr) return otherwise;
  if (!has(key) || !node_[key].IsScalar()) fail_without(key);
  return node_[key].Scalar();
}

double YamlCamera::number(const char* key) const {
  if (!has(key)) fail_without(key);
  return number(node_[key], key);
}

int YamlCamera::count(const char* key) const {
  constexpr int most = 100;
  const std::optional<int> value = whole_number(number(key));
  if (!value || *value > most) {
    fail(std::string("The key ") + key + " must be a whole number from 1 to 100", "correct it");
  }
  return *value;
}

int YamlCamera::side(double value, const char* key) const {
  const std::optional<int> pixels = whole_number(value);
  if (!pixels) {
    fail(std::string("The key ") + key + " has " + text_of(value),
         "give whole numbers of pixels, at most a million");
  }
  return *pixels;
}

int YamlCamera::side(const char* key) const { return side(number(key), key); }

std::vector<int> YamlCamera::sides(const char* key) const {
  const std::vector<double> values = numbers(key, 2);
  return {side(values[0], key), side(values[1], key)};
}

double YamlCamera::number(const YAML::Node& node, const char* key) const {
  // yaml-cpp would read and write numbers by the locale.
  const std::optional<double> value =
      node.IsScalar() ? number_of(node.Scalar()) : std::optional<double>();
  if (!value) {
    fail(std::string("The key ") + key + " holds something that is not a finite number",
         "correct it");
  }
  return *value;
}

std::vector<double> YamlCamera::numbers(const YAML::Node& list, const char* key) const {
  std::vector<double> values;
  for (const YAML::Node& value : list) values.push_back(number(value, key));
  return values;
}

YAML::Node YamlCamera::list(const char* key) const {
  const YAML::Node node = node_[key];
  const YAML::Node values = node && node.IsMap() ? node["data"] : node;
  return values && values.IsSequence() ? values : YAML::Node();
}

std::vector<double> YamlCamera::numbers(const char* key) const {
  const YAML::Node values = list(key);
  if (!values.IsSequence())
    fail(std::string("The key ") + key + " must list numbers", "correct it");
  return numbers(values, key);
}

std::vector<double> YamlCamera::numbers(const char* key, std::size_t count) const {
  const YAML::Node of_key = list(key);
  if (count == 0 && has(key) && node_[key].IsNull()) return {};
  if (!of_key.IsSequence() || of_key.size() < count) {
    fail(std::string("The key ") + key + " must list " + std::to_string(count) + " numbers",
         "correct it");
  }
  std::vector<double> values = numbers(of_key, key);
  if (std::any_of(values.begin() + static_cast<long>(count), values.end(),
                  [](double value) { return value != 0; })) {
    fail(std::string("The key ") + key + " lists " + std::to_string(values.size()) +
             " numbers, but with these models it has " + std::to_string(count),
         "correct the numbers or the models");
  }
  values.resize(count);
  return values;
}

std::vector<double> YamlCamera::rows(const YAML::Node& list, std::size_t columns, const char* key,
                                     const std::string& shape) const {
  std::vector<double> values;
  for (const YAML::Node& row : list) {
    if (!row.IsSequence() || row.size() != columns) {
      fail(std::string("The key ") + key + " must be " + shape, "correct it");
    }
    const std::vector<double> of_row = numbers(row, key);
    values.insert(values.end(), of_row.begin(), of_row.end());
  }
  return values;
}

Eigen::Matrix3d YamlCamera::matrix(const char* key) const {
  const YAML::Node node = node_[key];
  if (!node || !node.IsSequence() || node.size() != 3) {
    fail_without(std::string(key) + " (3x3 matrix, three rows)");
  }
  const std::vector<double> values = rows(node, 3, key, "a 3x3 matrix");
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(values.data());
}

Eigen::Isometry3d YamlCamera::motion(const char* key) const {
  const YAML::Node node = node_[key];
  std::vector<double> values;
  if (node && node.IsMap() && list(key).IsSequence()) {
    values = numbers(list(key), key);
  } else if (node && node.IsSequence() && node.size() >= 3) {
    values = rows(node, 4, key, "a 4x4 matrix");
  } else {
    fail_without(std::string(key) + " (4x4 matrix, four rows)");
  }
  if (values.size() != 12 && values.size() != 16) {
    fail(std::string("The key ") + key + " must be a 4x4 matrix", "correct it");
  }
  if (values.size() == 16) {
    require_last_row(document_, name_ + ": " + key,
                     Eigen::Map<const Eigen::RowVector4d>(values.data() + 12));
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
  if (has(max_theta_key)) {
    view.camera.max_theta = number(node_[max_theta_key], max_theta_key) * radians_per_degree;
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
    fail("The camera_model \"" + model + "\" is unknown",
         "use pinhole, omni, eucm, ds or equirectangular");
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
             text("camera_model") + "\" here",
         "use radtan, equidistant, fov or none with pinhole, radtan or none with omni, and none "
         "with eucm, ds and equirectangular");
  };
  if (model == "radtan" && (pinhole || camera.model == CameraModel::unified)) {
    const std::vector<double> d = numbers(coefficients, 4);
    camera.k1 = d[0];
    camera.k2 = d[1];
    camera.p1 = d[2];
    camera.p2 = d[3];
    camera.model = pinhole ? CameraModel::pinhole_radtan : CameraModel::mei;
  } else if (model == "equidistant" && pinhole) {
    set_fisheye(camera, numbers(coefficients, 4));
  } else if (model == "fov" && pinhole) {
    camera.omega = numbers(coefficients, 1)[0];
    camera.model = CameraModel::field_of_view;
  } else {
    unsupported();
  }
}

void YamlCamera::set_resolution(Camera& camera) const {
  const std::vector<int> resolution = sides("resolution");
  camera.width = resolution[0];
  camera.height = resolution[1];
}

}  // namespace widestereo::calibration
