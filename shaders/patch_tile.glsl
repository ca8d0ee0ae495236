// SPDX-License-Identifier: MIT
// What patches of a group of threads have in common: rays and intensities of the reference around the group's pixels, in
// memory that a GPU's threads share. Pixels try several planes each, so the rays are first turned into the axes of the
// one source: a plane then moves them along the baseline alone. For kernels of one colour: groups cover twice their
// width.

// What intensities are relative to, so that samples need not be made relative to their patch's centre: rounding of the
// reference's own sums is much the same for all planes of a pixel.
#define TILE_GREY 0.5f

// Where the thread's group begins in the image.
FN ivec2 first_pixel_of_group(CONTEXT_ARGUMENT_ONLY) {
  ivec2 group = GROUP_OF_LAUNCH;
  return ivec2(2 * group.x * GROUP_WIDTH, group.y * GROUP_HEIGHT + PASS.first_row);
}

// Of each row the even columns come first, then the odd ones: what threads side by side read at once, as they have every
// other pixel, lies side by side.
FN TilePlace place_in_tile(CONTEXT_ARGUMENT ivec2 column_and_row) {
  int half_row = 2 * column_and_row.y + (column_and_row.x & 1);
  return tile_place(CONTEXT half_row * (GROUP_WIDTH + WINDOW_RADIUS) + column_and_row.x / 2);
}

FN TilePlace place_of_pixel(CONTEXT_ARGUMENT ivec2 pixel) {
  ivec2 first = first_pixel_of_group(CONTEXT_ONLY);
  return place_in_tile(CONTEXT ivec2(pixel.x - first.x + WINDOW_RADIUS, pixel.y - first.y + WINDOW_RADIUS));
}

// Stores this thread's share; all threads of the group must be there, and wait for each other afterwards.
FN void fill_tile(CONTEXT_ARGUMENT_ONLY) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source_at(CONTEXT 0));
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  ivec2 first = first_pixel_of_group(CONTEXT_ONLY);
  ivec2 thread = THREAD_OF_GROUP;
  int reach = PATCH_TILE_WIDTH(GROUP_WIDTH, WINDOW_RADIUS);
  int samples = PATCH_TILE_SAMPLES(GROUP_WIDTH, GROUP_HEIGHT, WINDOW_RADIUS);
  for (int i = thread.y * GROUP_WIDTH + thread.x; i < samples; i += GROUP_WIDTH * GROUP_HEIGHT) {
    ivec2 place = ivec2(i % reach, i / reach);  // column and row
    ivec2 pixel = ivec2(first.x + place.x - WINDOW_RADIUS, first.y + place.y - WINDOW_RADIUS);
    vec4 ray_and_intensity = vec4(0.0f, 0.0f, 0.0f, MASKED_INTENSITY);
    if (in_image(size, pixel)) {
      vec4 ray = ray_at(CONTEXT REFERENCE, pixel);
      ray_and_intensity =
          vec4(rotate(pair, vec3(ray.x, ray.y, ray.z)), intensity_at(CONTEXT REFERENCE, pixel) - TILE_GREY);
    }
    store_tile(CONTEXT place_in_tile(CONTEXT place), ray_and_intensity);
  }
}

// Where a patch lies in the tile: its first sample, and the next one of its row.
struct PatchInTile {
  TilePlace even;
  TilePlace odd;
};

FN PatchInTile patch_in_tile(CONTEXT_ARGUMENT ivec2 pixel) {
  ivec2 first = ivec2(pixel.x - WINDOW_RADIUS, pixel.y - WINDOW_RADIUS);
  PatchInTile in_tile;
  in_tile.even = place_of_pixel(CONTEXT first);
  in_tile.odd = place_of_pixel(CONTEXT ivec2(first.x + 1, first.y));
  return in_tile;
}

// The ray in the axes of the source and the intensity, relative to TILE_GREY, of a sample of the patch, counted from its
// first one.
FN vec4 ray_and_intensity_in_tile(CONTEXT_ARGUMENT PatchInTile in_tile, int column, int row) {
  int further = 2 * row * (GROUP_WIDTH + WINDOW_RADIUS) + column / 2;
  return (column & 1) == 0 ? tile_at(CONTEXT in_tile.even, further) : tile_at(CONTEXT in_tile.odd, further);
}
