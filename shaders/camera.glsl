// SPDX-License-Identifier: MIT
// Projection of every camera model, with its exact domain. Compiled in single precision for the
// kernels and in double precision (real = double) for the host; formulas and domains are listed in
// docs/camera-models.md. Only projection is needed here: rays come from the ray image.

#define CAMERA_PINHOLE 0
#define CAMERA_PINHOLE_RADTAN 1
#define CAMERA_KANNALA_BRANDT 2
#define CAMERA_DOUBLE_SPHERE 3
#define CAMERA_UNIFIED 4
#define CAMERA_EXTENDED_UNIFIED 5
#define CAMERA_FIELD_OF_VIEW 6
#define CAMERA_MEI 7
#define CAMERA_EQUIRECTANGULAR 8

// std140: five 16-byte rows.
struct CameraParameters {
  real4 intrinsics;  // fx, fy, cx, cy in pixels
  // kannala_brandt: k1..k4; double_sphere: xi, alpha, w1; unified, mei: xi, min(xi, 1/xi);
  // extended_unified: alpha, beta, w; field_of_view: omega, 2 tan(omega / 2)
  real4 shape;
  real4 distortion;  // Brown-Conrady k1, k2, p1, p2
  // cosine of the field of view's half angle; the largest theta (kannala_brandt) or squared
  // undistorted radius (radtan) up to which the distortion increases; skew; Brown-Conrady k3
  real4 domain;
  ivec4 size;  // width, height, model, 0
};

// Brown-Conrady distortion of a point on the normalised plane.
FN real2 distort(CameraParameters camera, real x, real y, real q) {
  real radial = real(1) + q * (camera.distortion.x +
                               q * (camera.distortion.y + q * camera.domain.w));
  real p1 = camera.distortion.z;
  real p2 = camera.distortion.w;
  return real2(x * radial + real(2) * p1 * x * y + p2 * (q + real(2) * x * x),
               y * radial + p1 * (q + real(2) * y * y) + real(2) * p2 * x * y);
}

// Projects a direction of any positive length. `model` repeats camera.size.z so that a caller can pass a
// compile-time constant. Returns false outside the model's domain or the field of view.
FN bool project(CameraParameters camera, int model, real3 point, OUT(real2) pixel) {
  real rho2 = point.x * point.x + point.y * point.y;
  real d = sqrt(rho2 + point.z * point.z);
  bool inside = d > real(0) && point.z >= camera.domain.x * d;
  real x = real(0);
  real y = real(0);
  if (model == CAMERA_KANNALA_BRANDT) {
    real rho = sqrt(rho2);
    real theta = arc_tangent(rho, point.z);
    real t2 = theta * theta;
    real distorted =
        theta *
        (real(1) +
         t2 * (camera.shape.x +
               t2 * (camera.shape.y + t2 * (camera.shape.z + t2 * camera.shape.w))));
    inside = inside && theta < camera.domain.y;
    real scale = rho > real(0) ? distorted / rho : real(1) / point.z;
    x = point.x * scale;
    y = point.y * scale;
  } else if (model == CAMERA_FIELD_OF_VIEW) {
    real rho = sqrt(rho2);
    real distorted = arc_tangent(rho * camera.shape.y, point.z) / camera.shape.x;
    inside = inside && (rho > real(0) || point.z > real(0));
    real scale = rho > real(0) ? distorted / rho : camera.shape.y / (camera.shape.x * point.z);
    x = point.x * scale;
    y = point.y * scale;
  } else if (model == CAMERA_EQUIRECTANGULAR) {
    // The last meridian, on both edges of the image, and the poles have no pixel.
    inside = inside && (point.x * point.x > real(0) || point.z > real(0));
    x = arc_tangent(point.x, point.z);
    y = arc_tangent(point.y, sqrt(point.x * point.x + point.z * point.z));
  } else {
    real denominator = point.z;
    if (model == CAMERA_DOUBLE_SPHERE) {
      real k = camera.shape.x * d + point.z;
      real d2 = sqrt(rho2 + k * k);
      inside = inside && k > -camera.shape.z * d2;
      denominator = camera.shape.y * d2 + (real(1) - camera.shape.y) * k;
    } else if (model == CAMERA_UNIFIED || model == CAMERA_MEI) {
      inside = inside && point.z > -camera.shape.y * d;
      denominator = point.z + camera.shape.x * d;
    } else if (model == CAMERA_EXTENDED_UNIFIED) {
      real e = sqrt(camera.shape.y * rho2 + point.z * point.z);
      inside = inside && point.z > -camera.shape.z * e;
      denominator = camera.shape.x * e + (real(1) - camera.shape.x) * point.z;
    }
    inside = inside && denominator > real(0);
    x = point.x / denominator;
    y = point.y / denominator;
    if (model == CAMERA_PINHOLE_RADTAN || model == CAMERA_MEI) {
      real q = x * x + y * y;
      inside = inside && q < camera.domain.y;
      real2 distorted = distort(camera, x, y, q);
      x = distorted.x;
      y = distorted.y;
    }
  }
  pixel = real2(camera.intrinsics.x * x + camera.domain.z * y + camera.intrinsics.z,
                camera.intrinsics.y * y + camera.intrinsics.w);
  return inside;
}
