// SPDX-License-Identifier: MIT
#include "calibration/ocam.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "calibration/yaml_camera.h"
#include "geometry/angle.h"
#include "text/number.h"

namespace widestereo::calibration {
namespace {

double value_of(const std::vector<double>& polynomial, double r) {
  double value = 0;
  for (auto k = polynomial.rbegin(); k != polynomial.rend(); ++k) value = value * r + *k;
  return value;
}

double angle_of(const OCamLens& lens, double r) {
  const double sign = lens.polynomial.front() < 0 ? -1 : 1;
  return std::atan2(r, sign * value_of(lens.polynomial, r));
}

/// Radius of the image's farthest corner, before the affine matrix.
double corner_radius(const OCamLens& lens, int width, int height) {
  const Eigen::Matrix2d inverse = lens.matrix.inverse();
  double farthest = 0;
  for (const double u : {-0.5, width - 0.5}) {
    for (const double v : {-0.5, height - 0.5}) {
      farthest = std::max(farthest, (inverse * (Eigen::Vector2d(u, v) - lens.centre)).norm());
    }
  }
  return farthest;
}

/// Up to where the angle grows with the radius, or leaves the field of view, at most `end`.
double usable_radius(const OCamLens& lens, double end) {
  constexpr int steps = 4096;
  double last = 0;
  for (int i = 1; i <= steps; ++i) {
    const double angle = angle_of(lens, end * i / steps);
    if (!(angle > last)) return end * (i - 1) / steps;
    if (angle >= lens.max_theta) return end * i / steps;
    last = angle;
  }
  return end;
}

/// Coefficients of theta, theta^2, ..., theta^12 for the radius.
using Fit = Eigen::Vector<double, 12>;

/// Least squares at Chebyshev's nodes in [0, end], which keep the largest error small.
Fit fitted(const OCamLens& lens, double end) {
  constexpr int nodes = 200;
  const double largest = angle_of(lens, end);
  Eigen::Matrix<double, nodes, 12> powers;
  Eigen::Vector<double, nodes> radii;
  for (int i = 0; i < nodes; ++i) {
    radii[i] = 0.5 * end * (1 - std::cos(std::numbers::pi * (i + 0.5) / nodes));
    const double part = angle_of(lens, radii[i]) / largest;
    for (int j = 0; j < 12; ++j) powers(i, j) = std::pow(part, j + 1);
  }
  Fit fit = powers.colPivHouseholderQr().solve(radii);
  for (int j = 0; j < 12; ++j) fit[j] /= std::pow(largest, j + 1);
  return fit;
}

double largest_error(const OCamLens& lens, const Fit& fit, double end) {
  constexpr int samples = 1000;
  double largest = 0;
  for (int i = 1; i <= samples; ++i) {
    const double r = end * i / samples;
    const double theta = angle_of(lens, r);
    double radius = 0;
    for (int j = 11; j >= 0; --j) radius = (radius + fit[j]) * theta;
    largest = std::max(largest, std::abs(radius - r));
  }
  return largest;
}

void set_polynomial(Camera& camera, const Fit& fit, const Eigen::Matrix2d& matrix) {
  using C = Camera;
  constexpr double C::*members[] = {&C::k1, &C::k2, &C::k3, &C::k4,  &C::k5, &C::k6,
                                    &C::k7, &C::k8, &C::k9, &C::k10, &C::k11};
  camera.model = CameraModel::polynomial_fisheye;
  camera.fx = fit[0] * matrix(0, 0);
  camera.skew = fit[0] * matrix(0, 1);
  camera.shear = fit[0] * matrix(1, 0);
  camera.fy = fit[0] * matrix(1, 1);
  for (int i = 0; i < 11; ++i) camera.*members[i] = fit[i + 1] / fit[0];
}

/// As the toolbox states a lens: the row comes before the column.
OCamLens lens_of(std::vector<double> polynomial, const std::vector<double>& centre,
                 const std::vector<double>& affine) {
  OCamLens lens;
  lens.polynomial = std::move(polynomial);
  lens.centre = {centre[1], centre[0]};
  lens.set_rows_first(affine[0], affine[1], affine[2]);
  return lens;
}

/// What follows the number of coefficients in a list; none where there are not as many.
std::optional<std::vector<double>> after_count(const std::vector<double>& numbers) {
  if (numbers.empty() || numbers[0] != static_cast<double>(numbers.size() - 1)) return std::nullopt;
  return std::vector<double>(numbers.begin() + 1, numbers.end());
}

/// The lines that are no comments, as numbers.
std::vector<std::vector<double>> lines_of_numbers(const Document& document) {
  std::vector<std::vector<double>> lines;
  std::istringstream stream(document.text);
  for (std::string line; std::getline(stream, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    std::vector<double> numbers;
    for (std::string word; words >> word;) {
      const std::optional<double> number = number_of(word);
      if (!number) document.fail("\"" + word + "\" is not a finite number", "correct it");
      numbers.push_back(*number);
    }
    if (!numbers.empty()) lines.push_back(std::move(numbers));
  }
  return lines;
}

}  // namespace

Camera camera_of(const OCamLens& lens, int width, int height, const Document& document,
                 const std::string& what) {
  const auto fail = [&](const std::string& reason) {
    document.fail(what + ": " + reason, "calibrate the lens again");
  };
  if (!(lens.matrix.determinant() > 0.1)) {
    fail("The affine parameters c, d and e do not turn an image into one");
  }
  if (lens.polynomial.empty() || lens.polynomial.front() == 0) {
    fail("The polynomial does not begin with a number other than 0");
  }
  Camera camera;
  camera.width = width;
  camera.height = height;
  camera.cx = lens.centre.x();
  camera.cy = lens.centre.y();
  constexpr double narrowest = 20 * radians_per_degree;
  const double corner = corner_radius(lens, width, height);
  double end = usable_radius(lens, corner);
  while (angle_of(lens, end) > narrowest) {
    const Fit fit = fitted(lens, end);
    if (largest_error(lens, fit, end) <= 1e-4 * corner) {
      set_polynomial(camera, fit, lens.matrix);
      if (end < corner) camera.max_theta = std::min(lens.max_theta, angle_of(lens, end));
      return camera;
    }
    end *= 0.97;
  }
  fail("The polynomial is that of no lens");
  return camera;
}

/// It is named in comments; all else is numbers.
bool is_ocam(const Document& document) {
  return document.text.find("ocam_model") != std::string::npos && !document.contains(":");
}

Rig read_ocam(const Document& document) {
  const std::vector<std::vector<double>> lines = lines_of_numbers(document);
  constexpr std::size_t polynomial = 0, centre = 2, affine = 3, size = 4, all = 5;
  if (lines.size() < all || lines[centre].size() != 2 || lines[affine].size() != 3 ||
      lines[size].size() != 2) {
    document.fail(
        "It must have five lines of numbers: two polynomials, the centre (row, column), the affine "
        "parameters (c, d, e) and the image size (height, width)",
        "it may be truncated: copy it again");
  }
  const std::optional<std::vector<double>> coefficients = after_count(lines[polynomial]);
  if (!coefficients) {
    document.fail("The first polynomial does not have as many coefficients as it says",
                  "correct one or the other");
  }
  const auto side = [&](double value) {
    const std::optional<int> pixels = whole_number(value);
    if (!pixels) {
      document.fail("The image size is not a pair of whole numbers of pixels", "correct it");
    }
    return *pixels;
  };
  Rig rig;
  View& view = rig.views.emplace_back();
  view.name = "cam0";
  view.camera = camera_of(lens_of(*coefficients, lines[centre], lines[affine]),
                          side(lines[size][1]), side(lines[size][0]), document, view.name);
  return rig;
}

bool is_omnimvs(const Document& document) {
  return document.contains("inv_poly:") ||
         (document.contains("cameras:") && document.contains("poly:"));
}

Rig read_omnimvs(const Document& document) {
  Rig rig;
  read_yaml(document, [&](const YAML::Node& root) {
    const YAML::Node cameras = root["cameras"];
    if (!cameras || !cameras.IsSequence()) document.fail("The list cameras is missing", "add it");
    for (const YAML::Node& node : cameras) {
      View view;
      view.name = "cam" + std::to_string(rig.views.size());
      const YamlCamera keys(document, view.name, node);
      if (const std::string model = keys.text("model", "ocam"); model != "ocam") {
        document.fail(view.name + ": The model \"" + model + "\" is not supported", "use ocam");
      }
      const std::optional<std::vector<double>> polynomial = after_count(keys.numbers("poly"));
      if (!polynomial) {
        document.fail(view.name + ": The key poly does not list as many numbers as it says",
                      "correct one or the other");
      }
      OCamLens lens = lens_of(*polynomial, keys.numbers("center", 2), keys.numbers("affine", 3));
      if (keys.has("max_fov")) lens.max_theta = 0.5 * keys.number("max_fov") * radians_per_degree;
      const std::vector<int> size = keys.sides("image_size");
      view.camera = camera_of(lens, size[1], size[0], document, view.name);
      const std::vector<double> pose = keys.numbers("pose", 6);
      const Eigen::Vector3d turn(pose[0], pose[1], pose[2]);
      Eigen::Isometry3d rig_from_camera = Eigen::Isometry3d::Identity();
      rig_from_camera.linear() =
          Eigen::AngleAxisd(turn.norm(), turn.stableNormalized()).toRotationMatrix();
      rig_from_camera.translation() << pose[3], pose[4], pose[5];
      add_view_of_body(rig, std::move(view), rig_from_camera);
    }
    rig.world_from_imu.reset();
  });
  return rig;
}

}  // namespace widestereo::calibration
