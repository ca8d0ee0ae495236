// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <memory>
#include <numbers>
#include <opencv2/core/mat.hpp>
#include <span>
#include <string>

#include "widestereo/eigen_layout.h"
#include "widestereo/error.h"

namespace widestereo {

/// Central camera models. The values are those of the kernels (shaders/camera.glsl).
///
/// Frame: x right, y down, z forward. Integer pixel coordinates are pixel centres.
/// In the formulas d = |X|, rho = sqrt(x^2 + y^2), theta = atan2(rho, z).
enum class CameraModel : int {
  pinhole = 0,         ///< (x/z, y/z); domain z > 0
  pinhole_radtan = 1,  ///< pinhole, then Brown-Conrady distortion k1 k2 p1 p2 (k3)
  /// theta (1 + k1 theta^2 + ... + k4 theta^8) (Kannala, Brandt, TPAMI 2006): OpenCV fisheye,
  /// Kalibr equidistant
  kannala_brandt = 2,
  double_sphere = 3,  ///< xi, alpha (Usenko, Demmel, Cremers, 3DV 2018)
  /// (x, y) / (z + xi d) (Mei, Rives, ICRA 2007): Kalibr omni; xi = alpha / (1 - alpha)
  unified = 4,
  extended_unified = 5,  ///< alpha, beta (Khomutenko, Garcia, Martinet, RA-L 2016)
  field_of_view = 6,    ///< omega (Devernay, Faugeras, 2001), with atan2: reaches beyond 90 degrees
  mei = 7,              ///< unified, then Brown-Conrady: OpenCV omnidir, Kalibr omni + radtan
  equirectangular = 8,  ///< (longitude, latitude) = (atan2(x, z), atan2(y, sqrt(x^2 + z^2)))
  /// pinhole, then OpenCV's distortion with k1..k6, p1 p2 and thin prisms s1..s4
  pinhole_rational = 9,
  /// theta, then k1..k4, p1 p2 and s1..s4 of that point: COLMAP, ETH3D (s1, s3: sx1, sy1)
  thin_prism_fisheye = 10,
  /// theta (1 + k1 theta^2 + ... + k6 theta^12), then p1 p2 and s1..s4: Project Aria (Fisheye624)
  rad_tan_thin_prism_fisheye = 11,
  /// theta (1 + k1 theta + k2 theta^2 + ... + k11 theta^11): WoodScape and, fitted, OCam
  /// (Scaramuzza, Martinelli, Siegwart, IROS 2006)
  polynomial_fisheye = 12,
};

/// Number of camera models, which are counted from 0.
inline constexpr int camera_models = 13;

/// The model's name as used in messages and JSON, for example "kannala_brandt".
std::string to_string(CameraModel model);

/// Intrinsics of one camera. Members that the model does not use stay at their defaults.
struct Camera {
  CameraModel model = CameraModel::pinhole;
  int width = 0;                          ///< pixels
  int height = 0;                         ///< pixels
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels; (0, 0) is the centre of the top left pixel
  double skew = 0;                        ///< pixels: u = fx m_x + skew m_y + cx (K(0,1) of OpenCV)
  double shear = 0;  ///< pixels: v = fy m_y + shear m_x + cy; polynomial_fisheye
  double xi = 0;     ///< double_sphere, unified, mei
  double alpha = 0;  ///< double_sphere, extended_unified
  double beta = 1;   ///< extended_unified
  double omega = 0;  ///< field_of_view, radians
  /// Radial; radtan and mei: k1 k2 (k3); pinhole_rational: k4..k6 of the denominator.
  double k1 = 0, k2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;
  double k7 = 0, k8 = 0, k9 = 0, k10 = 0, k11 = 0;  ///< polynomial_fisheye
  double p1 = 0, p2 = 0;  ///< tangential, in OpenCV's order: p2 (r^2 + 2 x^2) is of x
  /// Thin prisms, in OpenCV's order: s1 r^2 + s2 r^4 of x, s3 r^2 + s4 r^4 of y.
  double s1 = 0, s2 = 0, s3 = 0, s4 = 0;
  /// Half angle of the lens's field of view in radians, measured from +z: rays beyond it are
  /// invalid even where the model would project them (the model's domain is often wider than the
  /// lens).
  double max_theta = std::numbers::pi;

  bool operator==(const Camera&) const = default;
};

/// All numbers of a camera but its size and max_theta, by their names.
struct Intrinsic {
  const char* name;
  double Camera::*member;
};
std::span<const Intrinsic> intrinsics();

/// An equirectangular image of the whole sphere (twice as wide as high where pixels are square);
/// the middle column looks along +z.
Camera whole_sphere(int width, int height);

/// Throws Error unless the camera's size and parameters are finite, in range and usable.
/// `name` (for example "camchain.yaml: cam0") begins the message.
void validate(const Camera& camera, const std::string& name);

/// Projects a point or direction (of any length whose square is finite) in the camera frame to a
/// pixel. The camera must be valid here, in unproject(), PreparedCamera and model_max_theta(),
/// which do not check it: where validate() throws, their results are unspecified. Returns false
/// when the point lies outside the model's exact domain or the field of view; pixels outside the
/// image are returned as true: the caller decides. `pixel` is unspecified when false.
bool project(const Camera& camera, const Eigen::Vector3d& point, Eigen::Vector2d& pixel);

/// As project(), with the derivative of the pixel by the point (pixels per metre).
bool project(const Camera& camera, const Eigen::Vector3d& point, Eigen::Vector2d& pixel,
             Eigen::Matrix<double, 2, 3>& jacobian);

/// Unit viewing ray of a pixel, which may lie outside the image and between pixel centres.
/// Closed form or Newton; the ray projects back to within 1e-6 px, and as much again for each 1000
/// px between the pixel and the image's origin. Returns false when the pixel has no such ray within
/// the model's domain and the field of view; `ray` is unspecified then.
bool unproject(const Camera& camera, const Eigen::Vector2d& pixel, Eigen::Vector3d& ray);

/// A camera for many points: the same functions, with what follows from the intrinsics alone (ends
/// of domains are roots of polynomials) worked out once. Copies share it.
class PreparedCamera {
 public:
  explicit PreparedCamera(const Camera& camera);
  bool project(const Eigen::Vector3d& point, Eigen::Vector2d& pixel) const;
  bool project(const Eigen::Vector3d& point, Eigen::Vector2d& pixel,
               Eigen::Matrix<double, 2, 3>& jacobian) const;
  bool unproject(const Eigen::Vector2d& pixel, Eigen::Vector3d& ray) const;
  /// Projects to a pixel of the image: at most half a pixel beyond the centres of the outermost.
  bool project_into_image(const Eigen::Vector3d& point, Eigen::Vector2d& pixel) const;

 private:
  class Implementation;
  std::shared_ptr<const Implementation> implementation_;
};

/// Largest theta (radians) that the model itself can project, whatever max_theta says.
double model_max_theta(const Camera& camera);

/// The camera after resizing its image to width x height (both axes scale about the image corner:
/// cx' = s (cx + 0.5) - 0.5). Throws Error where either size has no pixel; validates nothing else.
Camera resized(const Camera& camera, int width, int height);

/// The camera after its image was reduced, or enlarged, by exactly that factor both ways, as
/// binning and cv::resize() with factors do; the size is rounded as there. Throws Error where no
/// pixel is left, and for factors that are not positive or too large.
Camera scaled(const Camera& camera, double factor);

/// Unit rays of all pixels, CV_32FC4: (x, y, z, 1), or (x, y, z, 0) where the model has a ray but
/// the field of view or the mask excludes the pixel, or zeros where there is no ray. `mask`: empty,
/// or CV_8UC1 of the camera's size, 0 = excluded. Throws Error for other masks and for cameras that
/// validate() refuses.
cv::Mat ray_image(const Camera& camera, const cv::Mat& mask);

}  // namespace widestereo
