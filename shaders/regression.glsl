// SPDX-License-Identifier: MIT
// Local plane regression: every pixel takes the plane of the neighbourhood that determines it. It fills weak texture
// from confident surroundings and makes distances sub-pixel accurate.

// Squared change of the slopes, in units of the first round's variance, that a larger neighbourhood may make.
#define LARGEST_SLOPE_CHANGE 6.0f
// Squared displacement that a larger neighbourhood may make: in any case (px^2), and in units of the smaller one's
// variance, which is too small by the pixels of a patch, as neighbours share most of theirs.
#define SMALLEST_SQUARED_MOVE 0.25f
#define LARGEST_SQUARED_MOVE 300.0f
// Those of neighbourhoods that hold other surfaces, too: less than this share of their weights agrees. Among what was
// measured for the first time it may be outliers that disagree, of which there are fewer from round to round.
#define LEAST_AGREEMENT 0.4f
#define SMALLEST_SQUARED_MOVE_OF_MIXED 0.01f
#define LARGEST_SQUARED_MOVE_OF_MIXED 9.0f
// The share of a frame that started from the planes of the one before, at least; and the squared move (px^2) of the plane
// for which half of the rest counts, too: smaller ones are noise, mostly, larger ones mend errors.
#define LEAST_SHARE_OF_FRAME 0.1f
#define SQUARED_MOVE_OF_NOISE 0.0225f

FN bool mixes_surfaces(CONTEXT_ARGUMENT PlaneFit fit) {
  return planes_are_regressed(CONTEXT_ONLY) && fit.agreement < LEAST_AGREEMENT;
}

// The plane of the smallest neighbourhood that determines its offset to PASS.deviation, or of the largest that does not
// contradict the one before: a thin surface never determines its own, and what is behind it would outvote it. With
// REGRESS_NORMALS the whole neighbourhood gives the slopes, likewise.
FN bool regress_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 east, vec3 south, vec4 own,
                      INOUT(LocalPlane) plane) {
  bool normals = (PASS.candidates & REGRESS_NORMALS) != 0u;
  bool determined = false;
  bool found = false;
  float offset = plane.offset;
  float certainty = 0.0f;  // nothing is contradicted yet
  for (int round = 0; round < REGRESSION_ROUNDS; ++round) {
    // What has its offset needs but one more round for its slopes.
    if (determined && round < REGRESSION_ROUNDS - 1) continue;
    int radius = PASS.radius >> max(WHOLE_RADIUS_ROUND - round, 0);
    PlaneFit fit;
    if (!fit_plane(CONTEXT pixel, ray, east, south, own, round, radius, plane, fit)) continue;
    float move = fit.plane.offset - offset;
    float squared_move = move * move;
    bool mixed = mixes_surfaces(CONTEXT fit);
    float in_variances = mixed ? LARGEST_SQUARED_MOVE_OF_MIXED : LARGEST_SQUARED_MOVE;
    float in_pixels = mixed ? SMALLEST_SQUARED_MOVE_OF_MIXED : SMALLEST_SQUARED_MOVE;
    if (squared_move * certainty > in_variances && squared_move * own.y * own.y > in_pixels) break;
    plane = fit.plane;
    certainty = fit.certainty;
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
    int radius = round == 0 ? PASS.radius >> WHOLE_RADIUS_ROUND
                            : (round < NORMAL_ROUNDS - 1 ? PASS.radius / 2 : PASS.radius);
    PlaneFit fit;
    if (!fit_plane(CONTEXT pixel, ray, east, south, own, round, radius, plane, fit)) continue;
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

// Between the plane that the pixel held and the regressed one, the nearer to this the farther they are apart: an average over
// the frames of a sequence.
FN LocalPlane filtered_plane(LocalPlane held, LocalPlane regressed, float speed) {
  float move = speed * (regressed.offset - held.offset);
  float squared_move = move * move;
  float share = LEAST_SHARE_OF_FRAME +
                (1.0f - LEAST_SHARE_OF_FRAME) * (squared_move / (squared_move + SQUARED_MOVE_OF_NOISE));
  LocalPlane plane;
  plane.offset = held.offset + share * (regressed.offset - held.offset);
  // A frame tells less of slopes, so that what is noise in distance is noise in them all the more.
  float share_of_slopes = share * share * share;
  plane.slope_x = held.slope_x + share_of_slopes * (regressed.slope_x - held.slope_x);
  plane.slope_y = held.slope_y + share_of_slopes * (regressed.slope_y - held.slope_y);
  return plane;
}

// Stores the regressed plane (m, 1) as the pixel's prior, with FILTER_MOVED the filtered one, zero where there is none.
// Without PASS.deviation the pixel keeps its distance and gets a normal alone.
FN void regress_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
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
    LocalPlane moved = plane;
    vec4 own = check_at(CONTEXT REFERENCE, pixel);
    bool found = PASS.deviation > 0.0f ? regress_plane(CONTEXT pixel, ray, east, south, own, plane)
                                         : regress_slopes(CONTEXT pixel, ray, east, south, own, plane);
    if ((PASS.candidates & FILTER_MOVED) != 0u) plane = filtered_plane(moved, plane, own.y);
    vec3 regressed = plane.offset * ray + plane.slope_x * east + plane.slope_y * south;
    if (found && admissible(CONTEXT ray, regressed)) prior = vec4(regressed, 1.0f);
  }
  store_prior(CONTEXT REFERENCE, pixel, prior);
}

// Takes the prior over as the pixel's plane where a source sees its point, whatever it sees of the patch: the cost stays
// and the measure follows, for another regression or a vote, which need no new one. The plane that the pixel held so far
// stays as the prior (m, 0): a vote may give it back.
FN void adopt_point_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 prior = prior_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 ray = ray_at(CONTEXT REFERENCE, pixel);
  vec3 unit_ray = vec3(ray.x, ray.y, ray.z);
  vec3 m = vec3(prior.x, prior.y, prior.z);
  store_prior(CONTEXT REFERENCE, pixel, vec4(held.x, held.y, held.z, 0.0f));
  if (held.w >= INVALID_COST || prior.w == 0.0f || !in_some_source(CONTEXT unit_ray, m)) return;
  vec4 adopted = vec4(m, held.w);
  store_hypothesis(CONTEXT REFERENCE, pixel, adopted);
  vec4 measure = check_at(CONTEXT REFERENCE, pixel);
  measure.z = inverse_distance_of(adopted, unit_ray);
  store_check(CONTEXT REFERENCE, pixel, measure);
}

// Takes the prior over as the pixel's plane, where it can be seen in a source. With HELD_UNSEEN the plane that the pixel
// holds came by adopt_point_pixel(): where it stays it gets a cost of its own, of no information at most.
FN void adopt_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 prior = prior_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  bool held_unseen = (PASS.candidates & HELD_UNSEEN) != 0u;
  if (held.w >= INVALID_COST || (prior.w == 0.0f && !held_unseen)) return;
  vec3 own = vec3(held.x, held.y, held.z);
  vec3 m = prior.w != 0.0f ? vec3(prior.x, prior.y, prior.z) : own;
  // A loop over both planes: the cost function is then compiled once.
  float cost = INVALID_COST;
  for (int i = 0; i < 2; ++i) {
    cost = patch_cost(CONTEXT pixel, m);
    if (cost < INVALID_COST || !held_unseen) break;
    m = own;
  }
  if (cost >= INVALID_COST && held_unseen) cost = NO_INFORMATION_COST;
  if (cost < INVALID_COST) store_hypothesis(CONTEXT REFERENCE, pixel, vec4(m, cost));
}
