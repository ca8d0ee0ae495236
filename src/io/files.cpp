// SPDX-License-Identifier: MIT
#include "widestereo/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <fstream>
#include <system_error>
#include <vector>

#include "widestereo/error.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;

fs::path folder_of(const fs::path& file) {
  return file.has_parent_path() ? file.parent_path() : fs::path(".");
}

/// What names of files that are not finished begin with.
constexpr const char* unfinished = ".writing-";

/// A new file, empty, that is removed when leaving scope unless it was renamed.
class TemporaryFile {
 public:
  /// Made exclusively, as containers that share a folder may have the same process IDs; by a short
  /// name, as the target's may be as long as names can be.
  explicit TemporaryFile(const fs::path& folder) {
    static std::atomic<unsigned> counter{0};
    constexpr mode_t all_may_write = 0666;  // less the umask, as a stream makes files
    do {
      path_ = folder / (unfinished + std::to_string(getpid()) + "-" + std::to_string(counter++));
      const int file = open(path_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, all_may_write);
      error_ = file < 0 ? errno : 0;
      if (file >= 0) close(file);
    } while (error_ == EEXIST);
    is_mine_ = error_ == 0;
  }
  ~TemporaryFile() {
    std::error_code ignored;
    if (is_mine_) fs::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const fs::path& path() const { return path_; }
  /// Of the system, where the file could not be made; else 0.
  int error() const { return error_; }

  void rename_to(const fs::path& file, std::error_code& error) {
    fs::rename(path_, file, error);
    is_mine_ = static_cast<bool>(error);  // another process may have the name by now
  }

 private:
  fs::path path_;
  int error_ = 0;
  bool is_mine_ = false;
};

/// `error`: of the system, 0 where it gave none.
Error cannot_write(const fs::path& path, int error) {
  std::string remedy = "check permissions and free space";
  if (error == ENAMETOOLONG) remedy = "choose a shorter one";
  if (error == ELOOP) remedy = "its symbolic links lead in a circle, choose another name";
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
  if (path.empty()) throw Error("Cannot write a file without a name; give one.");
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

/// Of a stream that writes into a file that is there, and makes none.
constexpr std::ios::openmode only_existing = std::ios::in;

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
  TemporaryFile temporary(require_folder_of(file, path));
  if (temporary.error() != 0) throw cannot_write(path, temporary.error());
  write_checked(temporary.path(), only_existing, path, write);
  std::error_code error;
  const fs::file_status before = fs::status(file, error);
  if (fs::exists(before)) fs::permissions(temporary.path(), before.permissions(), error);
  temporary.rename_to(file, error);
  if (error) throw cannot_write(path, error.value());
}

void prepare_output_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error || !fs::is_directory(folder)) {
    throw Error("Cannot create the output folder " + folder.string() +
                (error ? ": " + error.message() : "") + "; choose another one.");
  }
  const TemporaryFile probe(folder);
  if (probe.error() != 0 || !std::ofstream(probe.path(), only_existing).put('\n').flush()) {
    throw Error("Cannot write into the output folder " + folder.string() +
                "; check its permissions and free space, or choose another one.");
  }
}

void remove_unfinished_files(const fs::path& folder) {
  std::error_code ignored;
  std::vector<fs::path> left;
  for (fs::directory_iterator entry(folder, ignored), end; entry != end; entry.increment(ignored)) {
    if (entry->path().filename().string().starts_with(unfinished)) left.push_back(entry->path());
  }
  for (const fs::path& file : left) fs::remove(file, ignored);
}

void require_writable(const fs::path& path) {
  const fs::path file = file_to_replace(path);
  if (file.empty()) return;
  const TemporaryFile probe(require_folder_of(file, path));
  if (probe.error() != 0) throw cannot_write(path, probe.error());
  write_checked(probe.path(), only_existing, path, [](std::ostream& stream) { stream << "\n"; });
}

void write_text(const fs::path& path, const std::string& text) {
  write_file(path, [&](std::ostream& stream) { stream << text; });
}

}  // namespace widestereo
