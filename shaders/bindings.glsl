// SPDX-License-Identifier: MIT
// Vulkan's side of portable.h: resources, accessors and the pixel of a thread. Texels are images, 2D arrays of one for
// each level with a layer for each of its views, as texture units must clamp to them. Maps and intensities of all views
// lie in buffers, row by row: loads from images take texture units, which have the samples to filter.
//
// Every kernel is compiled twice, for what is read with the same bits. GPUs gather or filter four texels in one
// instruction. Software devices, for which TEXEL_LOADS is defined, are a quarter faster without that machinery (lavapipe)
// and have the four numbers of a sample in one texel, which takes them much less than four texels of one; so they read
// maps and intensities as texel buffers, too. Where texture units filter, `interpolate` is compiled once more, for texels
// of half precision (HALF_PRECISION), and `iterate` for workgroups that share what their patches do (HAS_PATCH_TILE).

// Multiples of 8 in x keep the lanes of lavapipe busy, and let the threads that a GPU runs at once share a tile
// (draw4_of_tile()); 128 invocations are legal everywhere.
layout(local_size_x_id = 8, local_size_y_id = 9) in;

layout(constant_id = 0) const int WINDOW_RADIUS = 5;
layout(constant_id = 1) const int WARP = 0;
layout(constant_id = 2) const int CAMERA_MODEL = -1;
layout(constant_id = 3) const int SOURCE_COUNT = 1;
#define ONE_SOURCE (SOURCE_COUNT == 1)
layout(constant_id = 4) const int PATTERN = 0;
layout(constant_id = 5) const int WEIGHTED = 0;
layout(constant_id = 7) const int TEXELS_PER_PIXEL = 1;
#ifdef TEXEL_LOADS
#define FILTER FILTER_EXACT
#define ROWS_AT_ONCE 1
#else
layout(constant_id = 6) const int FILTER = 0;
#define HAS_DEVICE_FILTER
#define ROWS_AT_ONCE (PATTERN == PATTERN_CHECKERBOARD ? 2 : 1)
#endif

layout(set = 0, binding = 0, std140) uniform MatchBlock { MatchParameters parameters; };
layout(set = 0, binding = 1, std140) uniform PlaceBlock {
  ivec4 places[MAX_VIEWS];  // index of a view's pixel (0, 0) and what lies between rows: of maps; of intensities
};
#ifdef TEXEL_LOADS
layout(set = 0, binding = 2, r32f) uniform imageBuffer intensities;
layout(set = 0, binding = 3, rgba32f) readonly uniform imageBuffer rays;
layout(set = 0, binding = 4, rgba32f) uniform imageBuffer hypotheses;
layout(set = 0, binding = 5, rgba32f) uniform imageBuffer priors;
layout(set = 0, binding = 6, rgba32f) uniform imageBuffer checks;
#define LOAD_INTENSITY(index) imageLoad(intensities, index).x
#define STORE_INTENSITY(index, value) imageStore(intensities, index, vec4(value))
#define LOAD_MAP(map, index) imageLoad(map, index)
#define STORE_MAP(map, index, value) imageStore(map, index, value)
#else
layout(set = 0, binding = 2, std430) buffer IntensityBlock { float intensities[]; };
layout(set = 0, binding = 3, std430) readonly buffer RayBlock { vec4 rays[]; };
layout(set = 0, binding = 4, std430) buffer HypothesisBlock { vec4 hypotheses[]; };
layout(set = 0, binding = 5, std430) buffer PriorBlock { vec4 priors[]; };
layout(set = 0, binding = 6, std430) buffer CheckBlock { vec4 checks[]; };
#define LOAD_INTENSITY(index) intensities[index]
#define STORE_INTENSITY(index, value) intensities[index] = value
#define LOAD_MAP(map, index) map[index]
#define STORE_MAP(map, index, value) map[index] = value
#endif
layout(set = 0, binding = 7) uniform sampler2DArray texel_texture;
#ifdef TEXEL_LOADS
layout(set = 0, binding = 8, rgba32f) uniform image2DArray texels;  // with the right, lower and lower right one
#elif defined HALF_PRECISION
// Read by texture units alone: not all GPUs read and write one image of every format.
layout(set = 0, binding = 8, r16f) writeonly uniform image2DArray texels;
#else
layout(set = 0, binding = 8, r32f) writeonly uniform image2DArray texels;
#endif
layout(set = 0, binding = 9, std430) buffer NearestBlock { uint transfer_nearest[]; };
layout(set = 0, binding = 10, std430) buffer WinnerBlock { uint transfer_winner[]; };
layout(push_constant) uniform PassBlock {
  PassParameters pass;
#ifdef HAS_CONVERSION
  ConversionParameters conversion;
#endif
};

#define VIEW_OF_LAUNCH int(gl_WorkGroupID.z)

// Of the view whose pixels are updated, read once: lavapipe reads blocks lane by lane, in loops each time anew.
ivec4 place_of_reference = places[REFERENCE];

ivec4 place_of(int view) { return view == REFERENCE ? place_of_reference : places[view]; }

int in_maps(int view, ivec2 p) {
  ivec4 place = place_of(view);
  return place.x + p.y * place.y + p.x;
}

#define IntensityRow int

IntensityRow intensity_row(int view, ivec2 p) {
  ivec4 place = place_of(view);
  return place.z + p.y * place.w + p.x;
}

float intensity_in_row(IntensityRow row, int dx) { return LOAD_INTENSITY(row + dx); }

// Views of a level follow each other, and sources are of the reference's level.
int layer_of_texels(int view) { return view - pass.first_view; }

#ifdef HAS_PATCH_TILE
#define TILED true
#define GROUP_WIDTH int(gl_WorkGroupSize.x)
#define GROUP_HEIGHT int(gl_WorkGroupSize.y)
#define GROUP_OF_LAUNCH ivec2(gl_WorkGroupID.xy)
#define THREAD_OF_GROUP ivec2(gl_LocalInvocationID.xy)

// No specialisation constants, by which not every driver sizes arrays.
shared vec4 tile[LARGEST_PATCH_TILE];

#define TilePlace int

TilePlace tile_place(int index) { return index; }

vec4 tile_at(TilePlace place, int further) { return tile[place + further]; }

void store_tile(TilePlace place, vec4 ray_and_intensity) { tile[place] = ray_and_intensity; }
#endif

ivec3 in_texels(int view, ivec2 p) { return ivec3(p + TEXEL_APRON, layer_of_texels(view)); }

#define RayRow int

RayRow ray_row(int view, ivec2 p) { return in_maps(view, p); }

vec4 ray_in_row(RayRow row, int dx) { return LOAD_MAP(rays, row + dx); }

vec4 ray_at(int view, ivec2 p) { return ray_in_row(ray_row(view, p), 0); }

#ifdef TEXEL_LOADS

vec4 texel_taps(int view, ivec2 p) { return imageLoad(texels, in_texels(view, p)); }

#else

// Asked for once, not for each sample.
vec2 texel_size = 1.0f / vec2(textureSize(texel_texture, 0).xy);

vec4 texel_taps(int view, ivec2 p) {
  // The corner that the four texels share lies half a texel from any rounding trouble.
  vec2 corner = vec2(p + TEXEL_APRON + 1) * texel_size;
  vec4 taps = textureGather(texel_texture, vec3(corner, float(layer_of_texels(view))));
  return vec4(taps.w, taps.z, taps.x, taps.y);
}

vec2 filtered_texel_unit() { return texel_size; }

float filtered_texel(int view, vec2 texel) {
  return textureLod(texel_texture, vec3(texel, float(layer_of_texels(view))), 0.0f).x;
}

#endif

float intensity_at(int view, ivec2 p) { return intensity_in_row(intensity_row(view, p), 0); }

// Images of one number a texel take the first.
void store_texel(int view, ivec2 p, vec4 taps) {
#ifdef HALF_PRECISION
  taps = max(taps, vec4(LOWEST_HALF));
#endif
  imageStore(texels, in_texels(view, p), taps);
}

vec4 hypothesis_at(int view, ivec2 p) { return LOAD_MAP(hypotheses, in_maps(view, p)); }

void store_hypothesis(int view, ivec2 p, vec4 h) { STORE_MAP(hypotheses, in_maps(view, p), h); }

void store_intensity(int view, ivec2 p, float intensity) { STORE_INTENSITY(intensity_row(view, p), intensity); }

vec4 prior_at(int view, ivec2 p) { return LOAD_MAP(priors, in_maps(view, p)); }

void store_prior(int view, ivec2 p, vec4 m) { STORE_MAP(priors, in_maps(view, p), m); }

vec4 check_at(int view, ivec2 p) { return LOAD_MAP(checks, in_maps(view, p)); }

void store_check(int view, ivec2 p, vec4 c) { STORE_MAP(checks, in_maps(view, p), c); }

int transfer_index(ivec2 p) { return p.y * parameters.cameras[REFERENCE].size.x + p.x; }

void transfer_reset(ivec2 p) {
  transfer_nearest[transfer_index(p)] = 0u;
  transfer_winner[transfer_index(p)] = 0xffffffffu;
}

uint transfer_nearest_at(ivec2 p) { return transfer_nearest[transfer_index(p)]; }

void transfer_nearest_raise(ivec2 p, uint bits) {
  atomicMax(transfer_nearest[transfer_index(p)], bits);
}

uint transfer_winner_at(ivec2 p) { return transfer_winner[transfer_index(p)]; }

void transfer_winner_lower(ivec2 p, uint index) {
  atomicMin(transfer_winner[transfer_index(p)], index);
}

// This thread's pixel of `view`; false outside the dispatch. With a colour, half the columns are launched.
bool thread_pixel(int view, out ivec2 pixel) {
  pixel = ivec2(gl_GlobalInvocationID.xy);
  pixel.y += pass.first_row;
  if (pass.colour >= 0) pixel.x = 2 * pixel.x + ((pixel.y + pass.colour) & 1);
  ivec4 size = parameters.cameras[view].size;
  return pixel.x < size.x && pixel.y < min(pass.last_row, size.y);
}
