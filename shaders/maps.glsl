// SPDX-License-Identifier: MIT
// What the maps of a match mean: intensities from pixels, distances and normals from plane hypotheses. Compiled
// without contraction for the host and CUDA, which then agree bit by bit.

// Pixel types of an application's images, as include/widestereo/pixel_type.h numbers them.
#define PIXEL_GREY8 0
#define PIXEL_GREY16 1
#define PIXEL_INTENSITY 2

// What makes the intensity of a texture's texels: the first component, or red, green and blue.
#define TEXELS_GREY 0
#define TEXELS_COLOUR 1

// Largest values of 8 and 16 bits become 1.
#define SCALE_OF_8_BITS (1.0f / 255.0f)
#define SCALE_OF_16_BITS (1.0f / 65535.0f)
// Intensities end here: 1, with room for rounding.
#define ABOVE_INTENSITY (1.0f + 1e-6f)
#define SIGN_BIT 0x80000000u

// Maps of a view.
#define MAP_DISTANCE 0
#define MAP_NORMALS 1
#define MAP_COST 2
#define MAP_CONFIDENCE 3
#define MAP_REASONS 4

// By its bits, which order floats that are not negative: shader compilers may take every float for a number.
FN float intensity_or_masked(float value) {
  uint bits = float_as_uint(value);
  return bits < float_as_uint(ABOVE_INTENSITY) || bits == SIGN_BIT ? value : MASKED_INTENSITY;
}

// Rec. 601, as OpenCV makes grey of colours; of grey, that very grey.
FN float luma(float red, float green, float blue) {
  return green + 0.299f * (red - green) + 0.114f * (blue - green);
}

// Distance along the unit ray of the plane (m, cost) at a pixel, 0 where it holds none.
FN float plane_distance(vec4 hypothesis, vec4 ray) {
  float w = hypothesis.x * ray.x + hypothesis.y * ray.y + hypothesis.z * ray.z;
  if (hypothesis.w >= INVALID_COST || !(w > 0.0f)) return 0.0f;
  return 1.0f / w;
}

// Its unit normal, facing the camera, 0 where it holds none.
FN vec3 plane_normal(vec4 hypothesis, vec4 ray) {
  if (plane_distance(hypothesis, ray) == 0.0f) return vec3(0.0f, 0.0f, 0.0f);
  vec3 m = vec3(hypothesis.x, hypothesis.y, hypothesis.z);
  return (-1.0f / length(m)) * m;
}
