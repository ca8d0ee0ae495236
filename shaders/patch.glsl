// SPDX-License-Identifier: MIT
// Matching cost of a plane hypothesis: the reference pixel's patch is mapped through the plane into each
// source image with the source's real camera model and compared by ZNCC.

#define NO_INFORMATION_COST 1.0f
// A coordinate for sample_image() beyond every image's apron.
#define OUTSIDE_TEXEL -1e6f
// Positions are drawn to the middle of the image, by a ten-thousandth of a pixel in 500: rounding would put every other
// one of those that lie on its first or last pixels, as of rectified cameras, beyond them, where nothing is seen. What is
// left of the distance from the middle, and half of what is not.
#define DRAWN 0.9999996f
#define HALF_UNDRAWN 2e-7f

FN bool in_image(ivec4 size, ivec2 pixel) {
  return pixel.x >= 0 && pixel.y >= 0 && pixel.x < size.x && pixel.y < size.y;
}

#ifdef HAS_PATCH_TILE
#include "patch_tile.glsl"
#endif

// The first offset from x on a grid of this step that begins with `first` which lies in an image, whose first pixel is 0.
FN int first_in_image(int x, int first, int step) {
  while (x + first < 0) first += step;
  return first;
}

// The offsets from the pixel of a grid from `first` to `radius` that lie in the image: the first ones (x, y) and the
// limits of the last (z, w).
FN ivec4 grid_in_image(ivec4 size, ivec2 pixel, ivec2 first, int radius, ivec2 step) {
  return ivec4(first_in_image(pixel.x, first.x, step.x), first_in_image(pixel.y, first.y, step.y),
               min(radius, size.x - 1 - pixel.x), min(radius, size.y - 1 - pixel.y));
}

FN ivec2 nearest_in_image(ivec4 size, ivec2 pixel) {
  return ivec2(clamp(pixel.x, 0, size.x - 1), clamp(pixel.y, 0, size.y - 1));
}

// Whether the reference has a ray and an intensity there.
FN bool is_usable(CONTEXT_ARGUMENT ivec2 pixel, vec4 ray) {
  return ray.w != 0.0f && intensity_at(CONTEXT REFERENCE, pixel) >= 0.0f;
}

// A pixel in the coordinates of sample_image(); texture units round positions to more than they are drawn.
FN vec2 texel_scale(CONTEXT_ARGUMENT_ONLY) {
  float texels = float(TEXELS_PER_PIXEL);
#ifdef HAS_DEVICE_FILTER
  if (FILTER == FILTER_DEVICE) return texels * filtered_texel_unit(CONTEXT_ONLY);
#endif
  texels = DRAWN * texels;
  return vec2(texels, texels);
}

// A displacement (pixels) in those coordinates.
FN vec2 to_texels(vec2 scale, vec2 displacement) {
  return vec2(scale.x * displacement.x, scale.y * displacement.y);
}

// And where a position (pixels) lies in an image of this size.
FN vec2 texel_at(CONTEXT_ARGUMENT ivec4 size, vec2 position) {
  vec2 texel = to_texels(texel_scale(CONTEXT_ONLY), position);
#ifdef HAS_DEVICE_FILTER
  if (FILTER == FILTER_DEVICE) return texel + (float(TEXEL_APRON) + 0.5f) * filtered_texel_unit(CONTEXT_ONLY);
#endif
  return texel + vec2(HALF_UNDRAWN * float(TEXELS_PER_PIXEL * (size.x - 1)),
                      HALF_UNDRAWN * float(TEXELS_PER_PIXEL * (size.y - 1)));
}

// A camera that projects into them.
FN CameraParameters camera_of_texels(CONTEXT_ARGUMENT CameraParameters camera, int model) {
  vec2 scale = texel_scale(CONTEXT_ONLY);
  vec2 centre = texel_at(CONTEXT camera.size, vec2(camera.intrinsics.z, camera.intrinsics.w));
  camera.intrinsics = vec4(scale.x * camera.intrinsics.x, scale.y * camera.intrinsics.y, centre.x, centre.y);
  camera.domain.z = scale.x * camera.domain.z;
  if (model == CAMERA_POLYNOMIAL_FISHEYE) camera.domain.w = scale.y * camera.domain.w;
  return camera;
}

// Bilinear intensity, negative where it is not seen: any share of a masked texel outweighs the others (of half precision,
// from 1/32768 on), and every image is surrounded by masked ones. The weights are exact, or those of the texture units
// (1/256 on most GPUs).
FN float sample_image(CONTEXT_ARGUMENT int view, ivec4 size, vec2 texel) {
#ifdef HAS_DEVICE_FILTER
  if (FILTER == FILTER_DEVICE) return filtered_texel(CONTEXT view, texel);
#endif
  float x = min(float(TEXELS_PER_PIXEL * size.x), max(-2.0f, texel.x));
  float y = min(float(TEXELS_PER_PIXEL * size.y), max(-2.0f, texel.y));
  float left = floor(x);
  float top = floor(y);
  vec4 taps = texel_taps(CONTEXT view, ivec2(int(left), int(top)));
  float across = x - left;
  float upper = taps.x + across * (taps.y - taps.x);
  float lower = taps.z + across * (taps.w - taps.z);
  return upper + (y - top) * (lower - upper);
}

// Projects the point in a direction of the source, at inverse distance w along a reference ray; false where it is not in
// front, as on the zero ray of a pixel that has none.
FN bool project_in_front(CameraParameters camera, int model, vec3 direction, float w, OUT(vec2) position) {
  bool inside = project(camera, model, direction, position);
  return inside && w > 0.0f;
}

// Direction in the source of the plane's point on a reference ray.
FN vec3 warp_direction(PlaneWarp warp, vec3 ray) {
  return vec3(dot(warp.row0, ray), dot(warp.row1, ray), dot(warp.row2, ray));
}

// Projects the plane's point on one reference ray into a source; false where the plane is not in front.
FN bool warp_ray(PlaneWarp warp, CameraParameters camera, int model, vec3 ray, OUT(vec2) position) {
  return project_in_front(camera, model, warp_direction(warp, ray), dot(warp.m, ray), position);
}

FN bool warp_pixel(CONTEXT_ARGUMENT PlaneWarp warp, CameraParameters camera, int model, ivec2 pixel,
                   OUT(vec2) position) {
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  // No branch around it, so that a patch's anchors are projected side by side.
  vec4 ray = ray_at(CONTEXT REFERENCE, nearest_in_image(size, pixel));
  bool inside = warp_ray(warp, camera, model, vec3(ray.x, ray.y, ray.z), position);
  return inside && in_image(size, pixel);
}

// Where the point at inverse distance w along a reference ray lands in the source; false where it cannot.
FN bool position_in_source(CONTEXT_ARGUMENT int source, vec3 ray, float w, OUT(vec2) position) {
  CameraParameters camera = PARAMETERS.cameras[source];
  vec3 direction = direction_in_source(pair_between(CONTEXT REFERENCE, source), ray, w);
  return project_in_front(camera, model_of(CONTEXT camera), direction, w, position);
}

// The pixel of the source in which the point lands; false where it lands outside.
FN bool pixel_in_source(CONTEXT_ARGUMENT int source, vec3 ray, vec3 m, OUT(ivec2) q) {
  CameraParameters camera = PARAMETERS.cameras[source];
  vec2 position;
  q = ivec2(0, 0);
  if (!position_in_source(CONTEXT source, ray, dot(m, ray), position)) return false;
  // Before the conversion, which is defined only for what an integer holds.
  if (!(position.x >= -0.5f && position.y >= -0.5f && position.x < float(camera.size.x) &&
        position.y < float(camera.size.y))) {
    return false;
  }
  q = ivec2(int(floor(position.x + 0.5f)), int(floor(position.y + 0.5f)));
  return in_image(camera.size, q);
}

// The plane (m, cost) that a source holds where the pixel's point lands in it; INVALID_COST where it lands
// outside.
FN vec4 hypothesis_in_source(CONTEXT_ARGUMENT int source, vec3 ray, vec3 m) {
  ivec2 q;
  if (!pixel_in_source(CONTEXT source, ray, m, q)) return vec4(0.0f, 0.0f, 0.0f, INVALID_COST);
  return hypothesis_at(CONTEXT source, q);
}

// Whether a source may see the point, if not enough of the patch around it for a cost.
FN bool in_some_source(CONTEXT_ARGUMENT vec3 ray, vec3 m) {
  ivec2 q;
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    if (pixel_in_source(CONTEXT source_at(CONTEXT i), ray, m, q)) return true;
  }
  return false;
}

// A ray of the reference for the group's patches: of the tile, in the axes of the source, where there is one.
FN vec4 ray_of_patch(CONTEXT_ARGUMENT ivec2 pixel) {
#ifdef HAS_PATCH_TILE
  if (TILED) return tile_at(CONTEXT place_of_pixel(CONTEXT pixel), 0);
#endif
  return ray_at(CONTEXT REFERENCE, pixel);
}

// Whether the plane is in front at the corners of the patch, and so everywhere in it. `m`: in the axes of those rays.
FN bool patch_is_in_front(CONTEXT_ARGUMENT ivec2 pixel, vec3 m) {
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  for (int i = 0; i < 4; ++i) {
    int x = pixel.x + ((i & 1) == 0 ? -WINDOW_RADIUS : WINDOW_RADIUS);
    int y = pixel.y + (i < 2 ? -WINDOW_RADIUS : WINDOW_RADIUS);
    vec4 ray = ray_of_patch(CONTEXT nearest_in_image(size, ivec2(x, y)));
    if (dot(m, vec3(ray.x, ray.y, ray.z)) < 0.0f) return false;
  }
  return true;
}

// Second-order map of pixel offsets into the source: u = u0 + x ux + y uy + x^2 uxx + x y uxy + y^2 uyy.
struct PatchMap {
  vec2 u0;
  vec2 ux;
  vec2 uy;
  vec2 uxx;
  vec2 uxy;
  vec2 uyy;
};

// One axis of the map from the projections of -r, 0 and +r; at an image border one side is enough.
FN bool map_axis(vec2 centre, bool has_low, vec2 low, bool has_high, vec2 high, float r,
                 OUT(vec2) slope, OUT(vec2) curvature) {
  curvature = vec2(0.0f, 0.0f);
  slope = vec2(0.0f, 0.0f);
  if (has_low && has_high) {
    slope = (0.5f / r) * (high - low);
    curvature = (0.5f / (r * r)) * ((high - centre) - (centre - low));
    return true;
  }
  if (has_high) slope = (1.0f / r) * (high - centre);
  if (has_low) slope = (1.0f / r) * (centre - low);
  return has_high || has_low;
}

// Fits the map to exactly projected anchors: the centre, the ends of both axes and, for the quadratic
// warp, the corners. False where an axis has no anchor.
FN bool map_patch(CONTEXT_ARGUMENT PlaneWarp warp, CameraParameters camera, int model, ivec2 pixel,
                  vec2 centre, OUT(PatchMap) map) {
  int r = WINDOW_RADIUS;
  map.u0 = centre;
  map.uxy = vec2(0.0f, 0.0f);
  vec2 low;
  vec2 high;
  bool has_low = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x - r, pixel.y), low);
  bool has_high = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x + r, pixel.y), high);
  bool has_x = map_axis(centre, has_low, low, has_high, high, float(r), map.ux, map.uxx);
  has_low = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x, pixel.y - r), low);
  has_high = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x, pixel.y + r), high);
  bool has_y = map_axis(centre, has_low, low, has_high, high, float(r), map.uy, map.uyy);
  if (WARP == WARP_QUADRATIC) {
    vec2 a;
    vec2 b;
    vec2 c;
    vec2 d;
    bool corners = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x - r, pixel.y - r), a);
    corners =
        warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x + r, pixel.y - r), b) && corners;
    corners =
        warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x - r, pixel.y + r), c) && corners;
    corners =
        warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x + r, pixel.y + r), d) && corners;
    if (corners) map.uxy = (0.25f / float(r * r)) * ((d - c) - (b - a));
  }
  return has_x && has_y;
}

// How far what is curved lies from the affine map of the centre, on average over the samples of this radius: all matches
// would be displaced by as much.
FN vec2 mean_bend(PatchMap map, int radius) {
  float mean_square = float(radius * (radius + 1)) * (1.0f / 3.0f);
  return mean_square * (map.uxx + map.uyy);
}

// What a patch of the reference starts from in a source.
struct PatchStart {
  PlaneWarp warp;
  float centre_a;  // intensity of the reference at the centre
  float centre_b;  // and of the source: sums are taken relative to them, single precision then suffices
  PatchMap map;    // into what sample_image() reads
};

// False where the source does not see the plane's front at the patch's centre, or too little around it. `mapped`: with a
// map, for samples of this radius.
FN bool begin_patch(CONTEXT_ARGUMENT ViewPair pair, CameraParameters camera, int model, int source,
                    ivec2 pixel, vec3 m, bool mapped, int radius, OUT(PatchStart) start) {
  if (side_of_source(pair, m) <= 0.0f) return false;
  start.warp = warp_through(pair, m);
  vec2 centre;
  if (!warp_pixel(CONTEXT start.warp, camera, model, pixel, centre)) return false;
  start.centre_b = sample_image(CONTEXT source, camera.size, texel_at(CONTEXT camera.size, centre));
  start.centre_a = intensity_at(CONTEXT REFERENCE, pixel);
  if (!(min(start.centre_a, start.centre_b) >= 0.0f)) return false;
#ifdef HAS_PATCH_TILE
  // As the tile's rays are.
  if (TILED) m = rotate(pair, m);
#endif
  if (!mapped) return patch_is_in_front(CONTEXT pixel, m);
  if (!map_patch(CONTEXT start.warp, camera, model, pixel, centre, start.map)) return false;
  if (WARP != WARP_QUADRATIC) start.map.u0 = start.map.u0 + mean_bend(start.map, radius);
  start.map.u0 = texel_at(CONTEXT camera.size, start.map.u0);
  vec2 scale = texel_scale(CONTEXT_ONLY);
  start.map.ux = to_texels(scale, start.map.ux);
  start.map.uy = to_texels(scale, start.map.uy);
  if (WARP == WARP_QUADRATIC) {
    start.map.uxx = to_texels(scale, start.map.uxx);
    start.map.uxy = to_texels(scale, start.map.uxy);
    start.map.uyy = to_texels(scale, start.map.uyy);
  }
  return true;
}

// The part of the map for one row of the patch, from its first column x on: start + dx (slope + dx bend).
struct RowMap {
  vec2 start;
  vec2 slope;
  vec2 bend;
};

FN RowMap map_row(CONTEXT_ARGUMENT PatchMap map, float x, float y) {
  RowMap row;
  row.start = map.u0 + x * map.ux + y * map.uy;
  row.slope = map.ux;
  row.bend = map.uxx;
  if (WARP == WARP_QUADRATIC) {
    row.start = row.start + (x * x) * map.uxx + (x * y) * map.uxy + (y * y) * map.uyy;
    row.slope = row.slope + (2.0f * x) * map.uxx + y * map.uxy;
  }
  return row;
}

FN vec2 map_offset(CONTEXT_ARGUMENT RowMap row, float x) {
  if (WARP == WARP_QUADRATIC) return row.start + x * (row.slope + x * row.bend);
  return row.start + x * row.slope;
}

// 1 - ZNCC in [0, 2] of sums over n samples; a patch without texture carries no information.
FN float zncc_cost(float n, float sum_a, float sum_b, float sum_aa, float sum_bb, float sum_ab,
                   float smallest_variance) {
  float variance_a = sum_aa - sum_a * sum_a / n;
  float variance_b = sum_bb - sum_b * sum_b / n;
  float covariance = sum_ab - sum_a * sum_b / n;
  if (variance_a < n * smallest_variance) return NO_INFORMATION_COST;
  float scale = sqrt(max(variance_a, 0.0f) * max(variance_b, 0.0f));
  if (scale <= 0.0f) return NO_INFORMATION_COST;
  return 1.0f - clamp(covariance / scale, -1.0f, 1.0f);
}

#define COLUMN_STEP (PATTERN == PATTERN_CHECKERBOARD ? 2 : 1)

// First column of the row of a patch of this radius: on the checkerboard the centre is a sample.
FN int first_column(CONTEXT_ARGUMENT int radius, int row) {
  return -radius + (PATTERN == PATTERN_CHECKERBOARD ? (radius + row) & 1 : 0);
}

// About the eighth root of exp(a) for a >= 0, with the same bits everywhere (elementary.glsl); of a sum it is about the
// product of both.
FN float root_of_growth(float a) { return 1.0f + 0.125f * a; }

FN float eighth_power(float t) {
  t = t * t;
  t = t * t;
  return t * t;
}

// The eighth root of how unlike two intensities of the reference are, from 1 on, by their difference: pixels of one
// surface mostly are alike. `inverse_scale`: of PARAMETERS.support, which loops read once.
FN float root_of_unlikeness(float difference, float inverse_scale) {
  return 1.0f + (0.125f * inverse_scale) * abs(difference);
}

// Weight of a sample whose intensity differs from the centre's by `difference`. `inverse_scale`: PARAMETERS.support.x,
// which loops read once.
FN float sample_weight(CONTEXT_ARGUMENT float difference, float inverse_scale) {
  if (WEIGHTED == 0) return 1.0f;
  return 1.0f / eighth_power(root_of_unlikeness(difference, inverse_scale));
}

// Samples of the patch that the reference has.
FN int samples_in_reference(CONTEXT_ARGUMENT ivec2 pixel) {
  int samples = 0;
  for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
    for (int dx = first_column(CONTEXT WINDOW_RADIUS, dy); dx <= WINDOW_RADIUS; dx += COLUMN_STEP) {
      if (intensity_at(CONTEXT REFERENCE, ivec2(pixel.x + dx, pixel.y + dy)) >= 0.0f) ++samples;
    }
  }
  return samples;
}

// Cost of a hypothesis against one source, INVALID_COST where too little of the patch is seen there.
FN float source_cost(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m) {
  int reference = REFERENCE;
  ViewPair pair = pair_between(CONTEXT reference, source);
  CameraParameters camera = PARAMETERS.cameras[source];
  int model = model_of(CONTEXT camera);
  PatchStart start;
  if (!begin_patch(CONTEXT pair, camera, model, source, pixel, m, WARP != WARP_EXACT, WINDOW_RADIUS, start)) {
    return INVALID_COST;
  }

  int last_row = PARAMETERS.cameras[reference].size.y - 1;
  float offset_a = start.centre_a;
  float least_seen = 0.0f;  // of both; what is masked lies far below
#ifdef HAS_PATCH_TILE
  vec3 m_turned = rotate(pair, m);
  vec3 baseline = translation(pair);
  PatchInTile in_tile = patch_in_tile(CONTEXT pixel);
  if (TILED) {
    offset_a = WEIGHTED == 0 ? 0.0f : offset_a - TILE_GREY;
    least_seen = -TILE_GREY;
  }
#endif
  CameraParameters camera_of_samples = camera;
  if (WARP == WARP_EXACT) camera_of_samples = camera_of_texels(CONTEXT camera, model);
  float inverse_scale = PARAMETERS.support.x;
  float samples = 0.0f;
  float n = 0.0f;  // sum of weights
  float sum_a = 0.0f;
  float sum_b = 0.0f;
  float sum_aa = 0.0f;
  float sum_bb = 0.0f;
  float sum_ab = 0.0f;
  UNROLL_ROWS for (int top = -WINDOW_RADIUS; top <= WINDOW_RADIUS; top += ROWS_AT_ONCE) {
    UNROLL for (int turn = 0; turn < ROWS_AT_ONCE; ++turn) {
      int dy = top + turn;
      if (ROWS_AT_ONCE > 1 && dy > WINDOW_RADIUS) break;
      // Columns are constants then.
      int first = ROWS_AT_ONCE > 1 ? turn - WINDOW_RADIUS : first_column(CONTEXT WINDOW_RADIUS, dy);
      ivec2 begin = ivec2(pixel.x + first, pixel.y + dy);
      IntensityRow intensities_of_row = intensity_row(CONTEXT reference, begin);
      // The image ends where its intensities are masked.
      RayRow rays_of_row = ray_row(CONTEXT reference, ivec2(begin.x, clamp(begin.y, 0, last_row)));
      RowMap row;
      if (WARP != WARP_EXACT) row = map_row(CONTEXT start.map, float(first), float(dy));
      UNROLL_COLUMNS for (int dx = 0; dx <= WINDOW_RADIUS - first; dx += COLUMN_STEP) {
        float a;
        vec3 direction;
#ifdef HAS_PATCH_TILE
        if (TILED) {
          vec4 of_tile = ray_and_intensity_in_tile(CONTEXT in_tile, dx, dy + WINDOW_RADIUS);
          a = of_tile.w;
          vec3 turned = vec3(of_tile.x, of_tile.y, of_tile.z);
          direction = turned + dot(m_turned, turned) * baseline;
        } else
#endif
        {
          a = intensity_in_row(intensities_of_row, dx);
          if (WARP == WARP_EXACT) {
            vec4 ray = ray_in_row(rays_of_row, dx);
            direction = warp_direction(start.warp, vec3(ray.x, ray.y, ray.z));
          }
        }
        vec2 texel;
        if (WARP == WARP_EXACT) {
          float d;
          bool inside = project_in_domain(camera_of_samples, model, direction, d, texel);
          // The source is masked there, as it is outside its field of view. A condition would be kept in a register until
          // the sample is there.
          texel.x = inside ? texel.x : OUTSIDE_TEXEL;
        } else {
          texel = map_offset(CONTEXT row, float(dx));
        }
        float b = sample_image(CONTEXT source, camera.size, texel);
        bool seen = min(a, b) >= least_seen;
        a -= offset_a;
        b -= start.centre_b;
        float weight = sample_weight(CONTEXT a, inverse_scale);
        float weighted_a = weight * a;
        float weighted_b = weight * b;
        ADD_WHERE(seen, samples, 1.0f);
        if (WEIGHTED != 0) ADD_WHERE(seen, n, weight);
        ADD_WHERE(seen, sum_a, weighted_a);
        ADD_WHERE(seen, sum_b, weighted_b);
        ADD_WHERE(seen, sum_aa, weighted_a * a);
        ADD_WHERE(seen, sum_bb, weighted_b * b);
        ADD_WHERE(seen, sum_ab, weighted_a * b);
      }
    }
  }
  if (WEIGHTED == 0) n = samples;
  // The reference may have less than the window; its samples are counted only where that decides.
  float least = PARAMETERS.patch_limits.y;
  if (samples < least * float(samples_of_patch(WINDOW_RADIUS, PATTERN)) &&
      samples < least * float(samples_in_reference(CONTEXT pixel))) {
    return INVALID_COST;
  }
  return zncc_cost(n, sum_a, sum_b, sum_aa, sum_bb, sum_ab, PARAMETERS.patch_limits.x);
}

// Mean over the best sources that see the patch, of those that tell distances if any of them does; INVALID_COST when none
// sees it.
FN float patch_cost(CONTEXT_ARGUMENT ivec2 pixel, vec3 m) {
  if (ONE_SOURCE) return source_cost(CONTEXT source_at(CONTEXT 0), pixel, m);
  vec4 of_pixel = ray_at(CONTEXT REFERENCE, pixel);
  vec3 ray = vec3(of_pixel.x, of_pixel.y, of_pixel.z);
  float longest = longest_squared_baseline_across(CONTEXT ray);
  float best_of_others = INVALID_COST;
  float best[MAX_IMAGES];
  int count = 0;
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    int source = source_at(CONTEXT i);
    float cost = source_cost(CONTEXT source, pixel, m);
    if (cost >= INVALID_COST) continue;
    if (!tells_distance(CONTEXT source, ray, longest)) {
      best_of_others = min(best_of_others, cost);
      continue;
    }
    int place = count;
    while (place > 0 && best[place - 1] > cost) {
      best[place] = best[place - 1];
      --place;
    }
    best[place] = cost;
    ++count;
  }
  count = min(count, PARAMETERS.search.z);
  if (count == 0) return best_of_others;
  float sum = 0.0f;
  for (int i = 0; i < count; ++i) sum += best[i];
  return sum / float(count);
}
