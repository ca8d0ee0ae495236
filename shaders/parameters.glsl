// SPDX-License-Identifier: MIT
// What the host tells the kernels: one block for a match, one small block for a dispatch.

// Views at all levels of the image pyramid.
#define MAX_VIEWS 16

// Every image of intensities is surrounded by this many masked pixels, one more than the largest window's radius, so
// that patches need no checks of their own.
#define APRON 16
#define MASKED_INTENSITY -1e30f

// Of a pixel without a plane: the largest cost of all.
#define INVALID_COST 2.0f

// Sources are read from images of twice the size, which have a texel at every half pixel (interpolation.glsl).
#define HALF_PIXEL_APRON (2 * APRON)

// In a vote, the planes that compete with the pixel's own, and the radius of the part of the patch that compares them.
#define VOTE_RIVALS 2
#define VOTE_MIDDLE_RADIUS 1

// X_source ~ rotation . ray + translation . (m . ray); rows of [R | t].
struct ViewPair {
  vec4 row0;
  vec4 row1;
  vec4 row2;
};

// std140 uniform block.
struct MatchParameters {
  vec4 range;         // min and max distance (m), min and max inverse distance (1/m)
  vec4 patch_limits;  // texture: smallest variance; smallest visible share; cosine of the largest tilt; smallest
                      // support
  vec4 check_limits;  // consistency: relative, pixels; largest cost; smallest parallax (pixels)
  ivec4 search;       // distance sampling, refinements, best sources, number of views
  vec4 support;       // 1 / intensity scale of the patch's weights, of the regression's weights; margin of ambiguity;
                      // preference for far planes
  ivec4 frame;        // number of the frame since the last one that was started anew; unused
  CameraParameters cameras[MAX_VIEWS];
  // [reference * MAX_VIEWS + source]: source from reference; of a view with itself: now from the previous frame
  ViewPair pairs[MAX_VIEWS * MAX_VIEWS];
};

// Push constants.
struct PassParameters {
  int reference;   // view whose pixels are updated
  int first_view;  // of the level: its views follow each other; all but the reference are sources
  int other;       // the one view that a transfer or a change of level reads from
  int iteration;   // counts over the whole schedule of this view
  int colour;      // 0, 1: checkerboard; -1: all pixels
  int neighbours;  // bits: left, right, up, down
  uint seed;
  int first_row;   // rows of this dispatch: the back end may split a dispatch into bands
  int last_row;    // one past the last
  uint candidates;  // adaptive search: bit k: candidate kind k is tried; interpolating: INTERPOLATE_CUBIC;
                    // measuring: SUBPIXEL_MATCH; regression: REGRESS_NORMALS; adopting: ADOPT_UNSEEN; filling: reasons not to fill
  float step_pixels;  // adaptive search: largest displacement of a perturbation in the source
  float step_normal;  // adaptive search: largest change of a unit normal's coordinates
  int radius;         // regression, vote, filling: pixels
  int steps;          // sweep: inverse distances; regression: of its grid of neighbours, in the radius
  float deviation;    // regression: standard deviation (source pixels) that is enough; 0: normals only
  int places;         // check: other places tried for a better match
};

// Push constants after those, where an application's buffer is read or written (Vulkan).
struct BufferRows {
  uint first;  // of row 0: bytes of an image, words of 4 bytes of a map
  uint pitch;  // from row to row, likewise
  int kind;    // PIXEL_GREY8 and the like, or MAP_DISTANCE and the like
};
