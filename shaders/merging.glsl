// SPDX-License-Identifier: MIT
// Average over the views: each matches patches of its own, so that part of the noise of its planes is its own, too.

// Displacement (source pixels) from which on planes are not of the same surface, and its inverse: Mesa multiplies with that
// instead of dividing.
#define MERGED_DISPLACEMENT 0.5f
#define PER_MERGED_DISPLACEMENT (1.0f / MERGED_DISPLACEMENT)

// Stores as prior (m, 1) the pixel's plane, moved to the mean of its own inverse distance and of those that the sources'
// own planes have there, which count the less the farther away they are; zero where there is none.
FN void merge_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 prior = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (is_usable(CONTEXT pixel, usable_ray) && held.w < INVALID_COST) {
    vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
    vec3 m = vec3(held.x, held.y, held.z);
    float own = dot(m, ray);
    float n = 1.0f;
    float sum = 0.0f;
    for (int i = 0; i < SOURCE_COUNT; ++i) {
      int source = source_at(CONTEXT i);
      vec3 of_source = source_plane(CONTEXT source, ray, m);
      if (!admissible(CONTEXT ray, of_source)) continue;
      float difference = dot(of_source, ray) - own;
      float displacement = PER_MERGED_DISPLACEMENT * length(source_velocity(CONTEXT source, ray, own)) * difference;
      float agreement = saturate_below_one(1.0f - displacement * displacement);
      float weight = agreement * agreement;
      n += weight;
      sum += weight * difference;
    }
    vec3 merged = ((own + sum / n) / own) * m;
    if (admissible(CONTEXT ray, merged)) prior = vec4(merged, 1.0f);
  }
  store_prior(CONTEXT REFERENCE, pixel, prior);
}
