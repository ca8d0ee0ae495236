// SPDX-License-Identifier: MIT
// What records say of a calibrated view and its image, by which a run is taken up again.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "widestereo/device.h"
#include "widestereo/rig.h"

nlohmann::ordered_json to_json(const Eigen::Vector3d& position);
/// The upper three rows, row by row.
nlohmann::ordered_json to_json(const Eigen::Isometry3d& pose);
/// Focal lengths, centre and what else differs from a default widestereo::Camera, by its names.
nlohmann::ordered_json intrinsics_of(const widestereo::Camera& camera);
nlohmann::ordered_json to_json(const widestereo::View& view);
/// What decides the bits of results: CUDA and Vulkan give one card the same name.
nlohmann::ordered_json device_record(const widestereo::DeviceInfo& device);
/// What tells a file from another one that takes its place: its size and when it was last changed.
nlohmann::ordered_json file_record(const std::filesystem::path& file);
