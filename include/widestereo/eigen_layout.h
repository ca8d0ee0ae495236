// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

/// Structures here hold Eigen's matrices, whose alignment would otherwise follow the instructions
/// that a program is compiled for (-march=native, -mavx): with another one than the library's,
/// every call would read the wrong bytes.
static_assert(EIGEN_MAX_ALIGN_BYTES == 16,
              "widestereo needs EIGEN_MAX_ALIGN_BYTES=16 in all of an application that exchanges "
              "Eigen's types with it; CMake's target widestereo::widestereo defines it.");
