// SPDX-License-Identifier: MIT
#include "sequence_folder.h"

#include <fstream>
#include <opencv2/core.hpp>

#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* record_name = "sequence.json";
constexpr const char* unfinished = ".unfinished";

std::string of_view(const std::string& what, std::size_t view) {
  return what + std::to_string(view);
}

/// The first setting that differs, as "NAME is A there and B now"; empty if none does.
std::string first_difference(const Json& there, const Json& now) {
  const auto a = nlohmann::json::parse(there.dump());
  const auto b = nlohmann::json::parse(now.dump());
  const nlohmann::json differences = nlohmann::json::diff(a, b);
  if (differences.empty()) return "";
  const auto path = nlohmann::json::json_pointer(differences[0]["path"].get<std::string>());
  const auto value = [&path](const nlohmann::json& settings) {
    return settings.contains(path) ? settings[path].dump() : std::string("not set");
  };
  return path.to_string().substr(1) + " is " + value(a) + " there and " + value(b) + " now";
}

/// Frames are named by files of the data set, so they are names within the folder; a record that
/// someone edited may say otherwise.
bool is_plain_name(const std::string& name) {
  return !name.empty() && name != "." && name != ".." && fs::path(name).filename() == name;
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

}  // namespace

SequenceFolder::SequenceFolder(fs::path folder, const Json& settings, bool overwrite)
    : folder_(std::move(folder)) {
  ws::prepare_output_folder(folder_);
  read(settings, overwrite);
  std::error_code ignored;
  fs::remove_all(folder_ / unfinished, ignored);
}

void SequenceFolder::read(const Json& settings, bool overwrite) {
  const fs::path path = folder_ / record_name;
  record_ = {{"settings", settings}, {"frames", Json::array()}};
  if (!fs::exists(path)) return;
  Json before;
  try {
    before = Json::parse(std::ifstream(path));
    for (const Json& frame : before.at("frames")) {
      if (!is_plain_name(frame.at("name").get<std::string>())) throw ws::Error("name");
    }
    before.at("settings");
  } catch (const std::exception&) {
    throw ws::Error(path.string() + " is no record of a sequence; choose another folder.");
  }
  if (overwrite) {
    fs::remove(path);
    for (const Json& frame : before["frames"]) {
      fs::remove_all(folder_ / frame["name"].get<std::string>());
    }
    return;
  }
  const std::string difference = first_difference(before["settings"], settings);
  if (!difference.empty()) {
    throw ws::Error(folder_.string() + " holds a sequence made with other settings: " + difference +
                    "; give the same, another folder, or --overwrite.");
  }
  record_["frames"] = before["frames"];
}

std::size_t SequenceFolder::finished(const std::vector<std::string>& names) {
  Json frames = Json::array();
  for (std::size_t i = 0; i < names.size() && i < record_["frames"].size(); ++i) {
    const Json& frame = record_["frames"][i];
    if (frame["name"] != names[i] || !fs::exists(folder_ / names[i] / "result.json")) break;
    frames.push_back(frame);
  }
  record_["frames"] = frames;
  return frames.size();
}

void SequenceFolder::add(const std::string& name, const std::vector<ws::ViewResult>& views,
                         const std::function<Json(const fs::path&)>& write) {
  const fs::path temporary = folder_ / unfinished;
  fs::remove_all(temporary);
  ws::prepare_output_folder(temporary);
  Json frame = write(temporary);
  write_planes(temporary, views);
  std::error_code error;
  fs::remove_all(folder_ / name, error);
  fs::rename(temporary, folder_ / name, error);
  if (error) {
    throw ws::Error("Cannot write " + (folder_ / name).string() + ": " + error.message() + ".");
  }
  const std::string previous =
      record_["frames"].empty() ? "" : record_["frames"].back()["name"].get<std::string>();
  record_["frames"].push_back(std::move(frame));
  ws::write_text(folder_ / record_name, record_.dump(2) + "\n");
  if (previous.empty()) return;
  for (std::size_t i = 0; i < views.size(); ++i) {
    fs::remove(folder_ / previous / of_view("planes", i).append(".tiff"), error);
  }
}

std::vector<ws::ViewResult> SequenceFolder::planes(const std::string& name,
                                                   const ws::Rig& rig) const {
  std::vector<ws::ViewResult> views;
  try {
    for (std::size_t i = 0; i < rig.views.size(); ++i) {
      const fs::path folder = folder_ / name;
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
