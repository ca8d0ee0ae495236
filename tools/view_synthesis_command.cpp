// SPDX-License-Identifier: MIT
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "commands.h"
#include "folder_format.h"
#include "map_checks.h"
#include "option_checks.h"
#include "pose_settings.h"
#include "rig_settings.h"
#include "say.h"
#include "size_settings.h"
#include "white_level.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"
#include "widestereo/view_synthesis.h"

namespace ws = widestereo;

namespace {

struct SynthesisArguments {
  std::string distance, image, other;
  std::string picture;
  std::optional<double> png_scale;
  RigSettings rig;
  PoseSettings poses;
  SizeSettings size;
  WhiteLevel white_level;
  bool as_json = false;
};

void run_synthesis(const SynthesisArguments& a) {
  if (!a.picture.empty()) {
    std::vector<std::filesystem::path> read = {a.distance, a.image, a.other, a.rig.calibration,
                                               a.poses.file};
    read.insert(read.end(), a.rig.masks.begin(), a.rig.masks.end());
    require_other_file(a.picture, read);
  }
  require_different_images({a.image, a.other});
  cv::Mat image = a.white_level.read(a.image);
  cv::Mat other = a.white_level.read(a.other);
  const ws::Rig rig =
      calibrated_images(a.rig, a.poses, {a.image, a.other}, image.size(), a.rig.sfm_model()).rig;
  image = stretched_within_view(image, rig.views[0], a.image);
  other = stretched_within_view(other, rig.views[1], a.other);
  const cv::Mat distance =
      ws::read_map(a.distance, png_scale_of("--png-scale", a.png_scale, a.distance));
  require_values(distance, a.distance, 1, "a distance map");
  image = a.size.reduced(image, rig.views[0], a.image);
  other = a.size.reduced(other, rig.views[1], a.other);
  require_same_size(distance, a.distance, image, a.image,
                    "give the --max-image-size that the distances were matched with");
  const ws::SynthesisedView synthesised = ws::synthesise_view(
      distance, a.size.reduced(rig.views[0]), other, a.size.reduced(rig.views[1]));
  const ws::SynthesisScores scores = ws::synthesis_scores(image, synthesised);
  if (scores.windows == 0) {
    throw ws::Error("There is no textured window to score in " + a.image + " that " + a.other +
                    " sees at the distances of " + a.distance +
                    "; check that they belong together.");
  }
  if (!a.picture.empty()) {
    cv::Mat picture;
    synthesised.image.convertTo(picture, CV_8U);
    ws::write_image(a.picture, picture);
  }
  constexpr double hardly_alike = 0.3;
  if (scores.mean < hardly_alike) {
    say("The images are hardly alike at these distances; check that " + a.distance + " is of " +
        a.image + ", and the order of the images.");
  }
  std::cout << (a.as_json ? ws::to_json(scores) + "\n" : ws::to_table(scores));
}

}  // namespace

void add_view_synthesis_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "view-synthesis",
      "Score a distance map without ground truth, by warping another image into its view");
  auto a = std::make_shared<SynthesisArguments>();
  command->add_option("distance", a->distance, "Distance map")->required();
  command->add_option("image", a->image, "The image that it is of")->required();
  command->add_option("other", a->other, "Another image, best one that took no part in matching")
      ->required();
  add_image_options(*command, a->rig, a->poses);
  a->size.add_to(*command,
                 "As it was given when the distances were matched: larger images are reduced to "
                 "this width and height at most, pixels");
  a->white_level.add_to(*command);
  add_png_scale_of_input(*command, "--png-scale", "distances", a->png_scale);
  command->add_option("--picture", a->picture, "Write the warped image");
  command->add_flag("--json", a->as_json, "Print JSON");
  command->callback([a] { run_synthesis(*a); });
}
