// SPDX-License-Identifier: MIT
#include "folder_format.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "option_checks.h"
#include "result_folder.h"
#include "text/formatted.h"
#include "text/lower_case.h"
#include "text/number.h"
#include "widestereo/error.h"

namespace ws = widestereo;
namespace fs = std::filesystem;

namespace {

constexpr const char* group = "Output";

}  // namespace

void FolderFormat::add_maps_to(CLI::App& command) {
  command.add_option("--formats", maps, "Distance maps: tiff, exr, pfm, png (several by comma)")
      ->delimiter(',')
      ->check(CLI::IsMember({"tiff", "exr", "pfm", "png"}))
      ->capture_default_str()
      ->group(group);
  command.add_option("--png-scale", png_scale, "Units per metre of 16-bit PNG distances")
      ->check(positive_number())
      ->capture_default_str()
      ->group(group);
}

void add_png_scale_of_input(CLI::App& command, const std::string& option,
                            const std::string& distances, std::optional<double>& scale) {
  command
      .add_option(option, scale,
                  "Units per metre of a 16-bit PNG of " + distances +
                      " (default: as the result's record says, or else " +
                      ws::text_of(FolderFormat::usual_png_scale) + ")")
      ->check(positive_number());
}

double png_scale_of(const std::string& option, std::optional<double> given, const fs::path& map) {
  if (ws::extension_of(map) == ".png") {
    if (given) return *given;
    return recorded_number(map, "/png_scale").value_or(FolderFormat::usual_png_scale);
  }
  if (!given) return FolderFormat::usual_png_scale;
  throw ws::Error(option + " has no effect on " + map.string() +
                  ", which is no PNG; leave it out.");
}

void FolderFormat::add_to(CLI::App& command) {
  add_maps_to(command);
  command.add_flag("--no-cloud", no_cloud, "Do not write point clouds")->group(group);
  command.add_flag("--no-pictures", no_pictures, "Do not write preview pictures")->group(group);
}

void FolderFormat::add_for_many_frames_to(CLI::App& command) {
  add_maps_to(command);
  add_extras_to(command, "the rig's frame; poses are not applied");
}

void FolderFormat::add_for_fused_images_to(CLI::App& command) {
  add_extras_to(command, "of each image");
}

void FolderFormat::add_extras_to(CLI::App& command, const std::string& clouds) {
  no_cloud = no_pictures = true;
  command
      .add_flag_callback(
          "--clouds", [this] { no_cloud = false; }, "Write point clouds (" + clouds + ")")
      ->group(group);
  command
      .add_flag_callback(
          "--pictures", [this] { no_pictures = false; }, "Write preview pictures")
      ->group(group);
}

void FolderFormat::require_room_for(double min_distance, double max_distance) const {
  constexpr double largest = std::numeric_limits<std::uint16_t>::max();
  if (std::find(maps.begin(), maps.end(), "png") == maps.end()) {
    if (png_scale == usual_png_scale) return;
    throw ws::Error("--png-scale has no effect without --formats png; give it, or leave that out.");
  }
  // What is rounded to 0 reads as no value.
  const auto is_lost = [min_distance](double scale) {
    return std::round(min_distance * scale) < 1;
  };
  const bool too_far = max_distance * png_scale > largest;
  if (!too_far && !is_lost(png_scale)) return;
  const auto text = [](double number) { return ws::formatted("%g", number); };
  const std::string but = " at --png-scale " + text(png_scale) + ", but they ";
  const double scale = std::pow(10.0, std::floor(std::log10(largest / max_distance)));
  throw ws::Error(
      "A 16-bit PNG holds distances " +
      (too_far ? "up to " + text(largest / png_scale) + but + "reach to " + text(max_distance)
               : "from " + text(0.5 / png_scale) + " on" + but + "begin at " + text(min_distance)) +
      (is_lost(scale) ? "; leave png out of --formats or give a narrower range."
                      : "; give --png-scale " + text(scale) + ", say, or a narrower range."));
}
