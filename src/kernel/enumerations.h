// SPDX-License-Identifier: MIT
// The public enumerations that kernels know as numbers are the same numbers.
#pragma once

#include "kernel/host.h"
#include "widestereo/camera.h"
#include "widestereo/matcher.h"
#include "widestereo/options.h"

namespace widestereo::kernel {

static_assert(CAMERA_PINHOLE == static_cast<int>(CameraModel::pinhole));
static_assert(CAMERA_PINHOLE_RADTAN == static_cast<int>(CameraModel::pinhole_radtan));
static_assert(CAMERA_KANNALA_BRANDT == static_cast<int>(CameraModel::kannala_brandt));
static_assert(CAMERA_DOUBLE_SPHERE == static_cast<int>(CameraModel::double_sphere));
static_assert(CAMERA_UNIFIED == static_cast<int>(CameraModel::unified));
static_assert(CAMERA_EXTENDED_UNIFIED == static_cast<int>(CameraModel::extended_unified));
static_assert(CAMERA_FIELD_OF_VIEW == static_cast<int>(CameraModel::field_of_view));
static_assert(CAMERA_MEI == static_cast<int>(CameraModel::mei));
static_assert(CAMERA_EQUIRECTANGULAR == static_cast<int>(CameraModel::equirectangular));
static_assert(CAMERA_PINHOLE_RATIONAL == static_cast<int>(CameraModel::pinhole_rational));
static_assert(CAMERA_THIN_PRISM_FISHEYE == static_cast<int>(CameraModel::thin_prism_fisheye));
static_assert(CAMERA_RAD_TAN_THIN_PRISM_FISHEYE ==
              static_cast<int>(CameraModel::rad_tan_thin_prism_fisheye));
static_assert(CAMERA_POLYNOMIAL_FISHEYE == static_cast<int>(CameraModel::polynomial_fisheye));

static_assert(MAX_IMAGES == Matcher::most_views);

static_assert(WARP_EXACT == static_cast<int>(PatchWarp::exact));
static_assert(WARP_AFFINE == static_cast<int>(PatchWarp::affine));
static_assert(WARP_QUADRATIC == static_cast<int>(PatchWarp::quadratic));

static_assert(PATTERN_DENSE == static_cast<int>(PatchPattern::dense));
static_assert(PATTERN_CHECKERBOARD == static_cast<int>(PatchPattern::checkerboard));

static_assert(FILTER_EXACT == static_cast<int>(Filter::exact));
static_assert(FILTER_DEVICE == static_cast<int>(Filter::device));

static_assert(SAMPLING_UNIFORM == static_cast<int>(DistanceSampling::uniform));
static_assert(SAMPLING_INVERSE == static_cast<int>(DistanceSampling::inverse));

static_assert(REASON_NO_RAY == reason_no_ray);
static_assert(REASON_NO_OVERLAP == reason_no_overlap);
static_assert(REASON_NO_TEXTURE == reason_no_texture);
static_assert(REASON_HIGH_COST == reason_high_cost);
static_assert(REASON_INCONSISTENT == reason_inconsistent);
static_assert(REASON_UNCHECKED == reason_unchecked);
static_assert(REASON_LOW_PARALLAX == reason_low_parallax);
static_assert(REASON_TILT == reason_tilt);
static_assert(REASON_AMBIGUOUS == reason_ambiguous);
static_assert(REASON_SPECKLE == reason_speckle);
static_assert(REASON_FILLED == reason_filled);
static_assert(REASON_LOW_CONFIDENCE == reason_low_confidence);

}  // namespace widestereo::kernel
