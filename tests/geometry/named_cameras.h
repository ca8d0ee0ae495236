// SPDX-License-Identifier: MIT
// Cameras of every model.
#pragma once

#include <vector>

#include "widestereo/camera.h"

namespace widestereo::test {

struct NamedCamera {
  const char* name;
  Camera camera;
};

inline Camera make_camera(CameraModel model, int width, int height, double fx, double fy, double cx,
                          double cy) {
  Camera camera;
  camera.model = model;
  camera.width = width;
  camera.height = height;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  return camera;
}

/// Published calibrations of real lenses, and the corners of the parameter ranges.
inline std::vector<NamedCamera> cameras() {
  std::vector<NamedCamera> list;
  list.push_back({"pinhole", make_camera(CameraModel::pinhole, 640, 480, 400, 401, 320.5, 239)});

  Camera c = make_camera(CameraModel::pinhole_radtan, 752, 480, 458.654, 457.296, 367.215, 248.375);
  c.k1 = -0.28340811;
  c.k2 = 0.07395907;
  c.p1 = 0.00019359;
  c.p2 = 1.76187114e-05;
  list.push_back({"euroc_radtan", c});
  c.k3 = 0.01;
  c.k1 = 0.1;
  list.push_back({"barrel_radtan_k3", c});

  c = make_camera(CameraModel::kannala_brandt, 512, 512, 190.978, 190.973, 254.932, 256.897);
  c.k1 = 0.0034823894;
  c.k2 = 0.000715034845;
  c.k3 = -0.0020532361;
  c.k4 = 0.00020293673;
  list.push_back({"tumvi_kb4", c});
  c = make_camera(CameraModel::kannala_brandt, 848, 800, 285.722, 286.759, 420.135, 403.394);
  c.k1 = -0.00659769;
  c.k2 = 0.0473251;
  c.k3 = -0.0458264;
  c.k4 = 0.00897725;
  list.push_back({"t265_kb4", c});
  c.skew = 0.39;
  list.push_back({"t265_kb4_skew", c});

  c = make_camera(CameraModel::double_sphere, 512, 512, 158.286, 158.274, 254.961, 256.889);
  c.xi = -0.17213086;
  c.alpha = 0.59311776;
  list.push_back({"tumvi_ds", c});
  c = make_camera(CameraModel::double_sphere, 1216, 1216, 451, 451, 608, 607);
  c.xi = 0.46;
  c.alpha = 0.77;
  list.push_back({"sphere_stereo_ds", c});
  c.xi = 0.9;
  c.alpha = 0.6;
  list.push_back({"wide_ds", c});
  c.xi = 0.2;
  c.alpha = 0.4;
  list.push_back({"small_alpha_ds", c});

  c = make_camera(CameraModel::unified, 1024, 1024, 450, 449.6, 513.7, 509.2);
  c.xi = 0.9;
  list.push_back({"omni", c});
  c.xi = 2.2;
  c.fx = c.fy = 1336;
  list.push_back({"omni_xi_above_1", c});
  c.xi = 0;
  list.push_back({"omni_as_pinhole", c});

  c = make_camera(CameraModel::extended_unified, 512, 512, 190.9, 190.8, 254.9, 256.9);
  c.alpha = 0.6299;
  c.beta = 1.0420;
  list.push_back({"tumvi_eucm", c});
  c.alpha = 0.4;
  c.beta = 0.8;
  list.push_back({"small_alpha_eucm", c});

  c = make_camera(CameraModel::field_of_view, 640, 480, 250, 251, 319, 241);
  c.omega = 0.93;
  list.push_back({"fov", c});
  c.omega = 2.4;
  list.push_back({"wide_fov", c});

  c = make_camera(CameraModel::mei, 1280, 800, 895.548, 894.744, 649.624, 398.719);
  c.xi = 1.15844;
  c.k1 = -0.33084335;
  c.k2 = 0.08651983;
  c.p1 = -0.000676787;
  c.p2 = -3.6413e-05;
  list.push_back({"psl_mei", c});
  c = make_camera(CameraModel::mei, 1400, 1400, 1336.3, 1335.8, 716.94, 705.76);
  c.xi = 2.2134;
  c.k1 = 0.016798;
  c.k2 = 1.65475;
  c.p1 = 0.00042223;
  c.p2 = 0.00042462;
  list.push_back({"kitti360_mei", c});
  list.push_back({"panorama", whole_sphere(1024, 512)});
  list.push_back({"part_of_a_panorama",
                  make_camera(CameraModel::equirectangular, 600, 300, 210, 205, 250.5, 170)});

  c = make_camera(CameraModel::pinhole_rational, 640, 480, 380, 381, 322, 241);
  c.k1 = 0.51;
  c.k2 = -2.61;
  c.k3 = 1.52;
  c.k4 = 0.39;
  c.k5 = -2.43;
  c.k6 = 1.45;
  c.p1 = 0.0006;
  c.p2 = -0.0002;
  list.push_back({"rational", c});
  c.s1 = -0.0013;
  c.s2 = 0.0004;
  c.s3 = 0.0021;
  c.s4 = -0.0003;
  c.k1 = 0.4;
  c.k2 = c.k3 = c.k5 = c.k6 = 0;
  c.k4 = 0.9;
  list.push_back({"rational_with_prisms", c});

  // ETH3D's courtyard, at an eighth.
  c = make_camera(CameraModel::thin_prism_fisheye, 756, 504, 426.4275, 426.2525, 379.66, 251.26);
  c.k1 = 0.21047;
  c.k2 = 0.21102;
  c.k3 = -0.158023;
  c.k4 = 0.406856;
  c.p1 = -5.36231e-06;
  c.p2 = 0.00051541;
  c.s1 = -8.46499e-05;
  c.s3 = 0.000861313;
  list.push_back({"eth3d_thin_prism", c});

  // Of Aria Synthetic Environments, which has no prisms, and with some.
  c = make_camera(CameraModel::rad_tan_thin_prism_fisheye, 704, 704, 297.6375381, 297.6375381,
                  357.6599197, 349.1922497);
  c.k1 = 0.3650890375644368;
  c.k2 = -0.1738082418112771;
  c.k3 = -0.7534945484033189;
  c.k4 = 2.434788882752295;
  c.k5 = -2.57786220300886;
  c.k6 = 0.8788483538598834;
  c.p2 = 0.0008005198595407136;
  c.p1 = -0.000294237814554143;
  list.push_back({"aria_fisheye624", c});
  c.s1 = -0.0011;
  c.s2 = 0.0002;
  c.s3 = 0.0007;
  c.s4 = -0.0004;
  list.push_back({"aria_fisheye624_with_prisms", c});

  // WoodScape's front camera, and LaFiDa's right one, whose polynomial was fitted by hand.
  c = make_camera(CameraModel::polynomial_fisheye, 1280, 966, 339.749, 339.749, 643.442, 479.407);
  c.k1 = -31.988 / 339.749;
  c.k2 = 48.275 / 339.749;
  c.k3 = -7.201 / 339.749;
  list.push_back({"woodscape_polynomial", c});
  c = make_camera(CameraModel::polynomial_fisheye, 754, 480, 209.125720, 209.071570, 378.722262,
                  253.625158);
  c.k1 = -0.00728379311;
  c.k2 = -0.0184605947;
  c.k3 = -0.321880365;
  c.k4 = 1.35824889;
  c.k5 = -2.42353193;
  c.k6 = 2.31651294;
  c.k7 = -1.30901817;
  c.k8 = 0.449863157;
  c.k9 = -0.0911894685;
  c.k10 = 0.00972937035;
  c.k11 = -0.000390322931;
  c.skew = -2.581874;
  c.shear = 2.633094;
  list.push_back({"lafida_polynomial", c});
  return list;
}

}  // namespace widestereo::test
