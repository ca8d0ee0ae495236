// SPDX-License-Identifier: MIT
#include "map_checks.h"

#include <cmath>
#include <opencv2/core.hpp>

#include "text/size_text.h"
#include "widestereo/error.h"

namespace ws = widestereo;

void require_same_size(const cv::Mat& map, const std::string& name, const cv::Mat& other,
                       const std::string& other_name, const std::string& remedy) {
  if (map.size() == other.size()) return;
  throw ws::Error(name + " is " + ws::size_text(map.cols, map.rows) + " pixels, but " + other_name +
                  " is " + ws::size_text(other.cols, other.rows) + "; " + remedy + ".");
}

void require_values(const cv::Mat& map, const std::string& name, int count,
                    const std::string& what) {
  if (map.channels() == count) return;
  throw ws::Error(name + " has " + std::to_string(map.channels()) + " value(s) a pixel, but " +
                  what + " has " + std::to_string(count) + "; give another file.");
}

void require_unit_vectors(const cv::Mat& normals, const std::string& name) {
  constexpr double tolerance = 0.05;  // of lengths, as of components of 8 bits
  constexpr double few = 0.01;        // of the vectors, as where normals were blurred
  int vectors = 0;
  int others = 0;
  for (int y = 0; y < normals.rows; ++y) {
    for (int x = 0; x < normals.cols; ++x) {
      const double length = cv::norm(normals.at<cv::Vec3f>(y, x));
      if (length == 0) continue;
      ++vectors;
      others += !(std::abs(length - 1) <= tolerance);
    }
  }
  if (others <= few * vectors) return;
  throw ws::Error(name + " has no unit vectors at " + std::to_string(others) + " of " +
                  std::to_string(vectors) +
                  " pixels with a normal; scale them, or, if OpenCV wrote it, which compresses "
                  "three channels with loss, give IMWRITE_TIFF_COMPRESSION 1.");
}
