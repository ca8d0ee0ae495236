// SPDX-License-Identifier: MIT
#pragma once

#include "kernel/host.h"
#include "widestereo/camera.h"

namespace widestereo {

/// The camera as the shared projection source takes it, in double precision; validate() first.
kernel::precise::CameraParameters camera_parameters(const Camera& camera);

/// The same rounded to single precision, for the kernels.
kernel::CameraParameters kernel_camera(const Camera& camera);

}  // namespace widestereo
