// SPDX-License-Identifier: MIT
#include "calibration/woodscape.h"

#include <string>

#include "calibration/yaml_camera.h"

namespace widestereo::calibration {

bool is_woodscape(const Document& document) { return document.contains("\"radial_poly\""); }

Rig read_woodscape(const Document& document) {
  Rig rig;
  View& view = rig.views.emplace_back();
  view.name = "cam0";
  // JSON is YAML, too.
  read_yaml(document, [&](const YAML::Node& root) {
    if (!root["intrinsic"]) document.fail("The key intrinsic is missing", "add it");
    const YamlCamera keys(document, "intrinsic", root["intrinsic"]);
    Camera& camera = view.camera;
    camera.model = CameraModel::polynomial_fisheye;
    camera.width = keys.side("width");
    camera.height = keys.side("height");
    // Offsets from the image's middle.
    camera.cx = 0.5 * (camera.width - 1) + keys.number("cx_offset");
    camera.cy = 0.5 * (camera.height - 1) + keys.number("cy_offset");
    const double focal_length = keys.number("k1");  // pixels per radian
    if (!(focal_length > 0)) document.fail("The key k1 must be positive", "correct it");
    camera.fx = focal_length;
    camera.fy = focal_length * keys.number("aspect_ratio");
    camera.k1 = keys.number("k2") / focal_length;
    camera.k2 = keys.number("k3") / focal_length;
    camera.k3 = keys.number("k4") / focal_length;
    if (keys.has("poly_order") && keys.number("poly_order") != 4) {
      document.fail("The key poly_order is not 4, for k1 to k4",
                    "calibrate with four coefficients");
    }
  });
  return rig;
}

}  // namespace widestereo::calibration
