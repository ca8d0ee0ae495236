// SPDX-License-Identifier: MIT
// COLMAP's camera models and their equivalents.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "widestereo/camera.h"

namespace widestereo::calibration {

/// Its parameters: focal lengths (a panorama has none), the principal point (or a panorama's size),
/// coefficients.
struct ColmapModel {
  const char* name;
  std::size_t focal_lengths;
  CameraModel equivalent;
  /// Where each coefficient goes.
  std::vector<double Camera::*> coefficients;

  std::size_t parameters() const { return focal_lengths + 2 + coefficients.size(); }
};

/// All models, by COLMAP's number.
const std::vector<ColmapModel>& colmap_models();
/// The one of this name; null where there is none.
const ColmapModel* find_colmap_model(std::string_view name);

struct ColmapCamera {
  std::uint64_t number = 0;
  const ColmapModel* model = nullptr;
  double width = 0, height = 0;    ///< pixels
  std::vector<double> parameters;  ///< as many as the model has
};

/// The equivalent camera. Throws Error, beginning with `name`, for pincushion division models,
/// which have none.
Camera camera_of(const ColmapCamera& camera, const std::string& name);

}  // namespace widestereo::calibration
