// SPDX-License-Identifier: MIT
#include <algorithm>
#include <system_error>
#include <utility>

#include "calibration/camodocal.h"
#include "calibration/colmap_files.h"
#include "calibration/depthai.h"
#include "calibration/euroc.h"
#include "calibration/formats.h"
#include "calibration/multicol.h"
#include "calibration/ocam.h"
#include "calibration/orb_slam.h"
#include "calibration/ros.h"
#include "calibration/woodscape.h"
#include "geometry/validation.h"
#include "text/file_type.h"
#include "text/text_input.h"
#include "widestereo/error.h"
#include "widestereo/sfm_model.h"

namespace widestereo {
namespace calibration {

void add_view_of_body(Rig& rig, View view, const Eigen::Isometry3d& body_from_camera) {
  if (rig.views.empty()) {
    rig.world_from_imu = body_from_camera.inverse();
  } else {
    view.world_from_camera = *rig.world_from_imu * body_from_camera;
  }
  rig.views.push_back(std::move(view));
}

namespace {

constexpr std::uintmax_t largest_mebibytes = 4;  // parsers take hundreds of times as much memory

void require_no_part_of_a_model(const std::filesystem::path& folder) {
  const bool has_cameras = !colmap_file(folder, "cameras").empty();
  const bool has_images = !colmap_file(folder, "images").empty();
  if (!has_cameras && !has_images) return;
  const std::string missing = has_cameras ? "images" : "cameras";
  throw Error(folder.string() + " is no whole COLMAP model: " + missing + ".bin or " + missing +
              ".txt is missing; give the folder that has cameras and images.");
}

void require_no_file_of_a_model(const std::filesystem::path& file) {
  const std::string name = file.stem().string();
  const std::filesystem::path folder = file.parent_path();
  const bool is_part = name == "cameras" || name == "images" || name == "points3D";
  if (!is_part || !is_sfm_model(folder)) return;
  throw Error(file.string() + " is a file of a COLMAP model; give its folder, " +
              (folder.empty() ? "." : folder.string()) + ".");
}

/// A model in a folder, where structure from motion usually puts it; empty where there is none.
std::filesystem::path model_in(const std::filesystem::path& folder) {
  for (const char* place :
       {"transforms.json", "transforms_train.json", "0", "sparse", "sparse/0", "colmap/sparse/0"}) {
    if (is_sfm_model(folder / place)) return folder / place;
  }
  return {};
}

bool is_too_large(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  return !error && bytes > largest_mebibytes << 20;
}

Document load(const std::filesystem::path& path) {
  const std::filesystem::file_type type = type_of(path);
  if (type == std::filesystem::file_type::not_found) {
    throw Error("There is no calibration file " + path.string() + "; check the path.");
  }
  const bool is_file = type == std::filesystem::file_type::regular;
  if (is_file && is_too_large(path)) {
    throw Error(path.string() + " is too large for a calibration file (" +
                std::to_string(largest_mebibytes) + " MiB); give one with its cameras alone.");
  }
  if (is_sfm_model(path)) {
    throw Error(path.string() +
                " is a COLMAP model or transforms.json, which calibrates images; only `depth`, "
                "`reconstruct`, `calibration check` and `view-synthesis` take it.");
  }
  require_no_part_of_a_model(path);
  require_no_file_of_a_model(path);
  if (type == std::filesystem::file_type::directory) {
    std::error_code error;
    const std::filesystem::directory_iterator entries(path, error);
    if (error) {
      throw Error("Cannot read the folder " + path.string() + ": " + error.message() +
                  "; check its permissions.");
    }
  }
  if (!is_file) {
    const std::filesystem::path model = model_in(path);
    throw Error(path.string() +
                " is not a file; give a calibration file, a folder with cam0/sensor.yaml or ROS's "
                "camera_info files or, for images that it has, a COLMAP model, the folder that "
                "holds cameras.bin or .txt" +
                (model.empty() ? "." : "; this one holds " + model.string() + "."));
  }
  return {path, TextInput(path).rest()};
}

/// What a folder has of ROS's cameras, by name.
std::vector<Document> ros_documents(const std::filesystem::path& folder) {
  std::vector<Document> documents;
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error) || is_sfm_model(folder)) return documents;
  std::filesystem::directory_iterator entry(folder, error);
  for (; entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    const std::filesystem::path& file = entry->path();
    const bool is_yaml = file.extension() == ".yaml" || file.extension() == ".yml";
    if (!is_yaml || !entry->is_regular_file(error) || is_too_large(file)) continue;
    Document document = load(file);
    if (is_ros(document)) documents.push_back(std::move(document));
  }
  std::ranges::sort(documents, {}, &Document::path);
  return documents;
}

CalibrationFormat format_of(const Document& document) {
  const std::size_t first = document.text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) document.fail("The file is empty", "give a calibration file");
  if (is_ocam(document)) return CalibrationFormat::ocam;
  if (is_multicol(document)) return CalibrationFormat::multicol;
  if (is_omnimvs(document)) return CalibrationFormat::omnimvs;
  if (is_woodscape(document)) return CalibrationFormat::woodscape;
  if (is_orb_slam(document)) return CalibrationFormat::orb_slam;
  if (is_depthai(document)) return CalibrationFormat::depthai;
  if (is_ros(document)) return CalibrationFormat::ros;
  if (is_vins(document)) return CalibrationFormat::vins;
  // Configurations of VINS-Mono are a camera of CamOdoCal with more keys, some of them matrices.
  if (is_camodocal(document)) return CalibrationFormat::camodocal;
  if (document.contains("opencv-matrix") || document.contains("<opencv_storage")) {
    return CalibrationFormat::opencv;
  }
  const bool is_json = document.text[first] == '{';
  // Camchains may have been written as JSON.
  const bool has_cam0 = document.contains("\"cam0\"") || document.contains("cam0:");
  if (is_json && !has_cam0) {
    return !document.contains("\"value0\"") && has_opencv_matrix(document)
               ? CalibrationFormat::opencv
               : CalibrationFormat::basalt;
  }
  if (is_json || document.contains("cam0:")) return CalibrationFormat::kalibr;
  if (document.contains("T_BS")) return CalibrationFormat::euroc;
  if (document.contains("camera_model")) return CalibrationFormat::kalibr;
  if (has_opencv_matrix(document)) return CalibrationFormat::opencv;
  document.fail(
      "This is no calibration that can be read",
      "use a Kalibr camchain (YAML), a Basalt calibration (JSON), an OpenCV FileStorage, EuRoC's "
      "sensor.yaml, a camera of CamOdoCal, OCamCalib or WoodScape, a camera_info of ROS, or a rig "
      "of VINS-Fusion, ORB-SLAM3, OmniMVS, MultiCol-SLAM or DepthAI");
}

}  // namespace
}  // namespace calibration

Calibration read_calibration(const std::filesystem::path& path, cv::Size image_size) {
  using namespace calibration;
  Calibration result;
  const auto load_noted = [&result](const std::filesystem::path& file) {
    result.files.push_back(file);
    return load(file);
  };
  const std::vector<std::filesystem::path> sensor_files = euroc_files(path);
  std::vector<Document> documents;
  for (const std::filesystem::path& file : sensor_files) documents.push_back(load(file));
  if (documents.empty()) documents = ros_documents(path);
  if (documents.empty()) documents.push_back(load(path));
  for (const Document& document : documents) result.files.push_back(document.path);
  result.format = sensor_files.empty() ? format_of(documents[0]) : CalibrationFormat::euroc;
  switch (result.format) {
    case CalibrationFormat::kalibr:
      result.rig = read_kalibr(documents[0]);
      break;
    case CalibrationFormat::basalt:
      result.rig = read_basalt(documents[0]);
      break;
    case CalibrationFormat::opencv:
      result.rig = read_opencv(documents[0], image_size);
      break;
    case CalibrationFormat::euroc:
      result.rig = read_euroc(documents);
      break;
    case CalibrationFormat::camodocal:
      result.rig = read_camodocal(documents[0]);
      break;
    case CalibrationFormat::vins:
      result.rig = read_vins(documents[0], load_noted);
      break;
    case CalibrationFormat::ocam:
      result.rig = read_ocam(documents[0]);
      break;
    case CalibrationFormat::omnimvs:
      result.rig = read_omnimvs(documents[0]);
      break;
    case CalibrationFormat::multicol:
      result.rig = read_multicol(documents[0], load_noted);
      break;
    case CalibrationFormat::woodscape:
      result.rig = read_woodscape(documents[0]);
      break;
    case CalibrationFormat::orb_slam:
      result.rig = read_orb_slam(documents[0]);
      break;
    case CalibrationFormat::depthai:
      result.rig = read_depthai(documents[0]);
      break;
    case CalibrationFormat::ros:
      result.rig = read_ros(documents);
      break;
  }
  validate(result.rig, path.string());
  return result;
}

}  // namespace widestereo
