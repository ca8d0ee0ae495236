// SPDX-License-Identifier: MIT
// The texels that samples of a view are filtered from: its pixels or, with two texels a pixel, its half pixels, whose
// bilinear samples, as texture units take them, come near to cubic interpolation of the pixels.

// Halfway between a and b, which lie between `before` and `after`; masked where a or b is.
FN float intensity_between(float before, float a, float b, float after) {
  if (min(a, b) < 0.0f) return MASKED_INTENSITY;
  // The spline of Catmull and Rom; beyond a masked neighbour the line through a and b goes on.
  float rise = before >= 0.0f ? a - before : b - a;
  float fall = after >= 0.0f ? b - after : a - b;
  // Of images of little contrast, which are stretched, bright pixels lie beyond 1.
  return clamp(0.5f * (a + b) + 0.0625f * (rise + fall), 0.0f, max(1.0f, max(a, b)));
}

// Halfway between a pixel and its right neighbour.
FN float intensity_right_of(CONTEXT_ARGUMENT ivec2 pixel) {
  return intensity_between(intensity_at(CONTEXT REFERENCE, ivec2(pixel.x - 1, pixel.y)),
                           intensity_at(CONTEXT REFERENCE, pixel),
                           intensity_at(CONTEXT REFERENCE, ivec2(pixel.x + 1, pixel.y)),
                           intensity_at(CONTEXT REFERENCE, ivec2(pixel.x + 2, pixel.y)));
}

// A pixel's own half pixel and those to the right, below and between, each with its neighbours that a sample reads.
FN void store_half_pixels(CONTEXT_ARGUMENT ivec2 pixel) {
  // Rows and columns of three: the pixel, the half pixel after it and the next pixel.
  float texels[9];
  UNROLL for (int column = 0; column < 3; ++column) {
    float down[4];
    UNROLL for (int i = 0; i < 4; ++i) {
      ivec2 q = ivec2(pixel.x + column / 2, pixel.y + i - 1);
      down[i] = column == 1 ? intensity_right_of(CONTEXT q) : intensity_at(CONTEXT REFERENCE, q);
    }
    texels[column] = down[1];
    texels[3 + column] = intensity_between(down[0], down[1], down[2], down[3]);
    texels[6 + column] = down[2];
  }
  UNROLL for (int row = 0; row < 2; ++row) {
    UNROLL for (int column = 0; column < 2; ++column) {
      int first = 3 * row + column;
      store_texel(CONTEXT REFERENCE, ivec2(2 * pixel.x + column, 2 * pixel.y + row),
                       vec4(texels[first], texels[first + 1], texels[first + 3], texels[first + 4]));
    }
  }
}

FN void interpolate_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  if (TEXELS_PER_PIXEL == 2) {
    store_half_pixels(CONTEXT pixel);
  } else {
    store_texel(CONTEXT REFERENCE, pixel,
                vec4(intensity_at(CONTEXT REFERENCE, pixel),
                     intensity_at(CONTEXT REFERENCE, ivec2(pixel.x + 1, pixel.y)),
                     intensity_at(CONTEXT REFERENCE, ivec2(pixel.x, pixel.y + 1)),
                     intensity_at(CONTEXT REFERENCE, ivec2(pixel.x + 1, pixel.y + 1))));
  }
}
