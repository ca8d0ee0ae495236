// SPDX-License-Identifier: MIT
#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "commands.h"
#include "folder_format.h"
#include "map_checks.h"
#include "option_checks.h"
#include "result_folder.h"
#include "rig_settings.h"
#include "say.h"
#include "text/formatted.h"
#include "text/number.h"
#include "white_level.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/evaluation.h"
#include "widestereo/image_io.h"
#include "widestereo/sfm_model.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* calibration_of_set = "calib.yaml";

struct EvaluateArguments {
  std::string prediction, normals, confidence;
  std::string set;
  std::string truth, valid, occlusion, truth_normals, image, field_of_view, calibration;
  std::optional<int> view_of_map, source_of_map;  ///< as given
  int view = 0, source = 1;
  std::optional<double> png_scale, truth_png_scale;
  double far_distance = 0;  ///< metres, 0: do not score what has no ground truth
  WhiteLevel white_level;
  std::string error_map;
  bool as_json = false;
};

/// With the white level that the map was matched with, where none is given.
cv::Mat read_matched_image(const EvaluateArguments& a) {
  const double recorded = recorded_number(a.prediction, "/input/white_level").value_or(0);
  const bool is_level = recorded >= WhiteLevel::lowest && recorded <= WhiteLevel::highest;
  if (!is_level && recorded != 0 && a.white_level.value() == 0) {
    throw ws::Error("The record beside " + a.prediction + " has the white level " +
                    ws::text_of(recorded) + ", which no camera has; give --white-level.");
  }
  return a.white_level.read(a.image, is_level ? static_cast<int>(recorded) : 0);
}

/// One for each pixel, in an 8-bit grey image: as GroundTruth has them.
cv::Mat read_labels(const fs::path& path) {
  const cv::Mat image = ws::read_image(path);
  if (image.type() != CV_8UC1)
    throw ws::Error(path.string() + " is not an 8-bit grey image; convert it first.");
  return image;
}

/// A map of one value a pixel (distance, confidence) or three (normals).
cv::Mat read_map(const std::string& file, int values, const std::string& what,
                 double png_scale = FolderFormat::usual_png_scale) {
  cv::Mat map = ws::read_map(file, png_scale);
  require_values(map, file, values, what);
  return map;
}

cv::Mat read_normals(const std::string& file) {
  cv::Mat normals = read_map(file, 3, "a normal map");
  require_unit_vectors(normals, file);
  return normals;
}

/// Which view the map is of, as its name says where it is one of ours and the set has such a view;
/// 0 otherwise.
int view_in_name(const fs::path& map, const fs::path& set) {
  const std::string stem = map.stem().string();
  for (const std::string name : {"distance_accepted", "distance"}) {
    if (!stem.starts_with(name)) continue;
    const std::string number = stem.substr(name.size());
    int view = 0;
    const char* end = number.data() + number.size();
    const auto [rest, error] = std::from_chars(number.data(), end, view);
    if (error != std::errc() || rest != end || view < 0) continue;
    if (fs::exists(set / ("depth" + number + ".tiff"))) return view;
  }
  return 0;
}

/// Which of the cameras the map is of by the record beside it, which may have them in another
/// order; none where it names none of them.
std::optional<int> camera_in_record(const Json& record, const fs::path& map,
                                    const std::vector<ws::View>& cameras) {
  const auto view = view_with_file(record, map.filename().string());
  if (!view) return std::nullopt;
  const Json name = record["views"][*view].value("name", Json());
  if (!name.is_string()) return std::nullopt;
  // Of moving rigs it is FRAME/CAMERA.
  const auto text = "/" + name.get<std::string>();
  const auto camera = std::find_if(cameras.begin(), cameras.end(), [&](const ws::View& other) {
    return text.ends_with("/" + other.name);
  });
  if (camera == cameras.end()) return std::nullopt;
  return static_cast<int>(camera - cameras.begin());
}

/// Whether the cameras are those of the record beside the map, as it was matched.
bool takes_cameras_of_record(const EvaluateArguments& a) {
  return a.calibration.empty() ? a.set.empty() : ws::is_sfm_model(a.calibration);
}

/// `record`: beside the map, if there is one; `size`: of the map.
int view_by_record_or_name(const EvaluateArguments& a, const Json& record, cv::Size size) {
  const fs::path map = a.prediction;
  if (takes_cameras_of_record(a)) {
    return static_cast<int>(view_with_file(record, map.filename().string()).value_or(0));
  }
  const fs::path calibration =
      a.calibration.empty() ? fs::path(a.set) / calibration_of_set : fs::path(a.calibration);
  const int in_name = a.set.empty() ? 0 : view_in_name(a.prediction, a.set);
  if (!fs::exists(calibration)) return in_name;
  const std::vector<ws::View> cameras = ws::read_calibration(calibration, size).rig.views;
  const auto in_record = camera_in_record(record, map, cameras);
  const int view = in_record.value_or(in_name);
  const bool is_guess = record.is_object() && !in_record && in_name == 0 && cameras.size() > 1;
  if (view != 0 || in_name != 0 || is_guess) {
    say(a.prediction + " is scored as of view " + std::to_string(view) +
        (is_guess    ? ", as the record beside it names no camera of " + calibration.string()
         : in_record ? ", by the record beside it"
                     : ", by its name") +
        "; --view chooses another.");
  }
  return view;
}

void choose_views(EvaluateArguments& a, const Json& record, cv::Size size) {
  a.view = a.view_of_map ? *a.view_of_map : view_by_record_or_name(a, record, size);
  a.source = a.source_of_map.value_or(a.view == 0 ? 1 : 0);
}

/// Fills what was not named from a folder with depthN.tiff, validN.png, occN.png (or occN_M.png),
/// normalN.tiff, camN.png, fovN.png and calib.yaml.
void take_from_set(EvaluateArguments& a) {
  const fs::path folder = a.set;
  if (!fs::is_directory(folder))
    throw ws::Error("There is no folder " + a.set + "; check the path.");
  const std::string n = std::to_string(a.view);
  const auto take = [&](std::string& target, const std::string& name) {
    if (target.empty() && fs::exists(folder / name)) target = (folder / name).string();
  };
  take(a.truth, "depth" + n + ".tiff");
  take(a.valid, "valid" + n + ".png");
  take(a.occlusion, "occ" + n + "_" + std::to_string(a.source) + ".png");
  if (a.view + a.source == 1) take(a.occlusion, "occ" + n + ".png");  // of a pair
  take(a.truth_normals, "normal" + n + ".tiff");
  take(a.image, "cam" + n + ".png");
  take(a.field_of_view, "fov" + n + ".png");
  take(a.calibration, calibration_of_set);
  if (a.truth.empty()) throw ws::Error(a.set + " has no depth" + n + ".tiff; give --truth.");
  if (a.calibration.empty()) throw ws::Error(a.set + " has no calib.yaml; give --calibration.");
}

/// The cameras, and where they come from.
std::pair<ws::Rig, std::string> cameras_of(const EvaluateArguments& a, const Json& record,
                                           cv::Size size) {
  if (!takes_cameras_of_record(a)) {
    return {ws::read_calibration(a.calibration, size).rig, a.calibration};
  }
  const fs::path map = a.prediction;
  if (view_with_file(record, map.filename().string())) {
    const std::string name = (map.parent_path() / result_record).string();
    return {rig_in(record, name), name};
  }
  if (a.calibration.empty()) {
    throw ws::Error(
        "Give --truth and --calibration, or a folder with both by --set; the cameras of a map in "
        "the folder of its result are known.");
  }
  throw ws::Error(
      a.calibration +
      " is a COLMAP model or transforms.json, whose images are scored in the folders of "
      "their results, where " +
      a.prediction + " is not; give the map there, or another --calibration.");
}

/// Throws Error where something is asked for that a single camera does not tell. `cameras`: what
/// has it.
void report_single_camera(const EvaluateArguments& a, const Json& record,
                          const std::string& cameras) {
  if (!a.confidence.empty() || a.far_distance > 0) {
    throw ws::Error(std::string(a.confidence.empty() ? "--far-distance" : "--confidence") +
                    " needs another camera, in which displacements are measured, but " + cameras +
                    " has one; leave it out, or give a calibration of two or more.");
  }
  const fs::path map = a.prediction;
  const bool has_others = view_with_file(record, map.filename().string()) &&
                          record["views"].size() > 1 && !takes_cameras_of_record(a);
  say(cameras + " has one camera: displacements in another image are not measured" +
      (has_others ? "; without --calibration they are in those of the record beside the map."
                  : "."));
}

/// What is scored, of one size; empty what was not given.
struct ScoredMaps {
  cv::Mat distance, normals, confidence;
};

ScoredMaps read_scored(const EvaluateArguments& a) {
  return {.distance = read_map(a.prediction, 1, "a distance map",
                               png_scale_of("--png-scale", a.png_scale, a.prediction)),
          .normals = a.normals.empty() ? cv::Mat() : read_normals(a.normals),
          .confidence =
              a.confidence.empty() ? cv::Mat() : read_map(a.confidence, 1, "a confidence map")};
}

ws::GroundTruth read_truth(const EvaluateArguments& a) {
  if (a.truth.empty()) throw ws::Error("Give --truth, or a folder with it by --set.");
  if (!a.normals.empty() && a.truth_normals.empty()) {
    throw ws::Error("--normals needs --truth-normals, or a folder with them by --set.");
  }
  if (a.far_distance > 0 && a.field_of_view.empty()) {
    throw ws::Error("--far-distance needs --field-of-view, or a folder with it by --set.");
  }
  ws::GroundTruth truth;
  truth.distance = read_map(a.truth, 1, "a distance map",
                            png_scale_of("--truth-png-scale", a.truth_png_scale, a.truth));
  if (!a.valid.empty()) truth.valid = read_labels(a.valid);
  if (!a.occlusion.empty()) truth.occlusion = read_labels(a.occlusion);
  if (!a.truth_normals.empty()) truth.normals = read_normals(a.truth_normals);
  if (!a.image.empty()) truth.image = read_matched_image(a);
  if (a.far_distance > 0) truth.field_of_view = read_labels(a.field_of_view);
  return truth;
}

void require_one_size(const EvaluateArguments& a, const ScoredMaps& maps,
                      const ws::GroundTruth& truth) {
  require_same_size(maps.distance, a.prediction, truth.distance, a.truth,
                    "score maps that were matched at that size, without --max-image-size");
  using OfFile = std::pair<cv::Mat, std::string>;
  for (const auto& [map, file] :
       {OfFile(maps.normals, a.normals), OfFile(maps.confidence, a.confidence),
        OfFile(truth.valid, a.valid), OfFile(truth.occlusion, a.occlusion),
        OfFile(truth.normals, a.truth_normals), OfFile(truth.image, a.image),
        OfFile(truth.field_of_view, a.field_of_view)}) {
    if (map.empty()) continue;
    require_same_size(map, file, maps.distance, a.prediction, "use maps of one view");
  }
}

/// The camera of the map, and the one in which displacements are measured, if there is another one.
struct ScoredCameras {
  ws::View view;
  std::optional<ws::View> source;
};

ScoredCameras choose_cameras(const EvaluateArguments& a, const Json& record, cv::Size size) {
  const auto [rig, name] = cameras_of(a, record, size);
  const int count = static_cast<int>(rig.views.size());
  if (count == 1 && a.view == 0 && !a.source_of_map) {
    report_single_camera(a, record, name);
    return {rig.views[0], std::nullopt};
  }
  if (a.view < 0 || a.view >= count || a.source < 0 || a.source >= count || a.view == a.source) {
    throw ws::Error(name + " has " + std::to_string(count) +
                    " camera(s); choose two different ones by --view and --source.");
  }
  return {rig.views[a.view], rig.views[a.source]};
}

/// All that is asked for.
struct Scores {
  std::vector<ws::RegionScores> regions;
  std::optional<ws::FarScores> far;
  std::vector<ws::SparsificationPoint> sparsification;
  std::vector<ws::ReliabilityBin> reliability;
};

Scores score(const EvaluateArguments& a, const ScoredMaps& maps, const ws::GroundTruth& truth,
             const ScoredCameras& cameras) {
  const auto& [view, source] = cameras;
  Scores scores;
  if (!source) {
    scores.regions = ws::evaluate(maps.distance, maps.normals, truth, view);
    return scores;
  }
  scores.regions = ws::evaluate(maps.distance, maps.normals, truth, view, *source);
  if (a.far_distance > 0) {
    scores.far = ws::far_scores(maps.distance, truth, view, *source, a.far_distance);
  }
  if (!a.confidence.empty()) {
    scores.sparsification =
        ws::sparsification(maps.distance, maps.confidence, truth, view, *source);
    scores.reliability = ws::reliability(maps.distance, maps.confidence, truth, view, *source);
  }
  return scores;
}

/// Throws Error where nothing is scored, and says where nothing is visible in the source, or
/// normals face elsewhere.
void check_scores(const EvaluateArguments& a, const Scores& scores) {
  const std::vector<ws::RegionScores>& regions = scores.regions;
  if (regions.front().pixels == 0 && (!scores.far || scores.far->pixels == 0)) {
    throw ws::Error("There is no pixel to score in " + a.truth +
                    ": none has a true distance and is valid; check it and --valid.");
  }
  if (regions.size() > 1 && regions[1].region == "non-occluded" && regions[1].pixels == 0) {
    say("No pixel that is scored is visible (255) in " + a.occlusion +
        ", so that there are no scores of what is not occluded.");
  }
  if (regions.front().median_normal_angle > 90) {
    say(
        ws::formatted("The normals are %.0f degrees off (median): those of both files must "
                      "face the camera, in its frame (x right, y down, z forward).",
                      regions.front().median_normal_angle));
  }
}

void print(const Scores& scores, bool as_json) {
  const auto& [regions, far, curve, bins] = scores;
  if (as_json) {
    std::cout << "{\"regions\": " << ws::to_json(regions)
              << ", \"far\": " << (far ? ws::to_json(*far) : "null")
              << ", \"sparsification\": " << ws::to_json(curve)
              << ", \"reliability\": " << ws::to_json(bins) << "}\n";
  } else {
    std::cout << ws::to_table(regions) << (far ? ws::to_table(*far) : "") << ws::to_table(curve)
              << ws::to_table(bins);
  }
}

void run_evaluate(EvaluateArguments a) {
  const ScoredMaps maps = read_scored(a);
  const fs::path folder = fs::path(a.prediction).parent_path();
  const Json record = record_in(folder);
  if (record.is_discarded()) {
    throw ws::Error((folder / result_record).string() +
                    " beside the map is damaged; match again, or move the map elsewhere.");
  }
  choose_views(a, record, maps.distance.size());
  if (!a.set.empty()) take_from_set(a);
  if (!a.error_map.empty()) {
    require_other_file(a.error_map,
                       {a.prediction, a.normals, a.confidence, a.truth, a.valid, a.occlusion,
                        a.truth_normals, a.image, a.field_of_view, a.calibration});
  }
  ws::GroundTruth truth = read_truth(a);
  require_one_size(a, maps, truth);
  const ScoredCameras cameras = choose_cameras(a, record, maps.distance.size());
  if (!a.image.empty()) truth.image = stretched_within_view(truth.image, cameras.view, a.image);
  const Scores scores = score(a, maps, truth, cameras);
  check_scores(a, scores);
  if (!a.error_map.empty()) {
    ws::write_image(a.error_map, ws::error_picture(maps.distance, truth));
  }
  print(scores, a.as_json);
}

}  // namespace

void add_evaluate_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("evaluate", "Score a distance map against ground truth");
  auto a = std::make_shared<EvaluateArguments>();
  command->add_option("prediction", a->prediction, "Distance map: .tiff, .exr, .pfm or 16-bit .png")
      ->required();
  add_png_scale_of_input(*command, "--png-scale", "distances", a->png_scale);
  command->add_option("--normals", a->normals, "Normal map to score as well");
  command->add_option(
      "--confidence", a->confidence,
      "Confidence map: prints the error of the most confident pixels, and how often pixels "
      "of each confidence are right");
  command->add_option(
      "--set", a->set,
      "Folder with depthN.tiff, validN.png, occN.png or occN_M.png, normalN.tiff, camN.png, "
      "fovN.png, calib.yaml");
  command->add_option("--truth", a->truth, "Ground truth, metres along the ray");
  add_png_scale_of_input(*command, "--truth-png-scale", "true distances", a->truth_png_scale);
  command->add_option("--valid", a->valid, "Mask, 0 = do not score");
  command->add_option("--occlusion", a->occlusion,
                      "255 visible in the source, 0 occluded, 128 outside");
  command->add_option("--truth-normals", a->truth_normals, "Ground truth of the normals");
  command->add_option(
      "--image", a->image,
      "The view's image: scores textured surfaces, and their interiors (without true "
      "normals: away from steps of the distance), as well");
  a->white_level.add_to(*command);
  CLI::Option* far_distance =
      command
          ->add_option("--far-distance", a->far_distance,
                       "Also prints how much of what has no ground truth, such as a sky, comes out "
                       "at this distance (metres) to within 2 px")
          ->check(positive_number());
  command
      ->add_option("--field-of-view", a->field_of_view,
                   "Mask, 0 = outside the lens; for --far-distance")
      ->needs(far_distance);
  command->add_option(
      "-c,--calibration", a->calibration,
      "Calibration of the views (default: calib.yaml of --set, or else the views of "
      "the result's record, which also stand for a COLMAP model)");
  command->add_option(
      "--view", a->view_of_map,
      "Camera of the distance map (default: the one that the result's record names, "
      "or else with --set the number in its name, or else 0)");
  command->add_option(
      "--source", a->source_of_map,
      "Camera in which displacements are measured (default 1, or 0 for another view; none where "
      "there is but one)");
  command->add_option("--error-map", a->error_map, "Write a picture of the relative error");
  command->add_flag("--json", a->as_json, "Print JSON");
  command->callback([a] { run_evaluate(*a); });
}
