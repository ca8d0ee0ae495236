// SPDX-License-Identifier: MIT
#include "calibration/ros.h"

#include <string>
#include <utility>

#include "calibration/camera_forms.h"
#include "calibration/yaml_camera.h"

namespace widestereo::calibration {
namespace {

/// The first of the keys that is there, or the first: files, ROS and ROS 2 name them differently.
const char* named(const YamlCamera& keys, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    if (keys.has(name)) return name;
  }
  return *names.begin();
}

using Rows3x4 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
using Rows3x3 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

void set_lens(Camera& camera, const Document& document, const YamlCamera& keys) {
  const std::string model = keys.text("distortion_model");
  const char* key = named(keys, {"distortion_coefficients", "D", "d"});
  if (model == "equidistant" || model == "fisheye") {
    set_fisheye(camera, keys.numbers(key, 4));
  } else if (model == "plumb_bob" || model == "rational_polynomial") {
    camera = rational_camera(document, key, keys.numbers(key));
  } else {
    document.fail("The distortion_model \"" + model + "\" is unknown",
                  "use equidistant, plumb_bob or rational_polynomial");
  }
}

/// Images may be a part of what was calibrated, or reduced.
void require_whole_images(const Document& document, const YamlCamera& keys, const YAML::Node& root,
                          const Camera& camera) {
  for (const char* key : {"binning_x", "binning_y"}) {
    if (keys.has(key) && keys.number(key) > 1) {
      document.fail(std::string("Its images are binned (") + key + ")",
                    "set it to 0 and scale by `calibration convert --scale`");
    }
  }
  if (!keys.has("roi")) return;
  const YamlCamera roi(document, "roi", root["roi"]);
  // All of the image may be given as its size, too.
  const std::pair<const char*, int> whole[] = {
      {"x_offset", 0}, {"y_offset", 0}, {"width", camera.width}, {"height", camera.height}};
  for (const auto& [key, size] : whole) {
    if (!roi.has(key) || roi.number(key) == 0 || roi.number(key) == size) continue;
    document.fail(std::string("Its images are a part of what was calibrated (roi: ") + key + ")",
                  "move the centre in K, set width and height to theirs, and roi to 0");
  }
}

struct RectifiedView {
  View view;                      ///< without its pose
  Eigen::Isometry3d from_camera;  ///< to the frame in which all are rectified
};

RectifiedView read_view(const Document& document, const std::string& name, const YAML::Node& root) {
  const YamlCamera keys(document, name, root);
  RectifiedView result;
  result.view.name = name;
  Camera& camera = result.view.camera;
  set_lens(camera, document, keys);
  camera.width = keys.side(named(keys, {"image_width", "width"}));
  camera.height = keys.side(named(keys, {"image_height", "height"}));
  require_whole_images(document, keys, root, camera);
  const char* matrix = named(keys, {"camera_matrix", "K", "k"});
  const std::vector<double> k = keys.numbers(matrix, 9);
  set_matrix(camera, document, matrix, Eigen::Map<const Rows3x3>(k.data()));

  const char* rectification = named(keys, {"rectification_matrix", "R", "r"});
  const std::vector<double> r = keys.numbers(rectification, 9);
  const char* projection = named(keys, {"projection_matrix", "P", "p"});
  const std::vector<double> p = keys.numbers(projection, 12);
  const Eigen::Map<const Rows3x4> rectified(p.data());
  // P = K' (I | -c) of a camera at c.
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  if (rectified.col(3).head<2>() != Eigen::Vector2d::Zero()) {
    centre = -rectified.leftCols<3>().inverse() * rectified.col(3);
  }
  result.from_camera = rigid(document, std::string(rectification) + " and " + projection,
                             Eigen::Map<const Rows3x3>(r.data()), centre);
  return result;
}

}  // namespace

bool is_ros(const Document& document) {
  return document.contains("distortion_model") &&
         (document.contains("projection_matrix") || document.contains("binning_x"));
}

Rig read_ros(const std::vector<Document>& documents) {
  Rig rig;
  Eigen::Isometry3d first;
  for (const Document& document : documents) {
    read_yaml(document, [&](const YAML::Node& root) {
      auto [view, rectified_from_camera] =
          read_view(document, "cam" + std::to_string(rig.views.size()), root);
      if (rig.views.empty()) first = rectified_from_camera;
      view.world_from_camera = first.inverse() * rectified_from_camera;
      for (const View& other : rig.views) {
        if (other.world_from_camera.translation() != view.world_from_camera.translation()) continue;
        document.fail("It has no baseline to " + other.name + " in its projection matrix",
                      "calibrate both together, as a stereo pair");
      }
      rig.views.push_back(std::move(view));
    });
  }
  return rig;
}

}  // namespace widestereo::calibration
