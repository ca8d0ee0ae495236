// SPDX-License-Identifier: MIT
// In which formats a match is written, and the scale of distances in 16-bit PNGs.
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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

/// Adds the scale of a distance map that is read; `distances`: which, in the option's help.
void add_png_scale_of_input(CLI::App& command, const std::string& option,
                            const std::string& distances, std::optional<double>& scale);
/// That of a map: as given, else as the record beside it says, else the usual one. Throws Error
/// where it was given for a map that has none.
double png_scale_of(const std::string& option, std::optional<double> given,
                    const std::filesystem::path& map);
