// SPDX-License-Identifier: MIT
#include "widestereo/rig.h"

namespace widestereo {

bool is_masked(const View& view, const Eigen::Vector2d& position) {
  if (view.mask.empty()) return false;
  const cv::Point nearest(cvRound(position.x()), cvRound(position.y()));
  return !nearest.inside({{}, view.mask.size()}) || view.mask.at<uchar>(nearest) == 0;
}

}  // namespace widestereo
