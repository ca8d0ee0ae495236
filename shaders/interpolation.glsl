// SPDX-License-Identifier: MIT
// Intensities of a view at half pixels. Bilinear samples of them, as texture units take them, come near to cubic
// interpolation of the pixels.

// Halfway between a and b, which lie between `before` and `after`; masked where a or b is.
FN float intensity_between(CONTEXT_ARGUMENT float before, float a, float b, float after) {
  if (min(a, b) < 0.0f) return MASKED_INTENSITY;
  float mean = 0.5f * (a + b);
  if ((PASS.candidates & INTERPOLATE_CUBIC) == 0u) return mean;
  // The spline of Catmull and Rom; beyond a masked neighbour the line through a and b goes on.
  float rise = before >= 0.0f ? a - before : b - a;
  float fall = after >= 0.0f ? b - after : a - b;
  return clamp(mean + 0.0625f * (rise + fall), 0.0f, 1.0f);
}

// Halfway between a pixel and its right neighbour.
FN float intensity_right_of(CONTEXT_ARGUMENT ivec2 pixel) {
  return intensity_between(CONTEXT intensity_at(CONTEXT PASS.reference, ivec2(pixel.x - 1, pixel.y)),
                           intensity_at(CONTEXT PASS.reference, pixel),
                           intensity_at(CONTEXT PASS.reference, ivec2(pixel.x + 1, pixel.y)),
                           intensity_at(CONTEXT PASS.reference, ivec2(pixel.x + 2, pixel.y)));
}

// A pixel's own half pixel and those to the right, below and between.
FN void interpolate_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  float own[4];
  float right[4];
  for (int i = 0; i < 4; ++i) {
    ivec2 q = ivec2(pixel.x, pixel.y + i - 1);
    own[i] = intensity_at(CONTEXT PASS.reference, q);
    right[i] = intensity_right_of(CONTEXT q);
  }
  ivec2 texel = ivec2(2 * pixel.x, 2 * pixel.y);
  store_half_pixel(CONTEXT PASS.reference, texel, own[1]);
  store_half_pixel(CONTEXT PASS.reference, ivec2(texel.x + 1, texel.y), right[1]);
  store_half_pixel(CONTEXT PASS.reference, ivec2(texel.x, texel.y + 1),
                   intensity_between(CONTEXT own[0], own[1], own[2], own[3]));
  store_half_pixel(CONTEXT PASS.reference, ivec2(texel.x + 1, texel.y + 1),
                   intensity_between(CONTEXT right[0], right[1], right[2], right[3]));
}
