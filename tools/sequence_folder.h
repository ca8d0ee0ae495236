// SPDX-License-Identifier: MIT
// The output folder of a sequence: its frames' results, and what the next frame starts from.
#pragma once

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "result_folders.h"
#include "widestereo/matcher.h"
#include "widestereo/rig.h"

class SequenceFolder {
 public:
  using Json = nlohmann::ordered_json;

  /// As ResultFolders.
  SequenceFolder(std::filesystem::path folder, const Json& settings, bool overwrite);

  /// How many frames, from the first on, are there already, with these values in their records.
  /// Forgets all others.
  std::size_t finished(const std::vector<Json>& wanted);
  /// Records of the finished frames, in order.
  const Json& frames() const { return results_.results(); }
  const Json& record() const { return results_.record(); }
  /// As ResultFolders::origin().
  Json origin() const { return results_.origin(); }

  /// Adds a frame: `write` fills the folder that it is given and returns the frame's record. The
  /// frame appears when all of it is there. Its planes are kept until the next one is recorded.
  void add(const std::string& name, const std::vector<widestereo::ViewResult>& views,
           const std::function<Json(const std::filesystem::path&)>& write);

  /// As of ResultFolders.
  void finish() { results_.finish(); }

  /// What the next frame starts from: hypotheses and reasons of a frame's views, empty where its
  /// files are not there or do not fit.
  std::vector<widestereo::ViewResult> planes(const std::string& name,
                                             const widestereo::Rig& rig) const;

 private:
  ResultFolders results_;
  std::vector<std::string> with_planes_;  // by which a killed run may be taken up again
};
