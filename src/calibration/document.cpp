// SPDX-License-Identifier: MIT
#include "calibration/document.h"

#include <Eigen/Dense>
#include <cmath>
#include <sstream>

#include "geometry/validation.h"
#include "widestereo/error.h"

namespace widestereo::calibration {

bool Document::contains(const char* words) const {
  const std::size_t first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos) return false;
  const bool has_comments = text[first] != '{' && text[first] != '<';  // YAML, OCamCalib
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    for (std::size_t at = has_comments ? line.find('#') : std::string::npos;
         at != std::string::npos; at = line.find('#', at + 1)) {
      if (at > 0 && line[at - 1] != ' ' && line[at - 1] != '\t') continue;
      line.resize(at);
      break;
    }
    if (line.find(words) != std::string::npos) return true;
  }
  return false;
}

void Document::fail(const std::string& finding, const std::string& remedy) const {
  throw Error(path.string() + ": " + finding + "; " + remedy + ".");
}

std::optional<int> whole_number(double value) {
  if (!(value >= 1 && value <= 1e6) || value != std::floor(value)) return std::nullopt;
  return static_cast<int>(value);
}

void require_last_row(const Document& document, const std::string& what,
                      const Eigen::RowVector4d& row) {
  const Eigen::RowVector4d expected(0, 0, 0, 1);
  if (((row - expected).array().abs() <= 1e-6).all()) return;
  document.fail(what + " must end with the row 0 0 0 1",
                "it may be transposed, as MATLAB and OpenGL have it");
}

Eigen::Isometry3d rigid(const Document& document, const std::string& what,
                        const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = rotation;
  motion.translation() = translation;
  require_rigid(motion, document.path.string() + ": " + what);
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(rotation, Eigen::ComputeFullU | Eigen::ComputeFullV);
  motion.linear() = svd.matrixU() * svd.matrixV().transpose();
  return motion;
}

}  // namespace widestereo::calibration
