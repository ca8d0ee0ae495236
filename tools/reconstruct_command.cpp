// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <numeric>
#include <opencv2/core.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "acceptance.h"
#include "calibration_fit.h"
#include "commands.h"
#include "folder_format.h"
#include "image_checks.h"
#include "input_record.h"
#include "match_settings.h"
#include "matching_run.h"
#include "option_checks.h"
#include "posed_images.h"
#include "progress_bar.h"
#include "result_folder.h"
#include "result_folders.h"
#include "say.h"
#include "text/formatted.h"
#include "text/json_text.h"
#include "widestereo/error.h"
#include "widestereo/fusion.h"
#include "widestereo/image_io.h"
#include "widestereo/rig_refinement.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

/// The points of all images, and their picture.
constexpr const char* cloud_name = "cloud.ply";
constexpr const char* cloud_picture_name = "cloud_preview.png";

const cv::Size preview_size(1024, 768);

struct ReconstructArguments {
  PosedImageSettings images;
  std::string output;
  std::optional<int> sources;  ///< of each image
  bool overwrite = false;
  ws::FusionOptions fusion;
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

bool is_alone(const Images& group) { return group.size() == 1; }

/// Of each image, but of those of one frame.
std::size_t sources_of(const ReconstructArguments& arguments) {
  return static_cast<std::size_t>(arguments.sources.value_or(2));
}

std::size_t alone_in(const std::vector<Images>& groups) {
  return static_cast<std::size_t>(std::count_if(groups.begin(), groups.end(), is_alone));
}

/// Of cameras that look around each sees what but few others do, and there is nothing else.
bool is_one_group(const PosedImages& images, const ReconstructArguments& arguments) {
  const std::size_t all = images.views.size();
  return images.are_of_one_frame && !arguments.sources && all > 1 && all <= ws::Matcher::most_views;
}

/// To match with each other, those of a single image last; throws Error where no image has another
/// one, or where no point can be in as many as --min-views asks.
std::vector<Images> groups_of(const PosedImages& images, const ReconstructArguments& arguments) {
  const std::size_t all = images.views.size();
  std::vector<Images> groups;
  if (is_one_group(images, arguments)) {
    Images& group = groups.emplace_back(all);
    std::iota(group.begin(), group.end(), 0);
  } else {
    ProgressBar bar("Grouping images that see the same");
    groups = images.selection->groups(1 + sources_of(arguments),
                                      [&bar](double share) { bar.show(share); });
  }
  const std::size_t matched = all - alone_in(groups);
  if (matched == 0) {
    throw ws::Error(arguments.images.images +
                    " has no images that see the same from different places; by the points of a "
                    "COLMAP model (points3D), or by poses and the range of distances, it is told "
                    "which do.");
  }
  if (arguments.fusion.min_views > static_cast<int>(matched)) {
    throw ws::Error("--min-views " + std::to_string(arguments.fusion.min_views) +
                    " leaves out every point of the " + std::to_string(matched) +
                    " images that are matched; give " + std::to_string(matched) + " at most.");
  }
  std::stable_partition(groups.begin(), groups.end(),
                        [](const Images& group) { return !is_alone(group); });
  return groups;
}

std::string name_of(const Images& group, const PosedImages& images) {
  return images.views[group.front()].name + " and " + std::to_string(group.size() - 1) + " more";
}

/// The groups but those whose points lie beyond the one end of the range that was given.
std::vector<Images> within_range(const std::vector<Images>& groups, const PosedImages& images,
                                 const MatchSettings& settings) {
  if (settings.min_distance.has_value() == settings.max_distance.has_value()) return groups;
  std::vector<Images> within;
  std::vector<std::string> left_out;
  for (const Images& group : groups) {
    const auto points = images.distances(group);
    if (!points || is_alone(group) ||
        settings.min_distance.value_or(points->nearest) <
            settings.max_distance.value_or(points->farthest)) {
      within.push_back(group);
      continue;
    }
    left_out.push_back(name_of(group, images) +
                       ws::formatted(" have points from %g to %g, all beyond ", points->nearest,
                                     points->farthest) +
                       (settings.min_distance ? "--min-distance" : "--max-distance"));
  }
  if (alone_in(within) == within.size()) {
    throw ws::Error(left_out.front() + ", and so have all others; give another distance.");
  }
  for (const std::string& group : left_out) say(group + ", and are left out.");
  return within;
}

/// Of each group: its images' points say how far the scene reaches where the settings do not. What
/// is matched with nothing needs none.
std::vector<ws::Options> options_of(const std::vector<Images>& groups, const PosedImages& images,
                                    const ReconstructArguments& arguments) {
  std::vector<ws::Options> options;
  for (const Images& group : groups) {
    if (is_alone(group)) {
      options.emplace_back();
      continue;
    }
    const ws::CalibratedImages seen{
        .rig = {}, .distances = images.distances(group), .in_metres = images.in_metres};
    options.push_back(
        with_range(arguments.settings, seen, arguments.images.rig.calibration).options());
  }
  return options;
}

/// All that decides the results but the images, cameras and poses, which each result names. The
/// range has the ends that were given: the others are each group's own.
Json settings_of(const ReconstructArguments& a, const std::vector<Images>& groups,
                 const ws::Options& of_group, const ws::DeviceInfo& device) {
  Json options = Json::parse(ws::to_json(of_group));
  if (!a.settings.min_distance) options.erase("min_distance");
  if (!a.settings.max_distance) options.erase("max_distance");
  return {{"program", "widestereo " WIDESTEREO_VERSION},
          {"images", absolute_path(a.images.images)},
          {"folders", a.images.frames.folders},
          {"calibration", absolute_path(a.images.rig.calibration)},
          {"mask", absolute_paths(a.images.rig.masks)},
          {"masks", absolute_path(a.images.rig.mask_folder)},
          {"white_level", a.images.white_level.value()},
          {"max_image_size", a.images.size.value()},
          {"max_theta_degrees", a.images.rig.max_theta},
          {"sources", std::max(sources_of(a), groups.front().size() - 1)},
          {"clouds", !a.format.no_cloud},
          {"pictures", !a.format.no_pictures},
          {"device", device_record(device)},
          {"options", options}};
}

PosedImages images_of(const ReconstructArguments& arguments) {
  PosedImages images = arguments.images.read(arguments.settings);
  require_not_among(arguments.output, images.files);
  return images;
}

/// Matches images group by group and joins their points.
class Reconstruction {
 public:
  explicit Reconstruction(const ReconstructArguments& arguments)
      : arguments_(arguments),
        images_(images_of(arguments)),
        groups_(within_range(groups_of(images_, arguments), images_, arguments.settings)),
        options_(options_of(groups_, images_, arguments)),
        device_(open_device(arguments.settings)),
        folders_(arguments.output,
                 {.name = ResultFolders::reconstruction,
                  .results = "images",
                  .texts = {},
                  .numbers = {"accepted", "overlap"},
                  .files = {cloud_name, cloud_picture_name}},
                 settings_of(arguments, groups_, options_.front(), device_.info()),
                 arguments.overwrite) {}

  void run() {
    const std::size_t alone = alone_in(groups_);
    if (alone > 0) {
      say(std::to_string(alone) + " of " + std::to_string(images_.views.size()) +
          " images see nothing that others see and are left out.");
    }
    const auto largest =
        std::max_element(groups_.begin(), groups_.end(),
                         [](const Images& a, const Images& b) { return a.size() < b.size(); });
    report_few_sources(options_.front(), largest->size());
    keep_results();
    std::vector<std::size_t> to_do;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      const bool is_done = std::all_of(groups_[i].begin(), groups_[i].end(),
                                       [this](std::size_t image) { return is_matched(image); });
      if (!is_alone(groups_[i]) && !is_done) to_do.push_back(i);
    }
    check_fit(to_do);
    ProgressBar bar("Matching on " + device_.info().name);
    for (std::size_t i = 0; i < to_do.size(); ++i) match(to_do[i], bar.part(i, to_do.size()));
    fuse();
  }

  const ResultFolders& folders() const { return folders_; }
  bool is_of_one_frame() const { return images_.are_of_one_frame; }

 private:
  bool is_matched(std::size_t image) const { return matched_[image]; }

  /// What each group has of its own: the views that are matched with each other, their images, and
  /// the range of distances.
  Json inputs_of(std::size_t group) const {
    Json views = Json::array();
    for (const std::size_t image : groups_[group]) {
      views.push_back(to_json(images_.views[image]));
      views.back()["file"] = file_record(images_.files[image]);
    }
    const ws::Options& options = options_[group];
    return {{"group", views}, {"range", {options.min_distance, options.max_distance}}};
  }

  /// Results of an earlier run that came of the same images, cameras, poses, masks and ranges.
  void keep_results() {
    matched_.resize(images_.views.size());
    // With the inputs of every group that has the image, as any of them may have matched it.
    std::map<std::string, std::pair<std::size_t, std::vector<Json>>> wanted;
    for (std::size_t i = 0; i < groups_.size(); ++i) {
      const Json inputs = inputs_of(i);
      for (const std::size_t image : groups_[i]) {
        const std::string& name = images_.views[image].name;
        folders_.require_usable(name);
        folders_.require_free(name);
        const auto [entry, is_new] = wanted.try_emplace(name, image, std::vector<Json>());
        entry->second.second.push_back(inputs);
      }
    }
    Json kept = Json::array();
    std::size_t not_given = 0;
    std::size_t changed = 0;
    for (const Json& result : folders_.results()) {
      const auto image = wanted.find(result["name"].get<std::string>());
      if (image == wanted.end()) {
        ++not_given;
        continue;
      }
      const auto& [number, inputs_of_groups] = image->second;
      const bool is_of_same = std::any_of(inputs_of_groups.begin(), inputs_of_groups.end(),
                                          [&result](const Json& inputs) {
                                            Json of_inputs = result;
                                            of_inputs.update(inputs);
                                            return of_inputs == result;
                                          });
      if (!is_of_same || !folders_.is_there(result)) {
        ++changed;
        continue;
      }
      kept.push_back(result);
      matched_[number] = true;
    }
    folders_.keep(kept);
    if (not_given > 0) {
      say("Images that are not given now: " + std::to_string(not_given) +
          ". Their results will be removed.");
    }
    if (changed > 0) {
      say("Images that an earlier run matched: " + std::to_string(changed) +
          " are matched again, as they are grouped with others now, or they, their poses or their "
          "files have changed.");
    }
    if (kept.empty()) return;
    say("Kept as an earlier run matched them: " + std::to_string(kept.size()) + " of " +
        std::to_string(wanted.size() - alone_in(groups_)) + " images.");
  }

  /// A few pairs tell whether the calibration, the poses and the range fit, so that large scenes
  /// take no longer.
  void check_fit(const std::vector<std::size_t>& groups) const {
    constexpr std::size_t count = 8;
    std::set<std::pair<std::size_t, std::size_t>> taken;  // groups, and members besides the first
    std::vector<MatchedViews> pairs;
    ProgressBar bar("Comparing features");
    for (std::size_t k = 0; k < count && !groups.empty(); ++k) {
      bar.show(static_cast<double>(k) / count);
      const std::size_t number = groups[k * groups.size() / count];
      const Images& group = groups_[number];
      const std::size_t other = 1 + k % (group.size() - 1);
      const ws::Rig rig{.views = {images_.views[group[0]], images_.views[group[other]]}};
      const ws::Options& options = options_[number];
      // Not all of one frame's cameras see the same.
      if (!taken.insert({number, other}).second ||
          !share_field_of_view(rig.views[0], rig.views[1], options)) {
        continue;
      }
      pairs.push_back(
          match_with_first(rig, {images_.read(group[0]), images_.read(group[other])}, options)
              .front());
    }
    report_calibration_errors(pairs, !images_.are_of_one_frame);
    report_features_out_of_range(pairs, images_.in_metres ? " m" : "", images_.is_unit_doubtful);
  }

  /// `progress`: empty where nobody sees it.
  void match(std::size_t number, const ws::Matcher::Progress& progress) {
    const Images& group = groups_[number];
    // Before images are read: one that takes their place later is another one.
    const Json inputs = inputs_of(number);
    ws::Rig rig;
    std::vector<cv::Mat> pixels;
    for (const std::size_t image : group) {
      rig.views.push_back(images_.views[image]);
      pixels.push_back(images_.read(image));
    }
    // Of one among many, as where a frame was recorded twice, which does not end the run.
    const std::string same = same_pictures(rig, pixels);
    if (!same.empty()) say(same);
    report_blank_images(rig, pixels);
    MatchingRun run{.options = options_[number], .device = device_.info(), .result = {}};
    ws::Matcher matcher(device_, rig, run.options);
    try {
      run.result = matcher.match(pixels, progress);
    } catch (const ws::NoOverlap&) {
      say(name_of(group, images_) +
          " see nothing in common within the range of distances and are left out.");
      return;
    }
    require_no_validation_messages(device_);
    report_views_without_overlap(rig, run.result);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (!is_matched(group[i])) write(group, i, inputs, pixels[i], run);
    }
    if (arguments_.as_json || progress) return;
    std::printf("group %zu of %zu: %s, %.2f s\n", number + 1, groups_.size(),
                name_of(group, images_).c_str(), run.result.milliseconds / 1000);
    std::fflush(stdout);
  }

  /// The result of one image of a group.
  void write(const Images& group, std::size_t index, const Json& inputs, const cv::Mat& pixels,
             const MatchingRun& group_run) {
    const std::size_t image = group[index];
    const ws::Rig rig{.views = {images_.views[image]}};
    const std::vector<cv::Mat> images = {pixels};
    MatchingRun run = group_run;
    run.result.views = {group_run.result.views[index]};
    const ws::ViewResult& result = run.result.views.front();
    Json record = {
        {"name", images_.views[image].name},
        {"group_milliseconds", run.result.milliseconds},
        {"accepted", accepted_share(result)},
        {"overlap", overlap_share(run.result.views)},
        {"mean_cost", ws::consistency_scores(result.differences, result.cost).mean_cost}};
    record.update(inputs);
    folders_.add(images_.views[image].name, [&](const fs::path& folder) {
      FolderContents contents{
          .rig = rig, .images = images, .run = run, .in_metres = images_.in_metres};
      contents.world_origin = images_.origin;
      contents.origin = folders_.origin();
      for (const std::size_t member : group) {
        contents.origin["images"].push_back(images_.files[member].string());
      }
      contents.origin["calibration"] = arguments_.images.rig.calibration;
      write_result_folder(folder, contents, arguments_.format);
      return record;
    });
    matched_[image] = true;
  }

  fs::path folder_of(std::size_t image) const {
    return folders_.folder() / images_.views[image].name;
  }
  /// Of an image's result, perhaps of an earlier run.
  cv::Mat map_of(std::size_t image, const char* file) const {
    const fs::path folder = folder_of(image);
    try {
      return ws::read_map(folder / file);
    } catch (const ws::Error&) {
      throw ws::Error("Cannot read " + (folder / file).string() + "; remove " + folder.string() +
                      " and run again, so that its image is matched again.");
    }
  }
  cv::Mat distance_of(std::size_t image) const { return map_of(image, "distance_accepted0.tiff"); }
  ws::ViewMaps maps_of(std::size_t image) const {
    return {.distance = distance_of(image),
            .normals = map_of(image, "normals0.tiff"),
            .image = images_.read(image),
            .confidence = map_of(image, "confidence0.tiff")};
  }

  void fuse() {
    std::vector<ws::View> views;
    Images numbers;                                         // of the views in the model
    std::vector<std::size_t> places(images_.views.size());  // of the images among the views
    for (std::size_t i = 0; i < images_.views.size(); ++i) {
      if (!is_matched(i)) continue;
      places[i] = views.size();
      numbers.push_back(i);
      views.push_back(images_.views[i]);
    }
    if (views.empty()) {
      throw ws::Error(
          "No images see anything in common; check the poses, masks and the range of "
          "distances.");
    }
    std::vector<std::vector<std::size_t>> others(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      for (const std::size_t other : images_.selection->sources(numbers[i], images_.views.size())) {
        if (is_matched(other)) others[i].push_back(places[other]);
      }
    }
    ProgressBar bar("Fusing");
    const ws::PointCloud cloud = ws::fuse(
        views, others, [&](std::size_t view) { return maps_of(numbers[view]); }, arguments_.fusion,
        [&bar](double share) { bar.show(share); });
    ws::write_ply(folders_.folder() / cloud_name, cloud, images_.origin);
    const std::size_t middle = numbers[numbers.size() / 2];
    const ws::ColourRange range = ws::robust_range(distance_of(middle));
    ws::write_image(
        folders_.folder() / cloud_picture_name,
        ws::cloud_picture(cloud, viewpoint_behind(images_.views[middle].world_from_camera, range),
                          preview_size));
    folders_.note("cloud", {{"file", cloud_name},
                            {"points", cloud.size()},
                            {"images", views.size()},
                            {"origin", to_json(images_.origin)},
                            {"min_views", arguments_.fusion.min_views},
                            {"max_relative", arguments_.fusion.max_relative},
                            {"max_pixels", arguments_.fusion.max_pixels}});
  }

  const ReconstructArguments& arguments_;
  PosedImages images_;
  std::vector<Images> groups_;
  std::vector<ws::Options> options_;  // of the groups
  ws::Device device_;
  ResultFolders folders_;
  std::vector<bool> matched_;
};

void run_reconstruct(const ReconstructArguments& arguments) {
  require_other_folder(arguments.output, arguments.images.images);
  Reconstruction reconstruction(arguments);
  reconstruction.run();
  const Json& record = reconstruction.folders().record();
  const Json& images = record["images"];
  const double accepted = mean_in(images, "accepted");
  report_little_accepted(accepted, mean_in(images, "overlap"),
                         reconstruction.is_of_one_frame()
                             ? "the order of the cameras"
                             : "the poses (of the camera in the world, or of the IMU)");
  if (arguments.as_json) {
    std::cout << ws::to_text(record) << "\n";
    return;
  }
  std::printf("%zu images, %.1f %% accepted on average; %zu points in %s\n", images.size(),
              100 * accepted, record["cloud"]["points"].get<std::size_t>(),
              (reconstruction.folders().folder() / cloud_name).string().c_str());
}

}  // namespace

void add_reconstruct_command(CLI::App& app) {
  CLI::App* command =
      app.add_subcommand("reconstruct",
                         "Match all images of a COLMAP model or transforms.json, or of a rig on a "
                         "known trajectory, and fuse their points "
                         "into one cloud; run it again to resume");
  auto a = std::make_shared<ReconstructArguments>();
  a->images.add_to(*command);
  command
      ->add_option("-o,--output", a->output,
                   "Folder for the results: a folder for each image, cloud.ply and "
                   "reconstruction.json")
      ->required();
  command
      ->add_option(
          "--sources", a->sources,
          "How many others each image is matched with: groups have one more; by default 2, "
          "or all cameras of one frame")
      ->check(CLI::Range(1, ws::Matcher::most_views - 1));
  command->add_flag("--overwrite", a->overwrite, "Remove the results of an earlier run first");
  const std::string fusion = "Fusion";
  command
      ->add_option("--min-views", a->fusion.min_views,
                   "Images that must have a point, at least, for it to be in the cloud")
      ->check(positive_number())
      ->capture_default_str()
      ->group(fusion);
  command
      ->add_option("--fusion-relative", a->fusion.max_relative,
                   "Largest difference of distance between images that have the same point, share")
      ->check(positive_number())
      ->capture_default_str()
      ->group(fusion);
  command
      ->add_option("--fusion-pixels", a->fusion.max_pixels,
                   "Largest displacement between them, "
                   "pixels")
      ->check(positive_number())
      ->capture_default_str()
      ->group(fusion);
  a->format.add_for_fused_images_to(*command);
  command->add_flag("--json", a->as_json, "Print the record as JSON");
  a->settings.add_to(*command);
  command->callback([a] { run_reconstruct(*a); });
}
