// SPDX-License-Identifier: MIT
#include "schedule/work.h"

#include <algorithm>
#include <array>

namespace widestereo {
namespace {

// Counted by hand in the shaders' functions of these names; tests/kernel/work_test.cpp counts them
// again by running the functions with numbers that count.
constexpr int side_of_source = 21;  // a rotation, a scalar product and a sum
constexpr int warp_through = 18;
constexpr int warp_direction = 15;
constexpr int scalar_product = 5;  // what is in front
constexpr int limit_of_field_of_view = 1;
constexpr int map_row_affine = 8;
constexpr int map_row_quadratic = 32;
constexpr int map_offset_affine = 4;
constexpr int map_offset_quadratic = 8;
constexpr int map_axis = 15;
constexpr int mean_bend = 7;  // and its sum with the centre
constexpr int slopes_to_texels = 4;
constexpr int bends_to_texels = 6;
constexpr int map_corners = 9;
constexpr int weight_of_sample = 7;  // two products, a sum, an eighth power and a division
constexpr int zncc_cost = 15;        // and the visible share's limit

bool is_exact(const KernelConstants& c) { return c.filter == static_cast<int>(Filter::exact); }

/// Positions are drawn to the middle, unless texture units round them to more.
bool is_scaled(const KernelConstants& c) { return c.texels_per_pixel > 1 || is_exact(c); }

/// Two products, and the sums with where texels begin, or are drawn to.
int texel_at(const KernelConstants& c) { return (is_scaled(c) ? 2 : 0) + (is_exact(c) ? 4 : 2); }

/// Where texels are not pixels.
int camera_of_texels(int model) {
  return model == static_cast<int>(CameraModel::polynomial_fisheye) ? 4 : 3;
}

/// Texture units filter by themselves.
int sample_image(int filter) { return filter == static_cast<int>(Filter::exact) ? 11 : 0; }

/// Of project_in_domain(); sources of several models count as pinholes, which take least.
int projection(int model) {
  constexpr int common = 6;       // the length
  constexpr int perspective = 3;  // a reciprocal and two products with it
  constexpr int decentring = 22;
  constexpr int radial = 6;
  constexpr int rational = 13;
  constexpr int prisms = 8;
  constexpr int fisheye = 6;
  constexpr int radial_of_fisheye = 8;
  constexpr int of_angle = 2;  // its square, and the product with it
  constexpr int two_more_coefficients = 4;
  constexpr int polynomial_of_fisheye = 24;
  constexpr int to_pixels = 6;
  constexpr int shear = 2;
  switch (static_cast<CameraModel>(model)) {
    case CameraModel::pinhole_radtan:
      return common + perspective + radial + decentring + to_pixels;
    case CameraModel::pinhole_rational:
      return common + perspective + rational + decentring + prisms + to_pixels;
    case CameraModel::kannala_brandt:
      return common + fisheye + radial_of_fisheye + of_angle + to_pixels;
    case CameraModel::thin_prism_fisheye:
      return common + fisheye + radial_of_fisheye + decentring + prisms + to_pixels;
    case CameraModel::rad_tan_thin_prism_fisheye:
      return common + fisheye + radial_of_fisheye + two_more_coefficients + of_angle + decentring +
             prisms + to_pixels;
    case CameraModel::polynomial_fisheye:
      return common + fisheye + polynomial_of_fisheye + to_pixels + shear;
    case CameraModel::double_sphere:
      return common + 10 + perspective + to_pixels;
    case CameraModel::unified:
      return common + 3 + perspective + to_pixels;
    case CameraModel::extended_unified:
      return common + 9 + perspective + to_pixels;
    case CameraModel::field_of_view:
      return common + 7 + to_pixels;
    case CameraModel::mei:
      return common + 3 + perspective + radial + decentring + to_pixels;
    case CameraModel::equirectangular:
      return common + 7 + to_pixels;
    case CameraModel::pinhole:
      break;
  }
  return common + perspective + to_pixels;
}

/// Bytes of a pixel that a kernel reads or writes at least once, of these maps.
enum Map : unsigned {
  ray = 1,
  intensity = 2,
  plane = 4,
  checks = 8,
  prior = 16,
  nearest = 32,
  winner = 64,
  half_of_planes = 128,     // one colour's
  quarter_of_planes = 256,  // the coarser level's
  finer_intensities = 512,
  texels = 1024,
  half_of_checks = 2048,
};

int bytes_of(unsigned maps, const KernelConstants& c) {
  const int of_texels = c.texels_per_pixel * c.texels_per_pixel * bytes_of_texel(c);
  const std::array<int, 12> bytes = {16, 4, 16, 16, 16, 4, 4, 8, 4, 16, of_texels, 8};
  int sum = 0;
  for (unsigned i = 0; i < bytes.size(); ++i) {
    if ((maps >> i & 1) != 0) sum += bytes[i];
  }
  return sum;
}

struct Traffic {
  unsigned read = 0;
  unsigned read_in_sources = 0;
  unsigned written = 0;
};

Traffic traffic_of(const Dispatch& dispatch, int sources) {
  constexpr unsigned seen = ray | intensity;
  switch (dispatch.kernel) {
    case Kernel::initialise:
      return {seen, texels, plane};
    case Kernel::iterate:
      return {seen | plane | checks, texels, half_of_planes | half_of_checks};
    case Kernel::iterate_raster:
      return {seen | plane, texels, plane | checks};
    case Kernel::transfer_clear:
      return {0, 0, nearest | winner};
    case Kernel::transfer_nearest:
      return {ray | plane, 0, nearest};
    case Kernel::transfer_winner:
      return {ray | plane | nearest, 0, winner};
    case Kernel::transfer_gather:
      return {seen | winner | plane, texels, plane};
    case Kernel::structure:
      return {seen | texels | plane, sources > 1 ? 0U | plane : 0U, prior};
    case Kernel::check:
      return {seen | plane | prior, plane, checks};
    case Kernel::check_for_vote:
      return {seen | plane, plane | texels, checks};
    case Kernel::ambiguity:
      return {seen | plane | checks, texels, checks};
    case Kernel::interpolate:
      return {intensity, 0, texels};
    case Kernel::downsample:
      return {finer_intensities, 0, intensity};
    case Kernel::sweep:
      return {seen, texels, plane};
    case Kernel::upsample:
      return {seen | quarter_of_planes, texels, plane};
    case Kernel::search: {
      const bool asks_sources = (dispatch.pass.candidates & 1u << CANDIDATE_SOURCE_PLANE) != 0;
      return {seen | plane, asks_sources ? texels | plane : texels, half_of_planes};
    }
    case Kernel::measure:
      return {seen | texels | plane, plane, checks};
    case Kernel::subpixel:
      // Their planes tell which of several sources sees the point.
      return {seen | texels | plane | checks, sources > 1 ? texels | plane : texels, checks};
    case Kernel::regress:
    case Kernel::vote_normal:
      return {seen | plane | checks, 0, prior};
    case Kernel::merge:
      return {ray | plane, plane, prior};
    case Kernel::adopt:
      return {prior | plane | seen, texels, plane};
    case Kernel::adopt_point:
      return {prior | plane | ray | checks, 0, prior | plane | checks};
    case Kernel::fill:
      return {seen | plane | checks | prior, 0, prior};
    case Kernel::adopt_fill:
      return {prior | plane | checks | seen, texels, plane | checks};
    case Kernel::vote:
      return {seen | plane | checks | prior, texels, prior};
    case Kernel::transfer_keep:
      return {ray | winner | plane, 0, prior};
    case Kernel::renew_point:
      return {seen | prior, 0, plane};
    case Kernel::renew:
      return {seen | prior, texels, plane};
  }
  return {};
}

/// Of a pixel that its smallest neighbourhood determines, and that one more tells the normal of
/// where the dispatch asks for normals.
double regression_operations(const Dispatch& dispatch) {
  if (dispatch.kernel != Kernel::regress) return 0;
  const kernel::PassParameters& pass = dispatch.pass;
  const bool normals = pass.deviation == 0 || (pass.candidates & REGRESS_NORMALS) != 0;
  const FitOperations operations;
  const int side = side_of_fit(pass.radius >> WHOLE_RADIUS_ROUND, pass.steps);
  const int of_neighbour =
      operations.of_neighbour + (pass.tolerance < 1 ? operations.of_neighbours_plane : 0);
  return (normals ? 2 : 1) * (operations.of_fit + side * (operations.of_row + side * of_neighbour));
}

}  // namespace

PatchOperations patch_operations(const KernelConstants& c) {
  const bool exact = c.warp == static_cast<int>(PatchWarp::exact);
  const bool quadratic = c.warp == static_cast<int>(PatchWarp::quadratic);
  const int weighting = c.weighted != 0 ? weight_of_sample : 0;
  const int warp_sample = warp_direction + projection(c.camera_model);
  const int warp_ray = warp_sample + scalar_product + limit_of_field_of_view;
  const int map_offset = quadratic ? map_offset_quadratic : map_offset_affine;
  // Two differences from the centre, a count, five sums of intensities and their products; weights
  // take a sum and two products more.
  const int sums = 2 + 1 + 8 + (c.weighted != 0 ? 3 : 0);
  PatchOperations operations;
  operations.of_sample =
      weighting + (exact ? warp_sample : map_offset) + sample_image(c.filter) + sums;
  operations.of_patch =
      side_of_source + warp_through + warp_ray + texel_at(c) + sample_image(c.filter) + zncc_cost;
  if (exact) {
    operations.of_patch +=
        4 * scalar_product + texel_at(c) + (is_scaled(c) ? camera_of_texels(c.camera_model) : 0);
  } else {
    const int anchors = quadratic ? 8 : 4;
    const int rows = 2 * c.window_radius + 1;
    operations.of_patch += anchors * warp_ray + 2 * map_axis + texel_at(c) +
                           (quadratic ? 0 : mean_bend) + (is_scaled(c) ? slopes_to_texels : 0) +
                           rows * (quadratic ? map_row_quadratic : map_row_affine);
  }
  if (quadratic) operations.of_patch += map_corners + (is_scaled(c) ? bends_to_texels : 0);
  return operations;
}

int side_of_fit(int radius, int steps) {
  radius = std::max(radius, SMALLEST_FIT_RADIUS);
  const int step = std::max(radius / steps, 1);
  return 2 * std::min(radius / step, steps) + 1;
}

KernelWork work_of(const Schedule& schedule, const Dispatch& dispatch) {
  const PatchOperations operations = patch_operations(schedule.constants);
  const auto samples = static_cast<double>(dispatch.samples);
  const double patches =
      samples / static_cast<double>(kernel::samples_of_patch(schedule.constants.window_radius,
                                                             schedule.constants.pattern));
  const auto pixels = static_cast<double>(dispatch.pixels);
  const int sources = schedule.constants.source_count;
  const Traffic traffic = traffic_of(dispatch, sources);
  const auto bytes = [&](unsigned maps) { return bytes_of(maps, schedule.constants); };
  return {.samples = samples,
          .operations = samples * operations.of_sample + patches * operations.of_patch +
                        pixels * regression_operations(dispatch),
          .texels = 4 * samples,
          .bytes = pixels * (bytes(traffic.read) + bytes(traffic.written) +
                             sources * bytes(traffic.read_in_sources))};
}

bool views_are_independent(const Schedule& schedule, const Dispatch& dispatch) {
  const int sources = schedule.constants.source_count;
  const Traffic traffic = traffic_of(dispatch, sources);
  return dispatch.views == sources + 1 && (traffic.read_in_sources & plane) == 0 &&
         (traffic.written & texels) == 0;
}

}  // namespace widestereo
