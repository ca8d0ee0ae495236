// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace widestereo {

/// SPIR-V of a kernel, as NAME_loads of what is compiled for devices without texture units,
/// embedded by cmake/shaders.cmake; empty for an unknown name.
std::span<const std::uint32_t> shader_code(std::string_view name);

}  // namespace widestereo
