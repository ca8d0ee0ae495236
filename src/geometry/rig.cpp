// SPDX-License-Identifier: MIT
#include "widestereo/rig.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "geometry/validation.h"
#include "text/size_text.h"
#include "widestereo/error.h"

namespace widestereo {

View resized(const View& view, int width, int height) {
  require_fitting_mask(view.mask, view.camera, view.name);
  View result = view;
  result.camera = resized(view.camera, width, height);
  const cv::Size size(width, height);
  if (view.mask.empty() || view.mask.size() == size) return result;
  // In floats, where the share of one excluded pixel among however many is not rounded off.
  cv::Mat excluded;
  cv::Mat(view.mask == 0).convertTo(excluded, CV_32F);
  cv::resize(excluded, excluded, size, 0, 0, cv::INTER_AREA);
  result.mask = excluded == 0;
  return result;
}

Eigen::Vector3d local_origin(const View& view) {
  constexpr double far = 1e4;  // metres, where neighbours in single precision are 1 mm apart
  // So coarse that it stays, and with it what was matched, when another image comes first.
  constexpr double step = 1e3;
  return view.world_from_camera.translation().unaryExpr([](double coordinate) {
    return std::abs(coordinate) < far ? 0 : step * std::round(coordinate / step);
  });
}

bool is_masked(const View& view, const Eigen::Vector2d& position) {
  if (view.mask.empty()) return false;
  const cv::Point nearest(cvRound(position.x()), cvRound(position.y()));
  return !nearest.inside({{}, view.mask.size()}) || view.mask.at<uchar>(nearest) == 0;
}

void require_calibrated_size(const cv::Mat& map, const View& view, const std::string& name) {
  require_pixels(map, name);
  require_two_dimensions(map, name);
  const cv::Size calibrated(view.camera.width, view.camera.height);
  if (map.size() == calibrated) return;
  throw Error(name + " is " + size_text(map.cols, map.rows) + " pixels, but the calibration of " +
              view.name + " is for " + size_text(calibrated.width, calibrated.height) + "; " +
              remedy_of_size(map.size(), calibrated) + ".");
}

void require_mask_size(const cv::Mat& mask, const View& view, const std::string& name) {
  const cv::Size image(view.camera.width, view.camera.height);
  if (mask.size() == image) return;
  throw Error(name + " is " + size_text(mask.cols, mask.rows) + " pixels, but the images of " +
              view.name + " have " + size_text(image.width, image.height) +
              "; give a mask of that size.");
}

}  // namespace widestereo
