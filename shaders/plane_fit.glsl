// SPDX-License-Identifier: MIT
// The plane of a neighbourhood: inverse distance is exactly linear in the ray, so that it is a linear least-squares
// problem, here a robust one, weighted by how precisely each pixel was measured.

// Squared scale of the robust weights, in variances of the neighbour and of the pixel itself; less of both from round to
// round, as planes become smooth. Its own counts little: on weak texture it would make the scale so wide that other
// surfaces count as the pixel's.
#define NEIGHBOUR_SHARE 4.5f
#define OWN_SHARE 0.3f
#define LARGEST_SQUARED_SCALE 0.72f  // px^2
// Inverse square of the displacement (px) from the pixel's plane at which a neighbour's own plane passes the pixel where
// it weighs a quarter.
#define PER_SQUARED_PASSING 16.0f
// Information of slopes, as a share of the offset's, that the guess counts for: it decides slopes that the neighbourhood
// leaves open.
#define GUESS_SHARE 1e-3f
// Of the product of both slopes' information, the least that their determinant must be.
#define LEAST_DETERMINANT 1e-9f
// First random slot; the search uses lower ones.
#define REGRESSION_SLOT 64
// Length of the tangent vectors, so that neighbouring rays have coordinates of order 1.
#define TANGENT_SCALE 128.0f

// A plane's vector m by components, along the pixel's ray and along east and south, which are TANGENT_SCALE long:
// inverse distance in any direction is offset z + slope_x x + slope_y y, with the direction's products with these.
struct LocalPlane {
  float offset;
  float slope_x;
  float slope_y;
};

struct PlaneFit {
  LocalPlane plane;
  float certainty;   // inverse variance of the offset, as if each pixel of the neighbourhood were measured by itself
  vec3 information;  // inverse covariance of the slopes (xx, xy, yy), of the grid's pixels alone
  float agreement;   // share of the neighbours' weights that robustness leaves: 1 where all lie on the guess
};

// Whether neighbours' planes, too, come from a regression of this level. What lies beyond a crease may be near the
// pixel's plane by itself, but its own plane passes the pixel far off.
FN bool planes_are_regressed(CONTEXT_ARGUMENT_ONLY) { return PASS.tolerance < 1.0f; }

// One round of robust weighted least squares over a sparse grid of the neighbourhood; false where it is
// degenerate.
FN bool fit_plane(CONTEXT_ARGUMENT ivec2 pixel, vec3 ray, vec3 east, vec3 south, vec4 own,
                  int round, int radius, LocalPlane guess, OUT(PlaneFit) fit) {
  fit.plane = guess;
  fit.certainty = 0.0f;
  fit.information = vec3(0.0f, 0.0f, 0.0f);
  fit.agreement = 1.0f;
  ivec4 size = PARAMETERS.cameras[REFERENCE].size;
  float inverse_scale = PARAMETERS.support.y;
  float of_own = OWN_SHARE * PASS.tolerance * own.x;
  float of_neighbour = NEIGHBOUR_SHARE * PASS.tolerance;
  radius = max(radius, SMALLEST_FIT_RADIUS);
  int step = max(radius / PASS.steps, 1);
  radius = min(radius, step * PASS.steps);
  float fall_off = 0.25f / float(radius * radius);  // of the eighth root of the Gaussian
  bool by_planes = planes_are_regressed(CONTEXT_ONLY);
  // Every tile's grids lie elsewhere: pixels a step apart would share theirs and none with those between.
  vec4 u = draw4_of_tile(CONTEXT pixel, REGRESSION_SLOT + round);
  int first_x = pixel.x + first_in_image(pixel.x, int(u.x * float(step)) - step / 2 - radius, step);
  int first_y = pixel.y + first_in_image(pixel.y, int(u.y * float(step)) - step / 2 - radius, step);
  int last_x = min(pixel.x + radius, size.x - 1);
  int last_y = min(pixel.y + radius, size.y - 1);
  float s = 0.0f;
  float undoubted = 0.0f;
  float sx = 0.0f;
  float sy = 0.0f;
  float sxx = 0.0f;
  float sxy = 0.0f;
  float syy = 0.0f;
  float sr = 0.0f;
  float sxr = 0.0f;
  float syr = 0.0f;
  for (int qy = first_y; qy <= last_y; qy += step) {
    float dy = float(qy - pixel.y);
    float squared_dy = dy * dy;
    float dx = float(first_x - pixel.x);
    for (int qx = first_x; qx <= last_x; qx += step) {
      ivec2 q = ivec2(qx, qy);
      vec4 measure = check_at(CONTEXT REFERENCE, q);
      vec4 r = ray_at(CONTEXT REFERENCE, q);
      vec3 direction = vec3(r.x, r.y, r.z);
      float x = dot(direction, east);
      float y = dot(direction, south);
      float z = dot(direction, ray);
      float residual = measure.z - guess.offset * z - guess.slope_x * x - guess.slope_y * y;
      float displacement = residual * measure.y;
      // Geman and McClure's weight: other surfaces, however precise, must not outvote the pixel's own. Everything that
      // weighs shares one division.
      float scale2 = min(of_neighbour * measure.x + of_own, LARGEST_SQUARED_SCALE);
      float doubt = scale2 + displacement * displacement;
      float strangeness = 1.0f;
      if (by_planes) {
        vec4 plane = hypothesis_at(CONTEXT REFERENCE, q);
        float passing = own.y * (dot(vec3(plane.x, plane.y, plane.z), ray) - guess.offset);
        strangeness += PER_SQUARED_PASSING * (passing * passing);
      }
      float remoteness = 1.0f + fall_off * (squared_dy + dx * dx);
      float unlikeness = root_of_unlikeness(measure.w - own.w, inverse_scale);
      float trust = measure.y * scale2;
      float most = measure.y * doubt;
      float divided = 1.0f / (measure.x * (doubt * doubt) * (strangeness * strangeness) *
                              eighth_power(remoteness * unlikeness));
      if (measure.x >= UNMEASURED_VARIANCE) divided = 0.0f;
      float weight = trust * trust * divided;
      undoubted += most * most * divided;
      float zw = weight * z;
      float xw = weight * x;
      float yw = weight * y;
      s += zw * z;
      sx += zw * x;
      sy += zw * y;
      sxx += xw * x;
      sxy += xw * y;
      syy += yw * y;
      sr += zw * residual;
      sxr += xw * residual;
      syr += yw * residual;
      dx += float(step);
    }
  }
  fit.certainty = s * float(step * step);
  if (!(s > 0.0f)) return false;
  fit.agreement = s / undoubted;
  float mx = sx / s;
  float my = sy / s;
  float pull = GUESS_SHARE * s;
  float cxx = sxx - sx * mx + pull;
  float cxy = sxy - sx * my;
  float cyy = syy - sy * my + pull;
  fit.information = vec3(cxx, cxy, cyy);
  // Weights grow with the square of the points' speed, in whatever unit distances are: products of the sums would
  // overflow. Powers of two lose no bits.
  float unit = inverse_power_of_two(s);
  cxx *= unit;
  cxy *= unit;
  cyy *= unit;
  float cxr = unit * (sxr - sr * mx);
  float cyr = unit * (syr - sr * my);
  float determinant = cxx * cyy - cxy * cxy;
  if (!(determinant > LEAST_DETERMINANT * cxx * cyy)) return false;
  float turn_x = (cyy * cxr - cxy * cyr) / determinant;
  float turn_y = (cxx * cyr - cxy * cxr) / determinant;
  fit.plane.slope_x = guess.slope_x + turn_x;
  fit.plane.slope_y = guess.slope_y + turn_y;
  fit.plane.offset = guess.offset + sr / s - turn_x * mx - turn_y * my;
  return true;
}
