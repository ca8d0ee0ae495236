// SPDX-License-Identifier: MIT
#include "widestereo/point_cloud.h"

#include <bit>
#include <opencv2/core.hpp>
#include <ostream>

#include "geometry/distance.h"
#include "geometry/validation.h"
#include "io/bgr8.h"
#include "io/point_cloud.h"
#include "text/formatted.h"
#include "text/number.h"
#include "widestereo/files.h"

namespace widestereo {
namespace {

static_assert(std::endian::native == std::endian::little);

template <class T>
void append(std::vector<char>& bytes, const T& value) {
  const auto* begin = reinterpret_cast<const char*>(&value);
  bytes.insert(bytes.end(), begin, begin + sizeof value);
}

}  // namespace

void require_cloud_maps(const cv::Mat& distance, const cv::Mat& rays, const cv::Mat& normals,
                        const cv::Mat& image, const cv::Mat& confidence,
                        const std::string& of_view) {
  const cv::Size size = distance.size();
  require_type(distance, CV_32FC1, "The distance map" + of_view);
  require_map(rays, size, CV_32FC4, "The map of rays" + of_view);
  require_optional_map(normals, size, CV_32FC3, "The normal map" + of_view);
  require_optional_map(confidence, size, CV_32FC1, "The confidence map" + of_view);
  if (image.empty()) return;
  require_image(image, "The image" + of_view);
  require_size(image, size, "The image" + of_view);
}

PointCloud make_point_cloud(const cv::Mat& distance, const cv::Mat& rays, const cv::Mat& normals,
                            const cv::Mat& image, const cv::Mat& confidence,
                            const Eigen::Isometry3d& world_from_camera) {
  require_cloud_maps(distance, rays, normals, image, confidence, "");
  const Eigen::Matrix3f rotation = world_from_camera.linear().cast<float>();
  const cv::Mat colours = to_bgr8(image);
  PointCloud cloud;
  for (int y = 0; y < distance.rows; ++y) {
    for (int x = 0; x < distance.cols; ++x) {
      const float d = distance.at<float>(y, x);
      const cv::Vec4f& ray = rays.at<cv::Vec4f>(y, x);
      if (!has_point(d, ray)) continue;
      const Eigen::Vector3f seen(d * ray[0], d * ray[1], d * ray[2]);
      CloudPoint point{(world_from_camera * seen.cast<double>()).cast<float>(),
                       Eigen::Vector3f::Zero(),
                       255,
                       255,
                       255,
                       1};
      if (!normals.empty()) {
        const cv::Vec3f& n = normals.at<cv::Vec3f>(y, x);
        const Eigen::Vector3f normal(n[0], n[1], n[2]);
        if (normal.allFinite()) point.normal = rotation * normal;
      }
      if (!colours.empty()) {
        const cv::Vec3b& bgr = colours.at<cv::Vec3b>(y, x);
        point.red = bgr[2];
        point.green = bgr[1];
        point.blue = bgr[0];
      }
      if (!confidence.empty()) point.confidence = confidence.at<float>(y, x);
      cloud.push_back(point);
    }
  }
  return cloud;
}

void write_ply(const std::filesystem::path& path, const PointCloud& cloud,
               const Eigen::Vector3d& origin) {
  write_file(path, [&](std::ostream& stream) {
    stream << "ply\nformat binary_little_endian 1.0\n"
           << "comment world frame and unit of the cameras' poses\n";
    if (!origin.isZero(0)) {
      stream << formatted("comment origin, to be added: %.12g %.12g %.12g\n", origin.x(),
                          origin.y(), origin.z());
    }
    stream << "element vertex " << text_of(cloud.size()) << "\n"
           << "property float x\nproperty float y\nproperty float z\n"
           << "property float nx\nproperty float ny\nproperty float nz\n"
           << "property uchar red\nproperty uchar green\nproperty uchar blue\n"
           << "property float confidence\nend_header\n";
    std::vector<char> bytes;  // of one point: large clouds leave no room for another copy
    for (const CloudPoint& point : cloud) {
      bytes.clear();
      for (int i = 0; i < 3; ++i) append(bytes, point.position[i]);
      for (int i = 0; i < 3; ++i) append(bytes, point.normal[i]);
      append(bytes, point.red);
      append(bytes, point.green);
      append(bytes, point.blue);
      append(bytes, point.confidence);
      stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }
  });
}

}  // namespace widestereo
