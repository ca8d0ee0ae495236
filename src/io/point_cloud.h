// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <string>

namespace widestereo {

/// Throws Error unless the maps are as make_point_cloud() takes them. `of_view` (" of cam0", say)
/// ends their names in the message.
void require_cloud_maps(const cv::Mat& distance, const cv::Mat& rays, const cv::Mat& normals,
                        const cv::Mat& image, const cv::Mat& confidence,
                        const std::string& of_view);

}  // namespace widestereo
