// SPDX-License-Identifier: MIT
// Vote of the surroundings. Patches match best where they hold the edge of a nearer surface, so that its plane spreads
// over the weaker texture beside it. Most of the pixels that look alike around there still lie on the right one, and
// the middle of the patch, too small to hold the edge, tells the candidates apart where it has texture of its own.

// Displacement (source pixels) from which on a plane does not support another, and its inverse: Mesa multiplies with that
// instead of dividing.
#define VOTE_DISPLACEMENT 0.4f
#define PER_VOTE_DISPLACEMENT (1.0f / VOTE_DISPLACEMENT)
// Planes nearer than this to the pixel's own do not stand, so that curved surfaces stay curved.
#define SAME_DISPLACEMENT 0.06f
// Displacement up to which candidates are the same rival.
#define RIVAL_DISPLACEMENT 0.35f
// Largest difference of intensity that counts: all that differ by more are alike.
#define LARGEST_DIFFERENCE 0.08f
// Mean squared difference, five grey levels squared, that halves the likeness.
#define HALVING_DIFFERENCE2 4e-4f
// Displacement (source pixels) from which on the plane that the pixel held before its regression is a rival, and the share
// of a vote, of a pixel beside and alike, that this one has by itself: thin surfaces may have no such pixels left.
#define REGRESSED_DISPLACEMENT 0.35f
#define VOTE_OF_ITS_OWN 0.15f
// Displacement (source pixels) up to which it does not matter whether a rival is nearer or farther than the pixel's own.
#define FREE_DISPLACEMENT 0.6f
// Far beyond it, where the pixel's own plane matches perfectly, (1 - this) / (1 + this) of a nearer rival's votes count.
#define NEAR_HANDICAP 0.4f
// Random slot; the search and the regression use lower ones.
#define VOTE_SLOT 72
// Pixels around whose intensities tell the exposure: radius and step of their grid, and the rounds over them.
#define EXPOSURE_RADIUS 20
#define EXPOSURE_STEP 10
#define EXPOSURE_ROUNDS 3
// Intensity, in both images, that stands for a gain of one where nothing else tells it.
#define GAIN_OF_ONE 0.01f
// Variance of intensity, of 1.1 grey levels, that stands for a gain which is the ratio of brightness, without an offset,
// and the least share of that ratio which a gain is.
#define VARIANCE_OF_RATIO 2e-5f
#define LEAST_GAIN 0.05f
// Differences of 1 / 4 in the second round, and of 1 / 16 in the third, quarter the weight.
#define DOUBT_PER_DIFFERENCE 4.0f

// The pixel whose plane is candidate i.
FN ivec2 vote_candidate_at(CONTEXT_ARGUMENT ivec2 pixel, int i) {
  int reach = i < VOTE_CANDIDATES / 2 ? PASS.radius / 2 : PASS.radius;
  int k = i % (VOTE_CANDIDATES / 2);
  if (k >= 4) ++k;
  return ivec2(pixel.x + (k % 3 - 1) * reach, pixel.y + (k / 3 - 1) * reach);
}

// How much one plane supports another, by how far apart they put the pixel's point, in units of VOTE_DISPLACEMENT.
FN float support_over(float difference) {
  float agreement = saturate_below_one(1.0f - difference * difference);
  return agreement * agreement;
}

// The same, from where they put it.
FN float support_between(float place, float candidate) { return support_over(place - candidate); }

// By how much less than the pixel itself one counts at q, (dx, dy) away: from 1 on. `fall_off`: per squared pixel.
FN float remoteness_of_voter(CONTEXT_ARGUMENT ivec2 q, int dx, int dy, float fall_off, float intensity,
                             float inverse_scale) {
  return eighth_power(root_of_growth(float(dx * dx + dy * dy) * fall_off) *
                      root_of_unlikeness(intensity_at(CONTEXT REFERENCE, q) - intensity, inverse_scale));
}

// What the reference shows is this gain (x) times what the source does, plus this offset (y), around the pixel, for
// exposures, vignetting, black levels, tone curves and veils of light differ: from the pixels that passed
// check_for_vote_pixel(), which has left what the source shows of them.
FN vec2 exposure_around(CONTEXT_ARGUMENT int source, ivec2 pixel) {
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  vec2 exposure = vec2(1.0f, 0.0f);
  // What differs by more than noise is not the same point. A few such points tilt a line, but hardly change the ratio:
  // that comes first, and what lies off it is doubted less.
  for (int round = 0; round < EXPOSURE_ROUNDS; ++round) {
    float doubt_per_difference = DOUBT_PER_DIFFERENCE * float(round * round);
    float n = 1e-6f;
    float sum_a = 0.0f;
    float sum_b = 0.0f;
    float sum_bb = 0.0f;
    float sum_ab = 0.0f;
    for (int dy = -EXPOSURE_RADIUS; dy <= EXPOSURE_RADIUS; dy += EXPOSURE_STEP) {
      for (int dx = -EXPOSURE_RADIUS; dx <= EXPOSURE_RADIUS; dx += EXPOSURE_STEP) {
        ivec2 q = ivec2(pixel.x + dx, pixel.y + dy);
        if (!in_image(size, q)) continue;
        vec4 checked = check_at(CONTEXT REFERENCE, q);
        float a = intensity_at(CONTEXT REFERENCE, q);
        float b = checked.z;
        if (checked.w != 0.0f || int(checked.x) != source || min(a, b) < 0.0f) continue;
        float doubt = (a - exposure.x * b - exposure.y) * doubt_per_difference;
        float root = 1.0f / (1.0f + doubt * doubt);
        float weight = root * root;
        n += weight;
        sum_a += weight * a;
        sum_b += weight * b;
        sum_bb += weight * b * b;
        sum_ab += weight * a * b;
      }
    }
    float ratio = (GAIN_OF_ONE + sum_a) / (GAIN_OF_ONE + sum_b);
    exposure = vec2(ratio, 0.0f);
    if (round > 0) {
      // The line of least squares, drawn to the one through zero as far as there is no contrast to tell it.
      float mean_b = sum_b / n;
      float prior = (n + 2.0f) * VARIANCE_OF_RATIO;
      float gain = (sum_ab - sum_a * mean_b + prior * ratio) / (max(sum_bb - sum_b * mean_b, 0.0f) + prior);
      gain = max(gain, LEAST_GAIN * ratio);
      exposure = vec2(gain, (sum_a - gain * sum_b) / n);
    }
  }
  return exposure;
}

// The source that tells most about the pixel: that of the check, unless the pixel was filled since. `velocity`: the
// movement there.
FN int checked_source(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, float w, OUT(vec2) velocity) {
  if (SOURCE_COUNT > 1) {
    vec4 checked = check_at(CONTEXT REFERENCE, pixel);
    if ((uint(checked.w) & uint(REASON_FILLED)) == 0u) {
      velocity = source_velocity(CONTEXT int(checked.x), ray, w);
      return int(checked.x);
    }
  }
  return telling_source(CONTEXT ray, w, velocity);
}

// From 1 down by the mean squared difference of intensity over the middle of the patch, weighted by a tent as those at its
// rim may lie beyond an edge, in units of the darker image. It must not explain a wrong plane by an exposure of its
// own, as a correlation of so few pixels could. `whole`: whether the source sees all of it.
FN float likeness_of_middle(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 m, vec2 exposure, OUT(bool) whole) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
  CameraParameters camera = PARAMETERS.cameras[source];
  // Noise does not count for more where the source is the darker one.
  float per_unit = 1.0f / max(exposure.x, 1.0f);
  float n = 0.0f;
  float sum = 0.0f;
  PatchStart start;
  int model = model_of(CONTEXT camera);
  if (begin_patch(CONTEXT pair, camera, model, source, pixel, m, true, VOTE_MIDDLE_RADIUS, start)) {
    KEEP_LOOP for (int dy = -VOTE_MIDDLE_RADIUS; dy <= VOTE_MIDDLE_RADIUS; ++dy) {
      int first = -VOTE_MIDDLE_RADIUS;
      RowMap row = map_row(CONTEXT start.map, float(first), float(dy));
      KEEP_LOOP for (int dx = 0; dx <= VOTE_MIDDLE_RADIUS - first; ++dx) {
        float a = intensity_at(CONTEXT REFERENCE, ivec2(pixel.x + first + dx, pixel.y + dy));
        float b = sample_image(CONTEXT source, camera.size, map_offset(CONTEXT row, float(dx)));
        if (min(a, b) < 0.0f) continue;
        float difference = min(abs(a - exposure.x * b - exposure.y) * per_unit, LARGEST_DIFFERENCE);
        float weight = float((VOTE_MIDDLE_RADIUS + 1 - abs(first + dx)) * (VOTE_MIDDLE_RADIUS + 1 - abs(dy)));
        n += weight;
        sum += weight * difference * difference;
      }
    }
  }
  float weight_of_row = float((VOTE_MIDDLE_RADIUS + 1) * (VOTE_MIDDLE_RADIUS + 1));
  whole = n >= weight_of_row * weight_of_row;
  // What is not seen is as unlike as can be.
  if (n == 0.0f) return HALVING_DIFFERENCE2 / (HALVING_DIFFERENCE2 + LARGEST_DIFFERENCE * LARGEST_DIFFERENCE);
  return HALVING_DIFFERENCE2 * n / (HALVING_DIFFERENCE2 * n + sum);
}

// What a rival's votes are multiplied by that lies `nearer` (source pixels; negative: farther) than the pixel's own plane:
// patches carry planes over the edges of nearer surfaces, hardly ever of farther ones. They do so only where there is an
// edge to match; elsewhere, as on blank walls, neither is likelier. `cost`: that of the pixel's own plane.
FN float preference_for_far(float nearer, float cost) {
  float evidence = max(1.0f - cost, 0.0f);
  float beyond = max(abs(nearer) - FREE_DISPLACEMENT, 0.0f);
  float handicap = evidence * evidence * (NEAR_HANDICAP * (beyond / (1.0f + beyond)));
  return nearer > 0.0f ? (1.0f - handicap) / (1.0f + handicap) : (1.0f + handicap) / (1.0f - handicap);
}

// Stores as prior (m, 1) the plane, of the pixel's own and its rivals, for which support and likeness in the source speak
// most; zero where there is none. Rivals are the candidates that the planes around support most, and the plane that the
// pixel held before its regression, which is the prior's until then (m, 0): regressions outvote thin surfaces that the
// search has found. Planes around are weighted by nearness and likeness of intensity.
FN void vote_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 prior = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (is_usable(CONTEXT pixel, usable_ray) && held.w < INVALID_COST) {
    vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
    ivec4 size = PARAMETERS.cameras[REFERENCE].size;
    float own = inverse_distance_of(held, ray);
    vec2 velocity;
    int source = checked_source(CONTEXT pixel, ray, own, velocity);
    float speed = length(velocity);
    // Places along the epipolar curve, in units of VOTE_DISPLACEMENT.
    float scale = PER_VOTE_DISPLACEMENT * speed;
    float own_place = scale * own;
    vec4 before = prior_at(CONTEXT REFERENCE, pixel);
    vec3 m_before = vec3(before.x, before.y, before.z);
    float place_before = scale * dot(m_before, ray);
    bool regressed = abs(place_before - own_place) * VOTE_DISPLACEMENT > REGRESSED_DISPLACEMENT &&
                     admissible(CONTEXT ray, m_before);
    float support_before = VOTE_OF_ITS_OWN;
    float candidates[VOTE_CANDIDATES];
    float support[VOTE_CANDIDATES];
    UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
      ivec2 q = vote_candidate_at(CONTEXT pixel, i);
      candidates[i] = own_place;
      support[i] = 0.0f;
      if (!in_image(size, q)) continue;
      vec4 plane = hypothesis_at(CONTEXT REFERENCE, q);
      vec3 m = vec3(plane.x, plane.y, plane.z);
      bool differs = abs(dot(m, ray) - own) * speed > SAME_DISPLACEMENT;
      if (differs && plane.w < INVALID_COST && admissible(CONTEXT ray, m)) candidates[i] = scale * dot(m, ray);
    }
    float intensity = intensity_at(CONTEXT REFERENCE, pixel);
    float fall_off = 1.0f / float(PASS.radius * PASS.radius);
    float inverse_scale = PARAMETERS.support.y;
    float most = 0.0f;
    // Every tile asks others, so that its neighbours do not make the same mistake.
    vec4 u = draw4_of_tile(CONTEXT pixel, VOTE_SLOT);
    ivec2 step = ivec2(VOTE_STEP, VOTE_ROW_STEP);
    ivec2 first = ivec2(int(u.x * float(step.x)) - PASS.radius, int(u.y * float(step.y)) - PASS.radius);
    ivec4 grid = grid_in_image(size, pixel, first, PASS.radius, step);
    // Rows begin in turn half a step later, so that thin surfaces have their voters.
    int late = 0;
    for (int dy = grid.y; dy <= grid.w; dy += step.y) {
      for (int dx = grid.x + late; dx <= grid.z; dx += step.x) {
        ivec2 q = ivec2(pixel.x + dx, pixel.y + dy);
        vec4 plane = hypothesis_at(CONTEXT REFERENCE, q);
        float place = scale * inverse_distance_of(plane, ray);
        float weight = 1.0f / remoteness_of_voter(CONTEXT q, dx, dy, fall_off, intensity, inverse_scale);
        weight = plane.w < INVALID_COST ? weight : 0.0f;
        most += weight * support_between(place, own_place);
        support_before += weight * support_between(place, place_before);
        UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
          support[i] += weight * support_between(place, candidates[i]);
        }
      }
      late = VOTE_STEP / 2 - late;
    }
    prior = vec4(held.x, held.y, held.z, 1.0f);
    // The pixel's own plane comes first.
    ivec2 standing[VOTE_COMPARED];
    float votes[VOTE_COMPARED];
    standing[0] = pixel;
    votes[0] = most;
    int count = 1;
    UNROLL for (int rival = 1; rival <= VOTE_RIVALS; ++rival) {
      int chosen = -1;
      float place = own_place;
      votes[rival] = 0.0f;
      UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
        if (candidates[i] != own_place && support[i] > votes[rival]) {
          votes[rival] = support[i];
          chosen = i;
          place = candidates[i];
        }
      }
      if (chosen < 0) break;
      votes[rival] *= preference_for_far(VOTE_DISPLACEMENT * (place - own_place), held.w);
      standing[rival] = vote_candidate_at(CONTEXT pixel, chosen);
      ++count;
      UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
        if (abs(candidates[i] - place) * VOTE_DISPLACEMENT < RIVAL_DISPLACEMENT) support[i] = 0.0f;
      }
    }
    // The last one, if any, which is no pixel's plane any more.
    int regressed_at = regressed ? count : -1;
    if (regressed) {
      votes[count] = support_before * preference_for_far(VOTE_DISPLACEMENT * (place_before - own_place), held.w);
      ++count;
    }
    // Where nothing competes, as on most surfaces, nothing needs to be sampled.
    if (count == 1) count = 0;
    bool own_is_seen = false;
    float best = 0.0f;
    vec2 exposure = vec2(1.0f, 0.0f);
    if (count > 0) exposure = exposure_around(CONTEXT source, pixel);
    for (int k = 0; k < count; ++k) {
      bool is_before = k == regressed_at;
      // At the image's rim it may be whatever lies farther inside.
      if ((k > 0 && votes[k] <= best) || (is_before && !own_is_seen)) continue;
      vec4 plane = is_before ? before : hypothesis_at(CONTEXT REFERENCE, standing[k]);
      vec3 m = vec3(plane.x, plane.y, plane.z);
      bool whole;
      float likeness = likeness_of_middle(CONTEXT source, pixel, m, exposure, whole);
      if (k == 0) own_is_seen = whole;
      // Of thin surfaces there are fewer pixels around than of what is behind them: what the images show must outweigh that.
      float score = votes[k] * (likeness * likeness * likeness);
      if (score > best) {
        best = score;
        prior = vec4(m, 1.0f);
      }
    }
  }
  store_prior(CONTEXT REFERENCE, pixel, prior);
}
