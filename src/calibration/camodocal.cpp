// SPDX-License-Identifier: MIT
#include "calibration/camodocal.h"

#include <cctype>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "calibration/camera_forms.h"
#include "calibration/ocam.h"
#include "calibration/yaml_camera.h"

namespace widestereo::calibration {
namespace {

using Member = std::pair<const char*, double Camera::*>;

/// A map of the file, by names that tell the camera and the map.
YamlCamera part_of(const Document& document, const std::string& name, const YAML::Node& root,
                   const char* key) {
  if (!root[key]) document.fail(name + ": The key " + key + " is missing", "add it");
  return {document, name + ": " + key, root[key]};
}

void read_numbers(const YamlCamera& part, Camera& camera, std::initializer_list<Member> members) {
  for (const auto& [key, member] : members) camera.*member = part.number(key);
}

OCamLens read_ocam_lens(const YamlCamera& polynomial, const YamlCamera& affine) {
  OCamLens lens;
  const auto key = [&lens] {
    return std::string("p").append(std::to_string(lens.polynomial.size()));
  };
  do {
    lens.polynomial.push_back(polynomial.number(key().c_str()));
  } while (polynomial.has(key().c_str()));
  lens.set_columns_first(affine.number("ac"), affine.number("ad"), affine.number("ae"));
  lens.centre = {affine.number("cx"), affine.number("cy")};
  return lens;
}

View read_view(const Document& document, const std::string& name) {
  using C = Camera;
  View view;
  view.name = name;
  read_yaml(document, [&](const YAML::Node& root) {
    const YamlCamera keys(document, name, root);
    Camera& camera = view.camera;
    std::string model = keys.text("model_type");
    for (char& letter : model)
      letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    const int width = keys.side("image_width");
    const int height = keys.side("image_height");
    const auto part = [&](const char* key) { return part_of(document, name, root, key); };
    constexpr const char* projection = "projection_parameters";
    constexpr const char* distortion = "distortion_parameters";
    if (model == "KANNALA_BRANDT") {
      camera.model = CameraModel::kannala_brandt;
      // Its k1, of the angle itself, is 1.
      read_numbers(part(projection), camera,
                   {{"k2", &C::k1},
                    {"k3", &C::k2},
                    {"k4", &C::k3},
                    {"k5", &C::k4},
                    {"mu", &C::fx},
                    {"mv", &C::fy},
                    {"u0", &C::cx},
                    {"v0", &C::cy}});
    } else if (model == "MEI") {
      camera.model = CameraModel::mei;
      read_numbers(part("mirror_parameters"), camera, {{"xi", &C::xi}});
      read_numbers(part(projection), camera,
                   {{"gamma1", &C::fx}, {"gamma2", &C::fy}, {"u0", &C::cx}, {"v0", &C::cy}});
    } else if (model == "PINHOLE" || model == "PINHOLE_FULL") {
      camera.model = CameraModel::pinhole_radtan;
      read_numbers(part(projection), camera,
                   {{"fx", &C::fx}, {"fy", &C::fy}, {"cx", &C::cx}, {"cy", &C::cy}});
    } else if (model == "SCARAMUZZA") {
      camera = camera_of(read_ocam_lens(part("poly_parameters"), part("affine_parameters")), width,
                         height, document, name);
    } else {
      document.fail(name + ": The model_type \"" + model + "\" is not supported",
                    "use KANNALA_BRANDT, MEI, PINHOLE, PINHOLE_FULL or SCARAMUZZA");
    }
    if (model != "KANNALA_BRANDT" && model != "SCARAMUZZA") {
      read_numbers(part(distortion), camera,
                   {{"k1", &C::k1}, {"k2", &C::k2}, {"p1", &C::p1}, {"p2", &C::p2}});
    }
    if (model == "PINHOLE_FULL") {
      camera.model = CameraModel::pinhole_rational;
      read_numbers(part(distortion), camera,
                   {{"k3", &C::k3}, {"k4", &C::k4}, {"k5", &C::k5}, {"k6", &C::k6}});
      camera = simplified(camera);
    }
    camera.width = width;
    camera.height = height;
  });
  return view;
}

}  // namespace

bool is_vins(const Document& document) { return document.contains("cam0_calib"); }

Rig read_vins(const Document& document,
              const std::function<Document(const std::filesystem::path&)>& load) {
  Rig rig;
  read_yaml(document, [&](const YAML::Node& root) {
    const YamlCamera keys(document, "VINS-Fusion", root);
    const auto next = [&rig] { return "cam" + std::to_string(rig.views.size()); };
    for (std::string key = next() + "_calib"; keys.has(key.c_str()); key = next() + "_calib") {
      const Document camera = load(document.path.parent_path() / keys.text(key.c_str()));
      add_view_of_body(rig, read_view(camera, next()), keys.motion(("body_T_" + next()).c_str()));
    }
    const std::string found = std::to_string(rig.views.size());
    const std::string stated = keys.text("num_of_cam", found.c_str());
    if (stated != found) {
      document.fail(
          "The key num_of_cam says " + stated + ", but cam0_calib and the next name " + found,
          "correct one");
    }
    if (keys.text("imu", "1") == "0") {
      rig.world_from_imu.reset();
    } else if (keys.has("td")) {
      for (View& view : rig.views) view.imu_time_offset = keys.number("td");
    }
  });
  return rig;
}

bool is_camodocal(const Document& document) {
  return document.contains("model_type") &&
         (document.contains("projection_parameters") || document.contains("poly_parameters"));
}

Rig read_camodocal(const Document& document) {
  Rig rig;
  rig.views.push_back(read_view(document, "cam0"));
  return rig;
}

}  // namespace widestereo::calibration
