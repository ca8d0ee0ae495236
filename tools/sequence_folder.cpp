// SPDX-License-Identifier: MIT
#include "sequence_folder.h"

#include <opencv2/core.hpp>
#include <utility>

#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

std::string of_view(const std::string& what, std::size_t view) {
  return what + std::to_string(view);
}

void write_planes(const fs::path& folder, const std::vector<ws::ViewResult>& views) {
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<cv::Mat> channels;
    cv::split(views[i].hypotheses, channels);
    channels.pop_back();  // the cost has a file of its own
    cv::Mat planes;
    cv::merge(channels, planes);
    ws::write_map(folder / of_view("planes", i).append(".tiff"), planes);
  }
}

bool has_values(const Json& record, const Json& values) {
  for (const auto& [key, value] : values.items()) {
    if (!record.contains(key) || record[key] != value) return false;
  }
  return true;
}

}  // namespace

SequenceFolder::SequenceFolder(fs::path folder, const Json& settings, bool overwrite)
    : results_(std::move(folder),
               {.name = ResultFolders::sequence,
                .results = "frames",
                .texts = {"start", "motion"},
                .numbers = {"milliseconds", "motion_milliseconds", "patch_samples", "accepted",
                            "overlap"}},
               settings, overwrite) {}

std::size_t SequenceFolder::finished(const std::vector<Json>& wanted) {
  Json kept = Json::array();
  for (std::size_t i = 0; i < wanted.size() && i < frames().size(); ++i) {
    const Json& frame = frames()[i];
    if (!has_values(frame, wanted[i]) || !results_.is_there(frame)) break;
    kept.push_back(frame);
  }
  results_.keep(kept);
  if (!kept.empty()) with_planes_ = {kept.back()["name"].get<std::string>()};
  for (std::size_t i = kept.size(); i < wanted.size(); ++i) {
    results_.require_free(wanted[i]["name"].get<std::string>());
  }
  return kept.size();
}

void SequenceFolder::add(const std::string& name, const std::vector<ws::ViewResult>& views,
                         const std::function<Json(const fs::path&)>& write) {
  results_.add(name, [&](const fs::path& folder) {
    Json frame = write(folder);
    write_planes(folder, views);
    return frame;
  });
  // Of the last frame in the record alone, which begins the rest.
  if (results_.is_recorded()) {
    std::error_code ignored;
    for (const std::string& earlier : std::exchange(with_planes_, {})) {
      for (std::size_t i = 0; i < views.size(); ++i) {
        fs::remove(results_.folder() / earlier / of_view("planes", i).append(".tiff"), ignored);
      }
    }
  }
  with_planes_.push_back(name);
}

std::vector<ws::ViewResult> SequenceFolder::planes(const std::string& name,
                                                   const ws::Rig& rig) const {
  std::vector<ws::ViewResult> views;
  try {
    for (std::size_t i = 0; i < rig.views.size(); ++i) {
      const fs::path folder = results_.folder() / name;
      const cv::Mat planes = ws::read_map(folder / of_view("planes", i).append(".tiff"));
      const cv::Mat cost = ws::read_map(folder / of_view("cost", i).append(".tiff"));
      ws::ViewResult& view = views.emplace_back();
      view.reasons = ws::read_image(folder / of_view("reasons", i).append(".png"));
      const cv::Size size(rig.views[i].camera.width, rig.views[i].camera.height);
      if (planes.type() != CV_32FC3 || cost.type() != CV_32FC1 || view.reasons.type() != CV_16UC1 ||
          planes.size() != size || cost.size() != size || view.reasons.size() != size) {
        return {};
      }
      cv::merge(std::vector<cv::Mat>{planes, cost}, view.hypotheses);
    }
  } catch (const ws::Error&) {  // someone removed them
    return {};
  }
  return views;
}
