// SPDX-License-Identifier: MIT
#include "calibration/colmap_camera.h"

#include <algorithm>

#include "widestereo/error.h"

namespace widestereo::calibration {

const std::vector<ColmapModel>& colmap_models() {
  using enum CameraModel;
  using C = Camera;
  constexpr double C::*zero = nullptr;
  static const std::vector<ColmapModel> models = {
      {"SIMPLE_PINHOLE", 1, pinhole, {}},
      {"PINHOLE", 2, pinhole, {}},
      {"SIMPLE_RADIAL", 1, pinhole_radtan, {&C::k1}},
      {"RADIAL", 1, pinhole_radtan, {&C::k1, &C::k2}},
      {"OPENCV", 2, pinhole_radtan, {&C::k1, &C::k2, &C::p1, &C::p2}},
      {"OPENCV_FISHEYE", 2, kannala_brandt, {&C::k1, &C::k2, &C::k3, &C::k4}},
      {"FULL_OPENCV",
       2,
       pinhole_radtan,
       {&C::k1, &C::k2, &C::p1, &C::p2, &C::k3, zero, zero, zero}},
      {"FOV", 2, field_of_view, {&C::omega}},
      {"SIMPLE_RADIAL_FISHEYE", 1, kannala_brandt, {&C::k1}},
      {"RADIAL_FISHEYE", 1, kannala_brandt, {&C::k1, &C::k2}},
      {"THIN_PRISM_FISHEYE",
       2,
       kannala_brandt,
       {&C::k1, &C::k2, zero, zero, &C::k3, &C::k4, zero, zero}},
      {"RAD_TAN_THIN_PRISM_FISHEYE", 2, {}, std::vector<double C::*>(12, zero)},
      {"SIMPLE_DIVISION", 1, {}, {zero}},
      {"DIVISION", 2, {}, {zero}},
      {"SIMPLE_FISHEYE", 1, kannala_brandt, {}},
      {"FISHEYE", 2, kannala_brandt, {}},
      {"EUCM", 2, extended_unified, {&C::alpha, &C::beta}},
      {"EQUIRECTANGULAR", 0, equirectangular, {}}};
  return models;
}

const ColmapModel* find_colmap_model(std::string_view name) {
  for (const ColmapModel& model : colmap_models()) {
    if (name == model.name) return &model;
  }
  return nullptr;
}

Camera camera_of(const ColmapCamera& record, const std::string& name) {
  const ColmapModel& model = *record.model;
  const std::string remedy =
      "; reconstruct with another one, such as OPENCV_FISHEYE (--ImageReader.camera_model).";
  if (!model.equivalent) {
    throw Error(name + ": The camera model " + model.name + " is not supported" + remedy);
  }
  const double* next = record.parameters.data();
  Camera camera;
  camera.model = *model.equivalent;
  constexpr double beyond_any_image = 1e6;  // which validate() refuses
  camera.width = static_cast<int>(std::min(record.width, beyond_any_image));
  camera.height = static_cast<int>(std::min(record.height, beyond_any_image));
  if (camera.model == CameraModel::equirectangular) {
    // Its parameters repeat the size.
    return whole_sphere(camera.width, camera.height);
  }
  camera.fx = *next++;
  camera.fy = model.focal_lengths == 2 ? *next++ : camera.fx;
  // COLMAP's pixel centres lie at half pixels.
  camera.cx = *next++ - 0.5;
  camera.cy = *next++ - 0.5;
  for (double Camera::*member : model.coefficients) {
    const double value = *next++;
    if (member != nullptr) {
      camera.*member = value;
    } else if (value != 0) {
      throw Error(name + ": The camera model " + model.name +
                  " is supported only without thin-prism, tangential and rational coefficients" +
                  remedy);
    }
  }
  return camera;
}

}  // namespace widestereo::calibration
