// SPDX-License-Identifier: MIT
#include "widestereo/rig.h"

#include "widestereo/error.h"

namespace widestereo {

bool is_masked(const View& view, const Eigen::Vector2d& position) {
  if (view.mask.empty()) return false;
  const cv::Point nearest(cvRound(position.x()), cvRound(position.y()));
  return !nearest.inside({{}, view.mask.size()}) || view.mask.at<uchar>(nearest) == 0;
}

void require_calibrated_size(const cv::Mat& map, const View& view, const std::string& name) {
  const Camera& camera = view.camera;
  if (map.cols == camera.width && map.rows == camera.height) return;
  throw Error(name + " is " + std::to_string(map.cols) + "x" + std::to_string(map.rows) +
              " pixels, but the calibration of " + view.name + " is for " +
              std::to_string(camera.width) + "x" + std::to_string(camera.height) +
              "; use images of the calibrated size.");
}

}  // namespace widestereo
