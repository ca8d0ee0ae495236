// SPDX-License-Identifier: MIT
#include "calibration/euroc.h"

#include <system_error>

#include "calibration/yaml_camera.h"
#include "widestereo/error.h"

namespace widestereo::calibration {
namespace {

namespace fs = std::filesystem;

fs::path sensor_file(const fs::path& folder, std::size_t camera) {
  return folder / ("cam" + std::to_string(camera)) / "sensor.yaml";
}

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

/// No camera may be left out.
void require_no_gap(const fs::path& folder, std::size_t cameras) {
  constexpr std::size_t most = 100;
  for (std::size_t i = cameras; i < most; ++i) {
    if (!is_there(sensor_file(folder, i))) continue;
    throw Error(sensor_file(folder, i).string() + " is there, but " +
                sensor_file(folder, cameras).string() +
                " is not; number the cameras from cam0 without gaps.");
  }
}

}  // namespace

std::vector<fs::path> euroc_files(const fs::path& folder) {
  std::vector<fs::path> files;
  const fs::path base = is_there(folder / "mav0") ? folder / "mav0" : folder;
  while (is_there(sensor_file(base, files.size()))) {
    files.push_back(sensor_file(base, files.size()));
  }
  require_no_gap(base, files.size());
  return files;
}

Rig read_euroc(const std::vector<Document>& documents) {
  Rig rig;
  for (const Document& document : documents) {
    read_yaml(document, [&](const YAML::Node& root) {
      const YamlCamera camera(document, "cam" + std::to_string(rig.views.size()), root);
      const Eigen::Isometry3d body_from_camera = camera.motion("T_BS");
      add_view_of_body(rig, camera.view(), body_from_camera);
    });
  }
  return rig;
}

}  // namespace widestereo::calibration
