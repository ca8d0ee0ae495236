// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "commands.h"
#include "match_settings.h"
#include "matching_run.h"
#include "progress_bar.h"
#include "result_folder.h"
#include "result_folders.h"
#include "rig_settings.h"
#include "view_record.h"
#include "widestereo/colmap.h"
#include "widestereo/error.h"
#include "widestereo/fusion.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Images = std::vector<std::size_t>;  // by their numbers in the model

namespace {

constexpr int most_sources = 7;
// Images whose points may be those of an image, best first.
constexpr std::size_t fused_with = 10;
// Of a camera, to see where its lens ends.
constexpr std::size_t rim_images = 8;
const cv::Size preview_size(1024, 768);

struct ReconstructArguments {
  std::string images;
  std::string output;
  RigSettings rig;
  std::string masks;  // folder
  int sources = 2;
  bool overwrite = false;
  ws::FusionOptions fusion;
  MatchSettings settings;
  FolderFormat format;
  bool as_json = false;
};

/// The images of a COLMAP model with what the command line says of them.
class ReconstructionImages {
 public:
  explicit ReconstructionImages(const ReconstructArguments& arguments)
      : arguments_(arguments), model_(arguments.rig.calibration) {
    for (const std::string& name : model_.names()) {
      if (fs::exists(file(name))) continue;
      throw ws::Error(file(name).string() + " is missing; give the folder that the names of the " +
                      std::to_string(model_.names().size()) + " images in " +
                      arguments.rig.calibration + " begin in.");
    }
    if (!arguments.masks.empty() && !fs::is_directory(arguments.masks)) {
      throw ws::Error(arguments.masks +
                      " is no folder; give the one that holds NAME.png for the "
                      "image NAME.");
    }
  }

  const ws::ColmapModel& model() const { return model_; }
  const std::string& name(std::size_t image) const { return model_.names()[image]; }
  fs::path file(const std::string& name) const { return fs::path(arguments_.images) / name; }
  cv::Mat read(std::size_t image) const {
    const fs::path path = file(name(image));
    cv::Mat pixels = ws::read_image(path);
    ws::require_calibrated_size(pixels, model_.calibrated({image}).rig.views.front(),
                                path.string());
    return pixels;
  }

  /// With fields of view and masks.
  std::vector<ws::View> views() {
    std::vector<ws::View> views;
    for (std::size_t i = 0; i < model_.names().size(); ++i) views.push_back(view(i));
    return views;
  }

  /// To match with each other; throws Error where no image has another one.
  std::vector<Images> groups() const {
    std::vector<Images> groups =
        model_.selection().groups(static_cast<std::size_t>(arguments_.sources) + 1);
    if (std::all_of(groups.begin(), groups.end(), is_alone)) {
      throw ws::Error(arguments_.rig.calibration +
                      " has no images that share points (points3D), by which those are chosen that "
                      "see the same; give a complete model.");
    }
    return groups;
  }

  static bool is_alone(const Images& group) { return group.size() == 1; }

  /// Distances that the points of some images suggest, else those of all.
  ws::CalibratedImages with_distances(ws::Rig rig, const Images& images) const {
    ws::CalibratedImages calibrated{.rig = std::move(rig), .in_metres = false};
    calibrated.distances = model_.distances(images);
    if (!calibrated.distances) {
      Images all;
      for (std::size_t i = 0; i < model_.names().size(); ++i) all.push_back(i);
      calibrated.distances = model_.distances(all);
    }
    return calibrated;
  }

 private:
  ws::View view(std::size_t image) {
    ws::Rig rig = model_.calibrated({image}).rig;
    ws::View& view = rig.views.front();
    const ws::Camera calibrated = view.camera;
    arguments_.rig.limit_fields_of_view(rig);
    const fs::path mask = fs::path(arguments_.masks) / (name(image) + ".png");
    if (!arguments_.masks.empty() && fs::exists(mask)) {
      view.mask = ws::to_intensity(ws::read_image(mask), mask.string()) > 0;
      ws::require_calibrated_size(view.mask, view, mask.string());
    }
    if (arguments_.masks.empty()) view.camera.max_theta = max_theta_of(calibrated, view.camera);
    return view;
  }

  /// Where the lens of a camera ends by images of it from all over the model.
  double max_theta_of(const ws::Camera& calibrated, const ws::Camera& limited) {
    for (const auto& [camera, max_theta] : max_thetas_) {
      if (camera == calibrated) return max_theta;
    }
    ws::Rig sample;
    Images of_camera;
    for (std::size_t i = 0; i < model_.names().size(); ++i) {
      if (model_.calibrated({i}).rig.views.front().camera == calibrated) of_camera.push_back(i);
    }
    std::vector<cv::Mat> seen;
    const std::size_t count = std::min(rim_images, of_camera.size());
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t image = of_camera[i * of_camera.size() / count];
      sample.views.push_back(model_.calibrated({image}).rig.views.front());
      sample.views.back().camera = limited;
      seen.push_back(read(image));
    }
    arguments_.rig.leave_out_dark_rims(sample, seen);
    max_thetas_.emplace_back(calibrated, sample.views.front().camera.max_theta);
    return max_thetas_.back().second;
  }

  const ReconstructArguments& arguments_;
  ws::ColmapModel model_;
  std::vector<std::pair<ws::Camera, double>> max_thetas_;
};

/// All that decides the results but the images, cameras and poses, which each result names.
Json settings_of(const ReconstructArguments& a, const ws::DeviceInfo& device) {
  const auto absolute = [](const std::string& path) {
    return path.empty() ? path : fs::absolute(path).lexically_normal().string();
  };
  return {{"program", "widestereo " WIDESTEREO_VERSION},
          {"images", absolute(a.images)},
          {"calibration", absolute(a.rig.calibration)},
          {"mask", a.rig.masks.empty() ? "" : absolute(a.rig.masks.front())},
          {"masks", absolute(a.masks)},
          {"sources", a.sources},
          {"min_distance_given", a.settings.min_distance.has_value()},
          {"max_distance_given", a.settings.max_distance.has_value()},
          {"clouds", !a.format.no_cloud},
          {"pictures", !a.format.no_pictures},
          {"device", device.name},
          {"options", Json::parse(ws::to_json(a.settings.options()))}};
}

/// Matches the images of a model, group by group, and joins their points.
class Reconstruction {
 public:
  explicit Reconstruction(const ReconstructArguments& arguments)
      : arguments_(arguments),
        images_(arguments),
        groups_(images_.groups()),
        views_(images_.views()),
        device_(open_device(arguments.settings)),
        folders_(
            arguments.output,
            {.name = "reconstruction", .results = "images", .texts = {}, .numbers = {"accepted"}},
            settings_of(arguments, device_.info()), arguments.overwrite) {}

  void run() {
    const auto alone =
        std::count_if(groups_.begin(), groups_.end(), ReconstructionImages::is_alone);
    if (alone > 0) {
      std::fprintf(stderr,
                   "widestereo: %ld of %zu images share no points with others and are left out.\n",
                   alone, views_.size());
    }
    keep_results();
    ProgressBar bar("Matching on " + device_.info().name);
    for (std::size_t i = 0; i < groups_.size(); ++i) match(i, bar);
    fuse();
  }

  const ResultFolders& folders() const { return folders_; }

 private:
  bool is_matched(std::size_t image) const { return matched_[image]; }

  /// The views that are matched with each other in a group.
  Json views_of(const Images& group) const {
    Json views = Json::array();
    for (const std::size_t image : group) views.push_back(to_json(views_[image]));
    return views;
  }

  /// Results of an earlier run that came of the same images, cameras, poses and masks.
  void keep_results() {
    matched_.resize(views_.size());
    std::map<std::string, std::pair<std::size_t, Json>> wanted;
    for (const Images& group : groups_) {
      const Json views = views_of(group);
      for (const std::size_t image : group) {
        wanted.emplace(images_.name(image), std::pair{image, views});
      }
    }
    Json kept = Json::array();
    for (const Json& result : folders_.results()) {
      const auto image = wanted.find(result["name"].get<std::string>());
      if (image == wanted.end() || result["group"] != image->second.second) continue;
      if (!folders_.is_there(result)) continue;
      kept.push_back(result);
      matched_[image->second.first] = true;
    }
    folders_.keep(kept);
  }

  void match(std::size_t number, ProgressBar& bar) {
    const Images& group = groups_[number];
    const std::size_t count = groups_.size();
    const bool is_done = std::all_of(group.begin(), group.end(),
                                     [this](std::size_t image) { return is_matched(image); });
    if (ReconstructionImages::is_alone(group) || is_done) return;
    ws::Rig rig;
    std::vector<cv::Mat> pixels;
    for (const std::size_t image : group) {
      rig.views.push_back(views_[image]);
      pixels.push_back(images_.read(image));
    }
    const MatchSettings settings = with_range(
        arguments_.settings, images_.with_distances(rig, group), arguments_.rig.calibration);
    MatchingRun run{.options = settings.options(), .device = device_.info(), .result = {}};
    ws::Matcher matcher(device_, rig, run.options);
    ws::Matcher::Progress progress;
    if (bar.visible()) {
      progress = [&](double share) {
        bar.show((static_cast<double>(number) + share) / static_cast<double>(count));
      };
    }
    run.result = matcher.match(pixels, progress);
    require_no_validation_messages(device_);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (!is_matched(group[i])) write(group, i, pixels[i], run);
    }
    if (arguments_.as_json || bar.visible()) return;
    std::printf("group %zu of %zu: %s and %zu more, %.2f s\n", number + 1, count,
                images_.name(group.front()).c_str(), group.size() - 1,
                run.result.milliseconds / 1000);
    std::fflush(stdout);
  }

  void write(const Images& group, std::size_t index, const cv::Mat& pixels,
             const MatchingRun& group_run) {
    const std::size_t image = group[index];
    const ws::Rig rig{.views = {views_[image]}};
    const std::vector<cv::Mat> images = {pixels};
    MatchingRun run = group_run;
    run.result.views = {group_run.result.views[index]};
    const ws::ViewResult& result = run.result.views.front();
    const Json record = {
        {"name", images_.name(image)},
        {"group_milliseconds", run.result.milliseconds},
        {"accepted", accepted_share(result)},
        {"mean_cost", ws::consistency_scores(result.differences, result.cost).mean_cost},
        {"group", views_of(group)}};
    folders_.add(images_.name(image), [&](const fs::path& folder) {
      FolderContents contents{.rig = rig, .images = images, .run = run, .in_metres = false};
      contents.origin = folders_.origin();
      for (const std::size_t member : group) {
        contents.origin["images"].push_back(images_.file(images_.name(member)).string());
      }
      contents.origin["calibration"] = arguments_.rig.calibration;
      write_result_folder(folder, contents, arguments_.format);
      return record;
    });
    matched_[image] = true;
  }

  ws::ViewMaps maps_of(std::size_t image) const {
    const fs::path folder = folders_.folder() / images_.name(image);
    return {.distance = ws::read_map(folder / "distance_accepted0.tiff"),
            .normals = ws::read_map(folder / "normals0.tiff"),
            .image = images_.read(image),
            .confidence = ws::read_map(folder / "confidence0.tiff")};
  }

  void fuse() {
    std::vector<ws::View> views;
    Images numbers;                                  // of the views in the model
    std::vector<std::size_t> places(views_.size());  // of the images among the views
    for (std::size_t i = 0; i < views_.size(); ++i) {
      if (!is_matched(i)) continue;
      places[i] = views.size();
      numbers.push_back(i);
      views.push_back(views_[i]);
    }
    std::vector<std::vector<std::size_t>> others(views.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
      for (const std::size_t other : images_.model().selection().sources(numbers[i], fused_with)) {
        if (is_matched(other)) others[i].push_back(places[other]);
      }
    }
    ProgressBar bar("Fusing");
    const ws::PointCloud cloud = ws::fuse(
        views, others, [&](std::size_t view) { return maps_of(numbers[view]); }, arguments_.fusion,
        [&bar](double share) { bar.show(share); });
    ws::write_ply(folders_.folder() / "cloud.ply", cloud);
    const std::size_t middle = numbers[numbers.size() / 2];
    const ws::ColourRange range = ws::robust_range(maps_of(middle).distance);
    ws::write_image(
        folders_.folder() / "cloud_preview.png",
        ws::cloud_picture(cloud, viewpoint_behind(views_[middle].world_from_camera, range),
                          preview_size));
    folders_.note("cloud", {{"file", "cloud.ply"},
                            {"points", cloud.size()},
                            {"images", views.size()},
                            {"min_views", arguments_.fusion.min_views},
                            {"max_relative", arguments_.fusion.max_relative},
                            {"max_pixels", arguments_.fusion.max_pixels}});
  }

  const ReconstructArguments& arguments_;
  ReconstructionImages images_;
  std::vector<Images> groups_;
  std::vector<ws::View> views_;  // of all images
  ws::Device device_;
  ResultFolders folders_;
  std::vector<bool> matched_;
};

void run_reconstruct(const ReconstructArguments& arguments) {
  if (arguments.rig.masks.size() > 1) {
    throw ws::Error("--mask is for all images here; give one, or a folder of masks by --masks.");
  }
  Reconstruction reconstruction(arguments);
  reconstruction.run();
  const Json& record = reconstruction.folders().record();
  if (arguments.as_json) {
    std::cout << record.dump(2) << "\n";
    return;
  }
  double accepted = 0;
  for (const Json& image : record["images"]) accepted += image["accepted"].get<double>();
  const auto count = static_cast<double>(record["images"].size());
  std::printf("%.0f images, %.1f %% accepted on average; %zu points in %s\n", count,
              100 * accepted / count, record["cloud"]["points"].get<std::size_t>(),
              (reconstruction.folders().folder() / "cloud.ply").string().c_str());
}

}  // namespace

void add_reconstruct_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand(
      "reconstruct",
      "Match all images of a COLMAP model and fuse their points into one cloud; run it again to "
      "resume");
  auto a = std::make_shared<ReconstructArguments>();
  command->add_option("images", a->images, "Folder that the names of the model's images begin in")
      ->required();
  command
      ->add_option("-c,--calibration", a->rig.calibration,
                   "Folder of the COLMAP model, whose unit distances have")
      ->required();
  a->rig.add_fields_of_view_to(*command);
  command->add_option("--masks", a->masks,
                      "Folder of masks as COLMAP takes them: NAME.png for the image NAME, 0 = "
                      "ignore the pixel");
  command
      ->add_option("-o,--output", a->output,
                   "Folder for the results: a folder for each image, cloud.ply and "
                   "reconstruction.json")
      ->required();
  command
      ->add_option("--sources", a->sources,
                   "How many others each image is matched with: groups have one more")
      ->check(CLI::Range(1, most_sources))
      ->capture_default_str();
  command->add_flag("--overwrite", a->overwrite, "Remove the results of an earlier run first");
  const std::string fusion = "Fusion";
  command
      ->add_option("--min-views", a->fusion.min_views,
                   "Images that must have a point, at least, for it to be in the cloud")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(fusion);
  command
      ->add_option("--fusion-relative", a->fusion.max_relative,
                   "Largest difference of distance between images that have the same point, share")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(fusion);
  command
      ->add_option("--fusion-pixels", a->fusion.max_pixels,
                   "Largest displacement between them, "
                   "pixels")
      ->check(CLI::PositiveNumber)
      ->capture_default_str()
      ->group(fusion);
  a->format.add_for_fused_images_to(*command);
  command->add_flag("--json", a->as_json, "Print the record as JSON");
  a->settings.add_to(*command);
  command->callback([a] { run_reconstruct(*a); });
}
