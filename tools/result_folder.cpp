// SPDX-License-Identifier: MIT
#include "result_folder.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <opencv2/core.hpp>
#include <string>
#include <system_error>

#include "acceptance.h"
#include "geometry/angle.h"
#include "input_record.h"
#include "temporary_folder.h"
#include "text/formatted.h"
#include "text/json_text.h"
#include "text/number.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/image_io.h"
#include "widestereo/pictures.h"
#include "widestereo/point_cloud.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

/// Null where there is no such file, discarded where it is damaged.
Json json_in(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return Json();
  return Json::parse(std::ifstream(file), nullptr, false);
}

/// None where it is no record.
Json views_of(const Json& record) {
  const Json views = record.is_object() ? record.value("views", Json()) : Json();
  return views.is_array() ? views : Json::array();
}

void append_files_of_view(const Json& view, std::vector<std::string>& files) {
  if (!view.is_object() || !view.contains("files")) return;
  for (const Json& file : view["files"]) {
    if (file.is_string()) files.push_back(file.get<std::string>());
  }
}

/// What a record names, where it is one of this program.
void append_files(const Json& record, std::vector<std::string>& files) {
  if (!record.is_object() || !record.value("program", Json()).is_string() ||
      !record["program"].get<std::string>().starts_with("widestereo ")) {
    return;
  }
  for (const std::string& file : files_of(record)) {
    // Someone may have edited it.
    if (!fs::path(file).has_parent_path()) files.push_back(file);
  }
}

/// Files of an earlier run, and of one that ended while it replaced that, the record first; none
/// where the folder holds no result.
std::vector<std::string> earlier_files(const fs::path& folder) {
  std::vector<std::string> files = {result_record};
  append_files(record_in(folder), files);
  append_files(json_in(folder / interrupted_record), files);
  if (files.size() == 1) files.clear();
  return files;
}

/// What a record names, and the record, which comes last.
std::vector<std::string> all_files_of(const Json& record) {
  std::vector<std::string> files = files_of(record);
  files.emplace_back(result_record);
  return files;
}

/// Throws Error where something that is no file of an earlier run has a name of the new ones.
void require_no_other_files(const fs::path& folder, const Json& record) {
  const std::vector<std::string> earlier = earlier_files(folder);
  for (const std::string& file : all_files_of(record)) {
    if (std::find(earlier.begin(), earlier.end(), file) != earlier.end()) continue;
    if (!fs::exists(fs::symlink_status(folder / file))) continue;
    throw ws::Error((folder / file).string() +
                    " is there already and is not of an earlier run; move it, or choose another "
                    "folder.");
  }
}

/// For another run to know them as ours where this one ends before the new record is there.
void note_files(const fs::path& folder, const Json& record) {
  std::vector<std::string> files = earlier_files(folder);
  append_files(record, files);
  const Json views = {{{"files", files}}};
  ws::write_text(folder / interrupted_record,
                 ws::to_text({{"program", record["program"]}, {"views", views}}) + "\n");
}

/// Removes what the record of an earlier run names, nothing else. The record goes first: without it
/// the folder is not complete.
void remove_earlier_result(const fs::path& folder) {
  for (const std::string& file : earlier_files(folder)) {
    std::error_code error;
    fs::remove(folder / file, error);
    if (error) {
      throw ws::Error("Cannot remove " + (folder / file).string() +
                      " of an earlier run: " + error.message() + "; choose another folder.");
    }
  }
}

void move_result(const fs::path& from, const fs::path& to, const Json& record) {
  for (const std::string& file : all_files_of(record)) {
    std::error_code error;
    fs::rename(from / file, to / file, error);
    if (error) {
      throw ws::Error("Cannot write " + (to / file).string() + ": " + error.message() +
                      "; choose another folder.");
    }
  }
}

/// Throws an exception of JSON's where it is no number that an int holds.
int whole_number(const Json& value) {
  const auto number = value.get<std::int64_t>();
  if (number != static_cast<int>(number) || value != number) {
    throw std::out_of_range(value.dump() + " is no whole number of ordinary size");
  }
  return static_cast<int>(number);
}

/// As ViewWriter describes it.
ws::View view_in(const Json& record) {
  ws::View view;
  view.name = record.at("name");
  ws::Camera& camera = view.camera;
  const std::string model = record.at("model");
  int number = 0;
  while (to_string(static_cast<ws::CameraModel>(number)) != model) ++number;
  camera.model = static_cast<ws::CameraModel>(number);
  camera.width = whole_number(record.at("width"));
  camera.height = whole_number(record.at("height"));
  camera.max_theta = record.at("max_theta_degrees").get<double>() * ws::radians_per_degree;
  const Json& intrinsics = record.at("intrinsics");
  for (const auto& [name, member] : ws::intrinsics()) {
    camera.*member = intrinsics.value(name, camera.*member);
  }
  for (int i = 0; i < 12; ++i) {
    view.world_from_camera(i / 4, i % 4) = record.at("world_from_camera").at(i);
  }
  return view;
}

/// Writes the files of one view and notes their names.
class ViewWriter {
 public:
  ViewWriter(fs::path folder, const FolderContents& contents, const FolderFormat& format, int index)
      : folder_(std::move(folder)),
        contents_(contents),
        format_(format),
        index_(index),
        view_(contents.rig.views[index]),
        result_(contents.run.result.views[index]),
        accepted_(ws::accepted_distance(result_)) {}

  Json write() {
    write_maps();
    if (!format_.no_cloud || !format_.no_pictures) {
      const ws::PointCloud cloud = ws::make_point_cloud(
          accepted_, ws::ray_image(view_.camera, view_.mask), result_.normals,
          contents_.images[index_], result_.confidence, view_.world_from_camera);
      if (!format_.no_cloud) {
        ws::write_ply(named("cloud", ".ply"), cloud, contents_.world_origin);
      }
      if (!format_.no_pictures) write_pictures(cloud);
    }
    const cv::Mat textured = textured_pixels();
    const ws::ConsistencyScores scores =
        ws::consistency_scores(result_.differences, result_.cost, textured);
    const ws::ConsistencyScores of_accepted = ws::consistency_scores(
        result_.differences, result_.cost, textured & (result_.reasons == 0));
    return {{"name", view_.name},
            {"model", to_string(view_.camera.model)},
            {"width", view_.camera.width},
            {"height", view_.camera.height},
            {"max_theta_degrees", view_.camera.max_theta * ws::degrees_per_radian},
            {"intrinsics", intrinsics_of(view_.camera)},
            {"world_from_camera", to_json(view_.world_from_camera)},
            {"blur_pixels", contents_.blurs.empty() ? 0 : contents_.blurs[index_]},
            {"gain", result_.gain},
            {"accepted", accepted_share(result_)},
            {"filled", share_of_usable(result_, (result_.reasons & ws::reason_filled) != 0)},
            {"mean_cost", scores.mean_cost},
            {"cost_below_0.2", scores.low_cost},
            {"cost_below_0.2_textured", scores.low_cost_textured},
            {"cost_below_0.2_textured_accepted", of_accepted.low_cost_textured},
            {"textured_pixels", scores.textured},
            {"consistent_within_2_percent", scores.consistent_relative},
            {"consistent_within_2_pixels", scores.consistent_pixels},
            {"files", files_}};
  }

 private:
  cv::Mat textured_pixels() const {
    // As it was matched.
    const cv::Mat field_of_view = (result_.reasons & ws::reason_no_ray) == 0;
    const cv::Mat grey = ws::to_stretched_grey_levels(
        contents_.images[index_], "The image of " + view_.name, field_of_view, result_.gain);
    return ws::textured_pixels(grey, field_of_view);
  }

  fs::path named(const std::string& what, const std::string& extension) {
    const std::string name = what + std::to_string(index_) + extension;
    files_[what + extension] = name;
    return folder_ / name;
  }

  void write_maps() {
    for (const std::string& extension : format_.maps) {
      ws::write_map(named("distance", "." + extension), result_.distance, format_.png_scale);
      ws::write_map(named("distance_accepted", "." + extension), accepted_, format_.png_scale);
    }
    ws::write_map(named("normals", ".tiff"), result_.normals);
    ws::write_map(named("cost", ".tiff"), result_.cost);
    ws::write_map(named("confidence", ".tiff"), result_.confidence);
    ws::write_image(named("reasons", ".png"), result_.reasons);
  }

  void write_pictures(const ws::PointCloud& cloud) {
    const cv::Mat& image = contents_.images[index_];
    const bool has_truth = !contents_.truths.empty();
    const ws::ColourRange range =
        ws::robust_range(has_truth ? contents_.truths[index_].distance : accepted_);
    const std::string unit = contents_.in_metres ? " m" : "";
    const auto distances = [&](const cv::Mat& map) {
      return ws::with_distance_legend(ws::distance_picture(map, range), range, unit);
    };
    const cv::Mat accepted = distances(accepted_);
    const cv::Mat normals = ws::normal_picture(result_.normals);
    const cv::Mat confidence =
        ws::with_scalar_legend(ws::scalar_picture(result_.confidence, 0, 1), 0, 1);
    const cv::Mat reasons = ws::with_reason_legend(ws::reason_picture(result_.reasons, image));
    ws::write_image(named("distance_preview", ".png"), accepted);
    ws::write_image(named("normals_preview", ".png"), normals);
    ws::write_image(named("confidence_preview", ".png"), confidence);
    ws::write_image(named("reasons_preview", ".png"), reasons);
    std::vector<ws::Panel> panels = {
        {"image", image},
        {"distance", distances(result_.distance)},
        {"accepted distance", accepted},
        {"normals", normals},
        {"confidence", confidence},
        {"rejected because", reasons},
        {"accepted points",
         ws::cloud_picture(cloud, viewpoint_behind(view_.world_from_camera, range), image.size())}};
    if (has_truth) {
      const ws::GroundTruth& truth = contents_.truths[index_];
      panels.push_back({"true distance", distances(truth.distance)});
      panels.push_back({"error: green 0.5 %, red 5 %", ws::error_picture(result_.distance, truth)});
    }
    ws::write_image(named("summary", ".png"), ws::panel_sheet(panels, has_truth ? 3 : 4));
  }

  fs::path folder_;
  const FolderContents& contents_;
  const FolderFormat& format_;
  int index_;
  const ws::View& view_;
  const ws::ViewResult& result_;
  cv::Mat accepted_;
  Json files_;
};

/// "-" of no pixel.
std::string share_text(double share) {
  return std::isnan(share) ? "-" : ws::formatted("%.1f %%", 100 * share);
}

/// Those of rejected pixels, as "1 no ray, 2 no overlap".
std::string reason_bits() {
  std::string bits;
  for (const auto& [bit, name] : ws::named_reasons) {
    if (bit == ws::reason_filled) continue;
    bits += (bits.empty() ? "" : ", ") + std::to_string(bit) + " " + name;
  }
  return bits;
}

Json record_of(const FolderContents& contents, const FolderFormat& format) {
  const MatchingRun& run = contents.run;
  Json record = {{"program", "widestereo " WIDESTEREO_VERSION}};
  record["input"] = contents.origin;
  record["device"] = {{"id", run.device.id},     {"name", run.device.name},
                      {"type", run.device.type}, {"driver", run.device.driver},
                      {"uuid", run.device.uuid}, {"bytes", run.result.device_bytes}};
  record["options"] = Json::parse(ws::to_json(run.options));
  record["filter_used"] = ws::to_string(run.result.filter);
  record["levels_used"] = run.result.levels;
  record["milliseconds"] = run.result.milliseconds;
  for (const ws::KernelTime& time : run.result.times) {
    record["kernels"].push_back({{"kernel", time.kernel},
                                 {"dispatches", time.dispatches},
                                 {"milliseconds", time.milliseconds}});
  }
  record["patch_samples"] = run.result.samples;
  record["origin"] = to_json(contents.world_origin);
  record["png_scale"] = format.png_scale;
  const std::string patch_side = std::to_string(ws::texture_patch_side);
  record["conventions"] = {
      {"unit", contents.in_metres ? "metre" : "that of the reconstruction"},
      {"distance", "units along the unit viewing ray through the pixel centre; 0 = no value"},
      {"distance_png",
       "16 bit, " + Json(format.png_scale).dump() + " to a unit; 0 also where 65535 is exceeded"},
      {"distance_accepted", "distance, 0 where reasons is not 0 and the pixel was not filled"},
      {"normals",
       "unit, camera frame (x right, y down, z forward), facing the camera; file order x y z"},
      {"cost", "1 - ZNCC in [0, 2]; 2 = no plane, 1 = no texture"},
      {"textured_pixels", "pixels with a plane and a standard deviation of at least " +
                              ws::text_of(ws::texture_least_deviation) + " grey levels in " +
                              patch_side + "x" + patch_side + " pixels"},
      {"confidence",
       "probability that the point is within 2 px of its true place in the other view; 0 = no "
       "plane of its own"},
      {"reasons", "bits: " + reason_bits() + ", and " + std::to_string(ws::reason_filled) +
                      " beside these where the pixel was filled; 0 = accepted; 16 bit"},
      {"cloud", "world frame; pixels of distance_accepted that are not 0, row by row"},
      {"world", contents.world},
      {"intrinsics", "pixels, by the camera model; what is 0 is left out, and a beta of 1"},
      {"world_from_camera", "X_world = [R | C] X_camera, three rows of four"},
      {"origin",
       "where a model or trajectory lies far from its own origin: to be added to world coordinates "
       "for those of the model or trajectory; else 0"},
      {"pixels", "integer coordinates are pixel centres"}};
  return record;
}

}  // namespace

Eigen::Isometry3d viewpoint_behind(const Eigen::Isometry3d& world_from_camera,
                                   const ws::ColourRange& range) {
  const double scale = 2 * range.nearest;
  return world_from_camera * Eigen::Translation3d(0, -0.5 * scale, -0.7 * scale) *
         Eigen::AngleAxisd(-0.35, Eigen::Vector3d::UnitX());
}

Json record_in(const fs::path& folder) { return json_in(folder / result_record); }

std::optional<double> recorded_number(const fs::path& file, const std::string& pointer) {
  const Json record = record_in(file.parent_path());
  const Json::json_pointer at(pointer);
  if (!view_with_file(record, file.filename().string()) || !record.contains(at) ||
      !record.at(at).is_number()) {
    return std::nullopt;
  }
  return record.at(at).get<double>();
}

std::vector<std::string> files_of(const Json& record) {
  std::vector<std::string> files;
  for (const Json& view : views_of(record)) append_files_of_view(view, files);
  return files;
}

std::optional<std::size_t> view_with_file(const Json& record, const std::string& file) {
  const Json views = views_of(record);
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<std::string> files;
    append_files_of_view(views[i], files);
    if (std::find(files.begin(), files.end(), file) != files.end()) return i;
  }
  return std::nullopt;
}

ws::Rig rig_in(const Json& record, const std::string& name) {
  ws::Rig rig;
  try {
    for (const Json& view : views_of(record)) rig.views.push_back(view_in(view));
  } catch (const std::exception&) {  // JSON's own, of sizes and of unknown models
    throw ws::Error(name + " is damaged or of another version; give --calibration.");
  }
  ws::validate(rig, name);
  return rig;
}

Json write_result_folder(const fs::path& folder, const FolderContents& contents,
                         const FolderFormat& format) {
  const TemporaryFolder unfinished(folder / unfinished_result);
  Json record = record_of(contents, format);
  for (std::size_t i = 0; i < contents.rig.views.size(); ++i) {
    record["views"].push_back(
        ViewWriter(unfinished.path(), contents, format, static_cast<int>(i)).write());
  }
  if (!contents.scores.empty()) record["scores"] = Json::parse(ws::to_json(contents.scores));
  ws::write_text(unfinished.path() / result_record, ws::to_text(record) + "\n");
  require_no_other_files(folder, record);
  note_files(folder, record);
  remove_earlier_result(folder);
  move_result(unfinished.path(), folder, record);
  std::error_code ignored;
  fs::remove(folder / interrupted_record, ignored);
  return record;
}

std::string cost_text(double cost) { return std::isnan(cost) ? "-" : ws::formatted("%.3f", cost); }

void report(const Json& record, const fs::path& folder, bool as_json) {
  if (as_json) {
    std::cout << ws::to_text(record) << "\n";
    return;
  }
  std::printf("%s: %.2f s, %.0f million patch samples (preset %s)\n",
              record["device"]["name"].get<std::string>().c_str(),
              record["milliseconds"].get<double>() / 1000,
              record["patch_samples"].get<double>() / 1e6,
              record["options"]["preset"].get<std::string>().c_str());
  for (const auto& view : record["views"]) {
    const auto share = [&view](const char* key) { return share_text(view[key].get<double>()); };
    std::printf(
        "%s: %s accepted, mean cost %s, cost < 0.2 %s (%s of textured pixels, %s of those "
        "accepted), left-right within 2 %% %s, within 2 px %s\n",
        view["name"].get<std::string>().c_str(), share("accepted").c_str(),
        cost_text(view["mean_cost"].get<double>()).c_str(), share("cost_below_0.2").c_str(),
        share("cost_below_0.2_textured").c_str(), share("cost_below_0.2_textured_accepted").c_str(),
        share("consistent_within_2_percent").c_str(), share("consistent_within_2_pixels").c_str());
  }
  std::printf("Results are in %s\n", folder.string().c_str());
}
