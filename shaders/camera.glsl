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
#define CAMERA_PINHOLE_RATIONAL 9
#define CAMERA_THIN_PRISM_FISHEYE 10
#define CAMERA_RAD_TAN_THIN_PRISM_FISHEYE 11
#define CAMERA_POLYNOMIAL_FISHEYE 12

// Angle about which polynomial_fisheye is expanded: powers of the angle itself cancel out, beyond single precision.
#define POLYNOMIAL_CENTRE 1.25f

// std140: six 16-byte rows.
struct CameraParameters {
  real4 intrinsics;  // fx, fy, cx, cy in pixels
  // fisheyes, pinhole_rational: k1..k4; double_sphere: xi, alpha, w1; unified, mei: xi, min(xi, 1/xi);
  // extended_unified: alpha, beta, w; field_of_view: omega, 2 tan(omega / 2);
  // polynomial_fisheye: coefficients of theta - POLYNOMIAL_CENTRE, lowest power first, up to prism
  real4 shape;
  // radtan: k1, k2, p1, p2; where k1 and k2 are in shape: k5, k6, p1, p2
  real4 distortion;
  real4 prism;  // s1..s4
  // cosine of the field of view's half angle, -2 where nothing limits it; the largest theta (fisheyes) or squared
  // undistorted radius (others) up to which the distortion increases; skew; radtan: k3; polynomial_fisheye: shear
  real4 domain;
  ivec4 size;  // width, height, model, 0
};

FN bool is_fisheye(int model) {
  return model == CAMERA_KANNALA_BRANDT || model == CAMERA_THIN_PRISM_FISHEYE ||
         model == CAMERA_RAD_TAN_THIN_PRISM_FISHEYE || model == CAMERA_POLYNOMIAL_FISHEYE;
}

// Those with k1 to k6 and thin prisms.
FN bool has_prisms(int model) {
  return model == CAMERA_PINHOLE_RATIONAL || model == CAMERA_THIN_PRISM_FISHEYE ||
         model == CAMERA_RAD_TAN_THIN_PRISM_FISHEYE;
}

FN bool is_distorted(int model) {
  return model == CAMERA_PINHOLE_RADTAN || model == CAMERA_MEI || has_prisms(model);
}

// Factor of a radius whose square is q: an angle for fisheyes, a length on the normalised plane for others.
FN real radial_distortion(CameraParameters camera, int model, real q) {
  if (model == CAMERA_PINHOLE_RADTAN || model == CAMERA_MEI) {
    return real(1) + q * (camera.distortion.x +
                          q * (camera.distortion.y + q * camera.domain.w));
  }
  if (model == CAMERA_PINHOLE_RATIONAL) {
    return (real(1) + q * (camera.shape.x + q * (camera.shape.y + q * camera.shape.z))) /
           (real(1) + q * (camera.shape.w + q * (camera.distortion.x + q * camera.distortion.y)));
  }
  real last = camera.shape.w;
  if (model == CAMERA_RAD_TAN_THIN_PRISM_FISHEYE) {
    last = last + q * (camera.distortion.x + q * camera.distortion.y);
  }
  return real(1) +
         q * (camera.shape.x + q * (camera.shape.y + q * (camera.shape.z + q * last)));
}

// Radius on a fisheye's normalised plane at an angle; thin_prism_fisheye distorts the angle later.
FN real fisheye_radius(CameraParameters camera, int model, real theta) {
  if (model == CAMERA_THIN_PRISM_FISHEYE) return theta;
  if (model == CAMERA_POLYNOMIAL_FISHEYE) {
    real4 a = camera.shape;
    real4 b = camera.distortion;
    real4 c = camera.prism;
    real t = theta - real(POLYNOMIAL_CENTRE);
    real high = c.x + t * (c.y + t * (c.z + t * c.w));
    real middle = b.x + t * (b.y + t * (b.z + t * (b.w + t * high)));
    return theta * (a.x + t * (a.y + t * (a.z + t * (a.w + t * middle))));
  }
  return theta * radial_distortion(camera, model, theta * theta);
}

// Brown-Conrady distortion, with thin prisms where the model has them, of a point on the normalised plane (of a
// fisheye: in angles; of rad_tan_thin_prism_fisheye after radial distortion).
FN real2 distort(CameraParameters camera, int model, real x, real y, real q) {
  real radial = real(1);
  if (model != CAMERA_RAD_TAN_THIN_PRISM_FISHEYE) radial = radial_distortion(camera, model, q);
  real p1 = camera.distortion.z;
  real p2 = camera.distortion.w;
  // A product of its own: of two sums' terms with the factor y Mesa would make one, with other bits.
  real xy = x * y;
  real2 distorted = real2(x * radial + real(2) * p1 * xy + p2 * (q + real(2) * x * x),
                          y * radial + p1 * (q + real(2) * y * y) + real(2) * p2 * xy);
  if (!has_prisms(model)) return distorted;
  return real2(distorted.x + q * (camera.prism.x + q * camera.prism.y),
               distorted.y + q * (camera.prism.z + q * camera.prism.w));
}

// Projects a direction, d its length. `model` repeats camera.size.z so that a caller can pass a compile-time constant.
// Returns false outside the model's domain, wherever the field of view ends.
FN bool project_in_domain(CameraParameters camera, int model, real3 point, OUT(real) d, OUT(real2) pixel) {
  real rho2 = point.x * point.x + point.y * point.y;
  d = sqrt(rho2 + point.z * point.z);
  bool inside = true;
  real x = real(0);
  real y = real(0);
  if (is_fisheye(model)) {
    real rho = sqrt(rho2);
    real theta = polar_angle(rho, point.z);
    real distorted = fisheye_radius(camera, model, theta);
    inside = theta < camera.domain.y;
    bool off_axis = rho > real(0);
    real scale = (off_axis ? distorted : real(1)) * (real(1) / (off_axis ? rho : point.z));
    x = point.x * scale;
    y = point.y * scale;
  } else if (model == CAMERA_FIELD_OF_VIEW) {
    real rho = sqrt(rho2);
    real distorted = polar_angle(rho * camera.shape.y, point.z) / camera.shape.x;
    inside = rho > real(0) || point.z > real(0);
    real scale = rho > real(0) ? distorted / rho : camera.shape.y / (camera.shape.x * point.z);
    x = point.x * scale;
    y = point.y * scale;
  } else if (model == CAMERA_EQUIRECTANGULAR) {
    // The last meridian, on both edges of the image, and the poles have no pixel.
    inside = point.x * point.x > real(0) || point.z > real(0);
    x = arc_tangent(point.x, point.z);
    y = arc_tangent(point.y, sqrt(point.x * point.x + point.z * point.z));
  } else {
    // Positive wherever a spherical model's point is inside.
    real denominator = point.z;
    if (model == CAMERA_DOUBLE_SPHERE) {
      real k = camera.shape.x * d + point.z;
      real d2 = sqrt(rho2 + k * k);
      inside = k > -camera.shape.z * d2;
      denominator = camera.shape.y * d2 + (real(1) - camera.shape.y) * k;
    } else if (model == CAMERA_UNIFIED || model == CAMERA_MEI) {
      inside = point.z > -camera.shape.y * d;
      denominator = point.z + camera.shape.x * d;
    } else if (model == CAMERA_EXTENDED_UNIFIED) {
      real e = sqrt(camera.shape.y * rho2 + point.z * point.z);
      inside = point.z > -camera.shape.z * e;
      denominator = camera.shape.x * e + (real(1) - camera.shape.x) * point.z;
    } else {
      inside = denominator > real(0);
    }
    real scale = real(1) / denominator;
    x = point.x * scale;
    y = point.y * scale;
  }
  if (is_distorted(model)) {
    real q = x * x + y * y;
    if (!is_fisheye(model)) inside = inside && q < camera.domain.y;
    real2 distorted = distort(camera, model, x, y, q);
    x = distorted.x;
    y = distorted.y;
  }
  // Skew and shear last: of two products and a term Mesa adds the second product last, however it is written.
  pixel = real2((camera.intrinsics.x * x + camera.intrinsics.z) + camera.domain.z * y,
                camera.intrinsics.y * y + camera.intrinsics.w);
  if (model == CAMERA_POLYNOMIAL_FISHEYE) pixel.y = pixel.y + camera.domain.w * x;
  return inside;
}

// Projects a direction of any positive length. Returns false outside the model's domain or the field of view.
FN bool project(CameraParameters camera, int model, real3 point, OUT(real2) pixel) {
  real d;
  bool inside = project_in_domain(camera, model, point, d, pixel);
  return inside && point.z > camera.domain.x * d;  // false of the zero vector
}
