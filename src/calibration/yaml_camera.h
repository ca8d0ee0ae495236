// SPDX-License-Identifier: MIT
// Cameras in YAML, with the keys that Kalibr and EuRoC's data sets share, and values by their keys.
#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "calibration/formats.h"

namespace widestereo::calibration {

/// Hands the root of a document to `read`. Throws Error for what is no YAML, holds no keys or one
/// of them twice.
void read_yaml(const Document& document, const std::function<void(const YAML::Node& root)>& read);

/// What one camera's keys say, with messages that name file and camera.
class YamlCamera {
 public:
  /// The document must outlive it. Throws Error where the node holds no keys or one twice.
  YamlCamera(const Document& document, const std::string& name, const YAML::Node& node);

  /// The camera without its pose.
  View view() const;
  bool has(const char* key) const;
  /// Throws Error where the key is missing, unless there is something to take instead.
  std::string text(const char* key, const char* otherwise = nullptr) const;
  double number(const char* key) const;
  /// A whole number, at most 100.
  int count(const char* key) const;
  /// Pixels of an image's side.
  int side(const char* key) const;
  /// Of both sides, in the file's order.
  std::vector<int> sides(const char* key) const;
  /// A list, or the data of a matrix as OpenCV and ROS write them.
  std::vector<double> numbers(const char* key) const;
  /// Surplus numbers may only be zeros: what another one means would be lost.
  std::vector<double> numbers(const char* key, std::size_t count) const;
  Eigen::Isometry3d motion(const char* key) const;
  /// Three rows of three numbers.
  Eigen::Matrix3d matrix(const char* key) const;

 private:
  [[noreturn]] void fail(const std::string& finding, const std::string& remedy) const;
  /// That it is not there.
  [[noreturn]] void fail_without(const std::string& key) const;
  int side(double value, const char* key) const;
  /// A list of that key, also one that is the data of a matrix; null if there is none.
  YAML::Node list(const char* key) const;
  std::vector<double> numbers(const YAML::Node& list, const char* key) const;
  /// The numbers of rows of `columns` each, one row after the other.
  std::vector<double> rows(const YAML::Node& list, std::size_t columns, const char* key,
                           const std::string& shape) const;
  double number(const YAML::Node& node, const char* key) const;
  void set_projection(Camera& camera) const;
  void set_distortion(Camera& camera) const;
  void set_resolution(Camera& camera) const;

  const Document& document_;
  std::string name_;
  YAML::Node node_;
};

}  // namespace widestereo::calibration
