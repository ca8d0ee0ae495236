// SPDX-License-Identifier: MIT
#include "widestereo/evaluation.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <tuple>

#include "evaluation/ground_truth.h"
#include "geometry/angle.h"
#include "geometry/distance.h"
#include "geometry/validation.h"
#include "statistics/percentile.h"
#include "text/number.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr std::array<double, 4> relative_thresholds = {0.005, 0.01, 0.02, 0.05};
constexpr std::array<double, 3> pixel_thresholds = {0.5, 1, 2};
constexpr double right_pixels = 2;
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
  cv::Point pixel;
};

double angle_between(const cv::Vec3f& a, const cv::Vec3f& b) {
  const Eigen::Vector3d u(a[0], a[1], a[2]);
  const Eigen::Vector3d v(b[0], b[1], b[2]);
  if (u.norm() < 0.5 || v.norm() < 0.5) return -1;
  return degrees_between(u, v);
}

void require_maps(const cv::Mat& distance, const GroundTruth& truth, const View& reference) {
  require_truth(distance, truth);
  require_calibrated_size(distance, reference, "The distance map");
}

Eigen::Vector3d direction(const cv::Vec4f& ray) {
  return Eigen::Vector3f(ray[0], ray[1], ray[2]).cast<double>();
}

/// Projects points of the reference view into the source view.
class SourceView {
 public:
  SourceView(const View& source, const View& reference)
      : camera_(source.camera), motion_(source_from_reference(source, reference)) {
    require_valid(source, "The evaluation");
    // From one centre every distance fits.
    require_baseline(reference, source, "The evaluation");
  }

  bool in_image(const Eigen::Vector3d& point, Eigen::Vector2d& pixel) const {
    return camera_.project_into_image(motion_ * point, pixel);
  }
  /// How far the point's projection lies from `expected`; not_projected where it has none.
  double displacement(const Eigen::Vector3d& point, const Eigen::Vector2d& expected) const {
    Eigen::Vector2d pixel;
    return camera_.project(motion_ * point, pixel) ? (pixel - expected).norm() : not_projected;
  }

 private:
  PreparedCamera camera_;
  Eigen::Isometry3d motion_;
};

cv::Mat inside_field_of_view(const cv::Mat& rays) {
  cv::Mat valid;
  cv::extractChannel(rays, valid, 3);
  return valid > 0;
}

bool is_edge(const GroundTruth& truth, cv::Point a, cv::Point b) {
  const float first = truth.distance.at<float>(a);
  const float second = truth.distance.at<float>(b);
  if (has_distance(first) != has_distance(second)) return true;
  if (!has_distance(first)) return false;
  const auto nearer = static_cast<double>(std::min(first, second));
  const auto farther = static_cast<double>(std::max(first, second));
  if (farther - nearer > edge_distance_step * nearer) return true;
  return !truth.normals.empty() && angle_between(truth.normals.at<cv::Vec3f>(a),
                                                 truth.normals.at<cv::Vec3f>(b)) > edge_normal_step;
}

/// 255 where the pixel is far enough from every edge of the true scene.
cv::Mat interior_pixels(const GroundTruth& truth, const cv::Mat& rays) {
  const cv::Mat inside = inside_field_of_view(rays);
  cv::Mat no_edge(inside.size(), CV_8UC1, cv::Scalar(255));
  for (int y = 0; y < inside.rows; ++y) {
    for (int x = 0; x < inside.cols; ++x) {
      const cv::Point pixel(x, y);
      for (const cv::Point neighbour : {cv::Point(x + 1, y), cv::Point(x, y + 1)}) {
        if (neighbour.x >= inside.cols || neighbour.y >= inside.rows ||
            inside.at<uchar>(pixel) == 0 || inside.at<uchar>(neighbour) == 0 ||
            !is_edge(truth, pixel, neighbour)) {
          continue;
        }
        no_edge.at<uchar>(pixel) = no_edge.at<uchar>(neighbour) = 0;
      }
    }
  }
  if (cv::countNonZero(no_edge == 0) == 0) return no_edge;
  cv::Mat clearance;
  cv::distanceTransform(no_edge, clearance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return clearance >= interior_edge_clearance;
}

double confidence_at(const cv::Mat& confidence, int x, int y) {
  const float value = confidence.at<float>(y, x);
  if (value >= 0 && value <= 1) return static_cast<double>(value);
  throw Error("The confidence map has " + text_of(value) + " at pixel (" + std::to_string(x) +
              ", " + std::to_string(y) + "); give one of numbers from 0 to 1.");
}

/// `source`: null where nothing is projected into another view.
std::vector<Sample> collect(const cv::Mat& distance, const cv::Mat& normals,
                            const cv::Mat& confidence, const GroundTruth& truth,
                            const View& reference, const View* source) {
  const cv::Size size = distance.size();
  require_maps(distance, truth, reference);
  require_optional_map(normals, size, CV_32FC3, "The normal map");
  require_optional_map(confidence, size, CV_32FC1, "The confidence map");
  const cv::Mat rays = ray_image(reference.camera, {});
  std::optional<SourceView> source_view;
  if (source != nullptr) source_view.emplace(*source, reference);
  std::vector<Sample> samples;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float gt = truth.distance.at<float>(y, x);
      const cv::Vec4f& ray_of_pixel = rays.at<cv::Vec4f>(y, x);
      if (!has_point(gt, ray_of_pixel)) continue;
      if (!truth.valid.empty() && truth.valid.at<uchar>(y, x) == 0) continue;
      Sample& sample = samples.emplace_back();
      sample.pixel = {x, y};
      sample.truth = static_cast<double>(gt);
      const Eigen::Vector3d ray = direction(ray_of_pixel);
      sample.theta = std::atan2(ray.head<2>().norm(), ray.z()) * degrees_per_radian;
      sample.non_occluded =
          truth.occlusion.empty() || truth.occlusion.at<uchar>(y, x) == visible_label;
      if (!confidence.empty()) sample.confidence = confidence_at(confidence, x, y);
      Eigen::Vector2d expected;
      sample.in_source = source_view && source_view->in_image(sample.truth * ray, expected);
      const float d = distance.at<float>(y, x);
      sample.predicted = has_distance(d);
      if (!sample.predicted) continue;
      sample.error = std::abs(static_cast<double>(d) - sample.truth);
      if (sample.in_source) {
        sample.displacement = source_view->displacement(static_cast<double>(d) * ray, expected);
      }
      if (!normals.empty() && !truth.normals.empty()) {
        sample.normal_angle =
            angle_between(normals.at<cv::Vec3f>(y, x), truth.normals.at<cv::Vec3f>(y, x));
      }
    }
  }
  return samples;
}

/// Of a map of confidences that may not be missing.
std::vector<Sample> collect_confident(const cv::Mat& distance, const cv::Mat& confidence,
                                      const GroundTruth& truth, const View& reference,
                                      const View& source) {
  require_type(confidence, CV_32FC1, "The confidence map");
  return collect(distance, {}, confidence, truth, reference, &source);
}

/// Within right_pixels of its true place in the source; false where the predicted point does not
/// project.
bool is_right(const Sample& sample) { return sample.displacement <= right_pixels; }

/// What no pixel tells.
constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// A sum over so many pixels as their mean or, of ones, their share.
double share_of(double sum, long pixels) {
  return pixels == 0 ? unknown : sum / static_cast<double>(pixels);
}

double mean_of(const std::vector<double>& values) {
  return share_of(std::accumulate(values.begin(), values.end(), 0.0),
                  static_cast<long>(values.size()));
}

/// Share of values above a threshold; `missing` further ones count as above.
double share_above(const std::vector<double>& values, double threshold, std::size_t missing) {
  const auto above = static_cast<std::size_t>(std::count_if(
      values.begin(), values.end(), [threshold](double value) { return value > threshold; }));
  const std::size_t total = values.size() + missing;
  return share_of(static_cast<double>(above + missing), static_cast<long>(total));
}

RegionScores score(const std::string& region, const std::vector<const Sample*>& samples) {
  RegionScores scores;
  scores.region = region;
  scores.pixels = static_cast<long>(samples.size());
  std::vector<double> relative;
  std::vector<double> absolute;
  std::vector<double> displacement;
  std::vector<double> angle;
  std::vector<double> squares;
  std::size_t in_source = 0;
  for (const Sample* sample : samples) {
    if (sample->in_source) ++in_source;
    if (!sample->predicted) continue;
    absolute.push_back(sample->error);
    relative.push_back(sample->error / sample->truth);
    squares.push_back(sample->error * sample->error);
    if (!std::isnan(sample->displacement)) displacement.push_back(sample->displacement);
    if (sample->normal_angle >= 0) angle.push_back(sample->normal_angle);
  }
  const std::size_t missing = samples.size() - relative.size();
  for (const double t : relative_thresholds) {
    scores.bad_relative[t] = share_above(relative, t, missing);
    scores.bad_relative_predicted[t] = share_above(relative, t, 0);
  }
  for (const double t : pixel_thresholds) {
    scores.bad_pixels[t] = share_above(displacement, t, in_source - displacement.size());
    scores.bad_pixels_predicted[t] = share_above(displacement, t, 0);
  }
  if (!samples.empty()) {
    scores.completeness =
        static_cast<double>(relative.size()) / static_cast<double>(samples.size());
  }
  scores.median_pixels = median(displacement);
  scores.mean_absolute = mean_of(absolute);
  scores.median_absolute = median(absolute);
  scores.median_relative = median(relative);
  scores.root_mean_square = std::sqrt(mean_of(squares));
  scores.mean_normal_angle = mean_of(angle);
  scores.median_normal_angle = median(angle);
  return scores;
}

void require_occlusion_labels(const cv::Mat& occlusion) {
  for (int y = 0; y < occlusion.rows; ++y) {
    for (int x = 0; x < occlusion.cols; ++x) {
      const uchar label = occlusion.at<uchar>(y, x);
      if (label == visible_label || label == hidden_label || label == outside_label) continue;
      throw Error("The occlusion map has " + std::to_string(label) + " at pixel (" +
                  std::to_string(x) + ", " + std::to_string(y) + "); give 255 for what the " +
                  "source view sees, 0 for what is occluded and 128 for what is outside.");
    }
  }
}

/// Over every region.
std::vector<RegionScores> score_regions(const std::vector<Sample>& samples,
                                        const GroundTruth& truth, const View& reference) {
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
  std::vector<RegionScores> scores = {score_where("all", [](const Sample&) { return true; })};
  if (!truth.occlusion.empty()) {
    scores.push_back(score_where("non-occluded", [](const Sample& s) { return s.non_occluded; }));
  }
  for (const auto& [name, from, to] :
       {std::tuple("0-30 deg", 0, 30), std::tuple("30-60 deg", 30, 60),
        std::tuple("60-90 deg", 60, 90), std::tuple(">90 deg", 90, 181)}) {
    scores.push_back(band(name, from, to));
  }
  if (!truth.image.empty()) {
    const cv::Mat rays = ray_image(reference.camera, {});
    const cv::Mat textured = textured_pixels(truth.image, inside_field_of_view(rays));
    const cv::Mat interior = textured & interior_pixels(truth, rays);
    const auto within = [&](const std::string& region, const cv::Mat& mask) {
      return score_where(region, [&mask](const Sample& s) {
        return s.non_occluded && mask.at<uchar>(s.pixel) != 0;
      });
    };
    scores.push_back(within("textured", textured));
    // Without normals creases are not known: it is another set of pixels.
    scores.push_back(
        within(truth.normals.empty() ? "textured no steps" : "textured interior", interior));
  }
  return scores;
}

}  // namespace

void require_truth(const cv::Mat& distance, const GroundTruth& truth) {
  const cv::Size size = distance.size();
  require_type(distance, CV_32FC1, "The distance map");
  require_map(truth.distance, size, CV_32FC1, "The ground truth");
  require_optional_map(truth.valid, size, CV_8UC1, "The mask of valid pixels");
  require_optional_map(truth.occlusion, size, CV_8UC1, "The occlusion map");
  require_occlusion_labels(truth.occlusion);
  require_optional_map(truth.normals, size, CV_32FC3, "The ground truth of normals");
  require_optional_map(truth.image, size, CV_8UC1, "The reference image");
  require_optional_map(truth.field_of_view, size, CV_8UC1, "The mask of the field of view");
}

cv::Mat textured_pixels(const cv::Mat& image, const cv::Mat& field_of_view) {
  require_type(image, CV_8UC1, "The image");
  require_map(field_of_view, image.size(), CV_8UC1, "The mask of the field of view");
  cv::Mat value;
  image.convertTo(value, CV_64F);
  cv::Mat weight;
  cv::Mat(field_of_view != 0).convertTo(weight, CV_64F, 1 / 255.0);
  value = value.mul(weight);
  const auto patch_sum = [](const cv::Mat& map) {
    cv::Mat sum;
    cv::boxFilter(map, sum, CV_64F, {texture_patch_side, texture_patch_side}, {-1, -1}, false,
                  cv::BORDER_CONSTANT);
    return sum;
  };
  const cv::Mat count = patch_sum(weight);
  const cv::Mat sum = patch_sum(value);
  // Whole numbers, so the comparison is exact.
  const cv::Mat variance = count.mul(patch_sum(value.mul(value))) - sum.mul(sum);
  const cv::Mat least = texture_least_deviation * texture_least_deviation * count.mul(count);
  return (variance >= least) & (count > 0);
}

std::vector<RegionScores> evaluate(const cv::Mat& distance, const cv::Mat& normals,
                                   const GroundTruth& truth, const View& reference,
                                   const View& source) {
  return score_regions(collect(distance, normals, {}, truth, reference, &source), truth, reference);
}

std::vector<RegionScores> evaluate(const cv::Mat& distance, const cv::Mat& normals,
                                   const GroundTruth& truth, const View& reference) {
  return score_regions(collect(distance, normals, {}, truth, reference, nullptr), truth, reference);
}

FarScores far_scores(const cv::Mat& distance, const GroundTruth& truth, const View& reference,
                     const View& source, double far_distance) {
  require_maps(distance, truth, reference);
  if (truth.field_of_view.empty()) {
    throw Error(
        "Far things without ground truth are told from the lens's border by a mask of the "
        "field of view; give one.");
  }
  if (!has_distance(static_cast<float>(far_distance))) {
    throw Error("The distance of far things is " + text_of(far_distance) +
                "; give one that is finite and above 0.");
  }
  const cv::Mat rays = ray_image(reference.camera, {});
  const SourceView source_view(source, reference);
  FarScores scores;
  scores.distance = far_distance;
  long right = 0;
  for (int y = 0; y < distance.rows; ++y) {
    for (int x = 0; x < distance.cols; ++x) {
      const cv::Vec4f& r = rays.at<cv::Vec4f>(y, x);
      if (truth.field_of_view.at<uchar>(y, x) == 0 || r[3] == 0 ||
          has_distance(truth.distance.at<float>(y, x))) {
        continue;
      }
      Eigen::Vector2d expected;
      if (!source_view.in_image(far_distance * direction(r), expected)) continue;
      ++scores.pixels;
      const float d = distance.at<float>(y, x);
      right += has_distance(d) && source_view.displacement(static_cast<double>(d) * direction(r),
                                                           expected) <= right_pixels;
    }
  }
  scores.right = share_of(static_cast<double>(right), scores.pixels);
  return scores;
}

ConsistencyScores consistency_scores(const cv::Mat& differences, const cv::Mat& cost,
                                     const cv::Mat& textured) {
  require_type(cost, CV_32FC1, "The cost map");
  require_map(differences, cost.size(), CV_32FC2, "The map of differences");
  require_optional_map(textured, cost.size(), CV_8UC1, "The map of textured pixels");
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
      scores.consistent_pixels += static_cast<double>(difference[1]) <= right_pixels;
      if (textured.empty() || textured.at<uchar>(y, x) == 0) continue;
      ++scores.textured;
      scores.low_cost_textured += c < 0.2f;
    }
  }
  for (double* sum : {&scores.mean_cost, &scores.low_cost, &scores.consistent_relative,
                      &scores.consistent_pixels}) {
    *sum = share_of(*sum, scores.pixels);
  }
  scores.low_cost_textured = share_of(scores.low_cost_textured, scores.textured);
  return scores;
}

std::vector<SparsificationPoint> sparsification(const cv::Mat& distance, const cv::Mat& confidence,
                                                const GroundTruth& truth, const View& reference,
                                                const View& source) {
  std::vector<Sample> samples = collect_confident(distance, confidence, truth, reference, source);
  std::erase_if(samples, [](const Sample& s) { return !s.non_occluded || !s.in_source; });
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
  for (const Sample& sample : collect_confident(distance, confidence, truth, reference, source)) {
    if (!sample.predicted || !sample.in_source) continue;
    const auto above = std::upper_bound(limits.begin() + 1, limits.end() - 1, sample.confidence);
    ReliabilityBin& bin = bins[static_cast<std::size_t>(above - limits.begin() - 1)];
    bin.pixels += 1;
    bin.mean_confidence += sample.confidence;
    bin.right += is_right(sample);
  }
  for (ReliabilityBin& bin : bins) {
    bin.mean_confidence = share_of(bin.mean_confidence, bin.pixels);
    bin.right = share_of(bin.right, bin.pixels);
  }
  return bins;
}

}  // namespace widestereo
