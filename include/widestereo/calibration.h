// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "widestereo/rig.h"

namespace widestereo {

/// Calibration file formats, told apart by content, never by file name.
enum class CalibrationFormat {
  kalibr,
  basalt,
  opencv,
  euroc,
  camodocal,
  vins,
  ocam,
  omnimvs,
  multicol,
  woodscape,
  orb_slam,
  depthai,
  ros,
};

struct Calibration {
  Rig rig;  ///< view 0's camera frame is the world frame; the IMU as in T_cam_imu, T_imu_cam, T_BS,
            ///< body_T_cam0, IMU.T_b_c1, imuExtrinsics
  CalibrationFormat format = CalibrationFormat::kalibr;
  std::vector<std::filesystem::path> files;  ///< that it was read from, those named in one, too
};

/// Reads a Kalibr camchain YAML, a Basalt JSON, an OpenCV FileStorage (YAML, XML or JSON; fisheye
/// stereo or omnidir), EuRoC's sensor.yaml (one camera's, or the folder that has cam0/sensor.yaml,
/// cam1/sensor.yaml, ... or has them in mav0), ROS's camera_info (one camera's, or the folder that
/// has those of all), a camera of CamOdoCal, OCamCalib or WoodScape, a configuration of VINS-Fusion
/// or MultiCol-SLAM (with the cameras that it names), of OmniMVS or ORB-SLAM3, a calibration of
/// DepthAI, and validates it. Sizes come from the file; an OpenCV file without an image size takes
/// `image_size` (pixels), and one of another size is refused. The other formats ignore
/// `image_size`, as each of their cameras has a size of its own. Throws Error naming the file, the
/// key and the remedy.
Calibration read_calibration(const std::filesystem::path& path, cv::Size image_size = {});

/// A Kalibr camchain (with T_cam_imu where the IMU is known, timeshift_cam_imu where its clock is
/// another one, and the extra key max_theta_deg where the field of view is limited), for a file
/// that errors name. Throws Error for a rig that validate() refuses, and where a camera has no
/// Kalibr form (skew, k3, ...).
std::string kalibr_text(const std::filesystem::path& path, const Rig& rig);
/// Writes it. Throws Error where the file cannot be written, too.
void write_kalibr(const std::filesystem::path& path, const Rig& rig);

/// A Basalt JSON, for a file that errors name; T_imu_cam of view 0 is the identity where no IMU is
/// known, and the IMU's rate, biases and noise are Basalt's defaults. Throws Error for a rig that
/// validate() refuses, where a camera has no Basalt form, and where the time offsets of cameras
/// differ by more than a millisecond.
std::string basalt_text(const std::filesystem::path& path, const Rig& rig);
/// Writes it. Throws Error where the file cannot be written, too.
void write_basalt(const std::filesystem::path& path, const Rig& rig);

/// An OpenCV FileStorage, for a file that errors name: JSON or XML by its extension, else YAML; K,
/// D (xi) of one camera, or K1, D1 (xi1), K2, D2 (xi2), R and T as of cv::fisheye, cv::omnidir or
/// cv::stereoCalibrate, and the extra key max_theta_deg where the field of view is limited. Throws
/// Error for a rig that validate() refuses, that has three cameras, an IMU or its time offset, or
/// cameras of two sizes or kinds, and where OpenCV lacks a camera's model.
std::string opencv_text(const std::filesystem::path& path, const Rig& rig);
/// Writes it. Throws Error where the file cannot be written, too.
void write_opencv(const std::filesystem::path& path, const Rig& rig);

}  // namespace widestereo
