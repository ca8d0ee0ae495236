// SPDX-License-Identifier: MIT
#include "calibration/depthai.h"

#include <Eigen/Dense>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/camera_forms.h"
#include "calibration/yaml_camera.h"
#include "text/number.h"

namespace widestereo::calibration {
namespace {

/// Where something is, relative to a camera.
struct Link {
  int socket = -1;  ///< of that camera; negative: nowhere
  Eigen::Isometry3d from_this = Eigen::Isometry3d::Identity();
};

struct SocketCamera {
  View view;
  Link link;
  std::optional<Eigen::Isometry3d> first_from_camera;
};

constexpr const char* cameras_key = "cameraData";
constexpr const char* link_key = "toCameraSocket";
/// Of dai::LengthUnit, by its number; those after are an application's own.
constexpr double metres_of_units[] = {1, 0.01, 0.001, 0.0254, 0.3048};

/// CAM_A is 0; negative: none.
int socket_of(double number) {
  constexpr int sockets = 26;
  return number >= 0 && number < sockets ? static_cast<int>(number) : -1;
}

Link read_link(const Document& document, const std::string& name, const YAML::Node& node) {
  const YamlCamera keys(document, name, node);
  Link link;
  link.socket = socket_of(keys.number(link_key));
  if (link.socket < 0) return link;
  constexpr double centimetres = 1;
  const double unit = keys.has("lengthUnit") ? keys.number("lengthUnit") : centimetres;
  std::size_t known = 0;
  while (known < std::size(metres_of_units) && unit != static_cast<double>(known)) ++known;
  if (known == std::size(metres_of_units)) {
    document.fail(name + ": The lengthUnit is " + text_of(unit),
                  "metres (0) to feet (4) are known");
  }
  const YamlCamera of_unit(document, name + ": translation", node["translation"]);
  const Eigen::Vector3d translation(of_unit.number("x"), of_unit.number("y"), of_unit.number("z"));
  link.from_this = rigid(document, name + ": rotationMatrix", keys.matrix("rotationMatrix"),
                         metres_of_units[known] * translation);
  return link;
}

Camera read_camera(const Document& document, const std::string& name, const YamlCamera& keys) {
  constexpr int perspective = 0, fisheye = 1;
  const double type = keys.number("cameraType");
  const std::vector<double> coefficients = keys.numbers("distortionCoeff");
  Camera camera;
  if (type == perspective) {
    camera = rational_camera(document, name + ": The distortionCoeff", coefficients);
  } else if (type == fisheye) {
    set_fisheye(camera, keys.numbers("distortionCoeff", 4));
  } else {
    document.fail(name + ": The cameraType is none of 0 (perspective) and 1 (fisheye)",
                  "correct it");
  }
  set_matrix(camera, document, name + ": The intrinsicMatrix", keys.matrix("intrinsicMatrix"));
  camera.width = keys.side("width");
  camera.height = keys.side("height");
  return camera;
}

/// Follows the links from the first camera in both directions.
void find_poses(std::map<int, SocketCamera>& cameras) {
  cameras.begin()->second.first_from_camera = Eigen::Isometry3d::Identity();
  for (bool found = true; found;) {
    found = false;
    for (auto& [socket, camera] : cameras) {
      const auto other = cameras.find(camera.link.socket);
      if (other == cameras.end()) continue;
      auto& here = camera.first_from_camera;
      auto& there = other->second.first_from_camera;
      if (here.has_value() == there.has_value()) continue;
      found = true;
      if (there) {
        here = *there * camera.link.from_this;
      } else {
        there = *here * camera.link.from_this.inverse();
      }
    }
  }
}

}  // namespace

bool is_depthai(const Document& document) {
  return document.contains(cameras_key) && document.contains(link_key);
}

Rig read_depthai(const Document& document) {
  Rig rig;
  // JSON is YAML, too.
  read_yaml(document, [&](const YAML::Node& root) {
    const YAML::Node list = root[cameras_key];
    if (!list || !list.IsSequence()) document.fail("The list cameraData is missing", "add it");
    std::map<int, SocketCamera> cameras;
    for (const YAML::Node& entry : list) {
      const bool is_pair = entry.IsSequence() && entry.size() == 2;
      const int socket = is_pair ? socket_of(entry[0].as<double>(-1)) : -1;
      if (socket < 0) {
        document.fail("The list cameraData does not hold pairs of a socket and its camera",
                      "correct it");
      }
      SocketCamera camera;
      camera.view.name = "CAM_";
      camera.view.name.push_back(static_cast<char>('A' + socket));
      const YamlCamera keys(document, camera.view.name, entry[1]);
      // Sockets without a calibrated camera are there, too.
      if (keys.number("width") == 0) continue;
      camera.view.camera = read_camera(document, camera.view.name, keys);
      camera.link = read_link(document, camera.view.name + ": extrinsics", entry[1]["extrinsics"]);
      if (!cameras.emplace(socket, std::move(camera)).second) {
        document.fail("The list cameraData has the socket of " + camera.view.name + " twice",
                      "leave one");
      }
    }
    if (cameras.empty())
      document.fail("The list cameraData has no calibrated camera", "calibrate the device");
    find_poses(cameras);
    for (auto& [socket, camera] : cameras) {
      if (!camera.first_from_camera) {
        document.fail(camera.view.name + ": No toCameraSocket links it to " +
                          cameras.begin()->second.view.name,
                      "calibrate the cameras together");
      }
      camera.view.world_from_camera = *camera.first_from_camera;
      rig.views.push_back(camera.view);
    }
    if (const YAML::Node imu = root["imuExtrinsics"]) {
      const Link link = read_link(document, "imuExtrinsics", imu);
      if (const auto camera = cameras.find(link.socket); camera != cameras.end()) {
        rig.world_from_imu = *camera->second.first_from_camera * link.from_this;
      }
    }
  });
  return rig;
}

}  // namespace widestereo::calibration
