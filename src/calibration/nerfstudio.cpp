// SPDX-License-Identifier: MIT
#include "calibration/nerfstudio.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/core.hpp>
#include <string>
#include <tuple>
#include <utility>

#include "calibration/document.h"
#include "calibration/json_document.h"
#include "text/file_type.h"
#include "text/lower_case.h"
#include "text/number.h"
#include "text/text_input.h"
#include "widestereo/image_io.h"

namespace widestereo::calibration {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::json;

constexpr std::pair<const char*, double Camera::*> coefficient_keys[] = {
    {"k1", &Camera::k1},  {"k2", &Camera::k2},  {"k3", &Camera::k3},  {"k4", &Camera::k4},
    {"p1", &Camera::p1},  {"p2", &Camera::p2},  {"k5", &Camera::k5},  {"k6", &Camera::k6},
    {"sx1", &Camera::s1}, {"sx2", &Camera::s2}, {"sy1", &Camera::s3}, {"sy2", &Camera::s4}};
/// Stands for them: the first six, or all of Project Aria's cameras in their own order.
constexpr const char* coefficient_list = "distortion_params";
constexpr std::size_t listed_coefficients = 6;
constexpr const char* camera_keys[] = {
    "camera_model",   "is_fisheye",    "w", "h", "cx", "cy", "fl_x", "fl_y", "camera_angle_x",
    "camera_angle_y", coefficient_list};
constexpr const char* aria_name = "FISHEYE624";
/// By these Instant NGP chooses other lenses, which have no such focal length.
constexpr const char* lens_keys[] = {"ftheta_p0", "ftheta_p1", "ftheta_p2",       "ftheta_p3",
                                     "ftheta_p4", "latlong",   "equirectangular", "orthographic"};

/// nerfstudio's model of this name has k3, which COLMAP's has not.
const ColmapModel& radial_tangential() {
  using C = Camera;
  static const ColmapModel model = {
      "OPENCV", 2, CameraModel::pinhole_radtan, {&C::k1, &C::k2, &C::p1, &C::p2, &C::k3}};
  return model;
}

const ColmapModel* find_model(const std::string& name) {
  if (name == radial_tangential().name) return &radial_tangential();
  return find_colmap_model(name == aria_name ? "RAD_TAN_THIN_PRISM_FISHEYE" : name);
}

bool has_frames(const Json& root) {
  return root.is_object() && root.contains("frames") && root["frames"].is_array();
}

/// Finds a list "frames" of the outermost object without keeping anything, and stops there: files
/// of other kinds may be large.
class FrameFinder : public nlohmann::json_sax<Json> {
 public:
  bool found() const { return found_; }

  bool key(string_t& name) override {
    is_frames_ = depth_ == 1 && name == "frames";
    return true;
  }
  bool start_object(std::size_t /*elements*/) override {
    ++depth_;
    return value();
  }
  bool end_object() override {
    --depth_;
    return true;
  }
  bool start_array(std::size_t /*elements*/) override {
    found_ = is_frames_;
    ++depth_;
    return !found_;
  }
  bool end_array() override { return end_object(); }
  bool null() override { return value(); }
  bool boolean(bool /*value*/) override { return value(); }
  bool number_integer(number_integer_t /*value*/) override { return value(); }
  bool number_unsigned(number_unsigned_t /*value*/) override { return value(); }
  bool number_float(number_float_t /*value*/, const string_t& /*text*/) override { return value(); }
  bool string(string_t& /*value*/) override { return value(); }
  bool binary(binary_t& /*value*/) override { return value(); }
  bool parse_error(std::size_t /*position*/, const std::string& /*token*/,
                   const nlohmann::detail::exception& /*error*/) override {
    return false;
  }

 private:
  bool value() {
    is_frames_ = false;
    return true;
  }

  int depth_ = 0;
  bool is_frames_ = false;  ///< what comes next
  bool found_ = false;
};

/// What writers leave empty is not there.
void remove_nulls(Json& object) {
  if (!object.is_object()) return;
  for (auto member = object.begin(); member != object.end();) {
    member = member->is_null() ? object.erase(member) : std::next(member);
  }
}

class Reader {
 public:
  explicit Reader(const fs::path& file) : document_{file, {}} {
    try {
      root_ = parsed_json<Json>({file, TextInput(file).rest()});
    } catch (const Json::exception& error) {
      document_.fail(std::string("It is not valid JSON (") + error.what() + ")",
                     "correct it there, or copy it again");
    }
    if (!has_frames(root_))
      document_.fail("It has no list \"frames\"", "it may be damaged: copy it again");
    if (root_["frames"].empty()) document_.fail("Its list \"frames\" is empty", "add the images");
    remove_nulls(root_);
    for (Json& frame : root_["frames"]) remove_nulls(frame);
  }

  Transforms read() const {
    Transforms transforms;
    for (std::size_t i = 0; i < root_["frames"].size(); ++i) {
      const Json& frame = root_["frames"][i];
      if (!frame.is_object()) fail(i, "It is no object", "correct it");
      ColmapImage image = image_of(frame, i);
      const bool has_own =
          std::any_of(std::begin(camera_keys), std::end(camera_keys),
                      [&frame](const char* key) { return frame.contains(key); }) ||
          std::any_of(std::begin(coefficient_keys), std::end(coefficient_keys),
                      [&frame](const auto& key) { return frame.contains(key.first); });
      image.camera = has_own ? i + 1 : 0;
      if (!transforms.cameras.contains(image.camera)) {
        transforms.cameras.emplace(image.camera, camera_of(frame, i, image.name));
      }
      transforms.images.push_back(std::move(image));
    }
    return transforms;
  }

 private:
  [[noreturn]] void fail(std::size_t frame, const std::string& finding,
                         const std::string& remedy) const {
    document_.fail("Frame " + std::to_string(frame) + ": " + finding, remedy);
  }

  /// The frame's own value, else that of all frames; null where there is none.
  const Json* find(const Json& frame, const char* key) const {
    if (frame.contains(key)) return &frame[key];
    return root_.contains(key) ? &root_[key] : nullptr;
  }

  bool has(const Json& frame, const char* key) const { return find(frame, key) != nullptr; }

  double number(const Json& frame, std::size_t i, const char* key) const {
    const Json* value = find(frame, key);
    const std::string name = std::string("\"").append(key) + "\"";
    if (value == nullptr) fail(i, "The number " + name + " is missing", "add it");
    if (!value->is_number()) fail(i, name + " is no number", "write it without quotes or brackets");
    return value->get<double>();
  }

  double number_or(double otherwise, const Json& frame, std::size_t i, const char* key) const {
    return has(frame, key) ? number(frame, i, key) : otherwise;
  }

  /// Of one axis; NeRF's data sets state the angle of view instead.
  double focal_length(const Json& frame, std::size_t i, const char* key, const char* angle_key,
                      double side) const {
    if (has(frame, key) || !has(frame, angle_key)) return number(frame, i, key);
    const double angle = number(frame, i, angle_key);
    if (!(angle > 0 && angle < std::numbers::pi)) {
      fail(i, std::string("\"").append(angle_key).append("\" is ").append(text_of(angle)),
           "give radians, less than pi");
    }
    return side / 2 / std::tan(angle / 2);
  }

  std::string model_name(const Json& frame, std::size_t i) const {
    for (const char* key : lens_keys) {
      const Json* value = find(frame, key);
      if (value == nullptr || *value == false || *value == 0) continue;
      fail(i, "The lens that \"" + std::string(key) + "\" stands for is not supported",
           "give a camera_model instead");
    }
    const Json* fisheye = find(frame, "is_fisheye");
    std::string name = fisheye != nullptr && *fisheye == true ? "OPENCV_FISHEYE" : "OPENCV";
    if (const Json* given = find(frame, "camera_model")) {
      if (!given->is_string()) fail(i, "\"camera_model\" is no string", "correct it");
      name = given->get<std::string>();
    }
    return name;
  }

  /// In a camera that has nothing else; those of a list in this order.
  Camera coefficients(const Json& frame, std::size_t i,
                      const std::vector<double Camera::*>& listed) const {
    Camera camera;
    const Json* list = find(frame, coefficient_list);
    for (const auto& [key, member] : coefficient_keys) {
      if (list != nullptr && has(frame, key)) {
        fail(i, std::string("It has both \"") + coefficient_list + "\" and \"" + key + "\"",
             "remove what is not meant");
      }
      camera.*member = number_or(0, frame, i, key);
    }
    if (list == nullptr) return camera;
    const bool complete = list->is_array() && list->size() == listed.size() &&
                          std::all_of(list->begin(), list->end(),
                                      [](const Json& value) { return value.is_number(); });
    if (!complete) {
      fail(i,
           std::string("\"") + coefficient_list + "\" is no list of " +
               std::to_string(listed.size()) + " numbers, as its camera model has",
           "correct it");
    }
    for (std::size_t k = 0; k < listed.size(); ++k) camera.*listed[k] = (*list)[k].get<double>();
    return camera;
  }

  /// Focal lengths and principal point.
  std::vector<double> pinhole_parameters(const Json& frame, std::size_t i, const ColmapModel& model,
                                         const ColmapCamera& camera) const {
    std::vector<double> parameters = {
        focal_length(frame, i, "fl_x", "camera_angle_x", camera.width)};
    if (model.focal_lengths == 2) {
      const bool has_fy = has(frame, "fl_y") || has(frame, "camera_angle_y");
      parameters.push_back(has_fy ? focal_length(frame, i, "fl_y", "camera_angle_y", camera.height)
                                  : parameters.front());
    }
    parameters.push_back(number_or(camera.width / 2, frame, i, "cx"));
    parameters.push_back(number_or(camera.height / 2, frame, i, "cy"));
    return parameters;
  }

  /// Width and height in pixels; NeRF's data sets leave them to the image.
  std::pair<double, double> size_of(const Json& frame, std::size_t i,
                                    const std::string& image) const {
    if (has(frame, "w") || has(frame, "h")) return {number(frame, i, "w"), number(frame, i, "h")};
    const fs::path file = document_.path.parent_path() / image;
    if (type_of(file) == fs::file_type::not_found) {
      fail(i,
           "\"w\" and \"h\", the width and height of the images in pixels, are missing, and there "
           "is no " +
               file.string() + ", which would tell them",
           "add them");
    }
    const cv::Size size = read_image(file).size();
    return {size.width, size.height};
  }

  /// Of the frame that the image of this path is of.
  ColmapCamera camera_of(const Json& frame, std::size_t i, const std::string& image) const {
    const std::string name = model_name(frame, i);
    const ColmapModel* model = find_model(name);
    const auto has_key = [](double Camera::*member) {
      return std::any_of(std::begin(coefficient_keys), std::end(coefficient_keys),
                         [member](const auto& key) { return key.second == member; });
    };
    if (model == nullptr ||
        !std::all_of(model->coefficients.begin(), model->coefficients.end(), has_key)) {
      fail(i, "The camera model " + name + " is not supported",
           std::string("OPENCV_FISHEYE, OPENCV, PINHOLE, ") + aria_name +
               " and EQUIRECTANGULAR are");
    }
    ColmapCamera camera;
    camera.model = model;
    std::tie(camera.width, camera.height) = size_of(frame, i, image);
    if (model->equivalent == CameraModel::equirectangular) {
      // Whatever focal lengths writers invent for a whole sphere.
      camera.parameters = {camera.width, camera.height};
    } else {
      camera.parameters = pinhole_parameters(frame, i, *model, camera);
    }
    std::vector<double Camera::*> listed;
    for (std::size_t k = 0; k < listed_coefficients; ++k) {
      listed.push_back(coefficient_keys[k].second);
    }
    const bool of_aria = model->equivalent == CameraModel::rad_tan_thin_prism_fisheye;
    Camera given = coefficients(frame, i, of_aria ? model->coefficients : listed);
    for (double Camera::*member : model->coefficients) {
      camera.parameters.push_back(std::exchange(given.*member, 0));
    }
    if (std::any_of(std::begin(coefficient_keys), std::end(coefficient_keys),
                    [&given](const auto& key) { return given.*key.second != 0; })) {
      fail(i, "There are coefficients that the camera model " + name + " does not have",
           "correct either");
    }
    return camera;
  }

  ColmapImage image_of(const Json& frame, std::size_t i) const {
    const auto text = [&](const char* key) {
      if (!frame.contains(key) || !frame[key].is_string()) {
        fail(i, "The string \"" + std::string(key) + "\" is missing", "add it");
      }
      return fs::path(frame[key].get<std::string>()).lexically_normal();
    };
    ColmapImage image;
    fs::path name = text("file_path");
    // As NeRF's data sets name PNGs.
    if (!name.has_extension()) name += ".png";
    image.name = name.generic_string();
    if (frame.contains("mask_path")) image.mask = document_.path.parent_path() / text("mask_path");
    image.camera_from_world = pose_of(frame, i).inverse();
    return image;
  }

  /// Of the camera, to world; the file's cameras look along -z, with y up.
  Eigen::Isometry3d pose_of(const Json& frame, std::size_t i) const {
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    const Json rows = frame.value("transform_matrix", Json());
    bool complete = rows.is_array() && (rows.size() == 3 || rows.size() == 4);
    for (int y = 0; complete && y < static_cast<int>(rows.size()); ++y) {
      complete = rows[y].is_array() && rows[y].size() == 4;
      for (int x = 0; complete && x < 4; ++x) {
        complete = rows[y][x].is_number();
        if (complete) matrix(y, x) = rows[y][x].get<double>();
      }
    }
    if (!complete)
      fail(i, "\"transform_matrix\" (4x4 numbers) is missing or incomplete", "add all of it");
    const Eigen::Matrix3d axes = Eigen::Vector3d(1, -1, -1).asDiagonal();
    const std::string what = "The transform_matrix of frame " + std::to_string(i);
    require_last_row(document_, what, matrix.row(3));
    return rigid(document_, what, matrix.topLeftCorner<3, 3>() * axes,
                 matrix.topRightCorner<3, 1>());
  }

  Document document_;
  Json root_;
};

}  // namespace

bool is_transforms_file(const fs::path& path) {
  std::error_code ignored;
  if (extension_of(path) != ".json" || !fs::is_regular_file(path, ignored)) return false;
  FrameFinder frames;
  Json::sax_parse(TextInput(path).rest(), &frames);
  return frames.found();
}

Transforms read_transforms(const fs::path& file) { return Reader(file).read(); }

}  // namespace widestereo::calibration
