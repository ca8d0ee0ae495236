// SPDX-License-Identifier: MIT
// What the host tells the kernels: one block for a match, one small block for a dispatch.

// Images that are matched with each other, and views: those at all levels of their pyramids.
#define MAX_IMAGES 15
#define MAX_VIEWS 48

// Every image of intensities is surrounded by this many masked pixels, one more than the largest window's radius, so
// that patches need no checks of their own.
#define APRON 16
#define MASKED_INTENSITY -1e30f
// Stands for it in half precision, of which it is the lowest number.
#define LOWEST_HALF -65504.0f

// Of a pixel without a plane: the largest cost of all.
#define INVALID_COST 2.0f

// Sources are sampled from images of texels: one at every pixel or, for cubic interpolation, at every half pixel, too
// (interpolation.glsl).
#define TEXEL_APRON (TEXELS_PER_PIXEL * APRON)

// In a vote, the planes that stand for election besides the pixel's own (of pixels in eight directions, at half the
// radius and at it), the steps between the pixels that vote in a row and between their rows, the planes that then compete
// with the pixel's own, all that are compared (its own, these and the one it held before its regression), and the radius of
// the part of the patch that compares them.
#define VOTE_CANDIDATES 16
#define VOTE_STEP 4
#define VOTE_ROW_STEP 3
#define VOTE_RIVALS 2
#define VOTE_COMPARED (2 + VOTE_RIVALS)
#define VOTE_MIDDLE_RADIUS 1

// The grid of the pixels that vote on a normal.
#define NORMAL_VOTE_RADIUS 6
#define NORMAL_VOTE_STEP 2

// What options and results are as numbers (include/widestereo/options.h, matcher.h).
#define WARP_EXACT 0
#define WARP_AFFINE 1
#define WARP_QUADRATIC 2

#define PATTERN_DENSE 0
#define PATTERN_CHECKERBOARD 1

// Of the full window.
FN int samples_of_patch(int radius, int pattern) {
  int side = 2 * radius + 1;
  return pattern == PATTERN_CHECKERBOARD ? (side * side + 1) / 2 : side * side;
}

#define FILTER_EXACT 0
#define FILTER_DEVICE 1

#define SAMPLING_UNIFORM 0
#define SAMPLING_INVERSE 1

#define REASON_NO_RAY 1
#define REASON_NO_OVERLAP 2
#define REASON_NO_TEXTURE 4
#define REASON_HIGH_COST 8
#define REASON_INCONSISTENT 16
#define REASON_UNCHECKED 32
#define REASON_LOW_PARALLAX 64
#define REASON_TILT 128
#define REASON_AMBIGUOUS 256
#define REASON_SPECKLE 512
#define REASON_FILLED 1024
#define REASON_LOW_CONFIDENCE 2048  // the last: FILL_WITH_MATCHES is the next bit

// Bits of PassParameters.neighbours.
#define NEIGHBOUR_LEFT 1
#define NEIGHBOUR_RIGHT 2
#define NEIGHBOUR_UP 4
#define NEIGHBOUR_DOWN 8

// Kinds of candidates of the adaptive search, numbers of bits of PassParameters.candidates: first the near strips to
// these sides, then the far ones to the same.
#define STRIP_UP 0
#define STRIP_DOWN 1
#define STRIP_LEFT 2
#define STRIP_RIGHT 3
#define NEAR_STRIPS 4
#define STRIPS 8
#define CANDIDATE_INVERSE_DISTANCE 8
#define CANDIDATE_NORMAL 9
#define CANDIDATE_BOTH 10
#define CANDIDATE_RANDOM_DISTANCE 11
#define CANDIDATE_SURROUNDINGS 12
#define CANDIDATE_SOURCE_PLANE 13
#define CANDIDATE_OTHER_SURFACE 14

// Bits of PassParameters.candidates of other kernels: see regress_plane(), adopt_pixel(), filtered_plane(),
// subpixel_pixel(), and adopt_fill_pixel(), where it stands beside the reasons.
#define REGRESS_NORMALS 1u
#define HELD_UNSEEN 2u
#define FILTER_MOVED 4u
#define WHOLE_SHIFT 8u
#define FILL_WITH_MATCHES (2u * REASON_LOW_CONFIDENCE)

// Of the plane regression: the rounds for distances, of which one, from 0 on, first asks a whole neighbourhood, each
// before it half the next one; those for normals alone, over an eighth, a half and the whole radius; the smallest
// radius (pixels) that a plane is fitted to; the variance (px^2) of what was not measured.
#define REGRESSION_ROUNDS 5
#define WHOLE_RADIUS_ROUND 3
#define NORMAL_ROUNDS 3
#define SMALLEST_FIT_RADIUS 2
#define UNMEASURED_VARIANCE 1e4f

// X_source ~ rotation . ray + translation . (m . ray); rows of [R | t].
struct ViewPair {
  vec4 row0;
  vec4 row1;
  vec4 row2;
};

// std140 uniform block.
struct MatchParameters {
  vec4 range;         // min and max distance (m), min and max inverse distance (1/m)
  vec4 patch_limits;  // texture: smallest variance; smallest visible share; cosine of the largest tilt; unused
  vec4 check_limits;  // consistency: relative, pixels; smallest parallax (pixels); smallest support
  vec4 acceptance;    // smallest confidence; largest cost; unused
  vec4 repair_limits;  // as check_limits, of what is repaired and what counts as consistent until the last check
  ivec4 search;       // distance sampling, refinements, best sources; unused
  vec4 support;       // 1 / intensity scale of the patch's weights, of the regression's weights; margin of ambiguity;
                      // preference for far planes
  ivec4 frame;        // number of the frame in its sequence, for other random draws; unused
  CameraParameters cameras[MAX_VIEWS];
  // Of images, at all levels alike; [reference * MAX_IMAGES + source]: source from reference; of an image with itself:
  // now from the previous frame
  ViewPair pairs[MAX_IMAGES * MAX_IMAGES];
};

// Push constants.
struct PassParameters {
  int reference;   // view whose pixels are updated; of a launch over several views the first, others follow
  int first_view;  // of the level: its views follow each other; all but the reference are sources
  int other;       // the one view that a transfer or a change of level reads from, likewise
  int iteration;   // tells random draws apart; of regressions and their votes it counts over the whole schedule
  int colour;      // 0, 1: checkerboard; -1: all pixels
  int neighbours;  // bits: left, right, up, down
  uint seed;
  int first_row;   // rows of this dispatch: the back end may split a dispatch into bands
  int last_row;    // one past the last, which a view that is lower than others does not reach
  uint candidates;  // adaptive search: bit k: candidate kind k is tried; regression: REGRESS_NORMALS,
                    // FILTER_MOVED; adopting: HELD_UNSEEN; sub-pixel match: WHOLE_SHIFT; filling: reasons not to
                    // fill, FILL_WITH_MATCHES
  float step_pixels;  // adaptive search: largest displacement of a perturbation in the source
  float step_normal;  // adaptive search: largest change of a unit normal's coordinates
  int radius;         // regression, vote, filling: pixels
  int steps;          // sweep: inverse distances; regression: of its grid of neighbours, in the radius
  float deviation;    // regression: standard deviation (source pixels) that is enough; 0: normals only
  int places;         // ambiguity: other places tried for a better match; upsample: coarser pixels whose planes are tried
  float tolerance;    // regression: squared scale of its robust weights, as a share of the first round's; adaptive
                      // search: the most that a better plane may cost, as a share of the held one's cost
};

// Push constants after those, where an application's image is read or map is written (Vulkan).
struct ConversionParameters {
  uint first;  // of row 0 in a buffer: bytes of an image, words of 4 bytes of a map
  uint pitch;  // from row to row, likewise
  int kind;    // PIXEL_GREY8 and the like, TEXELS_GREY or TEXELS_COLOUR, or MAP_DISTANCE and the like
};
