// SPDX-License-Identifier: MIT
// Filling of rejected pixels from the nearest accepted ones in eight directions.

// Share of the planes around, counted from the farthest, that says which surface a pixel belongs to: occluded
// pixels, and those that a nearer surface's patches reach over, belong to the farther one.
#define FAR_SHARE 0.25f
// Displacement (source pixels) up to which planes belong to one surface.
#define SURFACE_DISPLACEMENT 1.0f
// In which the nearest accepted pixels are looked for, what stands for none, and more than the farthest is away.
#define DIRECTIONS 8
#define NO_PLACE 3e38f
#define BEYOND_ALL_STEPS 16384
// How much worse than the pixel's own a plane may match that takes its place.
#define LARGEST_EXTRA_COST 0.1f

// That step of that direction, as a number from 1 on which floats hold exactly, and its place from the pixel.
FN int numbered_step(int direction, int step) { return direction * BEYOND_ALL_STEPS + step; }

FN ivec2 place_of_step(int number) {
  int direction = number / BEYOND_ALL_STEPS;
  int step = number % BEYOND_ALL_STEPS;
  return ivec2(step * (direction % 3 - 1), step * (direction / 3 - 1));
}

// Stores as the prior's w where the plane lies that the pixel would take over (numbered_step()), zero where there is none:
// the median of the surface at the FAR_SHARE of the planes around, both weighted by likeness of intensity.
FN void fill_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  float intensity = intensity_at(CONTEXT REFERENCE, pixel);
  float inverse_scale = PARAMETERS.support.y;
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  // Sorted by the inverse distance that planes have at the pixel; constant indices alone keep them in registers.
  float places[DIRECTIONS];
  float weights[DIRECTIONS];
  int steps[DIRECTIONS];
  UNROLL for (int i = 0; i < DIRECTIONS; ++i) {
    places[i] = NO_PLACE;
    weights[i] = 0.0f;
    steps[i] = 0;
  }
  float total = 0.0f;
  uint reasons = uint(check_at(CONTEXT REFERENCE, pixel).w);
  bool wanted = reasons != 0u && (reasons & PASS.candidates) == 0u;
  for (int i = 0; i < 9 && wanted; ++i) {
    int dx = i % 3 - 1;
    int dy = i / 3 - 1;
    if (dx == 0 && dy == 0) continue;
    int reach = dx == 0 || dy == 0 ? PASS.radius : PASS.radius * 7 / 10;
    // The nearest accepted one first, what is done with it after the loop: software devices would do it every step.
    ivec2 q = pixel;
    int step = 0;
    bool accepted = false;
    for (int k = 1; k <= reach && !accepted; ++k) {
      q = ivec2(pixel.x + k * dx, pixel.y + k * dy);
      step = k;
      if (!in_image(size, q)) break;
      accepted = check_at(CONTEXT REFERENCE, q).w == 0.0f;
    }
    if (!accepted) continue;
    vec4 held = hypothesis_at(CONTEXT REFERENCE, q);
    vec3 m = vec3(held.x, held.y, held.z);
    if (!admissible(CONTEXT ray, m)) continue;
    float place = dot(m, ray);
    float weight =
        1.0f / eighth_power(root_of_unlikeness(intensity_at(CONTEXT REFERENCE, q) - intensity, inverse_scale));
    int number = numbered_step(i, step);
    total += weight;
    // All from its place on move on by one, so that of equal ones the first found stays first.
    bool comes_first = false;
    UNROLL for (int k = 0; k < DIRECTIONS; ++k) {
      comes_first = comes_first || place < places[k];
      float next_place = comes_first ? places[k] : place;
      float next_weight = comes_first ? weights[k] : weight;
      int next_number = comes_first ? steps[k] : number;
      places[k] = comes_first ? place : places[k];
      weights[k] = comes_first ? weight : weights[k];
      steps[k] = comes_first ? number : steps[k];
      place = next_place;
      weight = next_weight;
      number = next_number;
    }
  }
  vec4 prior = prior_at(CONTEXT REFERENCE, pixel);
  prior.w = 0.0f;
  if (total > 0.0f) {
    float w = places[0];
    float sum = weights[0];
    UNROLL for (int i = 1; i < DIRECTIONS; ++i) {
      if (sum >= FAR_SHARE * total || places[i] == NO_PLACE) continue;
      w = places[i];
      sum += weights[i];
    }
    float reach = SURFACE_DISPLACEMENT / max(speed_in_sources(CONTEXT pixel, ray, w), 1e-9f);
    float of_surface = 0.0f;
    UNROLL for (int i = 0; i < DIRECTIONS; ++i) {
      of_surface += places[i] >= w - reach && places[i] <= w + reach ? weights[i] : 0.0f;
    }
    int chosen = 0;
    sum = 0.0f;
    UNROLL for (int i = 0; i < DIRECTIONS; ++i) {
      if (places[i] < w - reach || places[i] > w + reach || (sum > 0.0f && sum >= 0.5f * of_surface)) continue;
      chosen = steps[i];
      sum += weights[i];
    }
    prior.w = float(chosen);
  }
  store_prior(CONTEXT REFERENCE, pixel, prior);
}

// Takes the plane over, with the cost of no information where the source does not see it, and marks the pixel. With
// FILL_WITH_MATCHES a pixel that agrees with another view keeps its own plane where that matches better: it is seen
// there, and what it was rejected for may be a fraction of a pixel, as of thin surfaces far away.
FN void adopt_fill_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 prior = prior_at(CONTEXT REFERENCE, pixel);
  if (prior.w == 0.0f) return;
  // Of an accepted pixel, which keeps it.
  ivec2 place = place_of_step(int(prior.w));
  vec4 plane = hypothesis_at(CONTEXT REFERENCE, ivec2(pixel.x + place.x, pixel.y + place.y));
  vec3 m = vec3(plane.x, plane.y, plane.z);
  float cost = min(patch_cost(CONTEXT pixel, m), NO_INFORMATION_COST);
  vec4 checked = check_at(CONTEXT REFERENCE, pixel);
  bool agrees = (PASS.candidates & FILL_WITH_MATCHES) != 0u && checked.y <= PARAMETERS.repair_limits.y;
  if (agrees && cost > hypothesis_at(CONTEXT REFERENCE, pixel).w + LARGEST_EXTRA_COST) return;
  store_hypothesis(CONTEXT REFERENCE, pixel, vec4(m, cost));
  store_check(CONTEXT REFERENCE, pixel,
              vec4(checked.x, checked.y, 0.0f, checked.w + float(REASON_FILLED)));
}
