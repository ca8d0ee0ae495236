// SPDX-License-Identifier: MIT
// The shared kernel source that needs no back end, compiled for the host: vectors, cameras (in
// single and double precision) and the parameter blocks.
#pragma once

#include "portable.h"

namespace widestereo::kernel {
#include "vector.h"

using real = float;
using real2 = vec2;
using real3 = vec3;
using real4 = vec4;
#include "camera.glsl"
#include "parameters.glsl"

namespace precise {
using real = double;
using real2 = Vector2<double>;
using real3 = Vector3<double>;
using real4 = Vector4<double>;
#include "camera.glsl"
}  // namespace precise

}  // namespace widestereo::kernel
