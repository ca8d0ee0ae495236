// SPDX-License-Identifier: MIT
#include "result_folders.h"

#include <algorithm>
#include <fstream>
#include <set>
#include <utility>

#include "result_folder.h"
#include "temporary_folder.h"
#include "text/json_text.h"
#include "widestereo/error.h"
#include "widestereo/files.h"

namespace ws = widestereo;
namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

namespace {

constexpr const char* removed = ".removed";

/// The first setting (of objects) that differs, as "NAME is A there and B now"; empty if none does.
std::string first_difference(const Json& there, const Json& now) {
  const auto a = nlohmann::json::parse(ws::to_text(there));
  const auto b = nlohmann::json::parse(ws::to_text(now));
  const nlohmann::json differences = nlohmann::json::diff(a, b);
  if (differences.empty()) return "";
  auto path = nlohmann::json::json_pointer(differences[0]["path"].get<std::string>());
  if (path.back() == "-") path.pop_back();  // a list that has more at its end now
  const auto value = [&path](const nlohmann::json& settings) {
    return settings.contains(path) ? settings[path].dump() : std::string("not set");
  };
  return path.to_string().substr(1) + " is " + value(a) + " there and " + value(b) + " now";
}

/// What is written, and removed, by a result's name must not be the data set, nor anything else
/// outside; a record that someone edited may name it.
bool is_within_folder(const fs::path& name) {
  return !name.empty() && name.is_relative() &&
         std::none_of(name.begin(), name.end(), [](const fs::path& component) {
           return component.empty() || component == "." || component == "..";
         });
}

/// What kind of run a record says that its result is of; null if none.
Json run_of(const Json& record) {
  const Json whose = record.is_object() ? record.value("input", Json()) : Json();
  return whose.is_object() ? whose.value("run", Json()) : Json();
}

}  // namespace

std::string absolute_path(const std::string& path) {
  if (path.empty()) return path;
  const fs::path whole = fs::absolute(path).lexically_normal();
  // The separator that "folder/" and "." leave at the end.
  return (whole.has_filename() ? whole : whole.parent_path()).string();
}

Json absolute_paths(const std::vector<std::string>& paths) {
  Json absolute = Json::array();
  for (const std::string& path : paths) absolute.push_back(absolute_path(path));
  return absolute;
}

ResultFolders::ResultFolders(fs::path folder, Kind kind, const Json& settings, bool overwrite)
    : folder_(std::move(folder)), kind_(std::move(kind)) {
  kind_.texts.emplace_back("name");
  ws::prepare_output_folder(folder_);
  lock_.emplace(folder_);
  read(settings, overwrite);
  std::error_code ignored;
  for (const char* left : {unfinished_result, removed}) fs::remove_all(folder_ / left, ignored);
  ws::remove_unfinished_files(folder_);
}

void ResultFolders::require_none(const fs::path& folder) {
  const Json run = run_of(record_in(folder));
  for (const std::string kind : {sequence, reconstruction}) {
    if (!fs::exists(folder / (kind + ".json")) && run != Json(kind)) continue;
    throw ws::Error(folder.string() + " holds results of a " + kind + "; choose another folder.");
  }
}

bool ResultFolders::is_record_of_result(const Json& record) const {
  const auto all = [&record](const std::vector<std::string>& keys, auto&& is_type) {
    return std::all_of(keys.begin(), keys.end(), [&](const std::string& key) {
      return record.contains(key) && is_type(record[key]);
    });
  };
  return record.is_object() &&
         all(kind_.texts, [](const Json& value) { return value.is_string(); }) &&
         all(kind_.numbers, [](const Json& value) { return value.is_number(); }) &&
         is_within_folder(record["name"].get<std::string>());
}

void ResultFolders::read(const Json& settings, bool overwrite) {
  for (const char* other : {sequence, reconstruction}) {
    if (other == kind_.name || !fs::exists(record_path(other))) continue;
    throw ws::Error(folder_.string() + " holds a " + other + "; choose another folder for the " +
                    kind_.name + ".");
  }
  const fs::path path = record_path(kind_.name);
  record_ = {{"settings", settings}, {kind_.results, Json::array()}};
  if (!fs::exists(path)) {
    for (const std::string& file : kind_.files) {
      if (fs::exists(folder_ / file)) refuse(folder_ / file);
    }
    return;
  }
  const Json before =
      fs::is_regular_file(path) ? Json::parse(std::ifstream(path), nullptr, false) : Json();
  const bool is_record = before.is_object() && before.value("settings", Json()).is_object() &&
                         before.value(kind_.results, Json()).is_array();
  if (!is_record ||
      !std::all_of(before[kind_.results].begin(), before[kind_.results].end(),
                   [this](const Json& result) { return is_record_of_result(result); })) {
    throw ws::Error(path.string() + " is no record of a " + kind_.name +
                    "; remove it, or choose another folder.");
  }
  if (overwrite) {
    for (const Json& result : before[kind_.results]) {
      obsolete_.push_back(result["name"].get<std::string>());
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

void ResultFolders::keep(const Json& kept) {
  std::multiset<std::string> names;
  for (const Json& result : kept) names.insert(result["name"].get<std::string>());
  for (const Json& result : results()) {
    const std::string name = result["name"].get<std::string>();
    const auto found = names.find(name);
    if (found == names.end()) {
      obsolete_.push_back(name);
    } else {
      names.erase(found);
    }
  }
  record_[kind_.results] = kept;
}

bool ResultFolders::is_of_this_kind(const Json& record) const {
  return run_of(record) == Json(kind_.name);
}

bool ResultFolders::is_there(const Json& result) const {
  const fs::path path = folder_ / result["name"].get<std::string>();
  const Json record = record_in(path);
  const std::vector<std::string> files = files_of(record);
  return is_of_this_kind(record) && !files.empty() &&
         std::all_of(files.begin(), files.end(), [&path](const auto& file) {
           std::error_code missing;
           const std::uintmax_t bytes = fs::file_size(path / file, missing);
           // A power failure may leave empty files.
           return !missing && bytes > 0;
         });
}

void ResultFolders::require_usable(const std::string& name) const {
  if (!is_within_folder(name)) {
    throw ws::Error("A result named " + name + " would not lie within " + folder_.string() +
                    "; rename its images.");
  }
  std::vector<std::string> taken = kind_.files;
  taken.insert(taken.end(), {record_path(kind_.name).filename(), unfinished_result, removed});
  const std::string first = fs::path(name).begin()->string();
  if (std::find(taken.begin(), taken.end(), first) == taken.end()) return;
  throw ws::Error("A result named " + name + " would lie where the " + kind_.name + " has its " +
                  first + "; rename its images.");
}

void ResultFolders::require_free(const std::string& name) const {
  const fs::path path = folder_ / name;
  if (fs::exists(path) && !is_of_this_kind(record_in(path))) refuse(path);
}

void ResultFolders::refuse(const fs::path& path) const {
  throw ws::Error(path.string() + " is there already and is no result of a " + kind_.name +
                  "; choose another folder, or remove it.");
}

void ResultFolders::remove(const std::string& name) const {
  const fs::path path = folder_ / name;
  if (!fs::exists(path)) return;
  require_free(name);
  // Whenever the run ends, a result is there as a whole or not at all.
  std::error_code error;
  fs::rename(path, folder_ / removed, error);
  if (!error) fs::remove_all(folder_ / removed, error);
  if (error) throw ws::Error("Cannot remove " + path.string() + ": " + error.message() + ".");
  for (fs::path parent = fs::path(name).parent_path(); !parent.empty();
       parent = parent.parent_path()) {
    if (!fs::remove(folder_ / parent, error)) break;  // there is something else in it
  }
}

void ResultFolders::add(const std::string& name,
                        const std::function<Json(const fs::path&)>& write) {
  require_usable(name);
  const TemporaryFolder temporary(folder_ / unfinished_result);
  Json result = write(temporary.path());
  remove(name);
  // First, so that what has the name is known to be a result, whenever the run ends.
  record_[kind_.results].push_back(std::move(result));
  write_record_now_and_then();
  const fs::path path = folder_ / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  fs::rename(temporary.path(), path, error);
  if (error) throw ws::Error("Cannot write " + path.string() + ": " + error.message() + ".");
}

void ResultFolders::note(const std::string& key, Json value) {
  record_[key] = std::move(value);
  write_record();
}

void ResultFolders::write_record() {
  const Clock::time_point begin = Clock::now();
  for (const std::string& old : std::exchange(obsolete_, {})) remove(old);
  ws::write_text(record_path(kind_.name), ws::to_text(record_) + "\n");
  written_ = Clock::now();
  writing_ = written_ - begin;
  is_written_ = true;
}

void ResultFolders::write_record_now_and_then() {
  constexpr int least_share = 20;  // of the time goes to it
  is_written_ = false;
  // What is obsolete may have the name of what is added next.
  if (!obsolete_.empty() || Clock::now() - written_ >= least_share * writing_) write_record();
}

void ResultFolders::finish() {
  if (!is_written_) write_record();
}

ResultFolders::~ResultFolders() {
  try {
    finish();
  } catch (const std::exception&) {
    // What it lacks is made again.
  }
}
