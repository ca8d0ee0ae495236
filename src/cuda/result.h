// SPDX-License-Identifier: MIT
#pragma once

#include <driver_types.h>

#include <string>

namespace widestereo {

/// Throws Error "DEVICE could not ACTION: reason and remedy" unless the call succeeded, and clears
/// the runtime's last error, so that a failure that leaves the device usable is not seen again.
void check(cudaError_t result, const std::string& device, const std::string& action);

/// What an error means and what to do about it, one sentence.
std::string explain(cudaError_t result);

}  // namespace widestereo
