// SPDX-License-Identifier: MIT
#include <Eigen/Dense>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <initializer_list>
#include <iterator>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/core/persistence.hpp>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "calibration/camera_forms.h"
#include "calibration/formats.h"
#include "geometry/angle.h"
#include "geometry/validation.h"
#include "text/size_text.h"

namespace widestereo::calibration {
namespace {

using Keys = std::initializer_list<const char*>;

/// The first camera's matrix where cameras count from 0.
constexpr Keys matrix_0 = {"K0", "M0", "cameraMatrix0", "camera_matrix_0"};

/// How many levels OpenCV's parsers find in a text at most: each begins with a bracket, an element
/// of XML, a key's colon or an item's dash. Those in comments and strings count, too, as parsers
/// differ in where these end.
std::size_t most_levels(std::string_view text) {
  std::size_t levels = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const char next = i + 1 < text.size() ? text[i + 1] : '\0';
    const bool negative = next == '.' || std::isdigit(static_cast<unsigned char>(next)) != 0;
    levels +=
        c == '[' || c == '{' || c == ':' || (c == '<' && next != '/') || (c == '-' && !negative);
  }
  return levels;
}

/// What OpenCV's parser of YAML needs that others do not: a first line, and lists further in than
/// their key.
std::string as_opencv_yaml(const std::string& text) {
  std::istringstream lines(text);
  std::string result = "%YAML:1.0\n";
  for (std::string line; std::getline(lines, line);) {
    const bool belongs_to_key = line.starts_with(' ') || line.starts_with("- ");
    result.append(belongs_to_key ? " " : "").append(line).push_back('\n');
  }
  return result;
}

/// Whether a line goes on after the mark that ends a document.
bool goes_on_after_end(const std::string& text) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("...") && line.find_first_not_of(" \t\r", 3) != std::string::npos) {
      return true;
    }
  }
  return false;
}

/// Refuses what OpenCV's parsers (4.6) crash on, or never return from.
void require_harmless(const Document& document, std::size_t first) {
  const std::string& text = document.text;
  const std::string damaged = "it may be damaged: copy it again";
  const bool is_xml = first != std::string::npos && text[first] == '<';
  if (is_xml) {
    constexpr std::string_view end = "</opencv_storage>";
    const std::string_view whole(text.data(), text.find_last_not_of(" \t\r\n") + 1);
    if (!whole.ends_with(end)) {
      document.fail(std::string("It does not end with ").append(end), damaged);
    }
  } else if (goes_on_after_end(text)) {
    document.fail("It goes on in the line of the \"...\" that ends it", damaged);
  }
  if (text.find('\0') != std::string::npos) document.fail("It has a byte that is 0", damaged);
  for (const char* packed : {"!!binary", "\"binary\"", "$base64$"}) {
    if (text.find(packed) == std::string::npos) continue;
    document.fail("It has numbers packed as base64", "have OpenCV write them as text");
  }
}

/// The parsers call themselves at each level, until the stack is full.
std::string parsable(const Document& document) {
  constexpr std::size_t most = 5000;  // 2 MiB of stack at 400 bytes a level
  if (most_levels(document.text) > most) {
    document.fail("It has more than " + std::to_string(most) +
                      " brackets, keys and items, which may be too deep in each other for OpenCV",
                  "leave only those of the calibration");
  }
  const std::size_t first = document.text.find_first_not_of(" \t\r\n");
  require_harmless(document, first);
  const bool is_told = first != std::string::npos &&
                       std::string_view("{<%").find(document.text[first]) != std::string::npos;
  return is_told ? document.text : as_opencv_yaml(document.text);
}

/// A FileStorage whose keys go by several names; numbers in them may begin with 0 or 1.
class Storage {
 public:
  explicit Storage(const Document& document)
      : document_(document),
        file_(parsable(document), cv::FileStorage::READ | cv::FileStorage::MEMORY) {
    if (!file_.isOpened())
      document_.fail("OpenCV cannot read it", "it may be truncated: copy it again");
    for (const char* key : matrix_0) {
      begins_with_0_ = begins_with_0_ || !node_of(key).empty();
    }
  }

  /// Those of the top level and of the maps there.
  std::vector<std::string> keys() const {
    std::vector<std::string> keys = file_.root().keys();
    for (const cv::FileNode& map : file_.root()) {
      if (!map.isMap()) continue;
      const std::vector<std::string> more = map.keys();
      keys.insert(keys.end(), more.begin(), more.end());
    }
    return keys;
  }

  /// What the file calls a key that is named as if its numbers begin with 1.
  std::string key_of(const char* named) const {
    std::string key = named;
    if (begins_with_0_ && key.back() >= '1' && key.back() <= '3') --key.back();
    return key;
  }

  /// The first of the keys that holds a numeric matrix (or a list, or a number), as double; empty
  /// if none does.
  cv::Mat matrix(Keys keys) const {
    for (const char* const named : keys) {
      const std::string key = key_of(named);
      const cv::FileNode node = node_of(key);
      cv::Mat value = numbers(node);
      if (node.isMap()) {
        require_small(node, key.c_str());
        node >> value;
      }
      if (value.empty() || value.channels() != 1) continue;
      value.convertTo(value, CV_64F);
      if (!cv::checkRange(value)) {
        document_.fail("The matrix " + key + " holds a number that is not finite", "correct it");
      }
      return value.reshape(1, value.rows);
    }
    return {};
  }

  cv::Mat required(Keys keys, int elements, const char* what) const {
    cv::Mat value = matrix(keys);
    if (value.empty() || static_cast<int>(value.total()) < elements) {
      document_.fail(std::string("The ") + what + " (" + *keys.begin() + ", at least " +
                         std::to_string(elements) + " numbers) is missing",
                     "add it");
    }
    return value;
  }

  cv::Size image_size() const {
    const cv::Mat both = matrix({"image_size", "imageSize", "img_size"});
    const cv::Mat width = matrix({"image_width", "width", "image_Width"});
    const cv::Mat height = matrix({"image_height", "height", "image_Height"});
    if (both.total() == 2) return size_of(both.at<double>(0), both.at<double>(1));
    if (!both.empty()) refuse_size();
    if (width.empty() != height.empty()) {
      const char* missing = width.empty() ? "width" : "height";
      document_.fail(std::string("It has one side of its images without their ") + missing,
                     std::string("add image_") + missing);
    }
    return width.empty() ? cv::Size() : size_of(width.at<double>(0), height.at<double>(0));
  }

 private:
  /// At the top level, or in the one map there that has the key: of several it would be of one
  /// camera among others.
  cv::FileNode node_of(const std::string& key) const {
    const cv::FileNode top = file_[key];
    cv::FileNode found;
    if (!top.empty()) return top;
    for (const cv::FileNode& map : file_.root()) {
      if (!map.isMap() || map[key].empty()) continue;
      if (!found.empty()) return {};
      found = map[key];
    }
    return found;
  }
  static bool is_number(const cv::FileNode& node) { return node.isReal() || node.isInt(); }

  /// A number, a list as OpenCV writes a cv::Size, cv::Vec or std::vector, or a list of rows as
  /// others write a matrix; empty otherwise.
  static cv::Mat numbers(const cv::FileNode& node) {
    if (is_number(node)) return cv::Mat(1, 1, CV_64F, cv::Scalar(node.real()));
    if (!node.isSeq()) return {};
    const bool has_rows = node.size() > 0 && (*node.begin()).isSeq();
    std::vector<double> values;
    cv::Mat rows;
    for (const cv::FileNode& element : node) {
      if (has_rows) {
        const cv::Mat row = element.isSeq() ? numbers(element).t() : cv::Mat();
        if (row.rows != 1 || (!rows.empty() && row.cols != rows.cols)) return {};
        rows.push_back(row);
      } else if (is_number(element)) {
        values.push_back(element.real());
      } else {
        return {};
      }
    }
    return has_rows ? rows : cv::Mat(values, true);
  }

  /// A damaged header must not make OpenCV allocate gigabytes.
  void require_small(const cv::FileNode& node, const char* key) const {
    constexpr double largest_side = 64;
    for (const char* side : {"rows", "cols"}) {
      const double count = node[side].isInt() ? node[side].real() : -1;
      if (count < 0 || count > largest_side) {
        document_.fail(std::string("The matrix ") + key + " has an impossible number of " + side,
                       "correct it");
      }
    }
  }

  cv::Size size_of(double width, double height) const {
    const std::optional<int> columns = whole_number(width);
    const std::optional<int> rows = whole_number(height);
    if (!columns || !rows) refuse_size();
    return {*columns, *rows};
  }

  [[noreturn]] void refuse_size() const {
    document_.fail("The image size is not a pair of whole numbers of pixels", "correct it");
  }

  const Document& document_;
  cv::FileStorage file_;
  bool begins_with_0_ = false;
};

/// One camera's name and keys.
struct CameraKeys {
  const char* name;
  Keys k, d, xi;
};

/// What is of the first camera, or the only one, of the second, and between them.
constexpr Keys first_matrix = {"K1",
                               "M1",
                               "cameraMatrix1",
                               "camera_matrix_1",
                               "K_left",
                               "camera_matrix_left",
                               "cameraMatrixL",
                               "K",
                               "camera_matrix",
                               "Camera_Matrix",
                               "cameraMatrix"};
constexpr Keys second_matrix = {
    "K2",           "M2", "cameraMatrix2", "camera_matrix_2", "K_right", "camera_matrix_right",
    "cameraMatrixR"};
constexpr Keys third_matrix = {"K3", "M3", "cameraMatrix3", "camera_matrix_3"};
constexpr Keys first_distortion = {"D1",
                                   "distCoeffs1",
                                   "dist_coeffs_1",
                                   "distortion_coefficients_1",
                                   "D_left",
                                   "distortion_left",
                                   "dist_coeffs_left",
                                   "distCoeffsL",
                                   "D",
                                   "distortion_coefficients",
                                   "Distortion_Coefficients",
                                   "distCoeffs"};
constexpr Keys second_distortion = {
    "D2",      "distCoeffs2",      "dist_coeffs_2",     "distortion_coefficients_2",
    "D_right", "distortion_right", "dist_coeffs_right", "distCoeffsR"};
constexpr Keys rotation_keys = {"R", "rotation", "R_stereo", "rvec", "om"};
constexpr Keys first_xi = {"xi1", "xi_1", "xi_left", "xi"};
constexpr Keys second_xi = {"xi2", "xi_2", "xi_right"};

constexpr int kannala_brandt_coefficients = 4;

/// A camera of cv::omnidir whose xi is overlooked would be taken for one of cv::fisheye.
void require_known_xi(const Document& document, const Storage& storage) {
  const auto holds_number = [&storage](const std::string& key) {
    for (const Keys keys : {first_xi, second_xi}) {
      for (const char* const named : keys) {
        if (storage.key_of(named) == key) return storage.matrix({named}).total() == 1;
      }
    }
    return false;
  };
  for (const std::string& key : storage.keys()) {
    const std::string start = key.substr(0, 2);
    if (start != "xi" && start != "Xi" && start != "XI") continue;
    if (holds_number(key)) continue;
    document.fail("The xi of a camera must be a number by the name xi, " + storage.key_of("xi1") +
                      " or " + storage.key_of("xi2"),
                  "correct " + key);
  }
}

/// A camera's model and its coefficients.
Camera read_lens(const Document& document, const Storage& storage, const CameraKeys& keys) {
  const std::string what = std::string(keys.name) + ": The distortion (" + *keys.d.begin() + ")";
  const cv::Mat_<double> row =
      storage.required(keys.d, kannala_brandt_coefficients, "distortion").reshape(1, 1);
  const std::vector<double> c(row.begin(), row.end());
  const cv::Mat xi = storage.matrix(keys.xi);
  Camera camera;
  if (!xi.empty()) {
    require_zero(document, what, std::span(c).subspan(4),
                 "cv::omnidir has four, k1 k2 p1 p2: calibrate with it");
    camera.model = CameraModel::mei;
    camera.xi = xi.at<double>(0);
    camera.k1 = c[0];
    camera.k2 = c[1];
    camera.p1 = c[2];
    camera.p2 = c[3];
    return camera;
  }
  // Files of cv::stereoCalibrate have five or more; those of one camera may say it.
  const bool four = c.size() == kannala_brandt_coefficients;
  const cv::Mat says_fisheye = storage.matrix({"fisheye_model"});
  const bool fisheye = says_fisheye.total() == 1 ? says_fisheye.at<double>(0) != 0 : four;
  if (fisheye && !four) {
    document.fail(what + " has " + std::to_string(c.size()) +
                      " coefficients, but fisheye_model asks for the four of cv::fisheye",
                  "correct what is wrong");
  }
  if (!fisheye) return rational_camera(document, what, c);
  set_fisheye(camera, c);
  return camera;
}

Camera read_camera(const Document& document, const Storage& storage, const CameraKeys& keys,
                   cv::Size size) {
  const std::string what = std::string(keys.name) + ": The camera matrix (" + *keys.k.begin() + ")";
  cv::Mat k = storage.required(keys.k, 9, "camera matrix");
  if (k.total() != 9) {
    document.fail(
        what + " is " + std::to_string(k.rows) + "x" + std::to_string(k.cols) + " instead of 3x3",
        "correct it");
  }
  k = k.reshape(1, 3);
  Camera camera = read_lens(document, storage, keys);
  camera.width = size.width;
  camera.height = size.height;
  Eigen::Matrix3d matrix;
  cv::cv2eigen(k, matrix);
  set_matrix(camera, document, what, matrix);
  return camera;
}

/// How large images are, compared to the given ones, of whose sides all principal points are the
/// middle; none where they tell different sizes.
std::optional<double> share_by_centres(const Rig& rig) {
  constexpr double tolerance = 0.04;
  std::vector<double> shares;
  for (const View& view : rig.views) {
    const Camera& c = view.camera;
    shares.push_back((c.cx + 0.5) / (c.width / 2.0));
    shares.push_back((c.cy + 0.5) / (c.height / 2.0));
  }
  const auto [least, most] = std::ranges::minmax(shares);
  const double share = (least + most) / 2;
  if (!(share > 0 && most - share <= tolerance * share)) return std::nullopt;
  return share;
}

/// A file without a size may be for images of another one.
void require_centres(const Document& document, const Rig& rig) {
  constexpr double same = 0.1;
  constexpr double least = 0.42;  // of the side
  const char* const remedy =
      "add image_width and image_height, those of the images it was made with";
  const Camera& first = rig.views[0].camera;
  const double share = share_by_centres(rig).value_or(1);
  const std::optional<int> width = whole_number(std::round(share * first.width));
  const std::optional<int> height = whole_number(std::round(share * first.height));
  if (std::abs(share - 1) > same && width && height) {
    document.fail(
        "It has no image size, and by its principal points it was likely made for images of "
        "about " +
            size_text(*width, *height) + " pixels, while the given ones have " +
            size_text(first.width, first.height),
        std::string(remedy) + ", and `calibration convert --scale` then makes one for the given");
  }
  const auto is_near_middle = [](double centre, int side) {
    return centre > least * side && centre < (1 - least) * side;
  };
  for (const View& view : rig.views) {
    const Camera& c = view.camera;
    if (is_near_middle(c.cx, c.width) && is_near_middle(c.cy, c.height)) continue;
    document.fail("It has no image size, and the principal point of " + view.name +
                      " is not near the middle of the given images of " +
                      size_text(c.width, c.height) + " pixels",
                  remedy);
  }
}

/// A key of ours, one number for each camera.
void limit_fields_of_view(Rig& rig, const Document& document, const Storage& storage) {
  const cv::Mat degrees = storage.matrix({max_theta_key});
  if (degrees.empty()) return;
  if (degrees.total() != rig.views.size()) {
    document.fail(std::string(max_theta_key) + " must hold one number for each camera",
                  "correct it");
  }
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    rig.views[i].camera.max_theta = degrees.at<double>(static_cast<int>(i)) * radians_per_degree;
  }
}

Eigen::Isometry3d second_from_first(const Storage& storage, const Document& document) {
  // As OpenCV's sample of stereo with cv::omnidir has them.
  const cv::Mat both = storage.matrix({"extrinsic_parameters"});
  const auto part = [&](Keys keys, int first, const char* what) {
    const bool in_both = both.total() == 6 && storage.matrix(keys).empty();
    return in_both ? both.reshape(1, 1).colRange(first, first + 3)
                   : storage.required(keys, 3, what);
  };
  if (both.empty() && storage.matrix(rotation_keys).empty()) {
    document.fail("It has two cameras without the rotation (R) and translation (T) between them",
                  "add those, as from the other file of OpenCV's stereo calibration");
  }
  cv::Mat rotation = part(rotation_keys, 0, "rotation");
  if (rotation.total() == 3) cv::Rodrigues(rotation.clone().reshape(1, 3), rotation);
  const cv::Mat translation = part({"T", "t", "tvec", "translation"}, 3, "translation");
  if (translation.total() != 3) {
    document.fail("The translation (T) has " + std::to_string(translation.total()) +
                      " numbers instead of three",
                  "correct it");
  }
  if (rotation.rows != 3 || rotation.cols != 3)
    document.fail("The rotation R must be 3x3", "correct it");
  Eigen::Matrix3d r;
  cv::cv2eigen(rotation, r);
  const cv::Mat_<double> t = translation.reshape(1, 1);
  return rigid(document, "R and T", r, {t(0), t(1), t(2)});
}

}  // namespace

bool has_opencv_matrix(const Document& document) {
  const std::string lines = "\n" + document.text;
  for (const Keys keys : {first_matrix, matrix_0}) {
    for (const std::string key : keys) {
      for (const std::string& written : {"\n" + key + ":", "\"" + key + "\""}) {
        if (lines.find(written) != std::string::npos) return true;
      }
    }
  }
  return false;
}

Rig read_opencv(const Document& document, cv::Size image_size) {
  try {
    const Storage storage(document);
    if (storage.matrix(first_matrix).empty()) {
      document.fail("It has no camera matrix (K1 or M1, K or camera_matrix)",
                    "one file must hold both, their distortions, R and T");
    }
    const cv::Size in_file = storage.image_size();
    const cv::Size size = in_file.empty() ? image_size : in_file;
    if (size.empty()) {
      document.fail("It holds no image size, so that it only does where images are given",
                    "add image_width and image_height");
    }
    if (!in_file.empty() && !image_size.empty() && in_file != image_size) {
      document.fail("It is for images of " + size_text(in_file.width, in_file.height) +
                        " pixels, the given ones have " +
                        size_text(image_size.width, image_size.height),
                    remedy_of_size(image_size, in_file));
    }
    require_known_xi(document, storage);
    if (!storage.matrix(third_matrix).empty()) {
      document.fail("It has three cameras, but R and T are those of two",
                    "give two, or a rig of more as a Kalibr camchain");
    }
    Rig rig;
    rig.views.resize(2);
    rig.views[0].name = "cam0";
    rig.views[1].name = "cam1";
    rig.views[0].camera =
        read_camera(document, storage, {"cam0", first_matrix, first_distortion, first_xi}, size);
    if (storage.matrix(second_matrix).empty()) {
      if (!storage.matrix(second_xi).empty()) {
        document.fail("It has the second camera's xi without its matrix (K2)", "add it");
      }
      rig.views.pop_back();
      if (in_file.empty()) require_centres(document, rig);
      limit_fields_of_view(rig, document, storage);
      return rig;
    }
    rig.views[1].camera =
        read_camera(document, storage, {"cam1", second_matrix, second_distortion, second_xi}, size);
    if ((rig.views[0].camera.model == CameraModel::mei) !=
        (rig.views[1].camera.model == CameraModel::mei)) {
      document.fail("It has a xi of one camera alone", "add the other's (xi1, xi2), or remove it");
    }
    if (in_file.empty()) require_centres(document, rig);
    rig.views[1].world_from_camera = second_from_first(storage, document).inverse();
    limit_fields_of_view(rig, document, storage);
    return rig;
  } catch (const cv::Exception& error) {
    document.fail("OpenCV cannot read it (" + error.err + ")", "correct it there");
  } catch (const std::logic_error& error) {
    // What its parsers do with texts that they do not foresee, such as keys without a name.
    document.fail(std::string("OpenCV cannot read it (") + error.what() + ")", "correct it there");
  }
}

}  // namespace widestereo::calibration
