// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "widestereo/matcher.h"
#include "widestereo/rig.h"

namespace widestereo {

/// How the rig moved between two frames, for WarmStart: X now = T X previous, in the rig's frame
/// (metres). Found by direct alignment: the accepted points of the previous frame's views keep
/// their intensities (up to a gain and an offset of each view) where the moved rig sees them. Good
/// for displacements of some ten pixels. Nothing where the frames do not determine the motion.
///
/// `previous`: its images and what was matched in them, of which only hypotheses and reasons are
/// used; `images`: of the frame now. One for each view, of the calibrated sizes; throws Error
/// otherwise. The same input gives the same bits.
std::optional<Eigen::Isometry3d> estimate_motion(const Rig& rig,
                                                 const std::vector<cv::Mat>& previous_images,
                                                 const std::vector<ViewResult>& previous,
                                                 const std::vector<cv::Mat>& images);

}  // namespace widestereo
