// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "widestereo/rig.h"

namespace widestereo {

/// What a distance map is scored against. Maps have the reference view's size.
struct GroundTruth {
  cv::Mat distance;  ///< CV_32FC1, metres along the unit ray; <= 0 or non-finite: no ground truth
  cv::Mat valid;     ///< empty, or CV_8UC1, 0 = do not score
  cv::Mat
      occlusion;  ///< empty, or CV_8UC1: 255 visible in the source view, 0 occluded, 128 outside it
  cv::Mat normals;        ///< empty, or CV_32FC3, unit, reference frame
  cv::Mat image;          ///< empty, or CV_8UC1, grey levels: scores the textured regions too
  cv::Mat field_of_view;  ///< empty, or CV_8UC1, 0 = outside the lens's field of view: far_scores()
};

/// Textured: the grey levels of the square patch of this side around the pixel have at least this
/// standard deviation (of the population). Patches are cut at the image border and at the camera's
/// field of view, whose edge is no texture.
constexpr int texture_patch_side = 9;          ///< pixels
constexpr double texture_least_deviation = 4;  ///< grey levels

/// 255 where the image (CV_8UC1, grey levels) is textured, else 0; `field_of_view`: CV_8UC1, 0 =
/// outside. This and all functions below that take maps throw Error for other types than these,
/// empty maps that are needed and different sizes.
cv::Mat textured_pixels(const cv::Mat& image, const cv::Mat& field_of_view);

/// An edge of the true scene runs between horizontal or vertical neighbours, both inside the
/// camera's field of view, if the larger of their true distances exceeds the smaller by more than
/// this share of it, if their true normals differ by more than this angle, or if only one has a
/// true distance. Both are edge pixels, whatever GroundTruth::valid says. Interior: at least this
/// far from the nearest edge pixel (Euclidean, centre to centre).
constexpr double edge_distance_step = 0.05;
constexpr double edge_normal_step = 20;        ///< degrees
constexpr double interior_edge_clearance = 8;  ///< pixels

/// Scores over one set of pixels. Shares lie in [0, 1]; a pixel without prediction counts as bad.
/// Shares, means and medians over no pixel at all are NaN (null in JSON), but for completeness.
struct RegionScores {
  /// "all", where occlusion is known "non-occluded", then by angle "0-30 deg", "30-60 deg",
  /// "60-90 deg" and ">90 deg", and where there is an image "textured" and "textured interior"
  /// (textured, and not at an edge of the true scene) or, where true normals are not known,
  /// "textured no steps" (not at an edge of the true distances).
  std::string region;
  long pixels = 0;          ///< pixels scored
  double completeness = 0;  ///< share with a prediction, 0 of no pixel
  std::map<double, double>
      bad_relative;  ///< threshold (0.005 = 0.5 %) -> share with larger relative error
  std::map<double, double>
      bad_pixels;  ///< threshold (px) -> share with larger displacement in the source, of the
                   ///< pixels whose true point projects into the source image
  /// The same over those of them that have a prediction (and, for displacements, one that projects
  /// into the source).
  std::map<double, double> bad_relative_predicted, bad_pixels_predicted;
  double median_pixels = 0;        ///< px, the pixels of bad_pixels_predicted
  double mean_absolute = 0;        ///< metres, predicted pixels
  double root_mean_square = 0;     ///< metres, predicted pixels
  double median_absolute = 0;      ///< metres, predicted pixels
  double median_relative = 0;      ///< share, predicted pixels
  double mean_normal_angle = 0;    ///< degrees, pixels with a predicted and a true normal
  double median_normal_angle = 0;  ///< degrees, likewise
};

/// Scores `distance` (CV_32FC1, metres along the ray; <= 0 or non-finite = no prediction) of view
/// `reference` against ground truth. Displacements are those of the predicted point's projection in
/// view `source` from the true one's: a predicted point that does not project there counts as bad,
/// a pixel whose true point lies outside the source image has none. `normals` (may be empty) as in
/// GroundTruth. Field-angle bands and the textured regions are taken over the non-occluded pixels,
/// all where occlusion is not known. Throws Error, as all scores here do, for maps and views that
/// do not fit, and for views of one centre.
std::vector<RegionScores> evaluate(const cv::Mat& distance, const cv::Mat& normals,
                                   const GroundTruth& truth, const View& reference,
                                   const View& source);
/// The same of a view alone, without displacements.
std::vector<RegionScores> evaluate(const cv::Mat& distance, const cv::Mat& normals,
                                   const GroundTruth& truth, const View& reference);

/// The scores as a fixed-width table and as JSON text.
std::string to_table(const std::vector<RegionScores>& scores);
std::string to_json(const std::vector<RegionScores>& scores);

/// How far things without ground truth come out, such as a sky.
struct FarScores {
  double distance = 0;  ///< metres along the ray, taken as true
  long pixels = 0;      ///< inside the field of view, without a true distance, and the point at
                        ///< `distance` projects into the source image
  double right = 0;     ///< share of them whose predicted point lies within 2 px of that point; of
                        ///< no pixel NaN (null in JSON)
};

/// `truth` needs a field of view; GroundTruth::valid has no part in it. `far_distance`: metres
/// along the ray.
FarScores far_scores(const cv::Mat& distance, const GroundTruth& truth, const View& reference,
                     const View& source, double far_distance);

/// The scores as one line and as JSON text.
std::string to_table(const FarScores& scores);
std::string to_json(const FarScores& scores);

/// Quality without ground truth, as in Table 1 of Hu et al.: shares over the pixels with a plane.
/// Shares and means over no pixel are NaN (null in JSON).
struct ConsistencyScores {
  double consistent_relative = 0;  ///< left-right difference of distance at most 2 %
  double consistent_pixels = 0;    ///< left-right displacement at most 2 px
  double low_cost = 0;             ///< cost 1 - ZNCC below 0.2
  double low_cost_textured = 0;    ///< the same, of the textured pixels with a plane
  double mean_cost = 0;
  long pixels = 0;
  long textured = 0;  ///< of these
};

/// `differences`: CV_32FC2, relative difference and displacement in pixels; `cost`: CV_32FC1, 2 =
/// no plane; `textured`: empty (none is), or as textured_pixels() gives it.
ConsistencyScores consistency_scores(const cv::Mat& differences, const cv::Mat& cost,
                                     const cv::Mat& textured = {});

/// One point of a sparsification curve: error of the most confident pixels.
struct SparsificationPoint {
  double kept = 0;        ///< share of the scored pixels kept
  double confidence = 0;  ///< smallest confidence among them
  double bad_pixels = 0;  ///< share of them displaced by more than 2 px
};

/// Ten points, from the most confident tenth to all non-occluded pixels whose true point projects
/// into the source image. `confidence`: CV_32FC1.
std::vector<SparsificationPoint> sparsification(const cv::Mat& distance, const cv::Mat& confidence,
                                                const GroundTruth& truth, const View& reference,
                                                const View& source);

/// The curve as a fixed-width table (empty for no points) and as JSON text.
std::string to_table(const std::vector<SparsificationPoint>& curve);
std::string to_json(const std::vector<SparsificationPoint>& curve);

/// How often pixels of about the same confidence are right: displaced by at most 2 px in the
/// source.
struct ReliabilityBin {
  double low = 0, high = 1;  ///< confidence: low <= c < high, 1 itself in the last one
  long pixels = 0;
  double mean_confidence = 0;  ///< NaN (null in JSON), as is the next, of no pixel
  double right = 0;            ///< share of the pixels
};

/// Bins from 0 to 1 over all pixels, occluded ones too, that have a prediction and whose true point
/// projects into the source image.
std::vector<ReliabilityBin> reliability(const cv::Mat& distance, const cv::Mat& confidence,
                                        const GroundTruth& truth, const View& reference,
                                        const View& source);

/// The bins that have pixels as a fixed-width table (empty for none), each also with all above it,
/// and all bins as JSON text.
std::string to_table(const std::vector<ReliabilityBin>& bins);
std::string to_json(const std::vector<ReliabilityBin>& bins);

/// BGR picture of the relative error: green <= 0.5 %, yellow 1.6 %, red >= 5 %, blue = no
/// prediction, dimmed = occluded or outside the source view, black = no ground truth.
cv::Mat error_picture(const cv::Mat& distance, const GroundTruth& truth);

}  // namespace widestereo
