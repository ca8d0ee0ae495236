// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <system_error>

#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;

/// A name that no other write of this machine uses; short, as the target's may be as long as names
/// can be.
fs::path temporary_in(const fs::path& folder) {
  static std::atomic<unsigned> counter{0};
  return folder / (".writing-" + std::to_string(getpid()) + "-" + std::to_string(counter++));
}

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// Removes a file when leaving scope, whether it exists or not.
struct RemoveOnExit {
  fs::path path;
  ~RemoveOnExit() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

/// `error`: of the system, 0 where it gave none.
Error cannot_write(const fs::path& path, int error) {
  std::string remedy = "check permissions and free space";
  if (error == ENAMETOOLONG) remedy = "choose a shorter one";
  if (error == ENOSPC || error == EDQUOT || error == EFBIG) {
    remedy = "make room, or write elsewhere";
  }
  if (error == EACCES || error == EPERM || error == EROFS) remedy = "check permissions";
  const std::string cause = error == 0 ? "" : ": " + std::generic_category().message(error);
  return Error("Cannot write " + path.string() + cause + "; " + remedy + ".");
}

/// The file to replace when `path` is written: where its symbolic links lead, even to nothing yet.
/// Empty for what is no file of a folder: devices, FIFOs and, by links of /proc, open files.
fs::path file_to_replace(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::none) throw cannot_write(path, error.value());
  if (fs::is_directory(status)) {
    throw Error("Cannot write " + path.string() + ": it is a folder; give the name of a file.");
  }
  if (fs::exists(status) && !fs::is_regular_file(status)) return {};
  fs::path file = path;
  while (fs::is_symlink(fs::symlink_status(file, error))) {
    const fs::path folder = fs::canonical(folder_of(file));
    if (folder.string().starts_with("/proc/")) return {};
    file = folder / fs::read_symlink(file);
  }
  return file;
}

/// `path` is for messages, here and below.
fs::path require_folder_of(const fs::path& file, const fs::path& path) {
  const fs::path folder = folder_of(file);
  std::error_code error;
  if (fs::is_directory(folder, error)) return folder;
  throw Error("Cannot write " + path.string() + ": the folder " + folder.string() +
              " does not exist; create it first.");
}

void write_checked(const fs::path& file, std::ios::openmode mode, const fs::path& path,
                   const std::function<void(std::ostream&)>& write) {
  errno = 0;
  std::ofstream stream(file, std::ios::binary | mode);
  if (stream) write(stream);
  stream.close();  // reports what the system has put off
  if (!stream) throw cannot_write(path, errno);
}

}  // namespace

void write_file(const fs::path& path, const std::function<void(std::ostream&)>& write) {
  const fs::path file = file_to_replace(path);
  if (file.empty()) return write_checked(path, std::ios::app, path, write);
  const RemoveOnExit temporary{temporary_in(require_folder_of(file, path))};
  write_checked(temporary.path, std::ios::trunc, path, write);
  std::error_code error;
  fs::rename(temporary.path, file, error);
  if (error) throw cannot_write(path, error.value());
}

void prepare_output_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    throw Error("Cannot create the output folder " + folder.string() +
                (error ? ": " + error.message() : "") + "; choose another one.");
  }
  const RemoveOnExit probe{temporary_in(folder)};
  if (!std::ofstream(probe.path).put('\n').flush()) {
    throw Error("Cannot write into the output folder " + folder.string() +
                "; check its permissions and free space, or choose another one.");
  }
}

void require_writable(const fs::path& path) {
  const fs::path file = file_to_replace(path);
  if (file.empty()) return;
  const RemoveOnExit probe{temporary_in(require_folder_of(file, path))};
  write_checked(probe.path, std::ios::trunc, path, [](std::ostream& stream) { stream << "\n"; });
}

void write_text(const fs::path& path, const std::string& text) {
  write_file(path, [&](std::ostream& stream) { stream << text; });
}

}  // namespace widestereo
