// SPDX-License-Identifier: MIT
// Elementary functions from arithmetic alone, which have the same bits on every device that rounds it as IEEE 754 says
// (libraries and drivers differ in the last bits, which thresholds of the search then amplify). Polynomials are minimax
// fits, in single precision.

#define EIGHTH_TURN 0.785398163f
#define QUARTER_TURN 1.57079633f
#define HALF_TURN 3.14159265f

// Angle of the point (x, y), y >= 0, from the x axis, as atan2; to 1e-7 rad.
FN float polar_angle(float y, float x) {
  float larger = max(abs(x), y);
  float smaller = min(abs(x), y);
  // tan(pi / 8): beyond it the angle is measured from pi / 4.
  bool beyond = smaller > 0.414213562f * larger;
  // Of the zero vector it is 0.
  float t = (beyond ? smaller - larger : smaller) * (1.0f / (beyond ? smaller + larger : max(larger, 1e-37f)));
  float z = t * t;
  float angle = t + t * z * (-0.333327567f + z * (0.199718792f + z * (-0.138244528f + z * 0.0790259548f)));
  if (beyond) angle = EIGHTH_TURN + angle;
  if (y > abs(x)) angle = QUARTER_TURN - angle;
  return x < 0.0f ? HALF_TURN - angle : angle;
}

// The same for any y.
FN float arc_tangent(float y, float x) {
  float angle = polar_angle(abs(y), x);
  return y < 0.0f ? -angle : angle;
}

// (cosine, sine) of an angle of a few turns at most; to 1e-6.
FN vec2 unit_vector(float angle) {
  float quarters = floor(angle * (1.0f / QUARTER_TURN) + 0.5f);
  float r = angle - quarters * QUARTER_TURN;
  float z = r * r;
  float sine = r + r * z * (-0.166666507f + z * (0.00833197866f + z * -0.00019495636f));
  float cosine = 1.0f - 0.5f * z + z * z * (0.0416666469f + z * (-0.00138873675f + z * 2.44384508e-5f));
  int quadrant = int(quarters) & 3;
  if (quadrant == 1) return vec2(-sine, cosine);
  if (quadrant == 2) return vec2(-cosine, -sine);
  if (quadrant == 3) return vec2(sine, -cosine);
  return vec2(cosine, sine);
}

// Natural logarithm of a normal positive number; to 1e-6.
FN float logarithm(float a) {
  uint bits = float_as_uint(a);
  // Mantissas from 3/4 to 3/2, so that the series below converges fast.
  int exponent = int((bits + 0x00400000u) >> 23) - 127;
  float mantissa = uint_as_float(bits - (uint(exponent) << 23));
  float s = (mantissa - 1.0f) / (mantissa + 1.0f);
  float z = s * s;
  float of_mantissa = 2.0f * s * (1.0f + z * (0.333333333f + z * (0.2f + z * 0.142857143f)));
  return float(exponent) * 0.693147181f + of_mantissa;
}

// Of a positive number: 1 over the power of two at or below it.
FN float inverse_power_of_two(float a) {
  return uint_as_float((254u << 23) - (float_as_uint(a) & 0x7f800000u));
}

// exp(a) for |a| <= 80, the nearest of these beyond; to 1e-6 of it.
FN float exponential(float a) {
  a = clamp(a, -80.0f, 80.0f);
  float twos = floor(a * 1.44269504f + 0.5f);
  float r = a - twos * 0.693147181f;
  float of_rest = 1.0f + r * (1.0f + r * (0.5f + r * (0.166666667f + r * (0.0416666667f + r * (0.00833333333f +
                                                                                      r * 0.00138888889f)))));
  return of_rest * uint_as_float(uint(int(twos) + 127) << 23);
}
