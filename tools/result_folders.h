// SPDX-License-Identifier: MIT
// The output folder of a run with many results: one result folder for each, complete or absent, and
// a record of all of them and of the settings, by which the run is taken up again.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "folder_lock.h"

/// As settings name files, so that another working directory makes no difference; empty if empty.
std::string absolute_path(const std::string& path);
nlohmann::ordered_json absolute_paths(const std::vector<std::string>& paths);

class ResultFolders {
 public:
  using Json = nlohmann::ordered_json;

  static constexpr const char* sequence = "sequence";
  static constexpr const char* reconstruction = "reconstruction";

  struct Kind {
    std::string name;                     ///< of the run, as above: the record is NAME.json
    std::string results;                  ///< what it has many of, the record's key
    std::vector<std::string> texts;       ///< that the record of each result has
    std::vector<std::string> numbers;     ///< likewise
    std::vector<std::string> files = {};  ///< of the whole run, besides its record
  };

  /// Takes up the folder where an earlier run left it; throws Error where that was of another kind.
  /// `settings`: all that decides the results; throws Error naming the first difference to those of
  /// an earlier run, or, where there is none, what has the name of one of the whole run's files.
  /// With `overwrite` its results are removed instead, as soon as there is something new to record.
  ResultFolders(std::filesystem::path folder, Kind kind, const Json& settings, bool overwrite);

  /// Throws Error where the folder holds such a run, or one of its results: another result there
  /// would spoil it.
  static void require_none(const std::filesystem::path& folder);

  const std::filesystem::path& folder() const { return folder_; }
  const Json& record() const { return record_; }
  /// Records of the finished results, in the order in which they were added.
  const Json& results() const { return record_[kind_.results]; }
  /// Forgets those results that are not among `kept`: they are removed as soon as there is
  /// something new to record.
  void keep(const Json& kept);
  /// Whether all files of the result that a record is about are still there.
  bool is_there(const Json& result) const;
  /// `record`: of a result.
  bool is_of_this_kind(const Json& record) const;

  /// Throws Error where a result cannot have the name, for it leads out of the folder, or is that
  /// of a file of the whole run.
  void require_usable(const std::string& name) const;

  /// What FolderContents::origin says of whose result it is.
  Json origin() const { return {{"run", kind_.name}}; }

  /// Throws Error where something else than a result of this kind has the name.
  void require_free(const std::string& name) const;

  /// Adds a result: `write` fills the folder that it is given, with that origin, and returns the
  /// record, which has the name. The result appears when all of it is there. Throws Error where
  /// something else has the name, or where it is not usable.
  void add(const std::string& name, const std::function<Json(const std::filesystem::path&)>& write);

  /// Whether the record on the disk has all results. It may lag behind where writing it takes long.
  bool is_recorded() const { return is_written_; }

  /// Notes something of the whole run in the record.
  void note(const std::string& key, Json value);

  /// Writes the record where it lags behind; throws Error where it cannot be written.
  void finish();
  /// Likewise after an error, but says nothing where it cannot be written.
  ~ResultFolders();
  ResultFolders(const ResultFolders&) = delete;
  ResultFolders& operator=(const ResultFolders&) = delete;

 private:
  using Clock = std::chrono::steady_clock;

  std::filesystem::path record_path(const std::string& kind) const {
    return folder_ / (kind + ".json");
  }
  void read(const Json& settings, bool overwrite);
  bool is_record_of_result(const Json& record) const;
  [[noreturn]] void refuse(const std::filesystem::path& path) const;
  /// Removes a result, of this run or of an earlier one, and folders that it leaves empty.
  void remove(const std::string& name) const;
  /// What is obsolete goes first, for nothing would know of it afterwards.
  void write_record();
  /// The same, but where that takes its time not for each of many thousand results. Those that the
  /// record lacks where a run is killed are made again.
  void write_record_now_and_then();

  std::filesystem::path folder_;
  std::optional<FolderLock> lock_;
  Kind kind_;
  Json record_;
  std::vector<std::string> obsolete_;  // names of results to be removed
  bool is_written_ = true;
  Clock::time_point written_{};
  Clock::duration writing_{};  // how long it took
};
