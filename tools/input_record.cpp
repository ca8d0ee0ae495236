// SPDX-License-Identifier: MIT
#include "input_record.h"

#include <chrono>
#include <functional>
#include <opencv2/core.hpp>
#include <string_view>
#include <system_error>

#include "geometry/angle.h"

namespace ws = widestereo;
using Json = nlohmann::ordered_json;

Json to_json(const Eigen::Vector3d& position) { return {position.x(), position.y(), position.z()}; }

Json to_json(const Eigen::Isometry3d& pose) {
  Json rows = Json::array();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) rows.push_back(pose.matrix()(row, column));
  }
  return rows;
}

Json intrinsics_of(const ws::Camera& camera) {
  Json record = {{"fx", camera.fx}, {"fy", camera.fy}, {"cx", camera.cx}, {"cy", camera.cy}};
  const ws::Camera without;
  for (const auto& [name, member] : ws::intrinsics()) {
    if (camera.*member != without.*member) record[name] = camera.*member;
  }
  return record;
}

namespace {

/// Tells masks with as many pixels apart; 0 for none. Of this program: another standard library has
/// other hashes.
std::size_t mask_hash(const cv::Mat& mask) {
  if (mask.empty()) return 0;
  const cv::Mat bytes = mask.isContinuous() ? mask : mask.clone();
  return std::hash<std::string_view>()({bytes.ptr<char>(), bytes.total() * bytes.elemSize()});
}

}  // namespace

Json to_json(const ws::View& view) {
  const ws::Camera& c = view.camera;
  return {{"name", view.name},
          {"model", to_string(c.model)},
          {"size", {c.width, c.height}},
          {"intrinsics", intrinsics_of(c)},
          {"max_theta_degrees", c.max_theta * ws::degrees_per_radian},
          {"world_from_camera", to_json(view.world_from_camera)},
          {"masked_pixels", view.mask.empty() ? 0 : cv::countNonZero(view.mask == 0)},
          {"mask_hash", mask_hash(view.mask)}};
}

Json device_record(const ws::DeviceInfo& device) {
  Json record = {{"back_end", device.id.substr(0, device.id.find(':'))}, {"name", device.name}};
  // The CPU's says its threads, which do not matter.
  if (device.kind != ws::DeviceKind::cpu) record["driver"] = device.driver;
  return record;
}

Json file_record(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  const auto changed = std::filesystem::last_write_time(file, error).time_since_epoch();
  // Who reads the image says what is wrong with it.
  if (error) return nullptr;
  return {{"bytes", bytes},
          {"changed", std::chrono::duration_cast<std::chrono::nanoseconds>(changed).count()}};
}
