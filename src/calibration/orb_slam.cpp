// SPDX-License-Identifier: MIT
#include "calibration/orb_slam.h"

#include <array>
#include <string>
#include <utility>

#include "calibration/camera_forms.h"
#include "calibration/yaml_camera.h"

namespace widestereo::calibration {
namespace {

/// `prefix` ends with a dot.
Camera read_camera(const Document& document, const YamlCamera& keys, const std::string& prefix) {
  const auto number = [&](const char* key) { return keys.number((prefix + key).c_str()); };
  const auto number_or_zero = [&](const char* key) {
    return keys.has((prefix + key).c_str()) ? number(key) : 0;
  };
  const std::string type = keys.text("Camera.type");
  Camera camera;
  if (type == "KannalaBrandt8") {
    set_fisheye(camera, std::array{number("k1"), number("k2"), number("k3"), number("k4")});
  } else if (type == "PinHole") {
    camera =
        rational_camera(document, prefix + "k1",
                        std::array{number_or_zero("k1"), number_or_zero("k2"), number_or_zero("p1"),
                                   number_or_zero("p2"), number_or_zero("k3")});
  } else if (type != "Rectified") {
    document.fail("The Camera.type \"" + type + "\" is unknown",
                  "use KannalaBrandt8, PinHole or Rectified");
  }
  camera.width = keys.side("Camera.width");
  camera.height = keys.side("Camera.height");
  camera.fx = number("fx");
  camera.fy = number("fy");
  camera.cx = number("cx");
  camera.cy = number("cy");
  return camera;
}

/// The first of the keys that is there, null if none is.
const char* present(const YamlCamera& keys, const char* first, const char* second) {
  if (keys.has(first)) return first;
  return keys.has(second) ? second : nullptr;
}

}  // namespace

bool is_orb_slam(const Document& document) { return document.contains("Camera.type"); }

Rig read_orb_slam(const Document& document) {
  Rig rig;
  read_yaml(document, [&](const YAML::Node& root) {
    const YamlCamera keys(document, "ORB-SLAM3", root);
    if (keys.has("LEFT.K")) {
      document.fail(
          "Its cameras are those of images that ORB-SLAM rectifies (LEFT.K)",
          "give the calibration of the images themselves, or Camera1, Camera2 and Stereo.T_c1_c2");
    }
    View& first = rig.views.emplace_back();
    first.name = "cam0";
    first.camera = read_camera(document, keys, keys.has("Camera1.fx") ? "Camera1." : "Camera.");
    View second = first;
    second.name = "cam1";
    if (keys.has("Camera2.fx")) {
      second.camera = read_camera(document, keys, "Camera2.");
      const char* pose = present(keys, "Stereo.T_c1_c2", "Tlr");
      second.world_from_camera = keys.motion(pose != nullptr ? pose : "Stereo.T_c1_c2");
      rig.views.push_back(std::move(second));
    } else if (keys.has("Stereo.b") && keys.text("Camera.type") == "Rectified") {
      second.world_from_camera.translation().x() = keys.number("Stereo.b");
      rig.views.push_back(std::move(second));
    }
    if (const char* imu = present(keys, "IMU.T_b_c1", "Tbc")) {
      rig.world_from_imu = keys.motion(imu).inverse();
    }
  });
  return rig;
}

}  // namespace widestereo::calibration
