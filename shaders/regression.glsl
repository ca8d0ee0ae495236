// SPDX-License-Identifier: MIT
// Local plane regression: inverse distance is exactly linear in the ray, so the plane of a neighbourhood is
// a linear least-squares problem, weighted by how precisely each pixel was measured. It fills weak texture from
// confident surroundings and makes distances sub-pixel accurate.

#define UNMEASURED_VARIANCE 1e4f
// Variance (px^2) below which no measurement is believed.
#define SMALLEST_VARIANCE 4e-4f
// Largest scale (px) of the robust weights.
#define LARGEST_RESIDUAL 0.6f
// Largest displacement from the source's own plane (px) that counts.
#define LARGEST_DISPLACEMENT 5.0f
// Largest shift (px) that a sub-pixel match may find.
#define LARGEST_SHIFT 0.5f
// Variance (px^2) of a match that gets half the shift found.
#define HALF_SHIFT_VARIANCE 0.01f
// Smallest gain between a source's intensities and the reference's that a sub-pixel match believes.
#define SMALLEST_GAIN 0.2f
// Rounds for distances, the last two over the whole radius, the others over an eighth, a quarter and a half of it.
#define REGRESSION_ROUNDS 5
#define WHOLE_RADIUS_ROUND 3
// Rounds for normals alone: over an eighth, twice a half, and the whole radius.
#define NORMAL_ROUNDS 4
// Squared change of the slopes, in units of the first round's variance, that a larger neighbourhood may make.
#define LARGEST_SLOPE_CHANGE 6.0f
// First random slot; the search uses lower ones.
#define REGRESSION_SLOT 64
// Length of the tangent vectors, so that neighbouring rays have coordinates of order 1.
#define TANGENT_SCALE 128.0f

// Direction in the reference image, per pixel of displacement along `along` (unit) in the source: the inverse of
// the map's derivative at the pixel; `along` itself where the derivative cannot be measured.
FN vec2 reference_direction(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 along) {
  ViewPair pair = pair_between(CONTEXT PASS.reference, source);
  CameraParameters camera = PARAMETERS.cameras[source];
  int model = model_of(CONTEXT camera);
  vec2 left;
  vec2 right;
  vec2 up;
  vec2 down;
  bool ok = warp_pixel(CONTEXT pair, camera, model, m, ivec2(pixel.x - 1, pixel.y), left);
  ok = warp_pixel(CONTEXT pair, camera, model, m, ivec2(pixel.x + 1, pixel.y), right) && ok;
  ok = warp_pixel(CONTEXT pair, camera, model, m, ivec2(pixel.x, pixel.y - 1), up) && ok;
  ok = warp_pixel(CONTEXT pair, camera, model, m, ivec2(pixel.x, pixel.y + 1), down) && ok;
  if (!ok) return along;
  vec2 jx = 0.5f * (right - left);
  vec2 jy = 0.5f * (down - up);
  float determinant = jx.x * jy.y - jx.y * jy.x;
  if (abs(determinant) < 0.05f) return along;
  return (1.0f / determinant) *
         vec2(jy.y * along.x - jy.x * along.y, jx.x * along.y - jx.y * along.x);
}

// Change of the reference's intensity at q per pixel of displacement in the source; false where it is not seen.
FN bool slope_at(CONTEXT_ARGUMENT ivec2 q, vec2 direction, OUT(float) slope) {
  float left = half_pixel_at(CONTEXT PASS.reference, ivec2(2 * q.x - 1, 2 * q.y));
  float right = half_pixel_at(CONTEXT PASS.reference, ivec2(2 * q.x + 1, 2 * q.y));
  float up = half_pixel_at(CONTEXT PASS.reference, ivec2(2 * q.x, 2 * q.y - 1));
  float down = half_pixel_at(CONTEXT PASS.reference, ivec2(2 * q.x, 2 * q.y + 1));
  slope = (right - left) * direction.x + (down - up) * direction.y;
  return min(min(left, right), min(up, down)) >= 0.0f;
}

// How far (px, along the source's curve) the plane's patch lies from where it matches best, by one step of least
// squares: the source's intensities are gain (a + shift slope) + offset. Zero where that tells nothing.
FN float subpixel_shift(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 direction) {
  ViewPair pair = pair_between(CONTEXT PASS.reference, source);
  CameraParameters camera = PARAMETERS.cameras[source];
  int model = model_of(CONTEXT camera);
  PatchStart start;
  if (!begin_patch(CONTEXT pair, camera, model, source, pixel, m, true, start)) return 0.0f;
  float inverse_scale = PARAMETERS.support.x;
  float n = 0.0f;
  float sum_a = 0.0f;
  float sum_b = 0.0f;
  float sum_s = 0.0f;
  float sum_aa = 0.0f;
  float sum_ab = 0.0f;
  float sum_as = 0.0f;
  float sum_bs = 0.0f;
  float sum_ss = 0.0f;
  for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
    int first = first_column(CONTEXT WINDOW_RADIUS, dy);
    RowMap row = map_row(CONTEXT start.map, float(first), float(dy));
    for (int dx = 0; dx <= WINDOW_RADIUS - first; dx += COLUMN_STEP) {
      ivec2 q = ivec2(pixel.x + first + dx, pixel.y + dy);
      float a = intensity_at(CONTEXT PASS.reference, q);
      float b = sample_image(CONTEXT source, camera.size, map_offset(CONTEXT row, float(dx)));
      float slope;
      if (!slope_at(CONTEXT q, direction, slope) || min(a, b) < 0.0f) continue;
      a -= start.centre_a;
      b -= start.centre_b;
      float weight = sample_weight(CONTEXT a, inverse_scale);
      n += weight;
      sum_a += weight * a;
      sum_b += weight * b;
      sum_s += weight * slope;
      sum_aa += weight * a * a;
      sum_ab += weight * a * b;
      sum_as += weight * a * slope;
      sum_bs += weight * b * slope;
      sum_ss += weight * slope * slope;
    }
  }
  if (!(n > 0.0f)) return 0.0f;
  float aa = sum_aa - sum_a * sum_a / n;
  float ab = sum_ab - sum_a * sum_b / n;
  float as = sum_as - sum_a * sum_s / n;
  float bs = sum_bs - sum_b * sum_s / n;
  float ss = sum_ss - sum_s * sum_s / n;
  float determinant = aa * ss - as * as;
  // Along the curve the patch must look like more than a change of its contrast.
  if (!(determinant > 0.02f * aa * ss)) return 0.0f;
  // Both unknowns times the determinant.
  float gain = ss * ab - as * bs;
  float gain_times_shift = aa * bs - as * ab;
  if (gain < SMALLEST_GAIN * determinant) return 0.0f;
  return clamp(gain_times_shift / gain, -LARGEST_SHIFT, LARGEST_SHIFT);
}

// Stores all that regress_pixel() needs of a neighbour: the variance of its match along the epipolar curve (px^2), the
// speed there (pixels per unit of inverse distance), its inverse distance and intensity. The variance is that of the
// patch's residual over the information of its gradients, and the square of half the displacement from the
// source's own plane, which exposes what the patch itself cannot tell. With SUBPIXEL_MATCH the inverse distance is
// where the patch matches best instead of where the search has left it.
FN void measure_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT PASS.reference, pixel);
  vec4 held = hypothesis_at(CONTEXT PASS.reference, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec3 m = vec3(held.x, held.y, held.z);
  float correlation = 1.0f - held.w;
  float centre = intensity_at(CONTEXT PASS.reference, pixel);
  float speed = 0.0f;
  float variance = UNMEASURED_VARIANCE;
  float w = inverse_distance_of(held, ray);
  if (is_usable(CONTEXT pixel, usable_ray) && correlation > 0.05f) {
    vec2 velocity;
    int source = telling_source(CONTEXT ray, dot(m, ray), velocity);
    speed = length(velocity);
    vec2 along = (1.0f / max(speed, 1e-9f)) * velocity;
    vec2 direction = reference_direction(CONTEXT source, pixel, m, along);
    float inverse_scale = PARAMETERS.support.x;
    float information = 0.0f;
    float n = 0.0f;
    float sum = 0.0f;
    float sum_squares = 0.0f;
    for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
      for (int dx = first_column(CONTEXT WINDOW_RADIUS, dy); dx <= WINDOW_RADIUS; dx += COLUMN_STEP) {
        ivec2 q = ivec2(pixel.x + dx, pixel.y + dy);
        float a = intensity_at(CONTEXT PASS.reference, q);
        float slope;
        if (!slope_at(CONTEXT q, direction, slope) || a < 0.0f) continue;
        a -= centre;
        float weight = sample_weight(CONTEXT a, inverse_scale);
        information += weight * slope * slope;
        n += weight;
        sum += weight * a;
        sum_squares += weight * a * a;
      }
    }
    // The checkerboard leaves out every other pixel, whose information is about the same.
    information *= float(COLUMN_STEP) * correlation * correlation;
    float spread = n > 0.0f ? max(sum_squares / n - sum * sum / (n * n), 0.0f) : 0.0f;
    float residual = spread * held.w * (2.0f - held.w) + 1e-7f;
    if (speed > 0.0f && information > 0.0f) {
      vec2 difference = difference_from_source(CONTEXT source, pixel, ray, m);
      float displacement = difference.y < UNKNOWN_DIFFERENCE ? min(difference.y, LARGEST_DISPLACEMENT)
                                                             : UNCHECKED_DISPLACEMENT;
      variance = min(residual / information + SMALLEST_VARIANCE + 0.25f * displacement * displacement,
                     UNMEASURED_VARIANCE);
      if ((PASS.candidates & SUBPIXEL_MATCH) != 0u) {
        // What a precise patch still asks for is less its noise than a second surface in it.
        float share = variance / (variance + HALF_SHIFT_VARIANCE);
        w -= share * subpixel_shift(CONTEXT source, pixel, m, direction) / speed;
      }
    }
  }
  store_check(CONTEXT PASS.reference, pixel, vec4(variance, speed, w, centre));
}

// A plane's vector m by components, along the pixel's ray and along east and south, which are TANGENT_SCALE long:
// inverse distance in any direction is offset z + slope_x x + slope_y y, with the direction's products with these.
struct LocalPlane {
  float offset;
  float slope_x;
  float slope_y;
};

struct PlaneFit {
  LocalPlane plane;
  float certainty;   // inverse variance of the offset, as if each pixel of the neighbourhood were measured by itself
  vec3 information;  // inverse covariance of the slopes (xx, xy, yy), of the grid's pixels alone
};

// One round of robust weighted least squares over a sparse grid of the neighbourhood; false where it is
// degenerate.
FN bool fit_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 east, vec3 south, vec4 own,
                  int round, int radius, LocalPlane guess, OUT(PlaneFit) fit) {
  fit.plane = guess;
  fit.certainty = 0.0f;
  fit.information = vec3(0.0f, 0.0f, 0.0f);
  ivec4 size = PARAMETERS.cameras[PASS.reference].size;
  float inverse_scale = PARAMETERS.support.y;
  float twice_own = 2.0f * own.x;
  int step = max(radius / PASS.steps, 1);
  radius = min(radius, step * PASS.steps);
  float fall_off = 2.0f / float(radius * radius);
  // Every pixel's grid lies elsewhere: pixels a step apart would share theirs and none with those between.
  vec4 u = draw4(CONTEXT pixel, REGRESSION_SLOT + round);
  int first_x = pixel.x - radius + int(u.x * float(step)) - step / 2;
  int first_y = pixel.y - radius + int(u.y * float(step)) - step / 2;
  while (first_x < 0) first_x += step;
  while (first_y < 0) first_y += step;
  int last_x = min(pixel.x + radius, size.x - 1);
  int last_y = min(pixel.y + radius, size.y - 1);
  float s = 0.0f;
  float sx = 0.0f;
  float sy = 0.0f;
  float sxx = 0.0f;
  float sxy = 0.0f;
  float syy = 0.0f;
  float sr = 0.0f;
  float sxr = 0.0f;
  float syr = 0.0f;
  for (int qy = first_y; qy <= last_y; qy += step) {
    float dy = float(qy - pixel.y);
    float remoteness_of_row = eighth_of_growth(dy * dy * fall_off);
    float dx = float(first_x - pixel.x);
    for (int qx = first_x; qx <= last_x; qx += step) {
      ivec2 q = ivec2(qx, qy);
      vec4 measure = check_at(CONTEXT PASS.reference, q);
      vec4 r = ray_at(CONTEXT PASS.reference, q);
      vec3 direction = vec3(r.x, r.y, r.z);
      float x = dot(direction, east);
      float y = dot(direction, south);
      float z = dot(direction, ray);
      float residual = measure.z - guess.offset * z - guess.slope_x * x - guess.slope_y * y;
      float displacement = residual * measure.y;
      // Geman and McClure's weight: other surfaces, however precise, must not outvote the pixel's own. Everything that
      // weighs shares one division.
      float scale2 = min(2.0f * measure.x + twice_own, 2.0f * LARGEST_RESIDUAL * LARGEST_RESIDUAL);
      float doubt = scale2 + displacement * displacement;
      float remoteness = remoteness_of_row + (0.125f * fall_off) * (dx * dx);
      float unlikeness = eighth_of_unlikeness(measure.w, own.w, inverse_scale);
      float trust = measure.y * scale2;
      float weight = trust * trust * (1.0f / (measure.x * (doubt * doubt) * eighth_power(remoteness * unlikeness)));
      if (measure.x >= UNMEASURED_VARIANCE) weight = 0.0f;
      float zw = weight * z;
      float xw = weight * x;
      float yw = weight * y;
      s += zw * z;
      sx += zw * x;
      sy += zw * y;
      sxx += xw * x;
      sxy += xw * y;
      syy += yw * y;
      sr += zw * residual;
      sxr += xw * residual;
      syr += yw * residual;
      dx += float(step);
    }
  }
  fit.certainty = s * float(step * step);
  if (!(s > 0.0f)) return false;
  float mx = sx / s;
  float my = sy / s;
  // A weak pull towards the guess decides slopes that the neighbourhood leaves open.
  float pull = 1e-3f * s;
  float cxx = sxx - sx * mx + pull;
  float cxy = sxy - sx * my;
  float cyy = syy - sy * my + pull;
  float cxr = sxr - sr * mx;
  float cyr = syr - sr * my;
  float determinant = cxx * cyy - cxy * cxy;
  if (!(determinant > 1e-9f * cxx * cyy)) return false;
  fit.information = vec3(cxx, cxy, cyy);
  float turn_x = (cyy * cxr - cxy * cyr) / determinant;
  float turn_y = (cxx * cyr - cxy * cxr) / determinant;
  fit.plane.slope_x = guess.slope_x + turn_x;
  fit.plane.slope_y = guess.slope_y + turn_y;
  fit.plane.offset = guess.offset + sr / s - turn_x * mx - turn_y * my;
  return true;
}

// The plane of the smallest neighbourhood that determines its offset to PASS.deviation. With REGRESS_NORMALS
// the whole neighbourhood gives the slopes.
FN bool regress_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 east, vec3 south, vec4 own,
                      INOUT(LocalPlane) plane) {
  bool normals = (PASS.candidates & REGRESS_NORMALS) != 0u;
  bool determined = false;
  bool found = false;
  float offset = plane.offset;
  for (int round = 0; round < REGRESSION_ROUNDS; ++round) {
    // What has its offset needs but one more round for its slopes.
    if (determined && round < REGRESSION_ROUNDS - 1) continue;
    int radius = max(PASS.radius >> max(WHOLE_RADIUS_ROUND - round, 0), 2);
    PlaneFit fit;
    if (!fit_plane(CONTEXT pixel, ray, east, south, own, round, radius, plane, fit)) continue;
    plane = fit.plane;
    found = true;
    if (!determined) offset = plane.offset;
    if (fit.certainty * PASS.deviation * PASS.deviation > own.y * own.y) determined = true;
    if (determined && !normals) break;
  }
  plane.offset = offset;
  return found;
}

// The slopes of the largest neighbourhood that does not contradict the smallest: wide where surfaces are plane,
// narrow at their edges.
FN bool regress_slopes(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 east, vec3 south, vec4 own,
                       INOUT(LocalPlane) plane) {
  bool found = false;
  float offset = plane.offset;
  PlaneFit first;
  for (int round = 0; round < NORMAL_ROUNDS; ++round) {
    int radius = round == 0 ? PASS.radius / 8 : (round < NORMAL_ROUNDS - 1 ? PASS.radius / 2 : PASS.radius);
    PlaneFit fit;
    if (!fit_plane(CONTEXT pixel, ray, east, south, own, round, max(radius, 2), plane, fit)) continue;
    if (!found) first = fit;
    float x = fit.plane.slope_x - first.plane.slope_x;
    float y = fit.plane.slope_y - first.plane.slope_y;
    vec3 information = first.information;
    if (x * x * information.x + 2.0f * (x * y * information.y) + y * y * information.z > LARGEST_SLOPE_CHANGE) break;
    plane = fit.plane;
    found = true;
  }
  plane.offset = offset;
  return found;
}

// Stores the regressed plane (m, 1) as the pixel's prior, zero where there is none. Without PASS.deviation the
// pixel keeps its distance and gets a normal alone.
FN void regress_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT PASS.reference, pixel);
  vec4 held = hypothesis_at(CONTEXT PASS.reference, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec3 m = vec3(held.x, held.y, held.z);
  vec4 prior = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (is_usable(CONTEXT pixel, usable_ray) && held.w < INVALID_COST) {
    vec3 axis = abs(ray.x) < 0.7f ? vec3(1.0f, 0.0f, 0.0f) : vec3(0.0f, 1.0f, 0.0f);
    vec3 east = cross(ray, axis);
    east = (TANGENT_SCALE / length(east)) * east;
    vec3 south = cross(ray, east);
    LocalPlane plane;
    plane.offset = dot(m, ray);
    plane.slope_x = dot(m, east) / (TANGENT_SCALE * TANGENT_SCALE);
    plane.slope_y = dot(m, south) / (TANGENT_SCALE * TANGENT_SCALE);
    vec4 own = check_at(CONTEXT PASS.reference, pixel);
    bool found = PASS.deviation > 0.0f ? regress_plane(CONTEXT pixel, ray, east, south, own, plane)
                                         : regress_slopes(CONTEXT pixel, ray, east, south, own, plane);
    vec3 regressed = plane.offset * ray + plane.slope_x * east + plane.slope_y * south;
    if (found && admissible(CONTEXT ray, regressed)) prior = vec4(regressed, 1.0f);
  }
  store_prior(CONTEXT PASS.reference, pixel, prior);
}

// Takes the prior over as the pixel's plane, where it can be seen in a source. With ADOPT_UNSEEN only its point must
// be seen: the cost stays and the measure follows, for another regression that needs no new one. With HELD_UNSEEN the
// plane that the pixel holds came like that: where it stays it gets a cost of its own, of no information at most.
FN void adopt_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 prior = prior_at(CONTEXT PASS.reference, pixel);
  vec4 held = hypothesis_at(CONTEXT PASS.reference, pixel);
  bool held_unseen = (PASS.candidates & HELD_UNSEEN) != 0u;
  if (held.w >= INVALID_COST || (prior.w == 0.0f && !held_unseen)) return;
  vec3 own = vec3(held.x, held.y, held.z);
  vec3 m = prior.w != 0.0f ? vec3(prior.x, prior.y, prior.z) : own;
  if ((PASS.candidates & ADOPT_UNSEEN) != 0u) {
    vec4 ray = ray_at(CONTEXT PASS.reference, pixel);
    vec3 unit_ray = vec3(ray.x, ray.y, ray.z);
    if (prior.w == 0.0f || !in_some_source(CONTEXT unit_ray, m)) return;
    vec4 adopted = vec4(m, held.w);
    store_hypothesis(CONTEXT PASS.reference, pixel, adopted);
    vec4 measure = check_at(CONTEXT PASS.reference, pixel);
    measure.z = inverse_distance_of(adopted, unit_ray);
    store_check(CONTEXT PASS.reference, pixel, measure);
    return;
  }
  // A loop over both planes: the cost function is then compiled once.
  float cost = INVALID_COST;
  for (int i = 0; i < 2; ++i) {
    cost = patch_cost(CONTEXT pixel, m);
    if (cost < INVALID_COST || !held_unseen) break;
    m = own;
  }
  if (cost >= INVALID_COST && held_unseen) cost = NO_INFORMATION_COST;
  if (cost < INVALID_COST) store_hypothesis(CONTEXT PASS.reference, pixel, vec4(m, cost));
}
