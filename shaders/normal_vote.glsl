// SPDX-License-Identifier: MIT
// Vote of the surroundings on normals. Where surfaces meet, the neighbourhood of a regression holds both, and its
// slopes lie between theirs; those of the pixels beside it, which hold one surface alone, agree with each other.

// Candidates: the pixel's own normal, in the middle, and those of its neighbours that far away.
#define NORMAL_CANDIDATES 9
#define NORMAL_CANDIDATE_REACH 3
// Normals support each other up to 14 degrees, by their cosines.
#define SUPPORT_PER_COSINE 33.0f
// Cosine of half a degree: candidates that differ less from the pixel's own need no election.
#define COSINE_OF_SAME_NORMAL 0.99996f

// Stores as prior (m, 1) the plane with the pixel's distance and that normal of the candidates which most of the
// planes around support, weighted by nearness, likeness of intensity and agreement in distance at the pixel; zero where
// there is none. The views must have been measured.
FN void vote_normal_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 measure = check_at(CONTEXT REFERENCE, pixel);
  vec4 prior = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (is_usable(CONTEXT pixel, usable_ray) && held.w < INVALID_COST && measure.x < UNMEASURED_VARIANCE) {
    vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
    ivec4 size = PARAMETERS.cameras[REFERENCE].size;
    float own = inverse_distance_of(held, ray);
    float scale = PER_VOTE_DISPLACEMENT * measure.y;
    vec3 candidates[NORMAL_CANDIDATES];
    float support[NORMAL_CANDIDATES];
    UNROLL for (int i = 0; i < NORMAL_CANDIDATES; ++i) {
      ivec2 q = ivec2(pixel.x + (i % 3 - 1) * NORMAL_CANDIDATE_REACH, pixel.y + (i / 3 - 1) * NORMAL_CANDIDATE_REACH);
      candidates[i] = vec3(0.0f, 0.0f, 0.0f);
      support[i] = 0.0f;
      if (!in_image(size, q)) continue;
      vec4 plane = hypothesis_at(CONTEXT REFERENCE, q);
      vec3 m = vec3(plane.x, plane.y, plane.z);
      if (plane.w < INVALID_COST && dot(m, ray) > 0.0f) candidates[i] = (1.0f / length(m)) * m;
    }
    float least_cosine = 1.0f;
    UNROLL for (int i = 0; i < NORMAL_CANDIDATES; ++i) {
      least_cosine = min(least_cosine, dot(candidates[i], candidates[NORMAL_CANDIDATES / 2]));
    }
    float fall_off = 2.0f / float(NORMAL_VOTE_RADIUS * NORMAL_VOTE_RADIUS);
    float inverse_scale = PARAMETERS.support.y;
    ivec4 grid = grid_in_image(size, pixel, ivec2(-NORMAL_VOTE_RADIUS, -NORMAL_VOTE_RADIUS), NORMAL_VOTE_RADIUS,
                               ivec2(NORMAL_VOTE_STEP, NORMAL_VOTE_STEP));
    // On most surfaces there is nothing to elect.
    if (least_cosine > COSINE_OF_SAME_NORMAL) grid.w = grid.y - 1;
    for (int dy = grid.y; dy <= grid.w; dy += NORMAL_VOTE_STEP) {
      for (int dx = grid.x; dx <= grid.z; dx += NORMAL_VOTE_STEP) {
        ivec2 q = ivec2(pixel.x + dx, pixel.y + dy);
        vec4 plane = hypothesis_at(CONTEXT REFERENCE, q);
        if (plane.w >= INVALID_COST) continue;
        vec3 m = vec3(plane.x, plane.y, plane.z);
        // Not as the difference of both places: Mesa would factor the scale out.
        float weight = support_over(scale * (dot(m, ray) - own)) /
                       remoteness_of_voter(CONTEXT q, dx, dy, fall_off, measure.w, inverse_scale);
        vec3 normal = (1.0f / length(m)) * m;
        UNROLL for (int i = 0; i < NORMAL_CANDIDATES; ++i) {
          // Not as 1 - SUPPORT_PER_COSINE (1 - cosine): Mesa would multiply out.
          float agreement = SUPPORT_PER_COSINE * dot(normal, candidates[i]) - (SUPPORT_PER_COSINE - 1.0f);
          support[i] += weight * max(agreement, 0.0f);
        }
      }
    }
    // The pixel's own comes first.
    vec3 elected = candidates[NORMAL_CANDIDATES / 2];
    float most = support[NORMAL_CANDIDATES / 2];
    UNROLL for (int i = 0; i < NORMAL_CANDIDATES; ++i) {
      if (support[i] > most) {
        most = support[i];
        elected = candidates[i];
      }
    }
    vec3 m = (own / dot(elected, ray)) * elected;
    if (admissible(CONTEXT ray, m)) prior = vec4(m, 1.0f);
  }
  store_prior(CONTEXT REFERENCE, pixel, prior);
}
