// SPDX-License-Identifier: MIT
// Lets glslang, nvcc and g++ compile the same kernel source. Rules of the subset: float literals with
// f, no swizzles, no array parameters, float(i) casts, OUT(T) and INOUT(T) instead of out and inout,
// everything an accessor or a launch needs passed behind CONTEXT (nothing in GLSL, a reference in C++
// and CUDA).
//
// A back end provides, before including the algorithm:
//   vec4  ray_at(view, pixel)               unit ray and 1 / 0 (usable or not), zeros where none
//   RayRow ray_row(view, pixel), vec4 ray_in_row(row, dx)
//                                           the same, dx pixels to the right of that pixel, from one address for a row; of
//                                           a column up to APRON pixels outside the image any ray
//   float intensity_at(view, pixel)         [0, 1]; MASKED_INTENSITY where masked and up to APRON pixels outside
//   IntensityRow intensity_row(view, pixel), float intensity_in_row(row, dx)
//                                           the same, dx pixels to the right of that pixel, from one address for a row
//   vec4  texel_taps(view, texel)           intensity of a texel (0, 0: pixel 0, 0; 1, 0: a pixel to its right, or half a
//                                           one, see TEXELS_PER_PIXEL) and of its right, lower and lower right neighbour
//   float filtered_texel(view, texel)       bilinear, of the texture units, in coordinates of the memory, of which texels
//   vec2  filtered_texel_unit()             take so much: the centre of pixel (0, 0) lies at TEXEL_APRON + 0.5 of them;
//                                           only with HAS_DEVICE_FILTER
//   void  store_texel(view, texel, vec4)    as texel_taps() reads them, of which memories may keep the first
//   vec4  hypothesis_at(view, pixel), void store_hypothesis(view, pixel, vec4)
//   vec4  prior_at, check_at and the like, and the blocks PARAMETERS and PASS of parameters.glsl;
//   TEXELS_PER_PIXEL                        each way, of the images that sources are sampled from: 1, or 2 where
//                                           interpolate_pixel() makes half pixels
//   ROWS_AT_ONCE                            of a patch: 1, or 2 where the pattern is a checkerboard, whose rows start in turn
//                                           one column later, and a compiler is not asked to unroll so many (UNROLL_ROWS)
//   SOURCE_COUNT                            of a view, and ONE_SOURCE, whether a compiler knows it to be 1
//   TilePlace tile_place(index)             where the vector with this index lies in memory that a group of threads shares,
//   vec4  tile_at(place, further)           and what lies so many vectors further; only with HAS_PATCH_TILE
//   void  store_tile(place, vec4)           (patch_tile.glsl), as are
//   TILED                                   whether this kernel has such a tile, GROUP_WIDTH and GROUP_HEIGHT of a group,
//                                           GROUP_OF_LAUNCH and THREAD_OF_GROUP: which of them this thread is
//   VIEW_OF_LAUNCH                          which of the views that one launch runs over this thread has, from 0.
#ifndef WIDESTEREO_PORTABLE_H
#define WIDESTEREO_PORTABLE_H

#ifdef __cplusplus

#ifdef __CUDACC__
#define FN __host__ __device__ inline
#define UNROLL _Pragma("unroll")
#define UNROLL_ROWS _Pragma("unroll C::unrolled_rows")
#else
#define FN inline
#define UNROLL
#define UNROLL_ROWS
#endif
#define UNROLL_COLUMNS UNROLL
#define KEEP_LOOP
#define OUT(T) T&
#define INOUT(T) T&
#define CONTEXT context,
#define CONTEXT_ONLY context
#define CONTEXT_ARGUMENT const Context &context,
#define CONTEXT_ARGUMENT_ONLY const Context &context
#define PARAMETERS context.parameters
#define PASS context.pass
// Adds where a condition holds, without a branch: CUDA under a predicate, others a zero elsewhere.
#define ADD_WHERE(condition, sum, x) \
  if (condition) sum += x

#include <math.h>
#include <string.h>

#else

#define FN
// Mesa unrolls the loops over patches of 3x3 pixels, and then adds in an order of its own.
#ifdef TEXEL_LOADS
#define UNROLL
#define UNROLL_COLUMNS KEEP_LOOP
#define KEEP_LOOP [[dont_unroll]]
#else
#define UNROLL [[unroll]]
#define UNROLL_COLUMNS UNROLL
#define KEEP_LOOP
#endif
#define UNROLL_ROWS KEEP_LOOP
#define OUT(T) out T
#define INOUT(T) inout T
#define CONTEXT
#define CONTEXT_ONLY
#define CONTEXT_ARGUMENT
#define CONTEXT_ARGUMENT_ONLY
#define PARAMETERS parameters
#define PASS pass
#define ADD_WHERE(condition, sum, x) sum += (condition) ? x : 0.0f
#define real float
#define real2 vec2
#define real3 vec3
#define real4 vec4
#define uint_as_float(a) uintBitsToFloat(a)
#define float_as_uint(a) floatBitsToUint(a)
#define lowest_bit(a) findLSB(a)
// Software would compute both limits.
#ifdef TEXEL_LOADS
#define saturate_below_one(a) max(a, 0.0f)
#else
#define saturate_below_one(a) clamp(a, 0.0f, 1.0f)
#endif

#include "elementary.glsl"

#endif

// Pixels that patches reach whose centres are every other pixel of `height` rows, `width` of each: of a row, of all.
#define PATCH_TILE_WIDTH(width, radius) (2 * ((width) + (radius)))
#define PATCH_TILE_SAMPLES(width, height, radius) (PATCH_TILE_WIDTH(width, radius) * ((height) + 2 * (radius)))
// That of Vulkan's workgroups on GPUs and of 11x11 windows, in less memory than the 16 KiB that all devices have.
#define LARGEST_PATCH_TILE PATCH_TILE_SAMPLES(8, 16, 5)

// This thread's views, of PASS.
#define REFERENCE (PASS.reference + VIEW_OF_LAUNCH)
#define OTHER (PASS.other + VIEW_OF_LAUNCH)

#endif
