// SPDX-License-Identifier: MIT
// Keeps two runs out of one output folder.
#pragma once

#include <filesystem>

class FolderLock {
 public:
  /// Holds an existing folder until the end of the object or of the program, however it ends.
  /// Throws Error where another run holds it; file systems without locks are not asked.
  explicit FolderLock(const std::filesystem::path& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_ = -1;
};
