// SPDX-License-Identifier: MIT
// The output folder of a run with many results: one result folder for each, complete or absent, and
// a record of all of them and of the settings, by which the run is taken up again.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

class ResultFolders {
 public:
  using Json = nlohmann::ordered_json;

  struct Kind {
    std::string name;     ///< of the run: the record is NAME.json
    std::string results;  ///< what it has many of, the record's key
  };

  /// Takes up the folder where an earlier run left it. `settings`: all that decides the results;
  /// throws Error naming the first difference to those of an earlier run, whose results are removed
  /// instead with `overwrite`.
  ResultFolders(std::filesystem::path folder, Kind kind, const Json& settings, bool overwrite);

  const std::filesystem::path& folder() const { return folder_; }
  const Json& record() const { return record_; }
  /// Records of the finished results, in the order in which they were added.
  const Json& results() const { return record_[kind_.results]; }
  /// Forgets those results that are not among `kept`.
  void keep(Json kept) { record_[kind_.results] = std::move(kept); }
  /// Whether the result that a record is about is still there.
  bool is_there(const Json& result) const;

  /// Adds a result: `write` fills the folder that it is given and returns the record, which has the
  /// name. The result appears when all of it is there.
  void add(const std::string& name, const std::function<Json(const std::filesystem::path&)>& write);

  /// Notes something of the whole run in the record.
  void note(const std::string& key, Json value);

 private:
  void read(const Json& settings, bool overwrite);
  void write_record() const;

  std::filesystem::path folder_;
  Kind kind_;
  Json record_;
};
