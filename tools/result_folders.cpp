// SPDX-License-Identifier: MIT
#include "result_folders.h"

#include <algorithm>
#include <fstream>

#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* unfinished = ".unfinished";
constexpr const char* result_record = "result.json";

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

/// Results are named by files of the data set, so they lie within the folder; a record that someone
/// edited may say otherwise.
bool is_within_folder(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& component) {
           return component.empty() || component == "." || component == "..";
         });
}

}  // namespace

ResultFolders::ResultFolders(fs::path folder, Kind kind, const Json& settings, bool overwrite)
    : folder_(std::move(folder)), kind_(std::move(kind)) {
  ws::prepare_output_folder(folder_);
  read(settings, overwrite);
  std::error_code ignored;
  fs::remove_all(folder_ / unfinished, ignored);
}

void ResultFolders::read(const Json& settings, bool overwrite) {
  const fs::path path = folder_ / (kind_.name + ".json");
  record_ = {{"settings", settings}, {kind_.results, Json::array()}};
  if (!fs::exists(path)) return;
  Json before;
  try {
    before = Json::parse(std::ifstream(path));
    for (const Json& result : before.at(kind_.results)) {
      if (!is_within_folder(result.at("name").get<std::string>())) throw ws::Error("name");
    }
    before.at("settings");
  } catch (const std::exception&) {
    throw ws::Error(path.string() + " is no record of a " + kind_.name +
                    "; choose another folder.");
  }
  if (overwrite) {
    fs::remove(path);
    for (const Json& result : before[kind_.results]) {
      fs::remove_all(folder_ / result["name"].get<std::string>());
    }
    return;
  }
  const std::string difference = first_difference(before["settings"], settings);
  if (!difference.empty()) {
    throw ws::Error(folder_.string() + " holds a " + kind_.name + " made with other settings: " +
                    difference + "; give the same, another folder, or --overwrite.");
  }
  record_[kind_.results] = before[kind_.results];
}

bool ResultFolders::is_there(const Json& result) const {
  return fs::exists(folder_ / result["name"].get<std::string>() / result_record);
}

void ResultFolders::add(const std::string& name,
                        const std::function<Json(const fs::path&)>& write) {
  const fs::path temporary = folder_ / unfinished;
  fs::remove_all(temporary);
  ws::prepare_output_folder(temporary);
  Json result = write(temporary);
  const fs::path path = folder_ / name;
  std::error_code error;
  if (fs::exists(path) && !fs::exists(path / result_record)) {
    throw ws::Error(path.string() +
                    " is there already and holds no result; choose another folder.");
  }
  fs::remove_all(path, error);
  fs::create_directories(path.parent_path(), error);
  fs::rename(temporary, path, error);
  if (error) throw ws::Error("Cannot write " + path.string() + ": " + error.message() + ".");
  record_[kind_.results].push_back(std::move(result));
  write_record();
}

void ResultFolders::note(const std::string& key, Json value) {
  record_[key] = std::move(value);
  write_record();
}

void ResultFolders::write_record() const {
  ws::write_text(folder_ / (kind_.name + ".json"), record_.dump(2) + "\n");
}
