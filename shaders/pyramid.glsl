// SPDX-License-Identifier: MIT
// Between the levels of the image pyramid. Every view has one entry for each level, with a camera of its own;
// OTHER is the same view one level finer (downsample) or coarser (upsample).

// Mean of the four finer pixels; masked unless at least three of them are usable.
FN void downsample_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  float sum = 0.0f;
  float n = 0.0f;
  for (int i = 0; i < 4; ++i) {
    ivec2 q = ivec2(2 * pixel.x + (i & 1), 2 * pixel.y + (i >> 1));
    float a = intensity_at(CONTEXT OTHER, q);
    if (a < 0.0f) continue;
    sum += a;
    n += 1.0f;
  }
  store_intensity(CONTEXT REFERENCE, pixel, n >= 3.0f ? sum / n : MASKED_INTENSITY);
}

// Starts a pixel from fronto-spherical planes at PASS.steps inverse distances over the whole range.
FN void sweep_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec3 ray;
  if (!starts_with_plane(CONTEXT pixel, ray)) return;
  vec4 best = vec4(0.0f, 0.0f, 0.0f, INVALID_COST);
  vec4 range = PARAMETERS.range;
  for (int i = 0; i < PASS.steps; ++i) {
    float share = (float(i) + 0.5f) / float(PASS.steps);
    best = better_of(CONTEXT pixel, ray, best, (range.z + share * (range.w - range.z)) * ray, 0.0f);
  }
  store_hypothesis(CONTEXT REFERENCE, pixel, best);
}

// Starts a pixel from the best of the PASS.places nearest coarser pixels' planes, of four: evaluated at the finer ray
// they are exact, so slanted surfaces need no interpolation. A random plane where there is none.
FN void upsample_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  vec3 ray;
  if (!starts_with_plane(CONTEXT pixel, ray)) return;
  vec4 best = vec4(0.0f, 0.0f, 0.0f, INVALID_COST);
  for (int i = 0; i <= PASS.places; ++i) {
    vec3 m = vec3(0.0f, 0.0f, 0.0f);
    if (i < PASS.places) {
      // The one that holds the pixel, then the one across the nearest corner, which its plane resembles least.
      bool beside = i == 1 || i == 2;
      bool below = i == 1 || i == 3;
      ivec2 q = ivec2(pixel.x / 2 + (beside ? (pixel.x & 1) * 2 - 1 : 0),
                      pixel.y / 2 + (below ? (pixel.y & 1) * 2 - 1 : 0));
      if (!in_image(PARAMETERS.cameras[OTHER].size, q)) continue;
      vec4 parent = hypothesis_at(CONTEXT OTHER, q);
      m = vec3(parent.x, parent.y, parent.z);
    } else if (best.w >= INVALID_COST) {
      m = random_plane(CONTEXT pixel, ray, 0);
    }
    best = better_of(CONTEXT pixel, ray, best, m, 0.0f);
  }
  store_hypothesis(CONTEXT REFERENCE, pixel, best);
}
