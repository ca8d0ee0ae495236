// SPDX-License-Identifier: MIT
#include "calibration/colmap_camera.h"

#include <optional>

#include "calibration/camera_forms.h"
#include "calibration/document.h"
#include "text/number.h"
#include "widestereo/error.h"

namespace widestereo::calibration {

const std::vector<ColmapModel>& colmap_models() {
  using enum CameraModel;
  using C = Camera;
  static const std::vector<ColmapModel> models = {
      {"SIMPLE_PINHOLE", 1, pinhole, {}},
      {"PINHOLE", 2, pinhole, {}},
      {"SIMPLE_RADIAL", 1, pinhole_radtan, {&C::k1}},
      {"RADIAL", 1, pinhole_radtan, {&C::k1, &C::k2}},
      {"OPENCV", 2, pinhole_radtan, {&C::k1, &C::k2, &C::p1, &C::p2}},
      {"OPENCV_FISHEYE", 2, kannala_brandt, {&C::k1, &C::k2, &C::k3, &C::k4}},
      {"FULL_OPENCV",
       2,
       pinhole_rational,
       {&C::k1, &C::k2, &C::p1, &C::p2, &C::k3, &C::k4, &C::k5, &C::k6}},
      {"FOV", 2, field_of_view, {&C::omega}},
      {"SIMPLE_RADIAL_FISHEYE", 1, kannala_brandt, {&C::k1}},
      {"RADIAL_FISHEYE", 1, kannala_brandt, {&C::k1, &C::k2}},
      {"THIN_PRISM_FISHEYE",
       2,
       thin_prism_fisheye,
       {&C::k1, &C::k2, &C::p1, &C::p2, &C::k3, &C::k4, &C::s1, &C::s3}},
      // Its p0, which is of x, is what others call p2.
      {"RAD_TAN_THIN_PRISM_FISHEYE",
       2,
       rad_tan_thin_prism_fisheye,
       {&C::k1, &C::k2, &C::k3, &C::k4, &C::k5, &C::k6, &C::p2, &C::p1, &C::s1, &C::s2, &C::s3,
        &C::s4}},
      // k, of which beta is -4.
      {"SIMPLE_DIVISION", 1, extended_unified, {&C::beta}},
      {"DIVISION", 2, extended_unified, {&C::beta}},
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

namespace {

/// (x, y) / ((z + sqrt(z^2 - 4 k rho^2)) / 2): the extended unified model with alpha = 1/2, for
/// lenses whose images shrink outwards, as wide ones do.
void set_division(Camera& camera, double k, const std::string& name) {
  if (k > 0) {
    throw Error(name + ": The camera model has the division coefficient " + text_of(k) +
                "; only those of wide lenses, 0 and less, are supported.");
  }
  camera.alpha = 0.5;
  camera.beta = -4 * k;
  if (k < 0) return;
  camera.model = CameraModel::pinhole;
  camera.alpha = Camera().alpha;
  camera.beta = Camera().beta;
}

}  // namespace

Camera camera_of(const ColmapCamera& record, const std::string& name) {
  const ColmapModel& model = *record.model;
  const double* next = record.parameters.data();
  Camera camera;
  camera.model = model.equivalent;
  const std::optional<int> width = whole_number(record.width);
  const std::optional<int> height = whole_number(record.height);
  if (!width || !height) {
    throw Error(name + ": A camera's size is " + text_of(record.width) + "x" +
                text_of(record.height) +
                "; give its width and height as whole numbers of pixels, at most a million.");
  }
  camera.width = *width;
  camera.height = *height;
  if (camera.model == CameraModel::equirectangular) {
    // Its parameters repeat the size.
    return whole_sphere(camera.width, camera.height);
  }
  camera.fx = *next++;
  camera.fy = model.focal_lengths == 2 ? *next++ : camera.fx;
  // COLMAP's pixel centres lie at half pixels.
  camera.cx = *next++ - 0.5;
  camera.cy = *next++ - 0.5;
  for (double Camera::*member : model.coefficients) camera.*member = *next++;
  if (std::string_view(model.name).ends_with("DIVISION")) {
    set_division(camera, camera.beta, name + ": " + model.name);
  }
  // The model is even in it, so that bundle adjustment may leave either sign.
  camera.omega = std::abs(camera.omega);
  return simplified(camera);
}

}  // namespace widestereo::calibration
