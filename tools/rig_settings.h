// SPDX-License-Identifier: MIT
// The command line's options of a calibrated rig, shared by all commands that match images.
#pragma once

#include <CLI/CLI.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "widestereo/rig.h"
#include "widestereo/sfm_model.h"

/// ws::to_stretched_grey_levels() of a view's image within the lens and the mask, as it is matched.
/// `name`, the file, begins messages.
cv::Mat stretched_within_view(const cv::Mat& image, const widestereo::View& view,
                              const std::string& name);

/// Ignores what a mask ignores, besides what the view's own does. `name`, the file, begins
/// messages.
void add_mask(widestereo::View& view, const cv::Mat& mask, const std::string& name);

struct RigSettings {
  std::string calibration;         ///< file, or what is_sfm_model() knows
  std::vector<int> views;          ///< cameras of the calibration; empty: the first ones
  std::vector<std::string> masks;  ///< none, one for all images or one for each
  std::string mask_folder;         ///< with NAME.png for the view NAME
  double max_theta = 0;            ///< degrees, 0 = as calibrated, or where images end

  /// What read_calibration() reads.
  static constexpr const char* calibration_formats =
      "Kalibr camchain, Basalt JSON, OpenCV file, EuRoC or ROS folder, camera of CamOdoCal, "
      "OCamCalib or WoodScape, rig of VINS-Fusion, ORB-SLAM3, OmniMVS, MultiCol-SLAM or DepthAI";
  /// What else --calibration may be where images with poses are taken, too.
  static constexpr const char* or_model =
      ", or folder of a COLMAP model, or transforms.json, whose unit distances then have";

  /// Adds --mask and --max-theta.
  void add_fields_of_view_to(CLI::App& command);
  /// Adds --masks, for images of models.
  void add_mask_folder_to(CLI::App& command);
  /// Adds these and --calibration; `or_other`: what else it may be.
  void add_whole_rig_to(CLI::App& command, const std::string& or_other = "");
  /// Adds these and --views; `which`: what cameras it names or may leave out.
  void add_to(CLI::App& command, const std::string& or_other = "",
              const std::string& which = ", one for each image");
  /// The calibrated views of `image_count` images, in their order, with masks; `size` of the first
  /// image.
  widestereo::Rig rig_for_images(std::size_t image_count, cv::Size size) const;
  /// Where the calibration is one.
  std::optional<widestereo::SfmModel> sfm_model() const;
  /// The calibrated views of its images, with masks.
  widestereo::CalibratedImages images_of(const widestereo::SfmModel& model,
                                         const std::vector<std::string>& files) const;

  /// Applies --masks; tells which views have one. Throws Error where none has.
  std::vector<bool> apply_mask_folder(std::vector<widestereo::View>& posed) const;

  /// Whether neither the calibration nor an option says how far a camera sees.
  bool looks_for_rim_of(const widestereo::Camera& camera) const;
  /// Limits such cameras to what their images show, unless masks do, and says so; one image for
  /// each view.
  void leave_out_dark_rims(widestereo::Rig& rig, const std::vector<cv::Mat>& images) const;
  /// The same for views that are calibrated alike, by images of some of them.
  static void leave_out_dark_rim(const std::vector<widestereo::View*>& views,
                                 const std::vector<cv::Mat>& images);

  /// Applies --mask and --max-theta.
  void limit_fields_of_view(widestereo::Rig& rig) const;
};
