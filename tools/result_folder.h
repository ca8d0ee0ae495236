// SPDX-License-Identifier: MIT
// The folder of maps, pictures, clouds and the record that a match leaves.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "matching_run.h"
#include "widestereo/evaluation.h"
#include "widestereo/pictures.h"
#include "widestereo/rig.h"

/// The record of a result folder, which is written last.
inline constexpr const char* result_record = "result.json";
/// Where a result is until it is complete, in the folder that it is for.
inline constexpr const char* unfinished_result = ".unfinished";

/// Which files are written.
struct FolderFormat {
  std::vector<std::string> maps = {"tiff"};  ///< of distance: tiff, exr, pfm, png
  static constexpr double usual_png_scale = 1000;
  double png_scale = usual_png_scale;  ///< units per metre of the 16-bit PNG
  bool no_cloud = false;
  bool no_pictures = false;
  /// Adds --formats, --png-scale, --no-cloud and --no-pictures.
  void add_to(CLI::App& command);
  /// The same for many frames, with --clouds and --pictures: neither is written unless asked for.
  void add_for_many_frames_to(CLI::App& command);
  /// --clouds and --pictures alone: maps that are read again are TIFFs.
  void add_for_fused_images_to(CLI::App& command);
  /// Throws Error where a PNG cannot hold all distances of this range, or --png-scale is of none.
  void require_room_for(double min_distance, double max_distance) const;

 private:
  void add_maps_to(CLI::App& command);
  void add_extras_to(CLI::App& command, const std::string& clouds);
};

/// Behind and above a camera, in proportion to the scene, looking down a little: what is wrong in a
/// map leaves its surface there.
Eigen::Isometry3d viewpoint_behind(const Eigen::Isometry3d& world_from_camera,
                                   const widestereo::ColourRange& range);

/// How much of a view's lens was accepted, in [0, 1].
double accepted_share(const widestereo::ViewResult& view);
/// The mean of the views.
double accepted_share(const std::vector<widestereo::ViewResult>& views);

/// Adds the scale of a distance map that is read; `distances`: which, in the option's help.
void add_png_scale_of_input(CLI::App& command, const std::string& option,
                            const std::string& distances, double& scale);
/// Throws Error where it was given for a map that has none.
void require_scaled_png(const std::string& option, double scale, const std::filesystem::path& map);

/// Says, on standard error, what to check where so little is accepted of all views that the images
/// hardly fit their calibration.
void report_little_accepted(double share, const std::string& first_cause);

/// Says so, on standard error, where much of what was accepted lies at the nearest distance that
/// was looked for.
void report_nearest(const std::vector<widestereo::ViewResult>& views, double min_distance);

struct FolderContents {
  const widestereo::Rig& rig;
  const std::vector<cv::Mat>& images;
  const MatchingRun& run;
  bool in_metres = true;                              ///< else in a reconstruction's unit
  std::vector<double> blurs = {};                     ///< pixels, one for each view, or none
  nlohmann::ordered_json origin = {};                 ///< where the images came from
  std::vector<widestereo::GroundTruth> truths = {};   ///< one for each view, or none
  std::vector<widestereo::RegionScores> scores = {};  ///< of view 0, or none
  /// Of the rig's frame, in that of the model or trajectory.
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
};

/// The record in a result folder; discarded where there is none.
nlohmann::ordered_json record_in(const std::filesystem::path& folder);
/// Names of the files that a record says are in its folder; none where it is no record.
std::vector<std::string> files_of(const nlohmann::ordered_json& record);

/// Writes the folder; returns the record. Whenever the run ends, an earlier result and its files
/// are there or, once the new ones are complete, replaced; the record comes last.
nlohmann::ordered_json write_result_folder(const std::filesystem::path& folder,
                                           const FolderContents& contents,
                                           const FolderFormat& format);

/// Of a mean cost: "-" where no pixel has a plane.
std::string cost_text(double cost);

/// Prints the record, or a summary of it for people.
void report(const nlohmann::ordered_json& record, const std::filesystem::path& folder,
            bool as_json);
