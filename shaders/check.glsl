// SPDX-License-Identifier: MIT
// What is known about a pixel once all views have planes: agreement with the sources' own planes, texture,
// parallax and tilt, summed up as reasons for rejection and a confidence.

#define REASON_NO_RAY 1
#define REASON_NO_OVERLAP 2
#define REASON_NO_TEXTURE 4
#define REASON_HIGH_COST 8
#define REASON_INCONSISTENT 16
#define REASON_UNCHECKED 32
#define REASON_LOW_PARALLAX 64
#define REASON_TILT 128

// Variance of the reference patch over its usable pixels.
FN float reference_variance(CONTEXT_ARGUMENT ivec2 pixel) {
  float centre = intensity_at(CONTEXT PASS.reference, pixel);
  float n = 0.0f;
  float sum = 0.0f;
  float sum_squares = 0.0f;
  for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
    for (int dx = -WINDOW_RADIUS; dx <= WINDOW_RADIUS; ++dx) {
      ivec2 q = ivec2(pixel.x + dx, pixel.y + dy);
      if (!in_image(PARAMETERS.cameras[PASS.reference].size, q)) continue;
      float a = intensity_at(CONTEXT PASS.reference, q);
      if (a < 0.0f) continue;
      a -= centre;
      n += 1.0f;
      sum += a;
      sum_squares += a * a;
    }
  }
  return (sum_squares - sum * sum / n) / n;
}

// Pixels that the point moves in the source over the whole range of inverse distance, by the derivative at
// its own. Zero at an epipole.
FN float parallax_in_source(CONTEXT_ARGUMENT int source, vec3 ray, float w) {
  ViewPair pair = PARAMETERS.pairs[PASS.reference * MAX_VIEWS + source];
  CameraParameters camera = PARAMETERS.cameras[source];
  float step = 0.01f * (PARAMETERS.range.w - PARAMETERS.range.z);
  if (w + step > PARAMETERS.range.w) step = -step;
  vec2 here;
  vec2 there;
  if (!project(camera, camera.size.z, direction_in_source(pair, ray, w), here)) return 0.0f;
  if (!project(camera, camera.size.z, direction_in_source(pair, ray, w + step), there)) return 0.0f;
  return 100.0f * length(there - here);
}

FN void check_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT PASS.reference, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec4 held = hypothesis_at(CONTEXT PASS.reference, pixel);
  vec3 m = vec3(held.x, held.y, held.z);
  vec2 difference = vec2(UNKNOWN_DIFFERENCE, UNKNOWN_DIFFERENCE);
  float confidence = 0.0f;
  int reasons = 0;
  if (usable_ray.w == 0.0f) {
    reasons = REASON_NO_RAY;
  } else if (held.w >= INVALID_COST) {
    reasons = REASON_NO_OVERLAP;
  } else {
    float parallax = 0.0f;
    for (int source = 0; source < VIEW_COUNT; ++source) {
      if ((PASS.sources & (1u << uint(source))) == 0u) continue;
      vec2 candidate = difference_from_source(CONTEXT source, pixel, ray, m);
      if (candidate.y < difference.y) difference = candidate;
      parallax = max(parallax, parallax_in_source(CONTEXT source, ray, dot(m, ray)));
    }
    vec4 limits = PARAMETERS.check_limits;
    if (reference_variance(CONTEXT pixel) < PARAMETERS.patch_limits.x) reasons |= REASON_NO_TEXTURE;
    if (held.w > limits.z) reasons |= REASON_HIGH_COST;
    if (parallax < limits.w) reasons |= REASON_LOW_PARALLAX;
    if (dot(m, ray) < PARAMETERS.patch_limits.z * length(m)) reasons |= REASON_TILT;
    if (difference.y >= UNKNOWN_DIFFERENCE) {
      reasons |= REASON_UNCHECKED;
    } else if (difference.x > limits.x || difference.y > limits.y) {
      reasons |= REASON_INCONSISTENT;
    }
    if (reasons == 0) {
      confidence = (1.0f - min(held.w, 1.0f)) * exp(-0.5f * difference.y * difference.y);
    }
  }
  store_check(CONTEXT PASS.reference, pixel, vec4(difference.x, difference.y, confidence, float(reasons)));
}
