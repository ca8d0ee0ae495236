// SPDX-License-Identifier: MIT
// Propagation from the best pixels of eight strips, and refinement in units of source pixels.

// Pixels away at which the surroundings of a pixel are taken for a normal.
#define SURROUNDINGS_RADIUS 3
// Cosine of the angle between that normal and the ray up to which it faces neither way.
#define LEAST_FACING 0.05f
// Share of the range of inverse distance to either side of a point over which its movement is measured, and 0.5 divided
// by it: compilers fold a quotient of two constants and a product, each in its own way, and round otherwise.
#define VELOCITY_STEP 0.002f
#define HALF_PER_VELOCITY_STEP 249.999985f

// What is small and moves by more than its size is lost at coarse levels, and lies far from what was found there. A
// random distance finds it: tried where the plane costs the first of these at least, and taken where it costs at most
// the second times as much, for on a blank wall one of several is often a little better.
#define DOUBTFUL_COST 0.25f
#define OTHER_SURFACE_SHARE 0.4f

// Movement in the source, pixels per unit of inverse distance; zero where it cannot be measured.
FN vec2 source_velocity(CONTEXT_ARGUMENT int source, vec3 ray, float w) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
  CameraParameters camera = PARAMETERS.cameras[source];
  float range = PARAMETERS.range.w - PARAMETERS.range.z;
  float step = VELOCITY_STEP * range;
  vec2 low;
  vec2 high;
  int model = model_of(CONTEXT camera);
  if (!project(camera, model, direction_in_source(pair, ray, w - step), low) ||
      !project(camera, model, direction_in_source(pair, ray, w + step), high)) {
    return vec2(0.0f, 0.0f);
  }
  return (HALF_PER_VELOCITY_STEP / range) * (high - low);
}

// Whether the source has an intensity where the point lands, which something nearer may hide there.
FN bool is_unmasked_in_source(CONTEXT_ARGUMENT int source, vec3 ray, float w) {
  ivec2 q;
  return pixel_in_source(CONTEXT source, ray, w * ray, q) && intensity_at(CONTEXT source, q) >= 0.0f;
}

// The source that tells most about the pixel's distance, and the movement there: of those in which the point lands the
// one in which it is fastest.
FN int telling_source(CONTEXT_ARGUMENT vec3 ray, float w, OUT(vec2) velocity) {
  int chosen = source_at(CONTEXT 0);
  velocity = source_velocity(CONTEXT chosen, ray, w);
  if (SOURCE_COUNT == 1) return chosen;
  bool seen = is_unmasked_in_source(CONTEXT chosen, ray, w);
  for (int i = 1; i < SOURCE_COUNT; ++i) {
    int source = source_at(CONTEXT i);
    vec2 v = source_velocity(CONTEXT source, ray, w);
    bool sees = is_unmasked_in_source(CONTEXT source, ray, w);
    bool tells_more = sees == seen ? length(v) > length(velocity) : sees;
    if (!tells_more) continue;
    chosen = source;
    velocity = v;
    seen = sees;
  }
  return chosen;
}

// The plane of lowest cost on a strip: 7 near pixels in a V, or 11 far ones along a line up to 23 pixels
// away, up, down, left or right. All are of the other colour, so that no thread reads what another writes.
FN vec3 best_of_strip(CONTEXT_ARGUMENT ivec2 pixel, int strip) {
  bool near = strip < NEAR_STRIPS;
  int side = near ? strip : strip - NEAR_STRIPS;
  bool upright = side == STRIP_UP || side == STRIP_DOWN;
  int outward = side == STRIP_UP || side == STRIP_LEFT ? -1 : 1;
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  float lowest = INVALID_COST;
  ivec2 best = pixel;
  int count = near ? 7 : 11;
  for (int k = 0; k < count; ++k) {
    int arm = (k + 1) / 2;
    int along = outward * (near ? 1 + arm : 3 + 2 * k);
    int across = near ? ((k & 1) == 1 ? -arm : arm) : 0;
    ivec2 q = ivec2(pixel.x + (upright ? across : along), pixel.y + (upright ? along : across));
    if (!in_image(size, q)) continue;
    float cost = hypothesis_at(CONTEXT REFERENCE, q).w;
    if (cost < lowest) {
      lowest = cost;
      best = q;
    }
  }
  // Costs alone are compared first, a quarter of what a plane takes to load.
  vec4 plane = hypothesis_at(CONTEXT REFERENCE, best);
  return lowest < INVALID_COST ? vec3(plane.x, plane.y, plane.z) : vec3(0.0f, 0.0f, 0.0f);
}

// The plane through the same point with a normal moved by up to PASS.step_normal (of unit length).
FN vec3 turned_plane(CONTEXT_ARGUMENT vec3 ray, vec3 m, vec4 u) {
  vec3 moved = (1.0f / length(m)) * m + PASS.step_normal * vec3(2.0f * u.x - 1.0f, 2.0f * u.y - 1.0f,
                                                                2.0f * u.z - 1.0f);
  float facing = dot(moved, ray);
  if (facing <= 0.0f) return m;
  return (dot(m, ray) / facing) * moved;
}

// The plane through the pixel's point that is parallel to the surface spanned by the points around it.
FN vec3 surroundings_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 m) {
  vec3 none = vec3(0.0f, 0.0f, 0.0f);
  vec3 points[4];
  for (int i = 0; i < 4; ++i) {
    int offset = (i & 1) == 0 ? -SURROUNDINGS_RADIUS : SURROUNDINGS_RADIUS;
    ivec2 q = i < 2 ? ivec2(pixel.x + offset, pixel.y) : ivec2(pixel.x, pixel.y + offset);
    if (!in_image(PARAMETERS.cameras[REFERENCE].size, q)) return none;
    vec4 plane = hypothesis_at(CONTEXT REFERENCE, q);
    vec4 r = ray_at(CONTEXT REFERENCE, q);
    vec3 direction = vec3(r.x, r.y, r.z);
    float w = inverse_distance_of(plane, direction);
    if (w <= 0.0f) return none;
    points[i] = (1.0f / w) * direction;
  }
  vec3 normal = cross(points[1] - points[0], points[3] - points[2]);
  float facing = dot(normal, ray);
  if (abs(facing) <= LEAST_FACING * length(normal)) return none;
  return (dot(m, ray) / facing) * normal;
}

// The plane that the source itself holds where the pixel's point lands in it.
FN vec3 source_plane(CONTEXT_ARGUMENT int source, vec3 ray, vec3 m) {
  vec3 none = vec3(0.0f, 0.0f, 0.0f);
  vec4 held = hypothesis_in_source(CONTEXT source, ray, m);
  vec3 plane = vec3(held.x, held.y, held.z);
  ViewPair back = pair_between(CONTEXT source, REFERENCE);
  if (held.w >= INVALID_COST || side_of_source(back, plane) <= 0.0f) return none;
  return plane_in_source(back, plane);
}

// Candidate of one kind; zero, which is never admissible, where there is none.
FN vec3 adaptive_candidate(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 m, float speed, int source,
                           int kind) {
  if (kind < STRIPS) return best_of_strip(CONTEXT pixel, kind);
  if (kind == CANDIDATE_SURROUNDINGS) return surroundings_plane(CONTEXT pixel, ray, m);
  if (kind == CANDIDATE_SOURCE_PLANE) return source_plane(CONTEXT source, ray, m);
  vec4 range = PARAMETERS.range;
  vec4 u = draw4(CONTEXT pixel, kind);
  float w = dot(m, ray);
  if (kind == CANDIDATE_RANDOM_DISTANCE || kind == CANDIDATE_OTHER_SURFACE) {
    return ((range.z + u.w * (range.w - range.z)) / w) * m;
  }
  vec3 plane = m;
  if (kind != CANDIDATE_INVERSE_DISTANCE) plane = turned_plane(CONTEXT ray, m, u);
  if (kind != CANDIDATE_NORMAL) {
    float step = PASS.step_pixels * (2.0f * u.w - 1.0f) / max(speed, 1e-6f);
    plane = (clamp(w + step, range.z, range.w) / w) * plane;
  }
  return plane;
}

FN void search_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  float w = inverse_distance_of(held, ray);
  if (!is_usable(CONTEXT pixel, usable_ray)) return;
  if (w <= 0.0f) {
    w = PARAMETERS.range.z;
    held = vec4(w * ray, INVALID_COST);
  }
  vec2 velocity;
  int source = telling_source(CONTEXT ray, w, velocity);
  float speed = length(velocity);
  for (uint kinds = PASS.candidates; kinds != 0u; kinds &= kinds - 1u) {
    int kind = lowest_bit(kinds);
    bool of_other_surface = kind == CANDIDATE_OTHER_SURFACE;
    if (of_other_surface && held.w < DOUBTFUL_COST) continue;
    vec3 m = vec3(held.x, held.y, held.z);
    vec4 better = better_of(CONTEXT pixel, ray, held,
                            adaptive_candidate(CONTEXT pixel, ray, m, speed, source, kind),
                            1.0f / max(speed, 1e-6f));
    if (better.w <= (of_other_surface ? OTHER_SURFACE_SHARE : PASS.tolerance) * held.w) held = better;
  }
  store_hypothesis(CONTEXT REFERENCE, pixel, held);
}
