// SPDX-License-Identifier: MIT
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "calibration_commands.h"
#include "calibration_fit.h"
#include "calibration_output.h"
#include "image_checks.h"
#include "option_checks.h"
#include "rig_settings.h"
#include "say.h"
#include "text/json_text.h"
#include "white_level.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/files.h"
#include "widestereo/image_io.h"
#include "widestereo/rig_refinement.h"

namespace ws = widestereo;

namespace {

struct RefineArguments {
  std::vector<std::string> images;
  RigSettings rig;
  WhiteLevel white_level;
  bool intrinsics = false;
  CalibrationOutput output;
  bool as_json = false;
};

/// Matches between all pairs of views that see the same, those of all frames together.
std::vector<ws::ViewMatches> match_frames(const ws::Rig& rig, const std::vector<std::string>& files,
                                          const WhiteLevel& white_level) {
  const std::size_t count = rig.views.size();
  std::vector<ws::ViewMatches> pairs;
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = i + 1; j < count; ++j) {
      if (count == 2 || ws::share_field_of_view(rig.views[i], rig.views[j])) {
        pairs.push_back({i, j, {}});
        continue;
      }
      say(rig.views[i].name + " and " + rig.views[j].name +
          " see next to nothing in common and are not matched.");
    }
  }
  for (std::size_t frame = 0; frame < files.size(); frame += count) {
    std::vector<cv::Mat> images;
    for (std::size_t i = 0; i < count; ++i) {
      images.push_back(white_level.read(files[frame + i]));
      ws::require_calibrated_size(images[i], rig.views[i], files[frame + i]);
    }
    require_different_pictures(rig, images);
    for (ws::ViewMatches& pair : pairs) {
      const auto found = ws::match_features(images[pair.first], images[pair.second]);
      pair.matches.insert(pair.matches.end(), found.begin(), found.end());
    }
  }
  return pairs;
}

nlohmann::ordered_json describe(const ws::RefinedValue& value) {
  return {{"change", value.change}, {"deviation", value.deviation}};
}

nlohmann::ordered_json to_json(const ws::RigRefinement& refined,
                               const std::vector<ws::ViewMatches>& pairs) {
  const std::vector<ws::View>& views = refined.rig.views;
  nlohmann::ordered_json json;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!refined.left_out[i].empty()) {
      json["pairs"].push_back({{"first", views[pairs[i].first].name},
                               {"second", views[pairs[i].second].name},
                               {"left_out", refined.left_out[i]}});
      continue;
    }
    json["pairs"].push_back({{"first", views[pairs[i].first].name},
                             {"second", views[pairs[i].second].name},
                             {"matches", refined.before[i].matches},
                             {"median_pixels_before", refined.before[i].median_pixels},
                             {"median_pixels_after", refined.after[i].median_pixels}});
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ws::ViewRefinement& view = refined.views[i];
    json["views"].push_back({{"name", views[i].name},
                             {"rotation_degrees", describe(view.rotation)},
                             {"direction_degrees", describe(view.direction)},
                             {"focal_length_percent", describe(view.focal_length)},
                             {"principal_point_pixels", describe(view.principal_point)}});
  }
  return json;
}

void print(const ws::RigRefinement& refined, const std::vector<ws::ViewMatches>& pairs,
           bool intrinsics) {
  const std::vector<ws::View>& views = refined.rig.views;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (!refined.left_out[i].empty()) {
      std::printf("%s - %s  left out: %s\n", views[pairs[i].first].name.c_str(),
                  views[pairs[i].second].name.c_str(), refined.left_out[i].c_str());
      continue;
    }
    std::printf("%s - %s  %d matched features  epipolar error: median %.2f px -> %.2f px\n",
                views[pairs[i].first].name.c_str(), views[pairs[i].second].name.c_str(),
                refined.before[i].matches, refined.before[i].median_pixels,
                refined.after[i].median_pixels);
  }
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ws::ViewRefinement& view = refined.views[i];
    const char* name = views[i].name.c_str();
    if (i > 0) {
      std::printf(
          "%s  turned by %.3f (+- %.3f) degrees, its direction from %s by %.2f (+- %.2f) degrees\n",
          name, view.rotation.change, view.rotation.deviation, views[0].name.c_str(),
          view.direction.change, view.direction.deviation);
    }
    if (intrinsics) {
      std::printf("%s  f by %.2f (+- %.2f) %%, c by %.1f (+- %.1f) px\n", name,
                  view.focal_length.change, view.focal_length.deviation,
                  view.principal_point.change, view.principal_point.deviation);
    }
  }
}

/// Whether the matches fit hardly better than before. What changed then is their noise.
bool fits_hardly_better(const ws::RigRefinement& refined) {
  constexpr double least_share = 0.15;  // of a pair's error
  for (std::size_t i = 0; i < refined.before.size(); ++i) {
    if (!refined.left_out[i].empty()) continue;
    const double before = refined.before[i].median_pixels;
    if (before - refined.after[i].median_pixels > least_share * before) return false;
  }
  return true;
}

/// --max-theta is of one run.
ws::Rig with_limits_of(const ws::Rig& calibrated, ws::Rig rig) {
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    rig.views[i].camera.max_theta = calibrated.views[i].camera.max_theta;
  }
  return rig;
}

void refine(const RefineArguments& arguments) {
  const cv::Size size = ws::read_image(arguments.images.front()).size();
  const ws::Calibration calibrated = ws::read_calibration(arguments.rig.calibration, size);
  ws::Rig rig = calibrated.rig;
  arguments.rig.limit_fields_of_view(rig);
  const std::size_t count = rig.views.size();
  if (count < 2 || arguments.images.size() % count != 0) {
    throw ws::Error(arguments.rig.calibration + " has " + std::to_string(count) +
                    " camera(s), but there are " + std::to_string(arguments.images.size()) +
                    " image(s); give one image of each camera, frame after frame, of two cameras "
                    "or more.");
  }
  std::vector<std::filesystem::path> read = calibrated.files;
  for (const auto* more : {&arguments.images, &arguments.rig.masks}) {
    read.insert(read.end(), more->begin(), more->end());
  }
  require_different_images({arguments.images.begin(), arguments.images.end()});
  require_other_file(arguments.output.file, read);
  ws::require_writable(arguments.output.file);
  arguments.output.require_form(rig);  // before the work of matching
  report_long_baseline(rig);
  const std::vector<ws::ViewMatches> pairs =
      match_frames(rig, arguments.images, arguments.white_level);
  const ws::RigRefinement refined = ws::refine_rig(rig, pairs, arguments.intrinsics);
  arguments.output.write(with_limits_of(calibrated.rig, refined.rig));
  if (fits_hardly_better(refined)) {
    say("The features fit hardly better than before, so that the changes are their noise; keep " +
        arguments.rig.calibration + ", or give more frames.");
  }
  if (arguments.as_json) {
    nlohmann::ordered_json json = {{"frames", arguments.images.size() / count}};
    json.update(to_json(refined, pairs));
    std::cout << ws::to_text(json) << "\n";
    return;
  }
  print(refined, pairs, arguments.intrinsics);
  say("Wrote " + arguments.output.file + ".");
}

}  // namespace

void add_calibration_refine_command(CLI::App& group) {
  CLI::App* command = group.add_subcommand(
      "refine", "Mend how the cameras of a rig stand to each other, from matched features");
  auto arguments = std::make_shared<RefineArguments>();
  command
      ->add_option("images", arguments->images,
                   "One image of each camera, then those of the next frame, and so on: the more "
                   "frames, the better")
      ->required();
  arguments->rig.add_whole_rig_to(*command);
  arguments->white_level.add_to(*command);
  command->add_option("-o,--output", arguments->output.file, "File to write")->required();
  arguments->output.add_format_to(*command);
  command->add_flag("--intrinsics", arguments->intrinsics,
                    "Refine focal lengths and principal points, too; needs near and far "
                    "features all over the images");
  command->add_flag("--json", arguments->as_json, "Print JSON");
  command->callback([arguments] { refine(*arguments); });
}
