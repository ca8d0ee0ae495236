// SPDX-License-Identifier: MIT
// How precisely each pixel's plane was matched, which the plane regression weighs by.

// Variance (px^2) below which no measurement is believed.
#define SMALLEST_VARIANCE 4e-4f
// Square of the slopes that noise makes in the reference, in units of the variance that the match leaves unexplained: less
// than it is, as at edges of surfaces more than noise is unexplained.
#define NOISE_OF_SLOPES 0.25f
// Share of a patch's information that is believed in any case.
#define LEAST_SHARE 0.05f
// Share of a match's variance that is the reference's noise, which the matches in all sources have in common.
#define COMMON_SHARE 0.5f
// Variance that a match leaves in any case, as of intensities of half precision.
#define LEAST_RESIDUAL 1e-7f
// Correlation up to which a patch matches nothing.
#define NO_CORRELATION 0.05f
// Squared sine of the angle between the images of a pixel's width and height up to which nothing is told across them.
#define LEAST_SQUARED_SINE 2.5e-3f
// Largest displacement from the source's own plane (px) that counts.
#define LARGEST_DISPLACEMENT 5.0f

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
  // By the angle alone: the source's pixels may be far larger or smaller.
  if (!(determinant * determinant > LEAST_SQUARED_SINE * (dot(jx, jx) * dot(jy, jy)))) return along;
  return (1.0f / determinant) *
         vec2(jy.y * along.x - jy.x * along.y, jx.x * along.y - jx.y * along.x);
}

// The reference's intensity at q and its change per pixel; false where it is not seen.
FN bool gradient_at(CONTEXT_ARGUMENT ivec2 q, OUT(float) intensity, OUT(vec2) gradient) {
  // Of the texels around it, those above and to the left, and those to the right and below.
  ivec2 own = ivec2(TEXELS_PER_PIXEL * q.x, TEXELS_PER_PIXEL * q.y);
  vec4 before = texel_taps(CONTEXT REFERENCE, ivec2(own.x - 1, own.y - 1));
  vec4 after = texel_taps(CONTEXT REFERENCE, own);
  intensity = after.x;
  float per_pixel = 0.5f * float(TEXELS_PER_PIXEL);
  gradient = vec2(per_pixel * (after.y - before.z), per_pixel * (after.z - before.y));
  return min(min(min(before.z, after.y), min(before.y, after.z)), intensity) >= 0.0f;
}

// The same, with its change per pixel of displacement in the source.
FN bool slope_at(CONTEXT_ARGUMENT ivec2 q, vec2 direction, OUT(float) intensity, OUT(float) slope) {
  vec2 gradient;
  bool seen = gradient_at(CONTEXT q, intensity, gradient);
  slope = gradient.x * direction.x + gradient.y * direction.y;
  return seen;
}

// Whether the source's own plane agrees with the pixel's, so that nothing hides the point there.
FN bool agrees(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 ray, vec3 m) {
  return difference_from_source(CONTEXT source, pixel, ray, m).y <= PARAMETERS.repair_limits.y;
}

// The source that tells most of those whose own planes agree with the pixel's, for the point may be hidden in others; of
// all where none agrees. `velocity`: the movement there.
FN int agreeing_source(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 m, OUT(vec2) velocity) {
  float w = dot(m, ray);
  int chosen = telling_source(CONTEXT ray, w, velocity);
  if (SOURCE_COUNT == 1) return chosen;
  // Of those in which the point lands it is the fastest, and in others nothing agrees.
  if (agrees(CONTEXT chosen, pixel, ray, m)) return chosen;
  float fastest = 0.0f;
  float longest = longest_squared_baseline_across(CONTEXT ray);
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    int source = source_at(CONTEXT i);
    if (!tells_distance(CONTEXT source, ray, longest)) continue;
    vec2 v = source_velocity(CONTEXT source, ray, w);
    float speed = length(v);
    if (speed <= fastest || !agrees(CONTEXT source, pixel, ray, m)) continue;
    chosen = source;
    velocity = v;
    fastest = speed;
  }
  return chosen;
}

// Whether a source tells of the pixel's distance: the chosen one of agreeing_source(), and others whose own planes agree.
// `longest`: the longest squared baseline across the ray.
FN bool counts_for(CONTEXT_ARGUMENT int source, int chosen, ivec2 pixel, vec3 ray, vec3 m, float longest) {
  if (SOURCE_COUNT == 1 || source == chosen) return true;
  return tells_distance(CONTEXT source, ray, longest) && agrees(CONTEXT source, pixel, ray, m);
}

// Sums over a patch of the reference, weighted.
struct PatchGradients {
  float n;
  float sum;          // of intensities, relative to the pixel's own
  float sum_squares;  // likewise
  vec2 gradients;
  vec2 products;  // of intensities and gradients
  vec3 squares;   // of gradients: xx, xy, yy
};

FN PatchGradients gradients_of_patch(CONTEXT_ARGUMENT ivec2 pixel) {
  float centre = intensity_at(CONTEXT REFERENCE, pixel);
  float inverse_scale = PARAMETERS.support.x;
  PatchGradients g;
  g.n = 0.0f;
  g.sum = 0.0f;
  g.sum_squares = 0.0f;
  g.gradients = vec2(0.0f, 0.0f);
  g.products = vec2(0.0f, 0.0f);
  g.squares = vec3(0.0f, 0.0f, 0.0f);
  for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
    for (int dx = first_column(CONTEXT WINDOW_RADIUS, dy); dx <= WINDOW_RADIUS; dx += COLUMN_STEP) {
      float a;
      vec2 gradient;
      if (!gradient_at(CONTEXT ivec2(pixel.x + dx, pixel.y + dy), a, gradient)) continue;
      a -= centre;
      float weight = sample_weight(CONTEXT a, inverse_scale);
      vec2 weighted = weight * gradient;
      g.n += weight;
      g.sum += weight * a;
      g.sum_squares += weight * a * a;
      g.gradients = g.gradients + weighted;
      g.products = g.products + a * weighted;
      g.squares = g.squares + vec3(weighted.x * gradient.x, weighted.x * gradient.y, weighted.y * gradient.y);
    }
  }
  return g;
}

// Of the pixel's match in a source, along the epipolar curve (px^2): that of the patch's residual over the information of
// its gradients, net of what gain and offset of the intensities explain, too, and of noise, and the square of half the
// displacement from the source's own plane, which exposes what the patch itself cannot tell. `velocity`: not zero.
FN float variance_in_source(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 ray, vec4 held, vec2 velocity,
                            PatchGradients g) {
  vec3 m = vec3(held.x, held.y, held.z);
  vec2 along = (1.0f / length(velocity)) * velocity;
  vec2 direction = reference_direction(CONTEXT source, pixel, m, along);
  float information = direction.x * direction.x * g.squares.x + 2.0f * direction.x * direction.y * g.squares.y +
                      direction.y * direction.y * g.squares.z;
  float slopes = dot(direction, g.gradients);
  float products = dot(direction, g.products);
  float least = LEAST_SHARE * information;
  float per_sample = g.n > 0.0f ? 1.0f / g.n : 0.0f;
  float spread = max((g.sum_squares - per_sample * g.sum * g.sum) * per_sample, 0.0f);
  float residual = spread * held.w * (2.0f - held.w) + LEAST_RESIDUAL;
  float along_gain = products - per_sample * g.sum * slopes;
  information -= per_sample * (slopes * slopes + along_gain * along_gain / max(spread, 1e-9f));
  // Slopes are those per pixel of the source, which has the same noise over a longer or shorter way.
  information = max(information - NOISE_OF_SLOPES * g.n * residual * dot(direction, direction), least);
  // The checkerboard leaves out every other pixel, whose information is about the same.
  float correlation = 1.0f - held.w;
  information *= float(COLUMN_STEP) * correlation * correlation;
  if (!(information > 0.0f)) return UNMEASURED_VARIANCE;
  vec2 difference = difference_from_source(CONTEXT source, pixel, ray, m);
  float displacement = difference.y < UNKNOWN_DIFFERENCE ? min(difference.y, LARGEST_DISPLACEMENT)
                                                         : UNCHECKED_DISPLACEMENT;
  return min(residual / information + SMALLEST_VARIANCE + 0.25f * displacement * displacement, UNMEASURED_VARIANCE);
}

// Stores all that regress_pixel() needs of a neighbour: the variance of its match along the epipolar curve (px^2), the
// speed there (pixels per unit of inverse distance, 0 where nothing matches), its inverse distance and intensity. Where
// several sources tell the distance, the variance is that of all of them, as if along the curve of the one that tells most.
FN void measure_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec3 m = vec3(held.x, held.y, held.z);
  float speed = 0.0f;
  float variance = UNMEASURED_VARIANCE;
  float w = inverse_distance_of(held, ray);
  if (is_usable(CONTEXT pixel, usable_ray) && 1.0f - held.w > NO_CORRELATION) {
    vec2 fastest;
    int chosen = agreeing_source(CONTEXT pixel, ray, m, fastest);
    // Not the product of roots, of which compilers take what they are of.
    float squared_speed = dot(fastest, fastest);
    speed = length(fastest);
    PatchGradients g = gradients_of_patch(CONTEXT pixel);
    float longest = longest_squared_baseline_across(CONTEXT ray);
    float per_variance = 0.0f;
    for (int i = 0; i < SOURCE_COUNT; ++i) {
      int source = source_at(CONTEXT i);
      if (!counts_for(CONTEXT source, chosen, pixel, ray, m, longest)) continue;
      vec2 velocity = fastest;
      if (SOURCE_COUNT > 1 && source != chosen) velocity = source_velocity(CONTEXT source, ray, w);
      float squared = dot(velocity, velocity);
      if (!(squared > 0.0f)) continue;
      float of_source = variance_in_source(CONTEXT source, pixel, ray, held, velocity, g);
      if (SOURCE_COUNT == 1 || source == chosen) variance = of_source;
      per_variance += squared / of_source;
    }
    if (SOURCE_COUNT > 1 && speed > 0.0f) {
      variance = COMMON_SHARE * variance + (1.0f - COMMON_SHARE) * (squared_speed / per_variance);
    }
  }
  store_check(CONTEXT REFERENCE, pixel, vec4(variance, speed, w, intensity_at(CONTEXT REFERENCE, pixel)));
}
