// SPDX-License-Identifier: MIT
// Where patches match best, to a fraction of a pixel, for the plane regression.

// Largest shift (px) that a sub-pixel match may find.
#define LARGEST_SHIFT 0.5f
// Variance (px^2) of a match that gets half the shift found.
#define HALF_SHIFT_VARIANCE 0.01f
// Smallest gain between a source's intensities and the reference's that a sub-pixel match believes.
#define SMALLEST_GAIN 0.2f

// How far (px, along the source's curve) the plane's patch lies from where it matches best (x), by one step of least
// squares: the source's intensities are gain (a + shift slope) + offset; and the information of that (y), the sum of
// squared slopes net of what gain and offset explain. Zeros where that tells nothing.
FN vec2 subpixel_shift(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 direction) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
  CameraParameters camera = PARAMETERS.cameras[source];
  int model = model_of(CONTEXT camera);
  PatchStart start;
  if (!begin_patch(CONTEXT pair, camera, model, source, pixel, m, true, WINDOW_RADIUS, start)) return vec2(0.0f, 0.0f);
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
  KEEP_LOOP for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
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
  if (!(n > 0.0f)) return vec2(0.0f, 0.0f);
  float aa = sum_aa - sum_a * sum_a / n;
  float ab = sum_ab - sum_a * sum_b / n;
  float as = sum_as - sum_a * sum_s / n;
  float bs = sum_bs - sum_b * sum_s / n;
  float ss = sum_ss - sum_s * sum_s / n;
  float determinant = aa * ss - as * as;
  // Along the curve the patch must look like more than a change of its contrast.
  if (!(determinant > 0.02f * aa * ss)) return vec2(0.0f, 0.0f);
  // Both unknowns times the determinant.
  float gain = ss * ab - as * bs;
  float gain_times_shift = aa * bs - as * ab;
  if (gain < SMALLEST_GAIN * determinant) return vec2(0.0f, 0.0f);
  return vec2(clamp(gain_times_shift / gain, -LARGEST_SHIFT, LARGEST_SHIFT), determinant / aa);
}

// The same as a shift of the inverse distance (x) with its information (y), by a source in which points move at that
// velocity.
FN vec2 shift_in_source(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 velocity) {
  float speed = length(velocity);
  if (!(speed > 0.0f)) return vec2(0.0f, 0.0f);
  float per_speed = 1.0f / speed;
  vec2 direction = reference_direction(CONTEXT source, pixel, m, per_speed * velocity);
  vec2 shift = subpixel_shift(CONTEXT source, pixel, m, direction);
  return vec2(per_speed * shift.x, dot(velocity, velocity) * shift.y);
}

// Of a pixel that was measured: the inverse distance is where its patch matches best instead of where the search has
// left it.
FN void subpixel_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 measure = check_at(CONTEXT REFERENCE, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec3 m = vec3(held.x, held.y, held.z);
  if (measure.x >= UNMEASURED_VARIANCE) return;
  vec2 fastest;
  int chosen = agreeing_source(CONTEXT pixel, ray, m, fastest);
  float longest = longest_squared_baseline_across(CONTEXT ray);
  float shift = 0.0f;
  float information = 0.0f;
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    int source = source_at(CONTEXT i);
    if (!counts_for(CONTEXT source, chosen, pixel, ray, m, longest)) continue;
    vec2 velocity = fastest;
    if (SOURCE_COUNT > 1 && source != chosen) velocity = source_velocity(CONTEXT source, ray, dot(m, ray));
    vec2 of_source = shift_in_source(CONTEXT source, pixel, m, velocity);
    shift += of_source.y * of_source.x;
    information += of_source.y;
  }
  if (!(information > 0.0f)) return;
  // What a precise patch still asks for is less its noise than a second surface in it. Where frames are averaged, each tells
  // all that it can by itself.
  bool whole = (PASS.candidates & WHOLE_SHIFT) != 0u;
  float share = whole ? 1.0f : measure.x / (measure.x + HALF_SHIFT_VARIANCE);
  measure.z -= share * (shift / information);
  store_check(CONTEXT REFERENCE, pixel, measure);
}
