// SPDX-License-Identifier: MIT
#include "widestereo/view_synthesis.h"

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "geometry/distance.h"
#include "geometry/validation.h"
#include "text/formatted.h"

namespace widestereo {
namespace {

constexpr int window_side = 11;
constexpr double least_visible = 0.7;
constexpr double least_deviation = 3;  // grey levels
constexpr float hidden_behind = 1.05f;
constexpr int cell = 2;  // pixels

/// Means over the window around each pixel, what lies outside counting as 0.
cv::Mat window_mean(const cv::Mat& map) {
  cv::Mat mean;
  cv::boxFilter(map, mean, CV_64F, {window_side, window_side}, {-1, -1}, true, cv::BORDER_CONSTANT);
  return mean;
}

}  // namespace

SynthesisedView synthesise_view(const cv::Mat& distance, const View& view,
                                const cv::Mat& other_image, const View& other) {
  require_calibrated_size(distance, view, "The distance map of " + view.name);
  require_calibrated_size(other_image, other, "The image of " + other.name);
  require_type(distance, CV_32FC1, "The distance map of " + view.name);
  require_type(other_image, CV_8UC1, "The image of " + other.name);
  for (const View* each : {&view, &other}) require_valid(*each, "The view synthesis");
  // From one centre every distance fits.
  require_baseline(view, other, "The view synthesis");
  const Eigen::Isometry3d motion = source_from_reference(other, view);
  const cv::Size size = distance.size();
  cv::Mat_<cv::Point2f> places(size, cv::Point2f(-1, -1));
  cv::Mat_<float> range(size, 0.0f);
  cv::Mat_<float> nearest((other_image.rows + cell - 1) / cell,
                          (other_image.cols + cell - 1) / cell,
                          std::numeric_limits<float>::infinity());
  const auto cell_of = [](const cv::Point2f& place) {
    return cv::Point(static_cast<int>(place.x) / cell, static_cast<int>(place.y) / cell);
  };
  const PreparedCamera camera(view.camera), other_camera(other.camera);
  SynthesisedView synthesised;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float d = distance.at<float>(y, x);
      Eigen::Vector3d ray;
      Eigen::Vector2d u;
      if (!has_distance(d) || is_masked(view, {x, y}) || !camera.unproject({x, y}, ray)) continue;
      ++synthesised.distances;
      const Eigen::Vector3d point = motion * (static_cast<double>(d) * ray);
      if (!other_camera.project(point, u) || u.x() < 0 || u.y() < 0 ||
          u.x() > other_image.cols - 1 || u.y() > other_image.rows - 1 || is_masked(other, u)) {
        continue;
      }
      places(y, x) = {static_cast<float>(u.x()), static_cast<float>(u.y())};
      range(y, x) = static_cast<float>(point.norm());
      float& first = nearest(cell_of(places(y, x)));
      first = std::min(first, range(y, x));
    }
  }
  cv::Mat grey;
  other_image.convertTo(grey, CV_32F);
  cv::remap(grey, synthesised.image, places, {}, cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  synthesised.visible = cv::Mat(size, CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      if (range(y, x) > 0 && range(y, x) <= hidden_behind * nearest(cell_of(places(y, x)))) {
        synthesised.visible.at<uchar>(y, x) = 255;
      }
    }
  }
  synthesised.image.setTo(0, synthesised.visible == 0);
  return synthesised;
}

SynthesisScores synthesis_scores(const cv::Mat& image, const SynthesisedView& synthesised) {
  const cv::Size size = synthesised.image.size();
  require_type(synthesised.image, CV_32FC1, "The image of the synthesised view");
  require_map(synthesised.visible, size, CV_8UC1, "The map of what the synthesised view shows");
  require_map(image, size, CV_8UC1, "The image to compare");
  cv::Mat seen, a, b;
  synthesised.visible.convertTo(seen, CV_64F, 1 / 255.0);
  image.convertTo(a, CV_64F);
  a = a.mul(seen);
  synthesised.image.convertTo(b, CV_64F);
  const cv::Mat share = window_mean(seen);
  const cv::Mat mean_a = window_mean(a), mean_b = window_mean(b);
  const cv::Mat mean_aa = window_mean(a.mul(a)), mean_bb = window_mean(b.mul(b)),
                mean_ab = window_mean(a.mul(b));
  SynthesisScores scores;
  long visible = 0;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (synthesised.visible.at<uchar>(y, x) == 0) continue;
      ++visible;
      const double n = share.at<double>(y, x);
      const auto moment = [&](const cv::Mat& product, const cv::Mat& first, const cv::Mat& second) {
        return product.at<double>(y, x) / n -
               first.at<double>(y, x) * second.at<double>(y, x) / (n * n);
      };
      const double variance = moment(mean_aa, mean_a, mean_a);
      if (n < least_visible || variance < least_deviation * least_deviation) continue;
      const double of_other = std::max(moment(mean_bb, mean_b, mean_b), 1e-9);
      const double zncc = moment(mean_ab, mean_a, mean_b) / std::sqrt(variance * of_other);
      ++scores.windows;
      scores.mean += zncc;
      scores.above_0_7 += zncc > 0.7 ? 1 : 0;
      scores.above_0_8 += zncc > 0.8 ? 1 : 0;
      scores.above_0_9 += zncc > 0.9 ? 1 : 0;
    }
  }
  scores.visible = static_cast<double>(visible) / static_cast<double>(synthesised.distances);
  for (double* sum : {&scores.mean, &scores.above_0_7, &scores.above_0_8, &scores.above_0_9}) {
    *sum /= static_cast<double>(scores.windows);
  }
  return scores;
}

std::string to_table(const SynthesisScores& s) {
  return formatted(
      "visible %.1f %% of the distances; ZNCC of %ld textured windows: mean %.3f, above "
      "0.7 %.1f %%, above 0.8 %.1f %%, above 0.9 %.1f %%\n",
      100 * s.visible, s.windows, s.mean, 100 * s.above_0_7, 100 * s.above_0_8, 100 * s.above_0_9);
}

std::string to_json(const SynthesisScores& s) {
  return nlohmann::ordered_json({{"visible", s.visible},
                                 {"windows", s.windows},
                                 {"mean_zncc", s.mean},
                                 {"above_0.7", s.above_0_7},
                                 {"above_0.8", s.above_0_8},
                                 {"above_0.9", s.above_0_9}})
      .dump(2);
}

}  // namespace widestereo
