// SPDX-License-Identifier: MIT
// What is known about a pixel once all views have planes: agreement with the sources' own planes and with the
// surroundings, texture, parallax and tilt, summed up as reasons for rejection and a confidence.

// The surroundings of a pixel: a sparse grid of this radius and step, which leaves out the pixel itself.
#define SUPPORT_RADIUS 20
#define SUPPORT_STEP 8
// Displacement (source pixels) up to which another plane supports the pixel's own.
#define SUPPORT_DISPLACEMENT 1.0f
// Inverse of the mean squared correlation of the surroundings below which next to nothing matches.
#define EVIDENCE_SCALE 32.0f
// What the share of the squared gradients of intensity around that lies along epipolar curves counts: so many times it,
// less this. Up to 0.057, which errors of sampling make, it tells nothing of distances, from 0.25 on all.
#define PER_ALONG 5.2f
#define LESS_ALONG 0.296f
// Inverse of the variance of slopes along epipolar curves around, net of noise's, from which on they tell surfaces: that
// of 0.7 grey levels a pixel.
#define PER_CERTAIN_SLOPE 1.5e5f
// Variance that any match may leave unexplained besides noise, of 1.4 grey levels.
#define EXPECTED_VARIANCE 3e-5f
// Displacement of another plane (px) that says half as much against a pixel's as any can.
#define HALF_DOUBTED_DISPLACEMENT 0.25f
// The pixels beside a pixel, this far (px) to each side and along diagonals, whose surface it may belong to.
#define BESIDE 3
// Difference of intensity at which a surface beside is half as much like the pixel, of 10 grey levels.
#define HALF_LIKE_DIFFERENCE 0.04f
// Displacement (px) from an end of the range of distances at which a plane is half as suspect of lying beyond.
#define HALF_SUSPECT_DISPLACEMENT 2.0f

// Variance of the reference patch over its usable pixels.
FN float reference_variance(CONTEXT_ARGUMENT ivec2 pixel) {
  float centre = intensity_at(CONTEXT REFERENCE, pixel);
  float n = 0.0f;
  float sum = 0.0f;
  float sum_squares = 0.0f;
  for (int dy = -WINDOW_RADIUS; dy <= WINDOW_RADIUS; ++dy) {
    IntensityRow row = intensity_row(CONTEXT REFERENCE, ivec2(pixel.x - WINDOW_RADIUS, pixel.y + dy));
    for (int dx = 0; dx <= 2 * WINDOW_RADIUS; ++dx) {
      float a = intensity_in_row(row, dx);
      bool usable = a >= 0.0f;
      a = usable ? a - centre : 0.0f;
      n += usable ? 1.0f : 0.0f;
      sum += a;
      sum_squares += a * a;
    }
  }
  return (sum_squares - sum * sum / n) / n;
}

// Radians that the point's direction turns in the source per unit of inverse distance.
FN float turn_in_source(CONTEXT_ARGUMENT int source, vec3 ray, float w) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
  vec3 direction = direction_in_source(pair, ray, w);
  float distance2 = dot(direction, direction);
  vec3 across = translation(pair) - (dot(translation(pair), direction) / distance2) * direction;
  return length(across) / sqrt(distance2);
}

// Source pixels that the point moves per unit of inverse distance, in the source where it is fastest of those in which it
// lands, or of all where it lands in none; where that leaves all fields of view, pixels of the reference. Zero at an
// epipole. Far beyond its image a camera's model may tell any speed.
FN float speed_in_sources(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, float w) {
  float speed = 0.0f;
  float speed_of_all = 0.0f;
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    int source = source_at(CONTEXT i);
    float of_source = length(source_velocity(CONTEXT source, ray, w));
    bool sees = SOURCE_COUNT == 1 || is_unmasked_in_source(CONTEXT source, ray, w);
    speed = max(speed, sees ? of_source : 0.0f);
    speed_of_all = max(speed_of_all, of_source);
  }
  if (speed > 0.0f) return speed;
  if (speed_of_all > 0.0f) return speed_of_all;
  float turn = 0.0f;
  for (int i = 0; i < SOURCE_COUNT; ++i) turn = max(turn, turn_in_source(CONTEXT source_at(CONTEXT i), ray, w));
  float angle = length(step_of_ray(CONTEXT pixel, ray, ivec2(1, 0)));
  return angle > 0.0f ? turn / angle : 0.0f;
}

// Of the surrounding planes: the share that puts the pixel's point where its own does (x) and the mean of their squared
// correlations, where positive (y). `speed`: source pixels per unit of inverse distance.
FN vec2 support_of_surroundings(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, float w, float speed) {
  float planes = 0.0f;
  float supporting = 0.0f;
  float evidence = 0.0f;
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  ivec4 grid = grid_in_image(size, pixel, ivec2(-SUPPORT_RADIUS, -SUPPORT_RADIUS), SUPPORT_RADIUS,
                             ivec2(SUPPORT_STEP, SUPPORT_STEP));
  for (int dy = grid.y; dy <= grid.w; dy += SUPPORT_STEP) {
    for (int dx = grid.x; dx <= grid.z; dx += SUPPORT_STEP) {
      vec4 plane = hypothesis_at(CONTEXT REFERENCE, ivec2(pixel.x + dx, pixel.y + dy));
      // No branches, so that planes are loaded ahead.
      float counts = plane.w < INVALID_COST ? 1.0f : 0.0f;
      planes += counts;
      float correlation = max(1.0f - plane.w, 0.0f);
      evidence += counts * (correlation * correlation);
      float difference = inverse_distance_of(plane, ray) - w;
      supporting += abs(difference) * speed < SUPPORT_DISPLACEMENT ? counts : 0.0f;
    }
  }
  float share = 1.0f / max(planes, 1.0f);
  return vec2(supporting * share, evidence * share);
}

// What the intensities of the surroundings tell of distances, 0 to 1: by the share of their squared gradients that lies
// along epipolar curves (x), and by the variance of the slopes there, net of noise's (y). Where intensity is constant or a
// gradient, or changes across the curves alone, patches match anywhere, and planes are those of what lies around, or of
// nothing.
FN vec2 structure_of_surroundings(CONTEXT_ARGUMENT ivec2 pixel) {
  float places = 0.0f;
  float along = 0.0f;
  float slope = 0.0f;
  ivec4 grid = grid_in_image(PARAMETERS.cameras[REFERENCE].size, pixel, ivec2(-SUPPORT_RADIUS, -SUPPORT_RADIUS),
                             SUPPORT_RADIUS, ivec2(SUPPORT_STEP, SUPPORT_STEP));
  for (int dy = grid.y; dy <= grid.w; dy += SUPPORT_STEP) {
    for (int dx = grid.x; dx <= grid.z; dx += SUPPORT_STEP) {
      vec4 structure = prior_at(CONTEXT REFERENCE, ivec2(pixel.x + dx, pixel.y + dy));
      places += structure.w;
      along += structure.w * structure.x;
      slope += structure.w * structure.y;
    }
  }
  float share = 1.0f / max(places, 1.0f);
  // Constants come first: of a product Mesa takes the first factor with them.
  return vec2(clamp(PER_ALONG * along * share - LESS_ALONG, 0.0f, 1.0f),
              clamp(PER_CERTAIN_SLOPE * slope * share, 0.0f, 1.0f));
}

// Of what the match leaves unexplained, the cost by the patch's variance, the share that noise explains: from 1 down.
FN float share_of_noise(float cost, float variance, float noise) {
  float expected = noise + EXPECTED_VARIANCE;
  return expected / (expected + variance * (cost * (2.0f - cost)));
}

// How suspect a plane at inverse distance w is of being held at an end of the range of distances while the surface lies
// beyond, 0 to 1. `speed`: source pixels per unit of inverse distance.
FN float suspicion_at_ends(CONTEXT_ARGUMENT float w, float speed) {
  float per_half = speed / HALF_SUSPECT_DISPLACEMENT;
  float to_far = per_half * max(w - PARAMETERS.range.z, 0.0f);
  float to_near = per_half * max(PARAMETERS.range.w - w, 0.0f);
  // Nothing lies beyond where points move by little on their way from the farthest distance to infinity, or from the
  // nearest to half of it.
  float beyond_far = min(per_half * PARAMETERS.range.z, 1.0f);
  float beyond_near = min(per_half * PARAMETERS.range.w, 1.0f);
  return max(beyond_far / (1.0f + to_far * to_far), beyond_near / (1.0f + to_near * to_near));
}

// From 0 up to 1 by the displacement (px) of another plane from the pixel's own.
FN float doubt_of(float displacement) { return displacement / (displacement + HALF_DOUBTED_DISPLACEMENT); }

// How suspect a plane at inverse distance w is of having spread from a nearer surface, 0 to 1: the surface beside the
// pixel is farther and looks like it. `speed`: source pixels per unit of inverse distance.
FN float suspicion_of_spread(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, float w, float speed) {
  float own = intensity_at(CONTEXT REFERENCE, pixel);
  float suspicion = 0.0f;
  ivec4 grid = grid_in_image(PARAMETERS.cameras[REFERENCE].size, pixel, ivec2(-BESIDE, -BESIDE), BESIDE,
                             ivec2(BESIDE, BESIDE));
  for (int dy = grid.y; dy <= grid.w; dy += BESIDE) {
    for (int dx = grid.x; dx <= grid.z; dx += BESIDE) {
      ivec2 beside = ivec2(pixel.x + dx, pixel.y + dy);
      vec4 plane = hypothesis_at(CONTEXT REFERENCE, beside);
      float unlike = abs(intensity_at(CONTEXT REFERENCE, beside) - own);
      float farther = max(w - inverse_distance_of(plane, ray), 0.0f) * speed;
      float suspect = doubt_of(farther) * (HALF_LIKE_DIFFERENCE / (HALF_LIKE_DIFFERENCE + unlike));
      suspicion = max(suspicion, plane.w < INVALID_COST ? suspect : 0.0f);
    }
  }
  return suspicion;
}

// What tells how likely a pixel's point is where its plane puts it.
struct Indications {
  float spread;        // suspicion_of_spread()
  float displacement;  // from the source's own plane (px)
  float support;       // of the surroundings
  float evidence;      // of the surroundings
  vec2 structure;      // structure_of_surroundings()
  float cost;          // 1 at most
  float noise_share;   // share_of_noise()
  float at_ends;       // suspicion_at_ends()
};

// Probability that the point lies within two source pixels of its true place: a logistic model, fitted to ray-traced
// scenes (docs/accuracy.md). Planes around that agree tell less where the match leaves more unexplained than noise, as
// they do where the scene lies beyond the range of distances, and where there is little to tell distances by. So does
// correlation: on blank walls everything matches. Neither tells anything where intensity changes across epipolar curves
// alone. Where next to nothing matches, as in the dark beyond the lens circle, planes agree because nothing contradicts
// them.
FN float confidence_of(Indications i) {
  float agreement = -(0.48f + 0.71f * i.structure.y) * logarithm(1.02f - i.support) * sqrt(i.noise_share);
  // Constants come first here, too.
  float log_odds = i.structure.x * (4.22f * i.structure.y * i.evidence + agreement) - 1.58f * doubt_of(i.displacement) -
                   5.3f * i.at_ends * sqrt(i.cost) - 2.42f * i.spread - 0.3f;
  return min(EVIDENCE_SCALE * i.evidence, 1.0f) / (1.0f + exponential(-log_odds));
}

// What a source shows of the point at inverse distance w, negative where it does not see it.
FN float intensity_in_source(CONTEXT_ARGUMENT int source, vec3 ray, float w) {
  vec2 position;
  if (!position_in_source(CONTEXT source, ray, w, position)) return MASKED_INTENSITY;
  ivec4 size = PARAMETERS.cameras[source].size;
  return sample_image(CONTEXT source, size, texel_at(CONTEXT size, position));
}

// A pixel's plane beside those of the sources and of the surroundings.
struct Comparison {
  vec3 ray;
  vec4 held;
  float w;          // its inverse distance
  float speed;      // speed_in_sources()
  vec2 difference;  // relative, and displacement (px), from the nearest of the sources' own planes
  vec2 support;     // support_of_surroundings()
  int reasons;
};

// From the nearest plane of the sources that tell distances, or of the others where none of those has one.
FN vec2 difference_from_nearest(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 m) {
  vec2 nearest = vec2(UNKNOWN_DIFFERENCE, UNKNOWN_DIFFERENCE);
  vec2 nearest_of_others = nearest;
  float longest = longest_squared_baseline_across(CONTEXT ray);
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    int source = source_at(CONTEXT i);
    vec2 candidate = difference_from_source(CONTEXT source, pixel, ray, m);
    if (tells_distance(CONTEXT source, ray, longest)) {
      if (candidate.y < nearest.y) nearest = candidate;
    } else if (candidate.y < nearest_of_others.y) {
      nearest_of_others = candidate;
    }
  }
  return nearest.y < UNKNOWN_DIFFERENCE ? nearest : nearest_of_others;
}

// False where the pixel has no plane; `difference` and `reasons` say so, too. `limits`: as MatchParameters.check_limits.
FN bool compare_with_others(CONTEXT_ARGUMENT ivec2 pixel, vec4 limits, float largest_cost, OUT(Comparison) c) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  c.ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  c.held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec3 m = vec3(c.held.x, c.held.y, c.held.z);
  c.w = dot(m, c.ray);
  c.difference = vec2(UNKNOWN_DIFFERENCE, UNKNOWN_DIFFERENCE);
  c.support = vec2(0.0f, 0.0f);
  c.speed = 0.0f;
  c.reasons = 0;
  if (!is_usable(CONTEXT pixel, usable_ray)) {
    c.reasons = REASON_NO_RAY;
    return false;
  }
  if (c.held.w >= INVALID_COST) {
    c.reasons = REASON_NO_OVERLAP;
    return false;
  }
  c.speed = speed_in_sources(CONTEXT pixel, c.ray, c.w);
  c.difference = difference_from_nearest(CONTEXT pixel, c.ray, m);
  c.support = support_of_surroundings(CONTEXT pixel, c.ray, c.w, c.speed);
  float least_variance = PARAMETERS.patch_limits.x;
  if (least_variance > 0.0f && reference_variance(CONTEXT pixel) < least_variance) c.reasons |= REASON_NO_TEXTURE;
  if (c.held.w > largest_cost) c.reasons |= REASON_HIGH_COST;
  if (c.speed * (PARAMETERS.range.w - PARAMETERS.range.z) < limits.z) c.reasons |= REASON_LOW_PARALLAX;
  if (c.w < PARAMETERS.patch_limits.z * length(m)) c.reasons |= REASON_TILT;
  if (c.difference.y >= UNKNOWN_DIFFERENCE) {
    c.reasons |= REASON_UNCHECKED;
  } else if (c.difference.x > limits.x || c.difference.y > limits.y) {
    c.reasons |= REASON_INCONSISTENT;
  }
  if (c.support.x < limits.w) c.reasons |= REASON_SPECKLE;
  return true;
}

// Stores the relative difference and the displacement from the nearest of the sources' own planes, the confidence and the
// reasons; the pixels must have been through structure_pixel().
FN void check_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  Comparison c;
  float confidence = 0.0f;
  if (compare_with_others(CONTEXT pixel, PARAMETERS.check_limits, PARAMETERS.acceptance.y, c)) {
    Indications i;
    i.spread = suspicion_of_spread(CONTEXT pixel, c.ray, c.w, c.speed);
    i.displacement = c.difference.y >= UNKNOWN_DIFFERENCE ? UNCHECKED_DISPLACEMENT : c.difference.y;
    i.support = c.support.x;
    i.evidence = c.support.y;
    i.structure = structure_of_surroundings(CONTEXT pixel);
    i.cost = min(c.held.w, 1.0f);
    i.noise_share =
        share_of_noise(i.cost, reference_variance(CONTEXT pixel), prior_at(CONTEXT REFERENCE, pixel).z);
    i.at_ends = suspicion_at_ends(CONTEXT c.w, c.speed);
    confidence = confidence_of(i);
    if (confidence < PARAMETERS.acceptance.x) c.reasons |= REASON_LOW_CONFIDENCE;
  }
  store_check(CONTEXT REFERENCE, pixel, vec4(c.difference.x, c.difference.y, confidence, float(c.reasons)));
}

// Stores what a vote asks for: the source that tells most (agreeing_source()), the displacement, what that source shows of
// the point, and the reasons, of which an image that contradicts the plane is one. Whatever is accepted in the end, planes
// are the same.
FN void check_for_vote_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  Comparison c;
  float source = 0.0f;
  float intensity = MASKED_INTENSITY;
  if (compare_with_others(CONTEXT pixel, PARAMETERS.repair_limits, NO_INFORMATION_COST, c)) {
    vec2 velocity;
    int agreeing = agreeing_source(CONTEXT pixel, c.ray, vec3(c.held.x, c.held.y, c.held.z), velocity);
    source = float(agreeing);
    intensity = intensity_in_source(CONTEXT agreeing, c.ray, c.w);
  }
  store_check(CONTEXT REFERENCE, pixel, vec4(source, c.difference.y, intensity, float(c.reasons)));
}
