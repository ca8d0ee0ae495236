// SPDX-License-Identifier: MIT
// The part of CUDA's header of this name that the back end uses, for running it without a GPU.
#pragma once

struct float4 {
  float x, y, z, w;
};
struct dim3 {
  unsigned x, y, z;
  constexpr dim3(unsigned x_ = 1, unsigned y_ = 1, unsigned z_ = 1) : x(x_), y(y_), z(z_) {}
};
