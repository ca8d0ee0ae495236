// SPDX-License-Identifier: MIT
// The few GLSL vector types and functions that the kernels use, for C++ and CUDA.
// Included inside a namespace by src/kernel/host.h; FN is the function qualifier.

template <class T>
struct Vector2 {
  T x, y;
  Vector2() = default;
  FN constexpr Vector2(T x_, T y_) : x(x_), y(y_) {}
};
template <class T>
struct Vector3 {
  T x, y, z;
  Vector3() = default;
  FN constexpr Vector3(T x_, T y_, T z_) : x(x_), y(y_), z(z_) {}
};
template <class T>
struct alignas(16) Vector4 {  // GPUs load it at once
  T x, y, z, w;
  Vector4() = default;
  FN constexpr Vector4(T x_, T y_, T z_, T w_) : x(x_), y(y_), z(z_), w(w_) {}
  FN constexpr Vector4(Vector3<T> v, T w_) : x(v.x), y(v.y), z(v.z), w(w_) {}
};

using vec2 = Vector2<float>;
using vec3 = Vector3<float>;
using vec4 = Vector4<float>;
using ivec2 = Vector2<int>;
using ivec4 = Vector4<int>;
using uint = unsigned int;
using uvec4 = Vector4<uint>;

template <class T>
FN Vector2<T> operator+(Vector2<T> a, Vector2<T> b) { return {a.x + b.x, a.y + b.y}; }
template <class T>
FN Vector2<T> operator-(Vector2<T> a, Vector2<T> b) { return {a.x - b.x, a.y - b.y}; }
template <class T>
FN Vector2<T> operator*(T s, Vector2<T> a) { return {s * a.x, s * a.y}; }
template <class T>
FN T dot(Vector2<T> a, Vector2<T> b) { return a.x * b.x + a.y * b.y; }

template <class T>
FN Vector3<T> operator+(Vector3<T> a, Vector3<T> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class T>
FN Vector3<T> operator-(Vector3<T> a, Vector3<T> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class T>
FN Vector3<T> operator*(T s, Vector3<T> a) { return {s * a.x, s * a.y, s * a.z}; }
template <class T>
FN T dot(Vector3<T> a, Vector3<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class T>
FN Vector3<T> cross(Vector3<T> a, Vector3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

FN float sqrt(float a) { return ::sqrtf(a); }
FN double sqrt(double a) { return ::sqrt(a); }
#ifdef __CUDA_ARCH__
FN float floor(float a) { return ::floorf(a); }
#else
// Of what an int holds: without SSE 4.1 the library's is a call.
FN float floor(float a) {
  float whole = static_cast<float>(static_cast<int>(a));
  return whole > a ? whole - 1.0f : whole;
}
#endif
FN double polar_angle(double y, double x) { return ::atan2(y, x); }
FN double arc_tangent(double y, double x) { return ::atan2(y, x); }
FN float abs(float a) { return ::fabsf(a); }
FN double abs(double a) { return ::fabs(a); }
FN int abs(int a) { return a < 0 ? -a : a; }
template <class T>
FN T min(T a, T b) { return b < a ? b : a; }
template <class T>
FN T max(T a, T b) { return a < b ? b : a; }
#ifdef __CUDA_ARCH__
FN float min(float a, float b) { return ::fminf(a, b); }
FN float max(float a, float b) { return ::fmaxf(a, b); }
#endif
// At least 0, of an `a` of 1 at most: costs a GPU nothing.
FN float saturate_below_one(float a) {
#ifdef __CUDA_ARCH__
  return __saturatef(a);
#else
  return max(a, 0.0f);
#endif
}
template <class T>
FN T clamp(T a, T low, T high) { return min(max(a, low), high); }
template <class T>
FN T length(Vector3<T> a) { return sqrt(dot(a, a)); }
template <class T>
FN T length(Vector2<T> a) { return sqrt(dot(a, a)); }
FN float uint_as_float(uint a) {
  float f;
  memcpy(&f, &a, sizeof f);
  return f;
}
FN uint float_as_uint(float a) {
  uint u;
  memcpy(&u, &a, sizeof u);
  return u;
}
// Number of the lowest bit that is set; `a` is not zero.
FN int lowest_bit(uint a) {
#ifdef __CUDA_ARCH__
  return __ffs(static_cast<int>(a)) - 1;
#else
  return __builtin_ctz(a);
#endif
}

#include "elementary.glsl"
