// SPDX-License-Identifier: MIT
// The folder of maps, pictures, clouds and the record that a match leaves.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <vector>

#include "folder_format.h"
#include "matching_run.h"
#include "widestereo/evaluation.h"
#include "widestereo/pictures.h"
#include "widestereo/rig.h"

/// The record of a result folder, which is written last.
inline constexpr const char* result_record = "result.json";
/// Names the files that may be there while a result takes its place, of it and of an earlier one.
inline constexpr const char* interrupted_record = ".interrupted.json";
/// Where a result is until it is complete, in the folder that it is for.
inline constexpr const char* unfinished_result = ".unfinished";

/// Behind and above a camera, in proportion to the scene, looking down a little: what is wrong in a
/// map leaves its surface there.
Eigen::Isometry3d viewpoint_behind(const Eigen::Isometry3d& world_from_camera,
                                   const widestereo::ColourRange& range);

struct FolderContents {
  const widestereo::Rig& rig;
  const std::vector<cv::Mat>& images;
  const MatchingRun& run;
  bool in_metres = true;               ///< else in a reconstruction's unit
  std::vector<double> blurs = {};      ///< pixels, one for each view, or none
  nlohmann::ordered_json origin = {};  ///< where the images came from
  std::string world = "the frame of camera 0, or of the poses";  ///< what it is, in words
  std::vector<widestereo::GroundTruth> truths = {};              ///< one for each view, or none
  std::vector<widestereo::RegionScores> scores = {};             ///< of view 0, or none
  /// Of the rig's frame, in that of the model or trajectory.
  Eigen::Vector3d world_origin = Eigen::Vector3d::Zero();
};

/// The record in a result folder: null where there is none, discarded where it is damaged.
nlohmann::ordered_json record_in(const std::filesystem::path& folder);
/// What the record beside a file, which names it among its files, has at a JSON pointer, such as
/// "/input/white_level"; none where there is no number.
std::optional<double> recorded_number(const std::filesystem::path& file,
                                      const std::string& pointer);
/// Names of the files that a record says are in its folder; none where it is no record.
std::vector<std::string> files_of(const nlohmann::ordered_json& record);
/// Which of the record's views has a file of that name; none where none has.
std::optional<std::size_t> view_with_file(const nlohmann::ordered_json& record,
                                          const std::string& file);
/// The record's views as they were matched, without masks; `name`, the file, begins messages.
widestereo::Rig rig_in(const nlohmann::ordered_json& record, const std::string& name);

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
