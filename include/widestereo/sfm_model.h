// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/rig.h"
#include "widestereo/view_selection.h"

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
/// .txt), or a transforms.json as nerfstudio and Instant NGP have it.
bool is_sfm_model(const std::filesystem::path& path);

/// Images whose cameras and poses structure from motion, or else, has found: a reconstruction that
/// COLMAP has written, binary or text, or a transforms.json, which has no points. Images are
/// numbered in the order of their names.
class SfmModel {
 public:
  /// Reads the whole model. Cameras of a transforms.json without a size have that of their first
  /// image. Throws Error naming the file and the remedy.
  explicit SfmModel(const std::filesystem::path& path);
  ~SfmModel();
  SfmModel(SfmModel&&) noexcept;
  SfmModel& operator=(SfmModel&&) noexcept;

  /// The images' paths in the model without their roots and leading "..", which no two share, so
  /// that they will do as names within a folder of results.
  const std::vector<std::string>& names() const;

  /// Forgets images, as such whose files are missing: the others are numbered anew. The points are
  /// read again. Throws Error, and forgets none, for numbers of no image, where none would be left,
  /// and where the points cannot be read.
  void leave_out(const std::vector<std::size_t>& images);

  /// Where an image lies, by its path in the model, which begins in `folder`. Throws Error for
  /// numbers of no image.
  std::filesystem::path file_of(std::size_t image, const std::filesystem::path& folder) const;

  /// The image whose name is the end of a file's path; the longest such name where there are
  /// several. Throws Error where there is none.
  std::size_t image_of(const std::filesystem::path& file) const;

  /// Calibration and pose of one image, validated, likewise named.
  View view(std::size_t image) const;

  /// Calibration and poses of images, validated; views are named as the images are. The world frame
  /// and the unit of length are the reconstruction's: metres only where it was scaled to them.
  /// Pixel centres, at half pixels there, are moved to whole ones. Views have the masks that a
  /// transforms.json names. Throws Error, also for numbers of no image and for division models of
  /// pincushion distortion.
  CalibratedImages calibrated(const std::vector<std::size_t>& images) const;

  /// The same of the images of files. Throws Error as image_of() does, too.
  CalibratedImages calibrated_files(const std::vector<std::filesystem::path>& files) const;

  /// From 0.75 of the 1st to 1.25 of the 99th percentile of the distances between the images and
  /// the points that they observe; nothing where that is fewer than 20. Throws Error for numbers of
  /// no image.
  std::optional<DistanceRange> distances(const std::vector<std::size_t>& images) const;

  /// Whether it has points that images observe; without any the selection is empty.
  bool has_points() const;

  /// Which images to match with each other, by the model's points.
  const ViewSelection& selection() const;

  /// ViewSelection::sources() of the image of a file, as files of the folder of images that it lies
  /// in by its name. Throws Error as image_of() does.
  std::vector<std::filesystem::path> source_files(const std::filesystem::path& file,
                                                  std::size_t count) const;
  /// The same by the range of distances alone, in the model's unit, where it has no points: those
  /// that see most of what may lie there (assumed_points()), of the 63 images taken nearest to it.
  std::vector<std::filesystem::path> source_files(const std::filesystem::path& file,
                                                  std::size_t count,
                                                  const DistanceRange& range) const;

 private:
  /// Those of images, in the folder of images in which that image's file lies by its name.
  std::vector<std::filesystem::path> files_beside(const std::filesystem::path& file,
                                                  std::size_t image,
                                                  const std::vector<std::size_t>& others) const;

  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace widestereo
