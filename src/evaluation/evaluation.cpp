// SPDX-License-Identifier: MIT
#include "widestereo/evaluation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <opencv2/core.hpp>

#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr std::array<double, 4> relative_thresholds = {0.005, 0.01, 0.02, 0.05};
constexpr std::array<double, 3> pixel_thresholds = {0.5, 1, 2};
constexpr uchar visible = 255;
constexpr double not_projected = std::numeric_limits<double>::quiet_NaN();

/// One scored pixel.
struct Sample {
  double truth = 0;
  double theta = 0;  ///< degrees
  bool non_occluded = true;
  bool predicted = false;
  bool in_source = false;               ///< the true point projects into the source image
  double error = 0;                     ///< metres
  double displacement = not_projected;  ///< pixels in the source
  double normal_angle = -1;             ///< degrees
  double confidence = 0;
};

bool has_distance(float distance) { return distance > 0 && std::isfinite(distance); }

void require_size(const cv::Mat& map, cv::Size size, int type, const char* what) {
  if (map.empty() || (map.size() == size && map.type() == type)) return;
  throw Error(std::string("The ") + what + " is " + std::to_string(map.cols) + "x" +
              std::to_string(map.rows) + " or of another type, but the distance map is " +
              std::to_string(size.width) + "x" + std::to_string(size.height) +
              "; give maps of the same view.");
}

double angle_between(const cv::Vec3f& a, const cv::Vec3f& b) {
  const Eigen::Vector3d u(a[0], a[1], a[2]);
  const Eigen::Vector3d v(b[0], b[1], b[2]);
  if (u.norm() < 0.5 || v.norm() < 0.5) return -1;
  return std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi;
}

std::vector<Sample> collect(const cv::Mat& distance, const cv::Mat& normals,
                            const cv::Mat& confidence, const GroundTruth& truth,
                            const View& reference, const View& source) {
  const cv::Size size = distance.size();
  if (distance.type() != CV_32FC1 || truth.distance.empty() || distance.empty()) {
    throw Error("Distance maps to compare must have one 32-bit float channel and not be empty.");
  }
  require_size(truth.distance, size, CV_32FC1, "ground truth");
  require_size(truth.valid, size, CV_8UC1, "mask of valid pixels");
  require_size(truth.occlusion, size, CV_8UC1, "occlusion map");
  require_size(truth.normals, size, CV_32FC3, "ground truth of normals");
  require_size(normals, size, CV_32FC3, "normal map");
  require_size(confidence, size, CV_32FC1, "confidence map");
  if (reference.camera.width != size.width || reference.camera.height != size.height) {
    throw Error("The distance map is " + std::to_string(size.width) + "x" +
                std::to_string(size.height) + ", but the calibration of " + reference.name +
                " is " + std::to_string(reference.camera.width) + "x" +
                std::to_string(reference.camera.height) + "; give the view's own map.");
  }
  const cv::Mat rays = ray_image(reference.camera, {});
  const Eigen::Isometry3d motion = source_from_reference(source, reference);
  const auto to_source = [&](const Eigen::Vector3d& point, Eigen::Vector2d& pixel) {
    return project(source.camera, motion * point, pixel) && pixel.x() >= -0.5 &&
           pixel.y() >= -0.5 && pixel.x() < source.camera.width - 0.5 &&
           pixel.y() < source.camera.height - 0.5;
  };
  std::vector<Sample> samples;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float gt = truth.distance.at<float>(y, x);
      if (!has_distance(gt) || (!truth.valid.empty() && truth.valid.at<uchar>(y, x) == 0)) continue;
      Sample& sample = samples.emplace_back();
      sample.truth = static_cast<double>(gt);
      const cv::Vec4f& r = rays.at<cv::Vec4f>(y, x);
      const Eigen::Vector3d ray = Eigen::Vector3f(r[0], r[1], r[2]).cast<double>();
      sample.theta = std::atan2(ray.head<2>().norm(), ray.z()) * 180 / std::numbers::pi;
      sample.non_occluded = truth.occlusion.empty() || truth.occlusion.at<uchar>(y, x) == visible;
      if (!confidence.empty()) sample.confidence = static_cast<double>(confidence.at<float>(y, x));
      const float d = distance.at<float>(y, x);
      sample.predicted = has_distance(d);
      if (!sample.predicted) continue;
      sample.error = std::abs(static_cast<double>(d) - sample.truth);
      Eigen::Vector2d predicted;
      Eigen::Vector2d expected;
      sample.in_source = to_source(sample.truth * ray, expected);
      if (sample.in_source &&
          project(source.camera, motion * (static_cast<double>(d) * ray), predicted)) {
        sample.displacement = (predicted - expected).norm();
      }
      if (!normals.empty() && !truth.normals.empty()) {
        sample.normal_angle =
            angle_between(normals.at<cv::Vec3f>(y, x), truth.normals.at<cv::Vec3f>(y, x));
      }
    }
  }
  return samples;
}

/// Within 2 px of its true place in the source; false where the predicted point does not project.
bool is_right(const Sample& sample) { return sample.displacement <= 2; }

double median_of(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<long>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  if (values.size() % 2 == 1) return *middle;
  return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

double mean_of(const std::vector<double>& values) {
  if (values.empty()) return 0;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Share of values above a threshold; `missing` further ones count as above.
double share_above(const std::vector<double>& values, double threshold, std::size_t missing) {
  const auto above = static_cast<std::size_t>(std::count_if(
      values.begin(), values.end(), [threshold](double value) { return value > threshold; }));
  const std::size_t total = values.size() + missing;
  return total == 0 ? 0 : static_cast<double>(above + missing) / static_cast<double>(total);
}

RegionScores score(const std::string& region, const std::vector<const Sample*>& samples) {
  RegionScores scores;
  scores.region = region;
  scores.pixels = static_cast<long>(samples.size());
  std::vector<double> relative;
  std::vector<double> absolute;
  std::vector<double> displacement;
  std::vector<double> angle;
  double squares = 0;
  for (const Sample* sample : samples) {
    if (!sample->predicted) continue;
    absolute.push_back(sample->error);
    relative.push_back(sample->error / sample->truth);
    squares += sample->error * sample->error;
    if (!std::isnan(sample->displacement)) displacement.push_back(sample->displacement);
    if (sample->normal_angle >= 0) angle.push_back(sample->normal_angle);
  }
  const std::size_t missing = samples.size() - relative.size();
  for (const double t : relative_thresholds) {
    scores.bad_relative[t] = share_above(relative, t, missing);
    scores.bad_relative_predicted[t] = share_above(relative, t, 0);
  }
  for (const double t : pixel_thresholds) {
    scores.bad_pixels[t] = share_above(displacement, t, samples.size() - displacement.size());
    scores.bad_pixels_predicted[t] = share_above(displacement, t, 0);
  }
  if (!samples.empty()) {
    scores.completeness =
        static_cast<double>(relative.size()) / static_cast<double>(samples.size());
  }
  scores.median_pixels = median_of(displacement);
  scores.mean_absolute = mean_of(absolute);
  scores.median_absolute = median_of(absolute);
  scores.median_relative = median_of(relative);
  if (!absolute.empty()) {
    scores.root_mean_square = std::sqrt(squares / static_cast<double>(absolute.size()));
  }
  if (!angle.empty()) {
    scores.mean_normal_angle = mean_of(angle);
    scores.median_normal_angle = median_of(angle);
  }
  return scores;
}

}  // namespace

std::vector<RegionScores> evaluate(const cv::Mat& distance, const cv::Mat& normals,
                                   const GroundTruth& truth, const View& reference,
                                   const View& source) {
  const std::vector<Sample> samples = collect(distance, normals, {}, truth, reference, source);
  const auto score_where = [&](const std::string& region, auto belongs) {
    std::vector<const Sample*> chosen;
    for (const Sample& sample : samples) {
      if (belongs(sample)) chosen.push_back(&sample);
    }
    return score(region, chosen);
  };
  const auto band = [&](const std::string& name, double from, double to) {
    return score_where(name, [from, to](const Sample& s) {
      return s.non_occluded && s.theta >= from && s.theta < to;
    });
  };
  return {score_where("all", [](const Sample&) { return true; }),
          score_where("non-occluded", [](const Sample& s) { return s.non_occluded; }),
          band("0-30 deg", 0, 30),
          band("30-60 deg", 30, 60),
          band("60-90 deg", 60, 90),
          band(">90 deg", 90, 181)};
}

ConsistencyScores consistency_scores(const cv::Mat& differences, const cv::Mat& cost) {
  ConsistencyScores scores;
  for (int y = 0; y < cost.rows; ++y) {
    for (int x = 0; x < cost.cols; ++x) {
      const float c = cost.at<float>(y, x);
      if (c >= 2) continue;
      const cv::Vec2f& difference = differences.at<cv::Vec2f>(y, x);
      ++scores.pixels;
      scores.mean_cost += static_cast<double>(c);
      scores.low_cost += c < 0.2f;
      scores.consistent_relative += difference[0] <= 0.02f;
      scores.consistent_pixels += difference[1] <= 2.0f;
    }
  }
  const double n = static_cast<double>(std::max(scores.pixels, 1L));
  scores.mean_cost /= n;
  scores.low_cost /= n;
  scores.consistent_relative /= n;
  scores.consistent_pixels /= n;
  return scores;
}

std::vector<SparsificationPoint> sparsification(const cv::Mat& distance, const cv::Mat& confidence,
                                                const GroundTruth& truth, const View& reference,
                                                const View& source) {
  std::vector<Sample> samples = collect(distance, {}, confidence, truth, reference, source);
  std::erase_if(samples, [](const Sample& s) { return !s.non_occluded; });
  std::stable_sort(samples.begin(), samples.end(),
                   [](const Sample& a, const Sample& b) { return a.confidence > b.confidence; });
  std::vector<SparsificationPoint> curve;
  std::size_t bad = 0;
  std::size_t next = 0;
  for (int tenth = 1; tenth <= 10 && !samples.empty(); ++tenth) {
    const std::size_t end = std::max<std::size_t>(1, samples.size() * tenth / 10);
    for (; next < end; ++next) bad += !is_right(samples[next]);
    curve.push_back({static_cast<double>(end) / static_cast<double>(samples.size()),
                     samples[end - 1].confidence,
                     static_cast<double>(bad) / static_cast<double>(end)});
  }
  return curve;
}

std::vector<ReliabilityBin> reliability(const cv::Mat& distance, const cv::Mat& confidence,
                                        const GroundTruth& truth, const View& reference,
                                        const View& source) {
  constexpr std::array<double, 9> limits = {0, 0.2, 0.5, 0.7, 0.8, 0.9, 0.95, 0.98, 1};
  std::vector<ReliabilityBin> bins;
  for (std::size_t i = 0; i + 1 < limits.size(); ++i) {
    bins.push_back({.low = limits[i], .high = limits[i + 1]});
  }
  for (const Sample& sample : collect(distance, {}, confidence, truth, reference, source)) {
    if (!sample.predicted || !sample.in_source) continue;
    const auto above = std::upper_bound(limits.begin() + 1, limits.end() - 1, sample.confidence);
    ReliabilityBin& bin = bins[static_cast<std::size_t>(above - limits.begin() - 1)];
    bin.pixels += 1;
    bin.mean_confidence += sample.confidence;
    bin.right += is_right(sample);
  }
  for (ReliabilityBin& bin : bins) {
    if (bin.pixels == 0) continue;
    bin.mean_confidence /= static_cast<double>(bin.pixels);
    bin.right /= static_cast<double>(bin.pixels);
  }
  return bins;
}

}  // namespace widestereo
