// SPDX-License-Identifier: MIT
// Starts a view from another view's planes: every plane is warped forward, the nearest one wins its pixel.
// Integer atomics on inverse distances and pixel indices keep the outcome independent of the order.

// A plane that moved gives way to one that costs less than so many times what it did in the frame before, and to any that
// costs less than this: what has come in front of it may match less well at first than it did.
#define GROWTH_OF_COST 1.5f
#define LEAST_COST_OF_MOVED 0.2f

// Pixels along each side of what a plane is warped onto: the four around it, so that the planes of another view,
// which sees everything at another size, leave no holes. Between two frames of one view the nearest one is enough
// and does not fatten what is near, frame after frame; renewing fills the holes.
FN int splat_side(CONTEXT_ARGUMENT_ONLY) { return OTHER == REFERENCE ? 1 : 2; }

// Where pixel p of view OTHER lands in the reference view: top left of its pixels and its inverse distance
// there. False where it has no plane or lands outside the model's domain.
FN bool forward_warp(CONTEXT_ARGUMENT ivec2 p, OUT(ivec2) corner, OUT(float) inverse_distance) {
  corner = ivec2(0, 0);
  inverse_distance = 0.0f;
  vec4 ray = ray_at(CONTEXT OTHER, p);
  vec4 plane = hypothesis_at(CONTEXT OTHER, p);
  // A cost that is no number would never be undercut.
  if (ray.w == 0.0f || !(plane.w < INVALID_COST)) return false;
  ViewPair pair = pair_between(CONTEXT OTHER, REFERENCE);
  CameraParameters camera = PARAMETERS.cameras[REFERENCE];
  vec3 m = vec3(plane.x, plane.y, plane.z);
  vec3 unit_ray = vec3(ray.x, ray.y, ray.z);
  vec2 position;
  if (side_of_source(pair, m) <= 0.0f) return false;
  float w = dot(m, unit_ray);
  vec3 direction = direction_in_source(pair, unit_ray, w);
  if (!project_in_front(camera, model_of(CONTEXT camera), direction, w, position)) return false;
  if (!(position.x > -1.0f && position.y > -1.0f && position.x < float(camera.size.x) &&
        position.y < float(camera.size.y))) {
    return false;
  }
  inverse_distance = w / length(direction);
  float offset = splat_side(CONTEXT_ONLY) == 1 ? 0.5f : 0.0f;
  corner = ivec2(int(floor(position.x + offset)), int(floor(position.y + offset)));
  return true;
}

FN void transfer_clear_pixel(CONTEXT_ARGUMENT ivec2 pixel) { transfer_reset(CONTEXT pixel); }

FN void transfer_nearest_pixel(CONTEXT_ARGUMENT ivec2 p) {
  ivec2 corner;
  float inverse_distance;
  if (!forward_warp(CONTEXT p, corner, inverse_distance)) return;
  int side = splat_side(CONTEXT_ONLY);
  for (int i = 0; i < side * side; ++i) {
    ivec2 q = ivec2(corner.x + (i & 1), corner.y + (i >> 1));
    if (in_image(PARAMETERS.cameras[REFERENCE].size, q)) {
      transfer_nearest_raise(CONTEXT q, float_as_uint(inverse_distance));
    }
  }
}

FN void transfer_winner_pixel(CONTEXT_ARGUMENT ivec2 p) {
  ivec2 corner;
  float inverse_distance;
  if (!forward_warp(CONTEXT p, corner, inverse_distance)) return;
  uint index = uint(p.y * PARAMETERS.cameras[OTHER].size.x + p.x);
  int side = splat_side(CONTEXT_ONLY);
  for (int i = 0; i < side * side; ++i) {
    ivec2 q = ivec2(corner.x + (i & 1), corner.y + (i >> 1));
    if (!in_image(PARAMETERS.cameras[REFERENCE].size, q)) continue;
    // Tolerant, because another kernel may have rounded the same inverse distance differently.
    float nearest = uint_as_float(transfer_nearest_at(CONTEXT q));
    if (inverse_distance >= nearest * 0.9999f) transfer_winner_lower(CONTEXT q, index);
  }
}

FN bool is_plane(vec3 m) { return m.x != 0.0f || m.y != 0.0f || m.z != 0.0f; }

// The plane that won the pixel, in the reference frame, and its cost where it comes from; zero where none did or the pixel
// may not hold it.
FN vec4 transferred_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray) {
  vec4 none = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  uint index = transfer_winner_at(CONTEXT pixel);
  if (index == 0xffffffffu) return none;
  int width = PARAMETERS.cameras[OTHER].size.x;
  ivec2 p = ivec2(int(index) % width, int(index) / width);
  vec4 plane = hypothesis_at(CONTEXT OTHER, p);
  ViewPair pair = pair_between(CONTEXT OTHER, REFERENCE);
  vec3 moved = plane_in_source(pair, vec3(plane.x, plane.y, plane.z));
  if (admissible(CONTEXT ray, moved)) return vec4(moved, plane.w);
  return none;
}

FN void transfer_gather_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  if (usable_ray.w == 0.0f) {
    store_no_plane(CONTEXT pixel);
    return;
  }
  vec3 ray = vec3(usable_ray.x, usable_ray.y, usable_ray.z);
  vec4 transferred = transferred_plane(CONTEXT pixel, ray);
  vec3 m = vec3(transferred.x, transferred.y, transferred.z);
  if (!is_plane(m)) m = random_plane(CONTEXT pixel, ray, 0);
  store_hypothesis(CONTEXT REFERENCE, pixel, vec4(m, patch_cost(CONTEXT pixel, m)));
}

// The same between two frames of one view, OTHER being the reference: the moved planes go where the priors
// are, since other pixels still read the planes that they come from. (m, what it may cost now), zero where there is none.
FN void transfer_keep_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 usable_ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 moved = vec4(0.0f, 0.0f, 0.0f, 0.0f);
  if (usable_ray.w != 0.0f) {
    moved = transferred_plane(CONTEXT pixel, vec3(usable_ray.x, usable_ray.y, usable_ray.z));
  }
  vec3 m = vec3(moved.x, moved.y, moved.z);
  float cost = clamp(GROWTH_OF_COST * moved.w, LEAST_COST_OF_MOVED, NO_INFORMATION_COST);
  store_prior(CONTEXT REFERENCE, pixel, vec4(m, is_plane(m) ? cost : 0.0f));
}

// The moved plane of the nearest pixel, about, that has one which this pixel may hold: surfaces continue into what
// comes into view. A random plane where there is none.
FN vec3 moved_plane_nearby(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray) {
  for (int radius = 1; radius <= 32; radius *= 2) {
    for (int i = 0; i < 8; ++i) {
      int side = i < 4 ? i : i + 1;  // without the middle of 3x3
      ivec2 q = ivec2(pixel.x + radius * (side % 3 - 1), pixel.y + radius * (side / 3 - 1));
      if (!in_image(PARAMETERS.cameras[REFERENCE].size, q)) continue;
      vec4 prior = prior_at(CONTEXT REFERENCE, q);
      vec3 m = vec3(prior.x, prior.y, prior.z);
      if (prior.w != 0.0f && admissible(CONTEXT ray, m)) return m;
    }
  }
  return random_plane(CONTEXT pixel, ray, 0);
}

// The plane that a usable pixel starts from: the one that has moved there, or one nearby, and what it may cost.
FN vec4 moved_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray) {
  vec4 prior = prior_at(CONTEXT REFERENCE, pixel);
  if (prior.w != 0.0f) return prior;
  return vec4(moved_plane_nearby(CONTEXT pixel, ray), NO_INFORMATION_COST);
}

// Starts a pixel from the plane that has moved there, which was seen before where its patch now is not.
FN void renew_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec3 ray;
  if (!starts_with_plane(CONTEXT pixel, ray)) return;
  vec4 moved = moved_plane(CONTEXT pixel, ray);
  vec3 m = vec3(moved.x, moved.y, moved.z);
  float cost = patch_cost(CONTEXT pixel, m);
  if (cost >= INVALID_COST && in_some_source(CONTEXT ray, m)) cost = NO_INFORMATION_COST;
  store_hypothesis(CONTEXT REFERENCE, pixel, vec4(m, cost));
}

// Likewise, for a search whose planes all get costs of their own at the end.
FN void renew_point_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec3 ray;
  if (!starts_with_plane(CONTEXT pixel, ray)) return;
  vec4 moved = moved_plane(CONTEXT pixel, ray);
  vec3 m = vec3(moved.x, moved.y, moved.z);
  store_hypothesis(CONTEXT REFERENCE, pixel, vec4(m, in_some_source(CONTEXT ray, m) ? moved.w : INVALID_COST));
}
