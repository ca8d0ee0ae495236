// SPDX-License-Identifier: MIT
#include "widestereo/sequence.h"

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "io/frame_images.h"
#include "io/frame_times.h"
#include "text/file_type.h"
#include "text/lower_case.h"
#include "text/number.h"
#include "text/text_input.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& path) {
  static constexpr std::array<const char*, 9> extensions = {
      ".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm", ".webp"};
  const std::string extension = extension_of(path);
  return std::find(extensions.begin(), extensions.end(), extension) != extensions.end();
}

CameraImages images_in(const fs::path& folder) {
  CameraImages images;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; entry != end; entry.increment(error)) {
    std::error_code ignored;  // a link to nothing is no image
    const fs::path& path = entry->path();
    // Such names are of files that macOS keeps attributes in.
    const bool holds_attributes = path.filename().string().starts_with("._");
    if (holds_attributes || !entry->is_regular_file(ignored) || !is_image(path)) continue;
    const auto [place, is_new] = images.of_frames.emplace(path.stem().string(), path);
    if (!is_new) {
      throw Error("The frame " + place->first + " has two images, " + place->second.string() +
                  " and " + path.filename().string() + "; leave one.");
    }
  }
  if (error)
    throw Error("Cannot read the folder " + folder.string() + ": " + error.message() +
                "; check the path.");
  if (images.of_frames.empty()) {
    throw Error("There are no images in " + folder.string() + "; check the path.");
  }
  return images;
}

CameraImages images_listed_in(const fs::path& list) {
  TextInput file(list);
  CameraImages images;
  images.listed = true;
  std::map<std::string, int> lines;
  std::string line;
  for (int number = 1; file.next_line(line); ++number) {
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (line.empty() || line[0] == '#') continue;
    const std::size_t comma = line.find(',');
    const std::string time = line.substr(0, comma);
    const std::size_t start =
        comma == std::string::npos ? comma : line.find_first_not_of(' ', comma + 1);
    if (!whole_number(time) || start == std::string::npos) {
      throw Error(list.string() + " line " + std::to_string(number) +
                  " is no \"nanoseconds,filename\"; correct it.");
    }
    const auto [earlier, is_new] = lines.emplace(time, number);
    if (!is_new) {
      throw Error(list.string() + " has the time " + time + " in line " +
                  std::to_string(earlier->second) + " and in line " + std::to_string(number) +
                  "; leave one.");
    }
    images.of_frames.emplace(time, list.parent_path() / "data" / line.substr(start));
  }
  if (images.of_frames.empty()) throw Error(list.string() + " lists no images; add them.");
  return images;
}

bool is_folder(const fs::path& path) { return type_of(path) == fs::file_type::directory; }

/// Leaves out what a list names and is not there.
void leave_out_missing(CameraImages& images) {
  std::erase_if(images.of_frames, [](const auto& image) {
    return type_of(image.second) == fs::file_type::not_found;
  });
}

/// Before any frame is matched, for that may be hours before the missing one's turn.
void require_listed(const CameraImages& images) {
  for (const auto& [time, path] : images.of_frames) {
    if (type_of(path) != fs::file_type::not_found) continue;
    throw Error("The frame " + time + " has no image " + path.string() +
                ", which data.csv lists; add it, or skip incomplete frames.");
  }
}

/// Of one camera, listed or not.
CameraImages images_of(const fs::path& folder, bool skip_missing) {
  const fs::path list = folder / "data.csv";
  CameraImages images = type_of(list) == fs::file_type::regular ? images_listed_in(list)
                        : is_folder(folder / "data")            ? images_in(folder / "data")
                                                                : images_in(folder);
  images.folder = folder;
  if (images.listed && skip_missing) leave_out_missing(images);
  if (images.listed && !skip_missing) require_listed(images);
  return images;
}

void require_different_folders(const std::vector<CameraImages>& images) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (std::size_t j = i + 1; j < images.size(); ++j) {
      std::error_code error;
      if (!fs::equivalent(images[i].folder, images[j].folder, error)) continue;
      throw Error("Two cameras have their images in the same folder, " + images[i].folder.string() +
                  "; give each camera its own.");
    }
  }
}

/// Where the images of camN are in either layout.
fs::path camera_folder(const fs::path& folder, int camera) {
  const std::string name = "cam" + std::to_string(camera);
  for (const fs::path& base : {folder / "mav0" / name, folder / name}) {
    if (is_folder(base)) return base;
  }
  throw Error("There is no folder " + (folder / name).string() +
              "; a data set has images in cam0, cam1, ... or in mav0/cam0/data, mav0/cam1/data, "
              "..., else name the folders of its cameras.");
}

const fs::path& first_image(const SequenceFrame& frame) {
  return *std::find_if(frame.images.begin(), frame.images.end(),
                       [](const fs::path& image) { return !image.empty(); });
}

/// Frames are told apart by name, which is also that of a folder.
void require_usable_names(const std::vector<SequenceFrame>& frames) {
  std::map<std::string, fs::path> images;
  for (const SequenceFrame& frame : frames) {
    if (!is_complete(frame)) continue;
    const fs::path& image = frame.images.front();
    if (frame.name.empty() || frame.name == "." || frame.name == "..") {
      throw Error("The image " + image.string() +
                  " gives its frame no usable name; rename it and its like.");
    }
    const auto [other, is_new] = images.emplace(frame.name, image);
    if (!is_new) {
      throw Error("Two frames have the name " + frame.name + ", those of " +
                  other->second.string() + " and " + image.string() +
                  "; give the images names that differ before the extension.");
    }
  }
}

/// All by one kind of clock.
void take_times_from_names(std::vector<SequenceFrame>& frames) {
  std::vector<std::string> names;
  for (const SequenceFrame& frame : frames) {
    if (is_complete(frame)) names.push_back(frame.name);
  }
  const bool of_any_clock = end_in_seconds(names);
  for (SequenceFrame& frame : frames) {
    frame.nanoseconds = time_in_name(frame.name, of_any_clock);
  }
}

/// A file of one camera that is named unlike the frames, which have times, is none of them.
void leave_out_strays(std::vector<SequenceFrame>& frames) {
  const bool are_timed = std::all_of(frames.begin(), frames.end(), [&](const SequenceFrame& frame) {
    return has_time(frame) || !is_complete(frame);
  });
  if (are_timed) std::erase_if(frames, std::not_fn(has_time));
}

bool have_a_common_frame(const std::vector<CameraImages>& images) {
  const auto& of_first = images.front().of_frames;
  return std::any_of(of_first.begin(), of_first.end(), [&images](const auto& image) {
    return std::all_of(images.begin(), images.end(), [&image](const CameraImages& of_camera) {
      return of_camera.of_frames.contains(image.first);
    });
  });
}

struct NumberInName {
  std::string whole;
  std::string fraction;  ///< after a point; empty where there is none
};

/// The digits at the end of a name.
NumberInName number_at_end(const std::string& name) {
  constexpr const char* digits = "0123456789";
  const auto start_of_digits = [&](std::size_t end) {
    const std::size_t before =
        end == 0 ? std::string::npos : name.find_last_not_of(digits, end - 1);
    return before == std::string::npos ? std::size_t{0} : before + 1;
  };
  const std::size_t start = start_of_digits(name.size());
  const std::size_t point = start > 0 && start < name.size() ? start - 1 : std::string::npos;
  if (point != std::string::npos && name[point] == '.' && start_of_digits(point) < point) {
    const std::size_t first = start_of_digits(point);
    return {name.substr(first, point - first), name.substr(start)};
  }
  return {name.substr(start), ""};
}

/// The frames of all cameras together.
std::vector<SequenceFrame> frames_of(std::vector<CameraImages> images, bool allow_incomplete,
                                     double time_tolerance) {
  if (images.empty()) throw Error("A data set has no cameras; give at least one.");
  require_different_folders(images);
  if (time_tolerance > 0) match_by_times(images, time_tolerance);
  if (!have_a_common_frame(images)) match_by_numbers(images);
  std::map<std::string, int, NumericalOrder> counts;
  for (const CameraImages& of_camera : images) {
    for (const auto& [key, path] : of_camera.of_frames) ++counts[key];
  }
  // First of all, as more images or fewer frames would not help.
  if (!have_a_common_frame(images)) {
    const std::optional<double> apart = least_time_apart(images);
    throw Error("No frame has images of all cameras, beginning with those in " +
                images.front().folder.string() +
                "; images of one frame must have equal names, or numbers in them, or equal times" +
                (apart ? " (they are " + text_of(static_cast<float>(*apart)) +
                             " s apart or more: a time tolerance allows that)."
                       : "."));
  }
  const bool are_listed = std::any_of(
      images.begin(), images.end(), [](const CameraImages& of_camera) { return of_camera.listed; });
  std::vector<SequenceFrame> frames;
  for (const auto& [key, count] : counts) {
    SequenceFrame frame;
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto found = images[i].of_frames.find(key);
      const bool is_there = found != images[i].of_frames.end();
      if (!is_there && !allow_incomplete) {
        throw Error("The frame " + key + " has no image in " + images[i].folder.string() + " (" +
                    std::to_string(images[i].of_frames.size()) + " of " +
                    std::to_string(counts.size()) +
                    " frames have one); add it, or skip incomplete frames.");
      }
      frame.images.push_back(is_there ? found->second : fs::path());
    }
    frame.name = first_image(frame).stem().string();
    if (are_listed) frame.nanoseconds = whole_number(key);
    frames.push_back(std::move(frame));
  }
  if (!are_listed) take_times_from_names(frames);
  require_usable_names(frames);
  leave_out_strays(frames);
  // Fractions of a second in names are of any number of digits: 7.5 is after 7.25.
  if (have_times(frames)) {
    std::stable_sort(frames.begin(), frames.end(),
                     [](const auto& a, const auto& b) { return a.nanoseconds < b.nanoseconds; });
  }
  return frames;
}

}  // namespace

std::optional<std::int64_t> time_in_name(const std::string& name, bool of_any_clock) {
  const auto [whole, fraction] = number_at_end(name);
  constexpr std::size_t digits_of_seconds = 10, digits_of_nanoseconds = 19;
  const bool is_short = of_any_clock && !fraction.empty() && whole.size() < digits_of_seconds;
  if (!is_short && (whole.size() < digits_of_seconds || whole.size() > digits_of_nanoseconds ||
                    whole.front() == '0' || (whole.size() - digits_of_seconds) % 3 != 0)) {
    return std::nullopt;
  }
  const std::size_t missing = is_short ? digits_of_seconds - whole.size() : 0;
  std::string nanoseconds = whole + fraction;
  nanoseconds.resize(digits_of_nanoseconds - missing, '0');
  return whole_number(nanoseconds);
}

bool end_in_seconds(const std::vector<std::string>& names) {
  std::set<std::size_t> lengths;
  bool have_zeros = false;
  for (const std::string& name : names) {
    if (time_in_name(name) || !time_in_name(name, true)) return false;
    const std::string fraction = number_at_end(name).fraction;
    lengths.insert(fraction.size());
    have_zeros = have_zeros || (fraction.size() > 1 && fraction.back() == '0');
  }
  return names.size() > 1 && (lengths.size() == 1 || !have_zeros);
}

bool is_complete(const SequenceFrame& frame) {
  return std::none_of(frame.images.begin(), frame.images.end(),
                      [](const fs::path& image) { return image.empty(); });
}

std::vector<SequenceFrame> read_sequence(const std::vector<fs::path>& camera_folders,
                                         bool allow_incomplete, double time_tolerance) {
  std::vector<CameraImages> images;
  for (const fs::path& folder : camera_folders) {
    images.push_back(images_of(folder, allow_incomplete));
  }
  return frames_of(std::move(images), allow_incomplete, time_tolerance);
}

std::vector<SequenceFrame> read_sequence(const fs::path& folder, const std::vector<int>& cameras,
                                         bool allow_incomplete, double time_tolerance) {
  if (!is_folder(folder)) {
    throw Error("There is no folder " + folder.string() + "; check the path.");
  }
  std::vector<CameraImages> images;
  for (const int camera : cameras) {
    images.push_back(images_of(camera_folder(folder, camera), allow_incomplete));
  }
  return frames_of(std::move(images), allow_incomplete, time_tolerance);
}

}  // namespace widestereo
