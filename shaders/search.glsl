// SPDX-License-Identifier: MIT
// PatchMatch over plane hypotheses: random initialisation, propagation and random refinement of one pixel.

// Pixels of a tile.
#define TILE_WIDTH 8
#define TILE_HEIGHT 4
// Share of the range of inverse distance over which half of the preference for far planes builds up.
#define SATURATED_SHARE 0.03f

// Random numbers of this iteration and frame.
FN vec4 draw4(CONTEXT_ARGUMENT ivec2 pixel, int slot) {
  uint seed = PASS.seed + 0x9e3779b9u * uint(PARAMETERS.frame.x);
  return random4(seed, REFERENCE, pixel, PASS.iteration, slot);
}

// The same for all pixels of a tile, whose grids of neighbours then lie at the same place: the threads that a GPU runs at
// once load neighbours side by side.
FN vec4 draw4_of_tile(CONTEXT_ARGUMENT ivec2 pixel, int slot) {
  return draw4(CONTEXT ivec2(pixel.x / TILE_WIDTH, pixel.y / TILE_HEIGHT), slot);
}

FN vec3 normal_from_angles(float theta, float phi) {
  vec2 around = unit_vector(theta);
  vec2 from_pole = unit_vector(phi);
  return vec3(from_pole.y * around.x, from_pole.y * around.y, from_pole.x);
}

// A distance drawn from the range as the options ask, u in [0, 1).
FN float draw_distance(CONTEXT_ARGUMENT float u) {
  vec4 range = PARAMETERS.range;
  if (PARAMETERS.search.x == SAMPLING_UNIFORM) return range.x + u * (range.y - range.x);
  return 1.0f / (range.z + u * (range.w - range.z));
}

// A hypothesis may be held only if its distance is in range and it is not seen too obliquely.
FN bool admissible(CONTEXT_ARGUMENT vec3 ray, vec3 m) {
  float w = dot(m, ray);
  // The tolerance lets distances at the very ends of the range survive rounding.
  return w >= PARAMETERS.range.z * 0.99999f && w <= PARAMETERS.range.w * 1.00001f &&
         w >= PARAMETERS.patch_limits.z * length(m);
}

// Draw `slot` of this iteration: a plane at a random distance with a random normal.
FN vec3 random_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, int slot) {
  vec3 m = vec3(0.0f, 0.0f, 0.0f);
  for (int attempt = 0; attempt < 4; ++attempt) {
    vec4 u = draw4(CONTEXT pixel, slot + attempt);
    float distance = draw_distance(CONTEXT u.x);
    m = plane_through(ray, distance, normal_from_angles(2.0f * HALF_TURN * u.y, HALF_TURN * u.z));
    if (admissible(CONTEXT ray, m)) return m;
    m = (1.0f / distance) * ray;
  }
  return m;
}

// A plane near m: distance and both angles of the normal moved by up to `scale` times their first ranges.
FN vec3 perturbed_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 m, float scale, int slot) {
  vec4 u = draw4(CONTEXT pixel, slot);
  vec4 range = PARAMETERS.range;
  float w = dot(m, ray);
  float distance = 1.0f / w;
  if (PARAMETERS.search.x == SAMPLING_UNIFORM) {
    distance += scale * 0.25f * (range.y - range.x) * (2.0f * u.x - 1.0f);
    distance = clamp(distance, range.x, range.y);
  } else {
    w += scale * 0.25f * (range.w - range.z) * (2.0f * u.x - 1.0f);
    distance = 1.0f / clamp(w, range.z, range.w);
  }
  float theta = arc_tangent(-m.y, -m.x) + scale * HALF_TURN * (2.0f * u.y - 1.0f);
  float phi = arc_tangent(sqrt(m.x * m.x + m.y * m.y), -m.z) + scale * 0.5f * HALF_TURN * (2.0f * u.z - 1.0f);
  return plane_through(ray, distance, normal_from_angles(theta, phi));
}

// Share of its cost by which a plane at inverse distance w must do better: decides where nothing else does, so that sky
// is far. Saturates at a few per cent of the range, and so does not pull at planes nearer than that.
FN float nearness_penalty(CONTEXT_ARGUMENT float w) {
  vec4 range = PARAMETERS.range;
  float nearness = max(w - range.z, 0.0f) / (SATURATED_SHARE * (range.w - range.z));
  return PARAMETERS.support.w * nearness / (1.0f + nearness);
}

FN bool is_same_plane(vec4 held, vec3 m) { return m.x == held.x && m.y == held.y && m.z == held.z; }

// Whether a candidate may be better than the held hypothesis: it is another plane, which the pixel may hold.
FN bool takes_a_patch(CONTEXT_ARGUMENT vec3 ray, vec4 held, vec3 m) {
  return !is_same_plane(held, m) && admissible(CONTEXT ray, m);
}

// The better of the held hypothesis (m, cost) and a candidate. `small`: difference of inverse distance up to which
// the farther of the two is not preferred, which would pull at planes that are matched. The preference is in proportion
// to the held cost: on a wall's gradient of brightness all planes match well, and a little better means much.
FN vec4 better_of(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec4 held, vec3 m, float small) {
  if (!takes_a_patch(CONTEXT ray, held, m)) return held;
  float cost = patch_cost(CONTEXT pixel, m);
  if (cost >= INVALID_COST) return held;
  float w = dot(m, ray);
  float w_held = inverse_distance_of(held, ray);
  float handicap = 0.0f;
  if (abs(w - w_held) > small) {
    handicap = min(held.w, NO_INFORMATION_COST) * (nearness_penalty(CONTEXT w) - nearness_penalty(CONTEXT w_held));
  }
  if (cost + handicap < held.w) return vec4(m, cost);
  return held;
}

// Whether the pixel has not tried a neighbour's plane yet. It tries them all in each iteration, and a plane that was not
// better once is never better, unless far planes are preferred to nearer ones. Until they are checked, planes have the
// iteration in which they were taken in the map of checks.
FN bool is_new_plane(CONTEXT_ARGUMENT ivec2 neighbour) {
  if (PASS.iteration == 1 || PASS.colour < 0 || PARAMETERS.support.w > 0.0f) return true;
  // Neighbours are of the other colour, which precedes the second one's pixels.
  int since = PASS.iteration - (PASS.colour == 0 ? 1 : 0);
  return check_at(CONTEXT REFERENCE, neighbour).x >= float(since);
}

// Where the neighbour of bit i lies.
FN ivec2 neighbour_of(ivec2 pixel, int i) {
  int side = 1 << i;
  int dx = side == NEIGHBOUR_LEFT ? -1 : (side == NEIGHBOUR_RIGHT ? 1 : 0);
  int dy = side == NEIGHBOUR_UP ? -1 : (side == NEIGHBOUR_DOWN ? 1 : 0);
  return ivec2(pixel.x + dx, pixel.y + dy);
}

// Bits of the neighbours whose planes are to be tried.
FN uint new_neighbours(CONTEXT_ARGUMENT ivec2 pixel) {
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  uint wanted = 0u;
  UNROLL for (int i = 0; i < 4; ++i) {
    ivec2 q = neighbour_of(pixel, i);
    // All are asked, so that a GPU does not wait for each of them in turn.
    bool is_new = is_new_plane(CONTEXT nearest_in_image(size, q));
    bool wants = (PASS.neighbours & (1 << i)) != 0 && in_image(size, q);
    if (wants && is_new) wanted |= 1u << uint(i);
  }
  return wanted;
}

// Candidate i of a pixel: the planes of the four neighbours, then random perturbations of the held plane with
// the range halved each time.
FN vec3 candidate_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec4 held, int i) {
  if (i >= 4) {
    float scale = 1.0f / float(1 << (i - 4));
    return perturbed_plane(CONTEXT pixel, ray, vec3(held.x, held.y, held.z), scale, i);
  }
  vec4 neighbour = hypothesis_at(CONTEXT REFERENCE, neighbour_of(pixel, i));
  return vec3(neighbour.x, neighbour.y, neighbour.z);
}

FN void store_random_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray) {
  vec3 m = random_plane(CONTEXT pixel, ray, 0);
  store_hypothesis(CONTEXT REFERENCE, pixel, vec4(m, patch_cost(CONTEXT pixel, m)));
}

FN void store_no_plane(CONTEXT_ARGUMENT ivec2 pixel) {
  store_hypothesis(CONTEXT REFERENCE, pixel, vec4(0.0f, 0.0f, 0.0f, INVALID_COST));
}

// False where the reference has no ray or no intensity, and no plane is stored.
FN bool starts_with_plane(CONTEXT_ARGUMENT ivec2 pixel, OUT(vec3) ray) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  if (is_usable(CONTEXT pixel, usable_ray)) return true;
  store_no_plane(CONTEXT pixel);
  return false;
}

FN void initialise_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 ray = ray_at(CONTEXT REFERENCE, pixel);
  if (ray.w == 0.0f) {
    store_no_plane(CONTEXT pixel);
  } else {
    store_random_plane(CONTEXT pixel, vec3(ray.x, ray.y, ray.z));
  }
}

FN void iterate_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  if (usable_ray.w == 0.0f) return;
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec4 before = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 held = before;
  // One loop for all candidates: the cost function is then compiled once. Threads that run at once wait for each other's
  // patches, so each goes on to its next candidate that takes one.
  // Bits of candidate_plane().
  uint candidates = new_neighbours(CONTEXT pixel) | (((1u << uint(PARAMETERS.search.y)) - 1u) << 4u);
  while (candidates != 0u) {
    vec3 m;
    do {
      m = candidate_plane(CONTEXT pixel, ray, held, lowest_bit(candidates));
      candidates &= candidates - 1u;
    } while (candidates != 0u && !takes_a_patch(CONTEXT ray, held, m));
    held = better_of(CONTEXT pixel, ray, held, m, 0.0f);
  }
  bool taken = !is_same_plane(before, vec3(held.x, held.y, held.z));
  if (taken || PASS.iteration == 1) {
    store_check(CONTEXT REFERENCE, pixel, vec4(taken ? float(PASS.iteration) : 0.0f, 0.0f, 0.0f, 0.0f));
  }
  store_hypothesis(CONTEXT REFERENCE, pixel, held);
}
