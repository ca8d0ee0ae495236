// SPDX-License-Identifier: MIT
// Whether another place in the sources matches better, one more reason for rejection. A kernel of its own: most
// schedules do without, and what a kernel does not ask for still takes its registers, and the time of software devices.

// Whether the patch matches better by more than the margin at one of PASS.places places: 2, 4, 8 ... source
// pixels away to either side.
FN bool is_ambiguous(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec4 held) {
  float margin = PARAMETERS.support.z;
  vec3 m = vec3(held.x, held.y, held.z);
  float w = dot(m, ray);
  float speed = speed_in_sources(CONTEXT pixel, ray, w);
  if (speed <= 0.0f) return false;
  for (int i = 0; i < PASS.places; ++i) {
    float pixels = float(2 << (i >> 1));
    float there = w + ((i & 1) == 0 ? pixels : -pixels) / speed;
    if (there < PARAMETERS.range.z || there > PARAMETERS.range.w) continue;
    if (patch_cost(CONTEXT pixel, (there / w) * m) < held.w - margin) return true;
  }
  return false;
}

// Adds the reason to those of the check.
FN void ambiguity_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec4 ray = ray_at(CONTEXT REFERENCE, pixel);
  vec4 held = hypothesis_at(CONTEXT REFERENCE, pixel);
  vec4 checked = check_at(CONTEXT REFERENCE, pixel);
  if ((uint(checked.w) & uint(REASON_NO_RAY | REASON_NO_OVERLAP)) != 0u) return;
  if (!is_ambiguous(CONTEXT pixel, vec3(ray.x, ray.y, ray.z), held)) return;
  store_check(CONTEXT REFERENCE, pixel, vec4(checked.x, checked.y, checked.z, checked.w + float(REASON_AMBIGUOUS)));
}
