// SPDX-License-Identifier: MIT
// Vote of the surroundings. Patches match best where they hold the edge of a nearer surface, so that its plane spreads
// over the weaker texture beside it. Most of the pixels that look alike around there still lie on the right one.

// Planes that stand for election besides the pixel's own: of pixels in eight directions, at half the radius and at it.
#define VOTE_CANDIDATES 16
// Step between the pixels that vote.
#define VOTE_STEP 3
// Displacement (source pixels) from which on a plane does not support another.
#define VOTE_DISPLACEMENT 0.7f
// Planes nearer than this to the pixel's own do not stand, so that curved surfaces stay curved.
#define SAME_DISPLACEMENT 0.1f
// Random slot; the search and the regression use lower ones.
#define VOTE_SLOT 72

// The pixel whose plane is candidate i.
FN ivec2 vote_candidate_at(CONTEXT_ARGUMENT ivec2 pixel, int i) {
  int reach = i < VOTE_CANDIDATES / 2 ? PASS.radius / 2 : PASS.radius;
  int k = i % (VOTE_CANDIDATES / 2);
  if (k >= 4) ++k;
  return ivec2(pixel.x + (k % 3 - 1) * reach, pixel.y + (k / 3 - 1) * reach);
}

// How much one plane supports another, from their inverse distances at the pixel. `scale`: of a displacement.
FN float support_between(float w, float candidate, float scale) {
  float difference = (w - candidate) * scale;
  float agreement = max(1.0f - difference * difference, 0.0f);
  return agreement * agreement;
}

// Stores as prior (m, 1) the plane, of the pixel's own and the candidates, that the planes around support most,
// weighted by nearness and likeness of intensity; zero where there is none.
FN void vote_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT PASS.reference, pixel);
  vec4 held = hypothesis_at(CONTEXT PASS.reference, pixel);
  vec4 prior = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (is_usable(CONTEXT pixel, usable_ray) && held.w < INVALID_COST) {
    vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
    ivec4 size = PARAMETERS.cameras[PASS.reference].size;
    float own = inverse_distance_of(held, ray);
    float speed = speed_in_sources(CONTEXT ray, own);
    float scale = speed / VOTE_DISPLACEMENT;
    float candidates[VOTE_CANDIDATES];
    float support[VOTE_CANDIDATES];
    UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
      ivec2 q = vote_candidate_at(CONTEXT pixel, i);
      candidates[i] = own;
      support[i] = 0.0f;
      if (!in_image(size, q)) continue;
      vec4 plane = hypothesis_at(CONTEXT PASS.reference, q);
      vec3 m = vec3(plane.x, plane.y, plane.z);
      bool differs = abs(dot(m, ray) - own) * speed > SAME_DISPLACEMENT;
      if (differs && plane.w < INVALID_COST && admissible(CONTEXT ray, m)) candidates[i] = dot(m, ray);
    }
    float intensity = intensity_at(CONTEXT PASS.reference, pixel);
    float fall_off = 1.0f / float(PASS.radius * PASS.radius);
    float most = 0.0f;
    // Every pixel asks others, so that neighbours do not all make the same mistake.
    vec4 u = draw4(CONTEXT pixel, VOTE_SLOT);
    int first_x = int(u.x * float(VOTE_STEP)) - PASS.radius;
    int first_y = int(u.y * float(VOTE_STEP)) - PASS.radius;
    for (int dy = first_y; dy <= PASS.radius; dy += VOTE_STEP) {
      for (int dx = first_x; dx <= PASS.radius; dx += VOTE_STEP) {
        ivec2 q = ivec2(pixel.x + dx, pixel.y + dy);
        if (!in_image(size, q)) continue;
        vec4 plane = hypothesis_at(CONTEXT PASS.reference, q);
        if (plane.w >= INVALID_COST) continue;
        float w = inverse_distance_of(plane, ray);
        float weight = 1.0f / (growth(float(dx * dx + dy * dy) * fall_off) *
                               unlikeness(CONTEXT intensity_at(CONTEXT PASS.reference, q), intensity));
        most += weight * support_between(w, own, scale);
        UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
          support[i] += weight * support_between(w, candidates[i], scale);
        }
      }
    }
    prior = vec4(held.x, held.y, held.z, 1.0f);
    int elected = -1;
    UNROLL for (int i = 0; i < VOTE_CANDIDATES; ++i) {
      if (support[i] > most) {
        most = support[i];
        elected = i;
      }
    }
    if (elected >= 0) {
      vec4 plane = hypothesis_at(CONTEXT PASS.reference, vote_candidate_at(CONTEXT pixel, elected));
      prior = vec4(plane.x, plane.y, plane.z, 1.0f);
    }
  }
  store_prior(CONTEXT PASS.reference, pixel, prior);
}
