// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace widestereo {

/// Whether kernels built for `architectures` (as CMAKE_CUDA_ARCHITECTURES, separated by spaces or
/// semicolons: "80-real 90-virtual") run on a device of this compute capability: machine code runs
/// on the same major version from its minor version on, PTX on everything newer. True for words
/// that name no number ("native"): the first launch tells.
bool runs_on(const std::string& architectures, int major, int minor);

/// Those that this build has kernels for, separated by spaces; empty without CUDA.
std::string built_architectures();

}  // namespace widestereo
