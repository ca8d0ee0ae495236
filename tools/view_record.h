// SPDX-License-Identifier: MIT
// What records say of a calibrated view, by which a run is taken up again.
#pragma once

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "widestereo/rig.h"

/// The upper three rows, row by row.
nlohmann::ordered_json to_json(const Eigen::Isometry3d& pose);
nlohmann::ordered_json to_json(const widestereo::View& view);
