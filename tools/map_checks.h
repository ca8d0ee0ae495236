// SPDX-License-Identifier: MIT
// What maps and images of files must be like to belong together.
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

/// Throws Error where a map is not of the size of another one; `remedy`: a clause.
void require_same_size(const cv::Mat& map, const std::string& name, const cv::Mat& other,
                       const std::string& other_name, const std::string& remedy);

/// Throws Error where a file's map has not as many values a pixel as what it should be, such as "a
/// distance map", which has `count`.
void require_values(const cv::Mat& map, const std::string& name, int count,
                    const std::string& what);

/// Throws Error where vectors of a file's normal map are neither unit vectors nor zeros.
void require_unit_vectors(const cv::Mat& normals, const std::string& name);
