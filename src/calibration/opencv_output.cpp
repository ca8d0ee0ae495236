// SPDX-License-Identifier: MIT
#include <Eigen/Dense>
#include <algorithm>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/core/persistence.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calibration/formats.h"
#include "geometry/angle.h"
#include "geometry/validation.h"
#include "text/lower_case.h"
#include "widestereo/error.h"
#include "widestereo/files.h"

namespace widestereo {
namespace calibration {
namespace {

struct OpenCvForm {
  std::vector<double> coefficients;
  std::optional<double> xi = std::nullopt;  ///< of cv::omnidir

  bool is_fisheye() const { return !xi && coefficients.size() == 4; }
  bool is_of_one_kind_with(const OpenCvForm& other) const {
    return xi.has_value() == other.xi.has_value() && is_fisheye() == other.is_fisheye();
  }
};

/// None where neither cv::fisheye nor cv::omnidir nor OpenCV's pinhole has the model.
std::optional<OpenCvForm> form_of(const Camera& c) {
  switch (c.model) {
    case CameraModel::kannala_brandt:
      return OpenCvForm{{c.k1, c.k2, c.k3, c.k4}};
    case CameraModel::mei:
    case CameraModel::unified:
      if (c.k3 != 0) return std::nullopt;
      return OpenCvForm{{c.k1, c.k2, c.p1, c.p2}, c.xi};
    case CameraModel::pinhole:
    case CameraModel::pinhole_radtan:
      if (c.skew != 0) return std::nullopt;  // which cv::projectPoints() ignores
      // Five, as four would be cv::fisheye's.
      return OpenCvForm{{c.k1, c.k2, c.p1, c.p2, c.k3}};
    case CameraModel::pinhole_rational:
      if (c.skew != 0) return std::nullopt;
      return OpenCvForm{{c.k1, c.k2, c.p1, c.p2, c.k3, c.k4, c.k5, c.k6, c.s1, c.s2, c.s3, c.s4}};
    default:
      return std::nullopt;
  }
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
  throw Error("Cannot write " + path.string() + ": " + what);
}

OpenCvForm opencv_form(const View& view, const std::filesystem::path& path) {
  const std::optional<OpenCvForm> form = form_of(view.camera);
  if (!form) fail(path, no_form(view, CalibrationFormat::opencv));
  return *form;
}

void require_form(const Rig& rig, const std::vector<OpenCvForm>& forms,
                  const std::filesystem::path& path) {
  if (rig.views.size() > 2) {
    fail(path, "OpenCV's calibrations are of two cameras at most, but the rig has " +
                   std::to_string(rig.views.size()) + "; choose Kalibr's or Basalt's format.");
  }
  if (rig.world_from_imu) {
    fail(path,
         "OpenCV's calibrations cannot say where the IMU is; choose Kalibr's or Basalt's "
         "format, or leave the IMU out of what is read.");
  }
  for (const View& view : rig.views) {
    if (view.imu_time_offset == 0) continue;
    fail(
        path,
        "OpenCV's calibrations cannot say how the IMU's clock differs; choose Kalibr's or Basalt's "
        "format, or leave the time offset out of what is read.");
  }
  const Camera& first = rig.views.front().camera;
  const Camera& last = rig.views.back().camera;
  if (first.width != last.width || first.height != last.height) {
    fail(path,
         "OpenCV calibrates cameras of one image size with each other; choose Kalibr's or "
         "Basalt's format.");
  }
  if (!forms.front().is_of_one_kind_with(forms.back())) {
    fail(path, "OpenCV calibrates cameras of one kind with each other, but " +
                   rig.views.front().name + " is " + to_string(first.model) + " and " +
                   rig.views.back().name + " is " + to_string(last.model) +
                   "; choose Kalibr's format.");
  }
}

int language_of(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (extension == ".xml") return cv::FileStorage::FORMAT_XML;
  return extension == ".json" ? cv::FileStorage::FORMAT_JSON : cv::FileStorage::FORMAT_YAML;
}

cv::Mat column(const std::vector<double>& numbers) { return cv::Mat(numbers, true); }

void write_camera(cv::FileStorage& file, const Camera& c, const OpenCvForm& form,
                  const std::string& number) {
  file << "K" + number << cv::Mat(cv::Matx33d(c.fx, c.skew, c.cx, 0, c.fy, c.cy, 0, 0, 1));
  file << "D" + number << column(form.coefficients);
  if (form.xi) file << "xi" + number << *form.xi;
}

}  // namespace

bool has_opencv_form(const Camera& camera) { return form_of(camera).has_value(); }

}  // namespace calibration

std::string opencv_text(const std::filesystem::path& path, const Rig& rig) {
  using namespace calibration;
  validate(rig, "Cannot write " + path.string() + ": the rig");
  std::vector<OpenCvForm> forms;
  for (const View& view : rig.views) forms.push_back(opencv_form(view, path));
  require_form(rig, forms, path);
  cv::FileStorage file("", cv::FileStorage::WRITE | cv::FileStorage::MEMORY | language_of(path));
  const Camera& first = rig.views.front().camera;
  file << "image_width" << first.width << "image_height" << first.height;
  const bool is_pair = rig.views.size() == 2;
  for (std::size_t i = 0; i < forms.size(); ++i) {
    write_camera(file, rig.views[i].camera, forms[i], is_pair ? std::to_string(i + 1) : "");
  }
  if (is_pair) {
    const Eigen::Isometry3d motion = source_from_reference(rig.views[1], rig.views[0]);
    cv::Mat rotation;
    cv::eigen2cv(Eigen::Matrix3d(motion.linear()), rotation);
    const Eigen::Vector3d t = motion.translation();
    file << "R" << rotation << "T" << column({t.x(), t.y(), t.z()});
  }
  const auto is_limited = [](const View& view) { return view.camera.max_theta < std::numbers::pi; };
  if (std::any_of(rig.views.begin(), rig.views.end(), is_limited)) {
    std::vector<double> limits;
    for (const View& view : rig.views) limits.push_back(view.camera.max_theta * degrees_per_radian);
    file << max_theta_key << limits;
  }
  return file.releaseAndGetString();
}

void write_opencv(const std::filesystem::path& path, const Rig& rig) {
  write_text(path, opencv_text(path, rig));
}

}  // namespace widestereo
