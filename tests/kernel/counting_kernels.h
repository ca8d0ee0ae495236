// SPDX-License-Identifier: MIT
// The shared patch cost and plane fit compiled with a number that counts what is done with it.
#pragma once

#include <bit>
#include <cmath>
#include <cstring>
#include <vector>

#include "kernel_fixture.h"

namespace widestereo::test::counting {

struct Counts {
  long operations = 0;
  long texels = 0;
  std::vector<cv::Point> checks;  ///< pixels whose check was read, in order
};
inline Counts counts;

/// A single-precision number; every operation on it counts as one.
struct Number {
  float value;
  Number() = default;
  Number(float v) : value(v) {}  // NOLINT: literals become numbers
  explicit Number(int v) : value(static_cast<float>(v)) {}
  explicit operator int() const { return static_cast<int>(value); }
};
inline Number counted(float value) {
  ++counts.operations;
  return value;
}
inline Number operator+(Number a, Number b) { return counted(a.value + b.value); }
inline Number operator-(Number a, Number b) { return counted(a.value - b.value); }
inline Number operator/(Number a, Number b) { return counted(a.value / b.value); }
inline Number operator*(Number a, Number b) { return counted(a.value * b.value); }
inline Number operator-(Number a) { return -a.value; }
inline Number& operator+=(Number& a, Number b) { return a = a + b; }
inline Number& operator-=(Number& a, Number b) { return a = a - b; }
inline Number& operator*=(Number& a, Number b) { return a = a * b; }
inline auto operator<=>(Number a, Number b) { return a.value <=> b.value; }
inline bool operator==(Number a, Number b) { return a.value == b.value; }
inline Number sqrt(Number a) { return counted(std::sqrt(a.value)); }
inline Number arc_tangent(Number y, Number x) { return counted(std::atan2(y.value, x.value)); }
inline Number polar_angle(Number y, Number x) { return arc_tangent(y, x); }
inline Number abs(Number a) { return std::fabs(a.value); }
inline Number floor(Number a) { return std::floor(a.value); }
inline Number inverse_power_of_two(Number a) { return kernel::inverse_power_of_two(a.value); }
inline Number min(Number a, Number b) { return b < a ? b : a; }
inline Number max(Number a, Number b) { return a < b ? b : a; }
inline Number clamp(Number a, Number low, Number high) { return min(max(a, low), high); }

using kernel::clamp;
using kernel::cross;
using kernel::dot;
using kernel::ivec2;
using kernel::ivec4;
using kernel::length;
using kernel::max;
using kernel::min;
using kernel::uint;
using vec2 = kernel::Vector2<Number>;
using vec3 = kernel::Vector3<Number>;
using vec4 = kernel::Vector4<Number>;
inline vec2 operator*(float factor, vec2 v) { return Number(factor) * v; }
using real = Number;
using real2 = vec2;
using real3 = vec3;
using real4 = vec4;

#define float Number
// clang-format off
#include "camera.glsl"
#include "parameters.glsl"
// clang-format on
#undef float

/// A host's block as one of Numbers, which have the layout of float.
template <class To, class From>
To numbers(const From& from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(static_cast<void*>(&to), &from, sizeof to);
  return to;
}

struct Context {
  MatchParameters parameters;
  PassParameters pass;
  KernelConstants constants;
  kernel::cpu::Context plain;
  int view_of_launch = 0;
};

inline Context context_of(KernelFixture& fixture) {
  return {numbers<MatchParameters>(fixture.schedule().parameters),
          numbers<PassParameters>(fixture.pass()), fixture.schedule().constants, fixture.context()};
}

inline vec4 ray_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return numbers<vec4>(kernel::cpu::ray_at(context.plain, view, p));
}
struct RayRow {
  kernel::cpu::RayRow plain;
};
inline RayRow ray_row(CONTEXT_ARGUMENT int view, ivec2 p) {
  return {kernel::cpu::ray_row(context.plain, view, p)};
}
inline vec4 ray_in_row(const RayRow& row, int dx) {
  return numbers<vec4>(kernel::cpu::ray_in_row(row.plain, dx));
}
inline Number intensity_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return kernel::cpu::intensity_at(context.plain, view, p);
}
using kernel::cpu::IntensityRow;
inline IntensityRow intensity_row(CONTEXT_ARGUMENT int view, ivec2 p) {
  return kernel::cpu::intensity_row(context.plain, view, p);
}
inline Number intensity_in_row(IntensityRow row, int dx) { return row[dx]; }
inline vec4 texel_taps(CONTEXT_ARGUMENT int view, ivec2 p) {
  counts.texels += 4;
  return numbers<vec4>(kernel::cpu::texel_taps(context.plain, view, p));
}
inline vec4 hypothesis_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  return numbers<vec4>(kernel::cpu::hypothesis_at(context.plain, view, p));
}
inline vec4 check_at(CONTEXT_ARGUMENT int view, ivec2 p) {
  counts.checks.emplace_back(p.x, p.y);
  return numbers<vec4>(kernel::cpu::check_at(context.plain, view, p));
}
inline vec4 draw4_of_tile(CONTEXT_ARGUMENT ivec2 pixel, int slot) {
  return numbers<vec4>(kernel::cpu::draw4_of_tile(context.plain, pixel, slot));
}

#define float Number
// clang-format off
#include "plane.glsl"
#include "patch.glsl"
#include "plane_fit.glsl"
// clang-format on
#undef float

}  // namespace widestereo::test::counting
