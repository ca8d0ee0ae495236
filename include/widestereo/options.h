// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "widestereo/error.h"

namespace widestereo {

/// How a patch is mapped into a source image (values of the kernels, shaders/parameters.glsl).
enum class PatchWarp : int {
  exact = 0,      ///< every sample through the real camera model
  affine = 1,     ///< affine map through 5 exactly projected anchors
  quadratic = 2,  ///< second-order map through 9 exactly projected anchors
};

/// How distances are drawn within [min_distance, max_distance].
enum class DistanceSampling : int {
  uniform = 0,  ///< uniform in distance, as in the paper
  inverse = 1,  ///< uniform in inverse distance
};

/// Order in which pixels are updated.
enum class Propagation : int {
  checkerboard = 0,  ///< red-black, 4 neighbours: parallel, deterministic
  raster = 1,        ///< the paper's sequential order; CPU only
};

/// Which pixels of a patch are compared (values of the kernels, shaders/parameters.glsl).
enum class PatchPattern : int {
  dense = 0,         ///< all
  checkerboard = 1,  ///< every other one
};

/// Intensities halfway between a source's pixels, from which the others follow bilinearly.
enum class Interpolation : int {
  linear = 0,  ///< none: samples are bilinear ones of the pixels
  cubic = 1,   ///< of Catmull and Rom's spline: keeps fine texture, as the reference has it
};

/// How samples are taken of pixels and half pixels, always bilinearly (values of the kernels,
/// shaders/parameters.glsl).
enum class Filter : int {
  exact = 0,   ///< in single precision. On CUDA with the CPU's very bits, at the price of speed
  device = 1,  ///< by the texture units of a GPU, in a fraction of the instructions; their
               ///< positions are rounded, to 1/256 pixel on most (cubic: 1/512), and pixels have
               ///< half precision, where a Vulkan device can write that. Exact on CPUs and on
               ///< Vulkan devices that cannot filter floats (StereoResult::filter and
               ///< VulkanMatcher::filter() say which)
};

/// How planes are found.
enum class SearchMethod : int {
  random = 0,   ///< the paper's: random planes, four neighbours, halved random perturbations
  pyramid = 1,  ///< sphere sweep, coarse to fine, eight strips, local plane regression
};

/// "exact" or "device".
std::string to_string(Filter filter);

/// Parameters of a match. Start from a preset, as Options::preset_named("quality"), and change what
/// you need: what is not set is that of `paper`, the algorithm as published, which is slower and
/// less accurate.
struct Options {
  /// What distances may be: the matcher squares them, and their inverses, in single precision.
  static constexpr double least_distance = 1e-6, most_distance = 1e9;
  static constexpr int most_levels = 8;
  static constexpr int largest_window_radius = 15;  ///< pixels

  std::string preset = "paper";
  double min_distance = 0.3;  ///< metres along the ray, at least least_distance
  double max_distance = 50;  ///< metres along the ray, more than min_distance by a share of 1e-5 at
                             ///< least, at most most_distance
  std::uint32_t seed = 1;

  SearchMethod search = SearchMethod::random;
  int window_radius = 5;  ///< patch of (2 r + 1)^2 pixels, 1..largest_window_radius
  PatchWarp warp = PatchWarp::exact;
  DistanceSampling sampling = DistanceSampling::uniform;
  Propagation propagation = Propagation::checkerboard;
  int first_iterations = 60;  ///< of the first view, started from random planes, 1..100000
  /// Of every further view, started from the first one's planes, 0..100000.
  int second_iterations = 8;
  int refinements =
      4;  ///< random perturbations per pixel and iteration, 0..16; range halved each time
  /// Cost = mean over this many of the source views that see the patch, best first, or over all of
  /// them if they are fewer; 1..8. Sources whose baseline across the ray is less than 5 % of the
  /// longest count where no other sees the patch.
  int best_sources = 1;
  PatchPattern pattern = PatchPattern::dense;
  /// Weight (1 + |difference| / (8 scale))^-8, about exp(-|difference| / scale), of a sample whose
  /// intensity differs from the centre's, grey levels (of 255), 0..10000; 0 = all weigh the same.
  double weight_scale = 0;
  Interpolation interpolation = Interpolation::linear;
  Filter filter = Filter::device;

  /// Of SearchMethod::pyramid: the image pyramid's levels, each half the size of the finer one,
  /// 1..most_levels; 0: as many as leave each coarsest image at least 40 whole pixels wide and
  /// high, so that what lies amid a blank wall comes near its edges, however large the images; in
  /// any case one for each number of the lists below, and fewer for many views
  /// (Matcher::most_views).
  int levels = 0;
  int sweep_steps = 64;  ///< inverse distances tried at the coarsest level, 1..10000
  /// Finest level last, 0..1000; the first number is that of all coarser levels, too. Not more than
  /// levels.
  std::vector<int> level_iterations = {2, 2, 2};
  std::vector<int> level_regressions = {1, 2, 3};  ///< rounds of plane regression, likewise
  int regression_radius = 40;  ///< largest neighbourhood of a regressed plane, pixels, 2..64; of
                               ///< normals alone four times that
  int regression_steps = 4;    ///< of the grid of neighbours that count, in its radius, 1..16
  /// Intensity scale of the regression's weights, grey levels, 0.1..10000.
  double regression_scale = 12;
  /// A neighbourhood of an eighth, a quarter or half the radius is taken where it determines the
  /// plane to this standard deviation (source pixels, nominal: neighbours count as independent), or
  /// where the next larger one contradicts it; 1e-6..1000. Each further round of a level asks for
  /// 0.6 of the one before.
  double regression_precision = 0.021;
  /// The first regression of a level averages what neighbours' patches match best, to sub-pixel
  /// accuracy by least squares, instead of where the search has left them.
  bool subpixel_match = true;
  /// After each regression at full size, pixels that fail the checks take the plane of accepted
  /// ones up to this many pixels away, 0..10000; 0 = none do. Those that agree with another view to
  /// a pixel take it only where it matches about as well as their own. Limits of checks (below)
  /// decide what is accepted in the end; repair goes by their defaults.
  int repair_radius = 32;
  /// After that, every pixel takes the plane, of those around and its own of before the regression,
  /// for which the planes up to this many pixels away and likeness of intensity in the other view
  /// speak most, 0..64; 0 = it keeps its own.
  int vote_radius = 10;
  /// Then the inverse distances of a pixel's plane and of those that other views hold for the same
  /// point, within half a pixel of displacement, are averaged: part of their noise is their own.
  bool merge_views = true;
  /// At the end, pixels take the normal, of those around, that most planes around agree with.
  bool normal_vote = true;
  /// Share of its cost by which the nearest planes must match better than the farthest, so that sky
  /// comes out as far, 0..1.
  double far_preference = 0;
  double step_pixels = 1;     ///< first perturbation, source pixels, 0..1000; halved each iteration
  double step_normal = 0.5;   ///< first perturbation of a unit normal, at the coarsest level only,
                              ///< 0..2; halved each iteration
  bool source_planes = true;  ///< try the source views' planes in the last iteration
  /// Coarser pixels around a finer one whose planes it starts from, the best of them, 1..4.
  int coarse_planes = 4;
  /// On all levels but the coarsest, iterations try the planes of far pixels and of near ones by
  /// turns instead of both.
  bool alternate_strips = false;

  /// Of a frame that starts from the previous one's planes (Matcher::match_next()).
  int warm_iterations = 8;  ///< of every view, all at full size, 0..100000
  /// SearchMethod::pyramid: rounds of plane regression, 0..1000. Fewer than a cold frame's, because
  /// frames average, too, and neighbourhoods that overlap from frame to frame would spread across
  /// edges.
  int warm_regressions = 1;

  /// What is given in grey levels, here and in the kernels, is meant for images of usual contrast:
  /// a Matcher multiplies intensities of which all but 4 % lie within less than 64 grey levels by
  /// up to this factor, 1..1000, so that they fill these; 1 = none. A CudaMatcher or VulkanMatcher
  /// takes images as they are; contrast_gain() tells the factor.
  double max_gain = 1;
  double min_texture = 0.5;  ///< grey levels (0..255): patches with a smaller standard deviation
                             ///< carry no information
  double min_visible = 0.6;  ///< share of the patch that must be seen in the source, 0.01..1
  double max_tilt = 85;      ///< degrees between normal and viewing ray, 0..90

  // Checks of the planes that were found, which leave the planes as they are.
  /// Left-right check: largest relative difference of distance, 0..999.
  double consistency_relative = 0.02;
  double consistency_pixels = 1.0;  ///< left-right check: largest displacement, pixels, 0..999
  /// Largest 1 - ZNCC accepted, 0..2. Noise on blank walls matches badly though the plane is right,
  /// which min_confidence knows: `fast` and `quality` accept any cost.
  double max_cost = 0.5;
  /// Pixels between min_distance and max_distance in the source view, 0..10000.
  double min_parallax = 0.5;
  /// Smallest share of the planes around (in 41x41 pixels) that put the pixel's point within a
  /// source pixel of its own place, 0..1; fewer are a speckle.
  double min_support = 0.1;
  /// Smallest ViewResult::confidence accepted, 0..1: what is more likely wrong than right is
  /// rejected; `fast` and `quality` ask for 0.7.
  double min_confidence = 0.5;
  /// Reject where a place 2, 4 or 8 source pixels away costs less by more than this, 0..2; 0 = not
  /// checked.
  double ambiguity_margin = 0;
  /// At the end, rejected pixels take the plane of accepted ones up to this many pixels away,
  /// 0..10000, and are marked; 0 = none do.
  int fill_radius = 0;

  /// Throws Error for an unknown name. Presets: "fast", "quality", "paper".
  static Options preset_named(const std::string& name);
  static std::vector<std::string> preset_names();
};

/// Throws Error naming the first value that is out of range or no enumerator.
void validate(const Options& options);

/// Every parameter as JSON text (an object).
std::string to_json(const Options& options);

}  // namespace widestereo
