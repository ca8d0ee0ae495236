// SPDX-License-Identifier: MIT
// Whether the source's own planes agree with a pixel's.

// Stands for "not measurable" in maps that a person may read.
#define UNKNOWN_DIFFERENCE 1000.0f
// The largest one that is measured: however much planes contradict each other, that is known.
#define LARGEST_KNOWN_DIFFERENCE 999.0f
// The displacement (px) that a pixel counts as where it cannot be measured.
#define UNCHECKED_DISPLACEMENT 1.0f

// Relative difference of distance (x) and displacement in reference pixels (y) between the pixel's point and
// where the source's own plane puts it; UNKNOWN_DIFFERENCE where the source has no plane there.
FN vec2 difference_from_source(CONTEXT_ARGUMENT int source, ivec2 pixel, vec3 ray, vec3 m) {
  vec2 unknown = vec2(UNKNOWN_DIFFERENCE, UNKNOWN_DIFFERENCE);
  ViewPair pair = pair_between(CONTEXT REFERENCE, source);
  vec4 other = hypothesis_in_source(CONTEXT source, ray, m);
  if (other.w >= INVALID_COST) return unknown;

  float w = dot(m, ray);
  vec3 direction = direction_in_source(pair, ray, w);
  // The source's inverse distance along this direction, in units of 1 / |direction|.
  float w_source = dot(vec3(other.x, other.y, other.z), direction);
  if (w_source <= 0.0f) return unknown;
  float relative = abs(w / w_source - 1.0f);
  vec3 back = rotate_back(pair, direction - w_source * translation(pair));
  vec2 reprojected;
  CameraParameters reference_camera = PARAMETERS.cameras[REFERENCE];
  if (!project(reference_camera, model_of(CONTEXT reference_camera), back, reprojected)) return unknown;
  return vec2(min(relative, LARGEST_KNOWN_DIFFERENCE),
              min(length(reprojected - vec2(float(pixel.x), float(pixel.y))), LARGEST_KNOWN_DIFFERENCE));
}
