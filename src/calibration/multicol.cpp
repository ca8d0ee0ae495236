// SPDX-License-Identifier: MIT
#include "calibration/multicol.h"

#include <Eigen/Dense>
#include <string>
#include <utility>

#include "calibration/ocam.h"
#include "calibration/yaml_camera.h"
#include "geometry/cross_matrix.h"

namespace widestereo::calibration {
namespace {

constexpr const char* word_of_camera = "Camera.nrpol";
constexpr const char* word_of_rig = "CameraSystem.nrCams";

View read_view(const Document& document, const std::string& name) {
  View view;
  view.name = name;
  read_yaml(document, [&](const YAML::Node& root) {
    const YamlCamera keys(document, name, root);
    OCamLens lens;
    const int coefficients = keys.count(word_of_camera);
    for (int i = 0; i < coefficients; ++i) {
      lens.polynomial.push_back(keys.number(("Camera.a" + std::to_string(i)).c_str()));
    }
    lens.set_columns_first(keys.number("Camera.c"), keys.number("Camera.d"),
                           keys.number("Camera.e"));
    lens.centre = {keys.number("Camera.u0"), keys.number("Camera.v0")};
    view.camera =
        camera_of(lens, keys.side("Camera.Iw"), keys.side("Camera.Ih"), document, view.name);
  });
  return view;
}

/// Cayley's parameters c: (I + [c]x) (I - [c]x)^-1.
Eigen::Matrix3d rotation_of(const Eigen::Vector3d& c) {
  const Eigen::Matrix3d skew = cross_matrix(c);
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  return (identity + skew) * (identity - skew).inverse();
}

}  // namespace

bool is_multicol(const Document& document) {
  return document.contains(word_of_camera) || document.contains(word_of_rig);
}

Rig read_multicol(const Document& document,
                  const std::function<Document(const std::filesystem::path&)>& load) {
  Rig rig;
  if (document.contains(word_of_camera)) {
    rig.views.push_back(read_view(document, "cam0"));
    return rig;
  }
  read_yaml(document, [&](const YAML::Node& root) {
    const YamlCamera keys(document, "MultiCol-SLAM", root);
    const int cameras = keys.count(word_of_rig);
    for (int i = 0; i < cameras; ++i) {
      const std::string number = std::to_string(i);
      const Document camera =
          load(document.path.parent_path() / ("InteriorOrientationFisheye" + number + ".yaml"));
      const std::string key = "CameraSystem.cam" + std::to_string(i + 1) + "_";
      const auto vector = [&](int first) {
        Eigen::Vector3d v;
        for (int j = 0; j < 3; ++j) v[j] = keys.number((key + std::to_string(first + j)).c_str());
        return v;
      };
      Eigen::Isometry3d body_from_camera = Eigen::Isometry3d::Identity();
      body_from_camera.linear() = rotation_of(vector(1));
      body_from_camera.translation() = vector(4);
      add_view_of_body(rig, read_view(camera, "cam" + number), body_from_camera);
    }
  });
  rig.world_from_imu.reset();
  return rig;
}

}  // namespace widestereo::calibration
