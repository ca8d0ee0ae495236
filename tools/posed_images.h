// SPDX-License-Identifier: MIT
// Many images of one scene whose cameras and poses are known: those of a COLMAP model or
// transforms.json, or of a rig that moves along a trajectory.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "frame_settings.h"
#include "match_settings.h"
#include "pose_settings.h"
#include "rig_settings.h"
#include "size_settings.h"
#include "white_level.h"
#include "widestereo/sfm_model.h"
#include "widestereo/view_selection.h"

/// By their numbers.
using Images = std::vector<std::size_t>;

struct PosedImages {
  std::vector<widestereo::View> calibrated;  ///< for the files, named as their results are
  std::vector<widestereo::View> views;       ///< the same as they are matched; with masks
  SizeSettings size;
  WhiteLevel white_level;
  std::vector<std::filesystem::path> files;
  std::shared_ptr<const widestereo::ViewSelection> selection;
  /// That some images have by what is known of the scene; nothing for options to be taken.
  std::function<std::optional<widestereo::DistanceRange>(const Images&)> distances;
  bool in_metres = true;
  bool are_of_one_frame = false;  ///< of a rig
  bool is_unit_doubtful = false;  ///< as report_long_baseline() asks
  /// Of the frame of the views, in that of the trajectory or model: coordinates stay small.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();

  /// As it is matched. Throws Error unless the file has the calibrated size.
  cv::Mat read(std::size_t image) const;
};

struct PosedImageSettings {
  std::string images;  ///< folder of a model's images, or a data set
  RigSettings rig;
  PoseSettings poses;
  FrameSettings frames;
  SizeSettings size;
  WhiteLevel white_level;

  /// Adds all these options.
  void add_to(CLI::App& command);
  /// Reads what is known of the images; `settings` say how far a scene without known points
  /// reaches.
  PosedImages read(const MatchSettings& settings) const;

 private:
  PosedImages of_model() const;
  /// Without those whose files are missing, where they may be skipped.
  std::shared_ptr<const widestereo::SfmModel> model_of_images() const;
  PosedImages of_trajectory() const;
  /// Of those that have none.
  void leave_out_dark_rims(PosedImages& images, const std::vector<bool>& masked) const;
};
