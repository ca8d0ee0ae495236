// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "widestereo/rig.h"

namespace widestereo {

/// Distances from a camera's centre, in the unit of length of its rig.
struct DistanceRange {
  double nearest = 0;
  double farthest = 0;
};

/// Images with their calibration, and the distances known of what they see.
struct CalibratedImages {
  Rig rig;
  std::optional<DistanceRange> distances = std::nullopt;
  bool in_metres = true;  ///< else the unit of length is a reconstruction's own
};

/// Whether a path is a folder that COLMAP writes a reconstruction to (cameras and images, .bin or
/// .txt).
bool is_colmap_model(const std::filesystem::path& path);

/// Reads the calibration, poses and points of `images` from a COLMAP model, binary or text, and
/// validates them. An image is the one whose name in the model is the end of its path (the longest
/// such name where there are several); that is the view's name, too. The world frame and the unit
/// of length are the reconstruction's: metres only where it was scaled to them. COLMAP's pixel
/// centres, at half pixels, are moved to whole ones. Distances reach from 0.75 of the 1st to 1.25
/// of the 99th percentile of those between the images and the points that they observe; they are
/// missing where that is fewer than 20. Throws Error naming the file and the remedy, also for
/// camera models that have no equivalent here (thin prisms, division, equirectangular).
CalibratedImages read_colmap(const std::filesystem::path& folder,
                             const std::vector<std::filesystem::path>& images);

/// Files of at most `count` other images of the model to match `image` with, best first: those that
/// observe most of its points, each of which counts by the angle between the two rays to it (most
/// at 5 degrees: Yao et al., MVSNet, ECCV 2018, section 4.1). They lie in the folder of images that
/// `image` lies in by its name. Fewer where fewer share points. Throws as read_colmap().
std::vector<std::filesystem::path> colmap_sources(const std::filesystem::path& folder,
                                                  const std::filesystem::path& image,
                                                  std::size_t count);

}  // namespace widestereo
