// SPDX-License-Identifier: MIT
// How precisely each pixel's plane was matched, which the plane regression weighs by.

// Variance (px^2) below which no measurement is believed.
#define SMALLEST_VARIANCE 4e-4f
// Largest displacement from the source's own plane (px) that counts.
#define LARGEST_DISPLACEMENT 5.0f
// Largest shift (px) that a sub-pixel match may find.
#define LARGEST_SHIFT 0.5f
// Variance (px^2) of a match that gets half the shift found.
#define HALF_SHIFT_VARIANCE 0.01f
// Smallest gain between a source's intensities and the reference's that a sub-pixel match believes.
#define SMALLEST_GAIN 0.2f

// Direction in the reference image, per pixel of displacement along `along` (unit) in the source: the inverse of
// the map's derivative at the pixel; `along` itself where the derivative cannot be measured.
FN vec2 reference_direction(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 along) {
  PlaneWarp warp = warp_through(pair_between(CONTEXT REFERENCE, source), m);
  CameraParameters camera = PARAMETERS.cameras[source];
  int model = model_of(CONTEXT camera);
  vec2 left;
  vec2 right;
  vec2 up;
  vec2 down;
  bool ok = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x - 1, pixel.y), left);
  ok = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x + 1, pixel.y), right) && ok;
  ok = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x, pixel.y - 1), up) && ok;
  ok = warp_pixel(CONTEXT warp, camera, model, ivec2(pixel.x, pixel.y + 1), down) && ok;
  if (!ok) return along;
  vec2 jx = 0.5f * (right - left);
  vec2 jy = 0.5f * (down - up);
  float determinant = jx.x * jy.y - jx.y * jy.x;
  if (abs(determinant) < 0.05f) return along;
  return (1.0f / determinant) *
         vec2(jy.y * along.x - jy.x * along.y, jx.x * along.y - jx.y * along.x);
}

// The reference's intensity at q and its change per pixel of displacement in the source; false where it is not seen.
FN bool slope_at(CONTEXT_ARGUMENT ivec2 q, vec2 direction, OUT(float) intensity, OUT(float) slope) {
  // Of the half pixels around it, those above and to the left, and those to the right and below.
  vec4 before = half_pixel_taps(CONTEXT REFERENCE, ivec2(2 * q.x - 1, 2 * q.y - 1));
  vec4 after = half_pixel_taps(CONTEXT REFERENCE, ivec2(2 * q.x, 2 * q.y));
  intensity = after.x;
  slope = (after.y - before.z) * direction.x + (after.z - before.y) * direction.y;
  return min(min(min(before.z, after.y), min(before.y, after.z)), intensity) >= 0.0f;
}

// How far (px, along the source's curve) the plane's patch lies from where it matches best, by one step of least
// squares: the source's intensities are gain (a + shift slope) + offset. Zero where that tells nothing.
FN float subpixel_shift(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 direction) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
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
      float b = sample_image(CONTEXT source, camera.size, map_offset(CONTEXT row, float(dx)));
      float a;
      float slope;
      if (!slope_at(CONTEXT q, direction, a, slope) || b < 0.0f) continue;
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
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec3 m = vec3(held.x, held.y, held.z);
  float correlation = 1.0f - held.w;
  float centre = intensity_at(CONTEXT REFERENCE, pixel);
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
        float a;
        float slope;
        if (!slope_at(CONTEXT q, direction, a, slope)) continue;
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
  store_check(CONTEXT REFERENCE, pixel, vec4(variance, speed, w, centre));
}
