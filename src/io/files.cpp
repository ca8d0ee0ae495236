// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <system_error>

#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;

/// A name beside `path` that no other write of this machine uses, with the same extension.
fs::path temporary_beside(const fs::path& path) {
  static std::atomic<unsigned> counter{0};
  const std::string unique =
      ".writing-" + std::to_string(getpid()) + "-" + std::to_string(counter++);
  return path.parent_path() / (path.stem().string() + unique + path.extension().string());
}

/// Removes a file when leaving scope, whether it exists or not.
struct RemoveOnExit {
  fs::path path;
  ~RemoveOnExit() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

void require_folder_of(const fs::path& path) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code error;
  if (fs::is_directory(folder, error)) return;
  throw Error("Cannot write " + path.string() + ": the folder " + folder.string() +
              " does not exist; create it first.");
}

bool can_make(const fs::path& file) { return !!std::ofstream(file).put('\n').flush(); }

}  // namespace

void write_atomically(const fs::path& path, const std::function<void(const fs::path&)>& write) {
  require_folder_of(path);
  std::error_code error;
  const RemoveOnExit temporary{temporary_beside(path)};
  write(temporary.path);
  fs::rename(temporary.path, path, error);
  if (error) {
    throw Error("Cannot write " + path.string() + ": " + error.message() +
                "; check the folder's permissions and free space.");
  }
}

void prepare_output_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    throw Error("Cannot create the output folder " + folder.string() +
                (error ? ": " + error.message() : "") + "; choose another one.");
  }
  const RemoveOnExit probe{temporary_beside(folder / "probe.txt")};
  if (!can_make(probe.path)) {
    throw Error("Cannot write into the output folder " + folder.string() +
                "; check its permissions and free space, or choose another one.");
  }
}

void require_writable(const fs::path& file) {
  require_folder_of(file);
  std::error_code error;
  const RemoveOnExit probe{temporary_beside(file)};
  if (fs::is_directory(file, error) || !can_make(probe.path)) {
    throw Error("Cannot write " + file.string() +
                (fs::is_directory(file, error)
                     ? ", which is a folder; give a file."
                     : "; check the folder's permissions and free space."));
  }
}

void write_text(const fs::path& path, const std::string& text) {
  write_atomically(path, [&](const fs::path& temporary) {
    std::ofstream file(temporary, std::ios::binary);
    file << text;
    if (!file.flush()) {
      throw Error("Cannot write " + path.string() + "; check permissions and free space.");
    }
  });
}

}  // namespace widestereo
