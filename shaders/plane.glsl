// SPDX-License-Identifier: MIT
// Plane hypotheses: m = n / (n . X) in the camera frame, so that the plane is {X : m . X = 1} and the
// inverse distance along a unit ray is w = m . ray.

// The sources of the reference, i below SOURCE_COUNT. A loop over all views would cost as many patches on devices
// that mask lanes instead of branching.
FN int source_at(CONTEXT_ARGUMENT int i) {
  int view = PASS.first_view + i;
  return view < REFERENCE ? view : view + 1;
}

// Of two views of the level.
FN ViewPair pair_between(CONTEXT_ARGUMENT int reference, int source) {
  return PARAMETERS.pairs[(reference - PASS.first_view) * MAX_IMAGES + source - PASS.first_view];
}

// A constant where all views agree: devices that mask lanes would compute every model.
FN int model_of(CONTEXT_ARGUMENT CameraParameters camera) {
  return CAMERA_MODEL >= 0 ? CAMERA_MODEL : camera.size.z;
}

FN vec3 plane_through(vec3 ray, float distance, vec3 normal) {
  return (1.0f / (distance * dot(normal, ray))) * normal;
}

// Inverse distance along a ray of the plane (m, cost).
FN float inverse_distance_of(vec4 hypothesis, vec3 ray) {
  return hypothesis.x * ray.x + hypothesis.y * ray.y + hypothesis.z * ray.z;
}

FN vec3 rotate(ViewPair pair, vec3 v) {
  return vec3(pair.row0.x * v.x + pair.row0.y * v.y + pair.row0.z * v.z,
              pair.row1.x * v.x + pair.row1.y * v.y + pair.row1.z * v.z,
              pair.row2.x * v.x + pair.row2.y * v.y + pair.row2.z * v.z);
}

FN vec3 rotate_back(ViewPair pair, vec3 v) {
  return vec3(pair.row0.x * v.x + pair.row1.x * v.y + pair.row2.x * v.z,
              pair.row0.y * v.x + pair.row1.y * v.y + pair.row2.y * v.z,
              pair.row0.z * v.x + pair.row1.z * v.y + pair.row2.z * v.z);
}

FN vec3 translation(ViewPair pair) { return vec3(pair.row0.w, pair.row1.w, pair.row2.w); }

// Direction, in the source frame, of the point at inverse distance w along a ray: R ray + t w. Divided by
// w it is the point itself in metres; all cameras are homogeneous, so projection needs no division.
FN vec3 direction_in_source(ViewPair pair, vec3 ray, float w) {
  return rotate(pair, ray) + w * translation(pair);
}

// Square of the share of the longest baseline across a ray below which a source tells next to nothing of distances there:
// all of them match, so that its cost would be the best.
#define LEAST_SQUARED_SHARE_OF_BASELINE 0.0025f

// Square of the part of a source's baseline that is across the ray, by which its points move as their distance changes.
FN float squared_baseline_across(CONTEXT_ARGUMENT int source, vec3 ray) {
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
  vec3 across = cross(translation(pair), rotate(pair, ray));
  return dot(across, across);
}

// The longest of all sources.
FN float longest_squared_baseline_across(CONTEXT_ARGUMENT vec3 ray) {
  float longest = 0.0f;
  for (int i = 0; i < SOURCE_COUNT; ++i) {
    longest = max(longest, squared_baseline_across(CONTEXT source_at(CONTEXT i), ray));
  }
  return longest;
}

// Whether the source tells enough of the ray's distance, `longest` being that of all sources.
FN bool tells_distance(CONTEXT_ARGUMENT int source, vec3 ray, float longest) {
  if (SOURCE_COUNT == 1) return true;
  return squared_baseline_across(CONTEXT source, ray) >= LEAST_SQUARED_SHARE_OF_BASELINE * longest;
}

// Maps reference rays into a source through one plane: rows of the plane's homography R + t m^T, which takes fewer
// operations a ray than direction_in_source().
struct PlaneWarp {
  vec3 m;
  vec3 row0;
  vec3 row1;
  vec3 row2;
};

FN PlaneWarp warp_through(ViewPair pair, vec3 m) {
  PlaneWarp warp;
  warp.m = m;
  warp.row0 = vec3(pair.row0.x, pair.row0.y, pair.row0.z) + pair.row0.w * m;
  warp.row1 = vec3(pair.row1.x, pair.row1.y, pair.row1.z) + pair.row1.w * m;
  warp.row2 = vec3(pair.row2.x, pair.row2.y, pair.row2.z) + pair.row2.w * m;
  return warp;
}

// 1 - m . C with C the source's centre in the reference frame: positive while the source is on the
// viewer's side of the plane.
FN float side_of_source(ViewPair pair, vec3 m) {
  return 1.0f + dot(rotate(pair, m), translation(pair));
}

// The same plane in the source frame; side_of_source() must be positive.
FN vec3 plane_in_source(ViewPair pair, vec3 m) {
  return (1.0f / side_of_source(pair, m)) * rotate(pair, m);
}
