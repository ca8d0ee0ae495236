// SPDX-License-Identifier: MIT
#include "calibration/colmap_files.h"

#include <array>
#include <bit>
#include <fstream>
#include <limits>
#include <locale>
#include <span>
#include <sstream>

#include "geometry/validation.h"
#include "text/text_input.h"
#include "widestereo/error.h"

namespace widestereo::calibration {
namespace {

namespace fs = std::filesystem;

using OnCamera = std::function<void(ColmapCamera)>;
using OnImage = std::function<void(ColmapImage)>;
using OnPoint = std::function<void(std::uint64_t number, const Eigen::Vector3d& position)>;

// .bin files: integers and doubles without padding.
static_assert(std::endian::native == std::endian::little, "COLMAP's files are little endian.");

struct Observation {
  double x, y;
  std::uint64_t point;
};

constexpr std::uint64_t no_point = ~std::uint64_t{0};

Eigen::Isometry3d pose_of(std::span<const double, 7> v, const std::string& where) {
  const Eigen::Quaterniond rotation(v[0], v[1], v[2], v[3]);
  return Eigen::Translation3d(v[4], v[5], v[6]) *
         require_unit(rotation, where, "a pose is \"qw qx qy qz tx ty tz\"");
}

/// A .txt file of a model.
class TextFile {
 public:
  explicit TextFile(const fs::path& path) : path_(path), file_(path) {}

  /// The next line that is neither blank nor a comment.
  bool next_record() {
    while (next_line()) {
      const std::size_t first = text_.find_first_not_of(" \t\r");
      if (first != std::string::npos && text_[first] != '#') return true;
    }
    return false;
  }

  /// The next line, whatever is in it.
  bool next_line() {
    if (!file_.next_line(text_)) return false;
    ++number_;
    line_ = std::istringstream(text_);
    line_.imbue(std::locale::classic());
    return true;
  }

  template <class T>
  T read(const char* what) {
    T value{};
    if (!(line_ >> value)) fail(std::string("lacks ") + what);
    return value;
  }

  /// Whether anything is left of the line.
  bool has_more() { return static_cast<bool>(line_ >> std::ws) && line_.good(); }

  /// What is left of the line.
  std::string rest() {
    std::string text;
    std::getline(line_ >> std::ws, text);
    while (!text.empty() && text.back() == '\r') text.pop_back();
    return text;
  }

  std::string where() const { return path_.string() + " line " + std::to_string(number_); }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(where() + " " + what + "; export the model again (colmap model_converter).");
  }

 private:
  fs::path path_;
  TextInput file_;
  std::string text_;
  std::istringstream line_;
  int number_ = 0;
};

/// A .bin file of a model.
class BinaryFile {
 public:
  explicit BinaryFile(const fs::path& path) : path_(path), file_(path, std::ios::binary) {
    if (!file_) throw Error("Cannot read " + path.string() + "; check its permissions.");
  }

  template <class T>
  T read() {
    T value{};
    read_bytes(&value, sizeof value);
    return value;
  }

  void read_bytes(void* target, std::size_t bytes) {
    file_.read(static_cast<char*>(target), static_cast<std::streamsize>(bytes));
    require(file_.good());
  }

  std::string read_name() {
    std::string name;
    require(static_cast<bool>(std::getline(file_, name, '\0')) && !file_.eof());
    return name;
  }

  void skip(std::uint64_t count, std::size_t bytes_of_each = 1) {
    require(count <= std::numeric_limits<std::uint64_t>::max() / bytes_of_each);
    const std::uint64_t bytes = count * bytes_of_each;
    file_.ignore(static_cast<std::streamsize>(bytes));
    require(file_.good() && static_cast<std::uint64_t>(file_.gcount()) == bytes);
  }

  /// After as many records as the file states.
  void require_end() {
    if (file_.peek() == std::ifstream::traits_type::eof()) return;
    throw Error(path_.string() +
                " goes on after as many entries as it says it has; it is damaged, copy it again.");
  }

  std::string where() const { return path_.string(); }

 private:
  void require(bool good) const {
    if (!good) {
      throw Error(path_.string() +
                  " ends too early; it is truncated or no file of COLMAP's, copy "
                  "it again.");
    }
  }

  fs::path path_;
  std::ifstream file_;
};

const ColmapModel& model_named(const std::string& name, const TextFile& file) {
  if (const ColmapModel* model = find_colmap_model(name)) return *model;
  file.fail("has the unknown camera model \"" + name + "\"");
}

void read_cameras(TextFile file, const OnCamera& visit) {
  while (file.next_record()) {
    ColmapCamera camera;
    camera.number = file.read<std::uint64_t>("a camera's number");
    camera.model = &model_named(file.read<std::string>("a camera model"), file);
    camera.width = file.read<double>("a width");
    camera.height = file.read<double>("a height");
    for (std::size_t i = 0; i < camera.model->parameters(); ++i) {
      camera.parameters.push_back(file.read<double>("parameters of its camera model"));
    }
    if (file.has_more()) file.fail("has more parameters than its camera model");
    visit(std::move(camera));
  }
}

void read_cameras(BinaryFile file, const OnCamera& visit) {
  const auto count = file.read<std::uint64_t>();
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto number = file.read<std::uint32_t>();
    const auto model = file.read<std::uint32_t>();
    if (model >= colmap_models().size()) {
      throw Error(file.where() + " has a camera of the unknown model number " +
                  std::to_string(model) + "; convert it with colmap model_converter.");
    }
    ColmapCamera camera{.number = number, .model = &colmap_models()[model], .parameters = {}};
    camera.width = static_cast<double>(file.read<std::uint64_t>());
    camera.height = static_cast<double>(file.read<std::uint64_t>());
    camera.parameters.resize(camera.model->parameters());
    file.read_bytes(camera.parameters.data(), camera.parameters.size() * sizeof(double));
    visit(std::move(camera));
  }
  file.require_end();
}

void read_images(TextFile file, const OnImage& visit) {
  while (file.next_record()) {
    ColmapImage image;
    image.number = file.read<std::uint64_t>("an image's number");
    std::array<double, 7> pose{};
    for (double& value : pose) value = file.read<double>("numbers of a pose");
    image.camera = file.read<std::uint64_t>("a camera's number");
    image.name = file.rest();
    if (image.name.empty()) file.fail("lacks the image's name");
    image.camera_from_world = pose_of(pose, file.where());
    // The line of points may be empty, or missing at the end.
    if (file.next_line()) {
      while (file.has_more()) {
        file.read<double>("an observation's x");
        file.read<double>("an observation's y");
        const auto point = file.read<std::int64_t>("an observation's point");
        if (point >= 0) image.points.push_back(static_cast<std::uint64_t>(point));
      }
    }
    visit(std::move(image));
  }
}

void read_images(BinaryFile file, const OnImage& visit) {
  const auto count = file.read<std::uint64_t>();
  for (std::uint64_t i = 0; i < count; ++i) {
    ColmapImage image;
    image.number = file.read<std::uint32_t>();
    std::array<double, 7> pose{};
    file.read_bytes(pose.data(), sizeof pose);
    image.camera = file.read<std::uint32_t>();
    image.name = file.read_name();
    image.camera_from_world = pose_of(pose, file.where() + ": " + image.name);
    const auto observations = file.read<std::uint64_t>();
    for (std::uint64_t j = 0; j < observations; ++j) {
      const auto observation = file.read<Observation>();
      if (observation.point != no_point) image.points.push_back(observation.point);
    }
    visit(std::move(image));
  }
  file.require_end();
}

void read_points(TextFile file, const OnPoint& visit) {
  while (file.next_record()) {
    const auto id = file.read<std::uint64_t>("a point's number");
    Eigen::Vector3d position;
    for (double& value : position) value = file.read<double>("a point's position");
    visit(id, position);
  }
}

void read_points(BinaryFile file, const OnPoint& visit) {
  const auto count = file.read<std::uint64_t>();
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto id = file.read<std::uint64_t>();
    Eigen::Vector3d position;
    file.read_bytes(position.data(), 3 * sizeof(double));
    file.skip(3 + sizeof(double));  // colour, error
    file.skip(file.read<std::uint64_t>(), 2 * sizeof(std::uint32_t));
    visit(id, position);
  }
  file.require_end();
}

template <class Read>
void with_file(const fs::path& path, const Read& read) {
  if (path.extension() == ".bin") {
    read(BinaryFile(path));
  } else {
    read(TextFile(path));
  }
}

}  // namespace

fs::path colmap_file(const fs::path& folder, const std::string& name) {
  std::error_code error;
  for (const char* extension : {".bin", ".txt"}) {
    fs::path path = folder / (name + extension);
    if (fs::is_regular_file(path, error)) return path;
  }
  return {};
}

void each_colmap_camera(const fs::path& file, const OnCamera& visit) {
  with_file(file, [&](auto opened) { read_cameras(std::move(opened), visit); });
}

void each_colmap_image(const fs::path& file, const OnImage& visit) {
  with_file(file, [&](auto opened) { read_images(std::move(opened), visit); });
}

void each_colmap_point(const fs::path& file, const OnPoint& visit) {
  with_file(file, [&](auto opened) { read_points(std::move(opened), visit); });
}

}  // namespace widestereo::calibration
