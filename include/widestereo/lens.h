// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "widestereo/camera.h"

namespace widestereo {

/// Where the images of a lens end before the sensor does.
struct LensRim {
  double dark = 0;    ///< radians off the axis: from here on pixels are black
  double usable = 0;  ///< less: where the light has fallen to half; reflections may lie between
};

/// Whether find_lens_rim() may find one: what a camera's image shows reaches 60 degrees off the
/// axis.
bool may_show_rim(const Camera& camera);

/// The rim that a camera's images (8 or 16 bit or as to_intensity() returns them, of the camera's
/// size) show, taken together by their brightest pixels: the more there are, and the brighter the
/// scene, the surer. None where light reaches the outermost pixels, and nearer to the axis than 60
/// degrees, where darkness is the scene's. Pixels beyond camera.max_theta are left out. Throws
/// Error on images of another size.
std::optional<LensRim> find_lens_rim(const Camera& camera, const std::vector<cv::Mat>& images);

}  // namespace widestereo
