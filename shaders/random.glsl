// SPDX-License-Identifier: MIT
// Stateless random numbers: the PCG4D hash of Jarzynski and Olano (JCGT 9(3), 2020) over pixel, step
// and seed. Integer arithmetic only, so every back end draws the same bits.

FN uvec4 pcg4d(uvec4 v) {
  uint x = v.x * 1664525u + 1013904223u;
  uint y = v.y * 1664525u + 1013904223u;
  uint z = v.z * 1664525u + 1013904223u;
  uint w = v.w * 1664525u + 1013904223u;
  x += y * w;
  y += z * x;
  z += x * y;
  w += y * z;
  x ^= x >> 16u;
  y ^= y >> 16u;
  z ^= z >> 16u;
  w ^= w >> 16u;
  x += y * w;
  y += z * x;
  z += x * y;
  w += y * z;
  return uvec4(x, y, z, w);
}

// Uniform in [0, 1), a multiple of 2^-24 and therefore exact.
FN float unit_float(uint bits) { return float(bits >> 8u) * (1.0f / 16777216.0f); }

// Four numbers in [0, 1) for draw `slot` of iteration `iteration` at a pixel of a view.
FN vec4 random4(uint seed, int view, ivec2 pixel, int iteration, int slot) {
  uvec4 bits = pcg4d(uvec4(uint(pixel.x) | (uint(pixel.y) << 16u),
                           (uint(iteration) << 8u) | uint(slot), seed, uint(view)));
  return vec4(unit_float(bits.x), unit_float(bits.y), unit_float(bits.z), unit_float(bits.w));
}
