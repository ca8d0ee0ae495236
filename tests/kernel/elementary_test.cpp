// SPDX-License-Identifier: MIT
// The kernels' elementary functions against the library's.
#include <gtest/gtest.h>

#include <cmath>

#include "kernel/host.h"

namespace widestereo::test {
namespace {

TEST(ElementaryFunctions, AgreeWithTheLibrarys) {
  for (int i = -400; i <= 400; ++i) {
    const double a = 0.05 * i;  // -20 to 20
    const float single = static_cast<float>(a);
    const double power = static_cast<double>(kernel::exponential(single));
    EXPECT_NEAR(power / std::exp(a), 1, 3e-6) << a;
    EXPECT_NEAR(static_cast<double>(kernel::logarithm(static_cast<float>(std::exp(a)))), a, 3e-6)
        << a;
    const kernel::vec2 unit = kernel::unit_vector(single);
    EXPECT_NEAR(static_cast<double>(unit.x), std::cos(a), 4e-6) << a;
    EXPECT_NEAR(static_cast<double>(unit.y), std::sin(a), 4e-6) << a;
  }
}

}  // namespace
}  // namespace widestereo::test
