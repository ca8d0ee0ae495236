// SPDX-License-Identifier: MIT
#include "map_checks.h"

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
