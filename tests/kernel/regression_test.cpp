// SPDX-License-Identifier: MIT
// The plane regression on maps with known planes, known noise and known edges.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;
using kernel::vec3;

constexpr int size = 96;
/// Movement in the source, pixels per unit of inverse distance.
constexpr double speed = 3;
constexpr float grey = 0.5f;

/// View 0 of evenly grey images, whose planes were measured with known precision.
class Regression : public ::testing::Test {
 protected:
  using Truth = std::function<Eigen::Vector3d(int x)>;

  Regression() : fixture_(fisheye_rig(size), wide_range("fast")) {
    fixture_.view(0).image().setTo(grey);
    fixture_.set_reference(0);
  }

  Eigen::Vector3d ray(ivec2 pixel) { return fixture_.ray(0, pixel); }

  /// Fills the view with the planes of `truth` by column, their displacement in the source wrong by
  /// `noise` pixels (standard deviation) and the tangent of their tilt by `tilt`.
  void measure(const Truth& truth, double noise, double tilt) {
    cv::RNG random(7);
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const Eigen::Vector3d r = ray({x, y});
        const Eigen::Vector3d m = truth(x);
        const Eigen::Vector3d wrong(random.gaussian(tilt), random.gaussian(tilt), 0);
        const Eigen::Vector3d tangent = m.norm() * (wrong - wrong.dot(r) * r);
        const Eigen::Vector3d held = m + random.gaussian(noise / speed) * r + tangent;
        fixture_.view(0).hypotheses(y, x) =
            cv::Vec4f(static_cast<float>(held.x()), static_cast<float>(held.y()),
                      static_cast<float>(held.z()), 0.1f);
        fixture_.view(0).checks(y, x) =
            cv::Vec4f(static_cast<float>(noise * noise), static_cast<float>(speed),
                      static_cast<float>(held.dot(r)), grey);
      }
    }
  }

  /// m of the regressed plane; zero where there is none.
  Eigen::Vector3d regressed(ivec2 pixel, int radius, double precision, int steps = 4,
                            unsigned how = 0, float tolerance = 1) {
    fixture_.pass().radius = radius;
    fixture_.pass().steps = steps;
    fixture_.pass().deviation = static_cast<float>(precision);
    fixture_.pass().candidates = how;
    fixture_.pass().tolerance = tolerance;
    kernel::cpu::regress_pixel(fixture_.context(), pixel);
    const cv::Vec4f prior = fixture_.view(0).priors(pixel.y, pixel.x);
    return {prior[0], prior[1], prior[2]};
  }

  /// Displacement in the source (px) of a plane's point from that of the true one.
  double displacement(ivec2 pixel, const Eigen::Vector3d& plane, const Eigen::Vector3d& truth) {
    return std::abs((plane - truth).dot(ray(pixel))) * speed;
  }

  /// Root mean square over a grid of pixels with columns `first` to `last`.
  double over_pixels(int first, int last, const std::function<double(ivec2)>& error) {
    double sum = 0;
    int count = 0;
    for (int y = 24; y <= 72; y += 4) {
      for (int x = first; x <= last; x += 2, ++count) {
        const double e = error({x, y});
        sum += e * e;
      }
    }
    return std::sqrt(sum / count);
  }

  KernelFixture fixture_;
};

const Eigen::Vector3d wall(0.05, 0.1, 0.5);

TEST_F(Regression, IsAboutAsPreciseAsAskedFor) {
  const double noise = 0.1;
  measure([](int) { return wall; }, noise, 0.3);
  const auto error = [&](double precision) {
    return over_pixels(24, 72, [&](ivec2 pixel) {
      return displacement(pixel, regressed(pixel, 18, precision), wall);
    });
  };
  // It looks at every other pixel or fewer, but counts all.
  EXPECT_LT(error(0.03), 1.5 * 0.03);
  EXPECT_LT(error(0.015), 1.5 * 0.015);
  EXPECT_GT(error(0.06), 1.5 * 0.015) << "a smaller neighbourhood is enough";
}

TEST_F(Regression, IsMorePreciseWithMoreNeighbours) {
  measure([](int) { return wall; }, 0.1, 0.1);
  const auto error = [&](int steps) {
    return over_pixels(24, 72, [&](ivec2 pixel) {
      return displacement(pixel, regressed(pixel, 12, 1e-6, steps), wall);
    });
  };
  EXPECT_LT(error(6), 0.7 * error(3)) << "half as wrong with four times as many";
}

TEST_F(Regression, DoesNotBlendSurfaces) {
  const auto step = [](int x) -> Eigen::Vector3d { return x < 48 ? wall : 2 * wall; };
  measure(step, 0.05, 0.1);
  for (const auto& [first, last] : {std::pair(40, 47), std::pair(48, 55)}) {
    EXPECT_LT(over_pixels(first, last,
                          [&](ivec2 pixel) {
                            return displacement(pixel, regressed(pixel, 18, 0.015), step(pixel.x));
                          }),
              0.03)
        << "columns " << first << " to " << last;
  }
}

TEST_F(Regression, OfAWeakPixelDoesNotBlendSurfacesThatLieNearEachOther) {
  const auto step = [](int x) -> Eigen::Vector3d { return x < 48 ? wall : 1.3 * wall; };  // 0.45 px
  measure(step, 0.05, 0.1);
  const cv::Mat_<cv::Vec4f> strong = fixture_.view(0).checks.clone();
  EXPECT_LT(over_pixels(40, 47,
                        [&](ivec2 pixel) {
                          strong.copyTo(fixture_.view(0).checks);
                          fixture_.view(0).checks(pixel.y, pixel.x)[0] = 0.3f;
                          return displacement(pixel, regressed(pixel, 18, 0.015), wall);
                        }),
            0.03);
}

TEST_F(Regression, OfAThinSurfaceKeepsToItAlthoughItIsNeverPreciseEnough) {
  // Two pixels of displacement before the wall, by whose precision 200 pixels outvote five.
  const auto pole = [](int x) -> Eigen::Vector3d { return 46 <= x && x <= 50 ? 2.3 * wall : wall; };
  measure(pole, 0.3, 0.1);
  EXPECT_LT(over_pixels(46, 50,
                        [&](ivec2 pixel) {
                          return displacement(pixel, regressed(pixel, 40, 0.015), pole(pixel.x));
                        }),
            0.5);
}

TEST_F(Regression, FillsWhatWasNotMeasuredFromAround) {
  measure([](int) { return wall; }, 0.05, 0.1);
  const cv::Rect weak(44, 44, 9, 9);
  fixture_.view(0).hypotheses(weak).setTo(cv::Scalar(0.06, 0.12, 0.6, 0.9));
  fixture_.view(0).checks(weak).setTo(cv::Scalar(UNMEASURED_VARIANCE, speed, 0, 0));
  const ivec2 pixel(48, 48);
  EXPECT_LT(displacement(pixel, regressed(pixel, 18, 0.015), wall), 0.02);
  fixture_.view(0).checks.setTo(cv::Scalar(UNMEASURED_VARIANCE, speed, 0, 0));
  EXPECT_EQ(regressed(pixel, 18, 0.015), Eigen::Vector3d::Zero()) << "nothing to fill from";
}

TEST_F(Regression, AtTheEdgeOfWhatWasMeasuredIsNoLessTilted) {
  const Eigen::Vector3d tilted(0.3, 0.4, 0.5);
  const ivec2 pixel(48, 48);
  for (const cv::Rect& weak :
       {cv::Rect(0, 0, 48, size), cv::Rect(0, 0, size, 48), cv::Rect(49, 0, size - 49, size),
        cv::Rect(0, 49, size, size - 49)}) {
    measure([&](int) { return tilted; }, 0.005, 0);
    for (cv::Vec4f& check : fixture_.view(0).checks) check[0] = 0.05f * 0.05f;
    fixture_.view(0).checks(weak).setTo(cv::Scalar(UNMEASURED_VARIANCE, speed, 0, grey));
    const float w = static_cast<float>(tilted.dot(ray(pixel)));
    fixture_.view(0).hypotheses(pixel.y, pixel.x) = cv::Vec4f(0, 0, w, 0.1f);
    EXPECT_LT(displacement(pixel, regressed(pixel, 18, 0.05), tilted), 0.012) << weak;
  }
}

TEST_F(Regression, WeighsByThePrecisionOfInverseDistances) {
  // Every other column moves a tenth as fast in the source, and is as wrong in pixels.
  constexpr float share = 0.1f;
  measure([](int) { return wall; }, 0.1, 0.1);
  for (int x = 0; x < size; x += 2) {
    for (int y = 0; y < size; ++y) {
      cv::Vec4f& check = fixture_.view(0).checks(y, x);
      const float truth = static_cast<float>(wall.dot(ray({x, y})));
      check[2] = truth + (check[2] - truth) / share;
      check[1] *= share;
    }
  }
  EXPECT_LT(over_pixels(25, 71,
                        [&](ivec2 pixel) {
                          return displacement(pixel, regressed(pixel, 12, 1e-6, 12), wall);
                        }),
            0.02);
}

TEST_F(Regression, GoesByIntensityWhereSurfacesLieNearEachOther) {
  const auto step = [](int x) -> Eigen::Vector3d { return x < 48 ? wall : 1.3 * wall; };  // 0.45 px
  measure(step, 0.05, 0.1);
  for (cv::Vec4f& check : fixture_.view(0).checks) check[0] = 0.3f * 0.3f;
  for (int x = 48; x < size; ++x) {
    for (int y = 0; y < size; ++y) fixture_.view(0).checks(y, x)[3] = grey + 0.3f;
  }
  const auto error = [&] {
    return over_pixels(42, 53, [&](ivec2 pixel) {
      return displacement(pixel, regressed(pixel, 18, 0.015), step(pixel.x));
    });
  };
  EXPECT_LT(error(), 0.05);
  Options blind = wide_range("fast");
  blind.regression_scale = 10000;  // grey levels
  fixture_.schedule().parameters.support = make_schedule(fixture_.rig(), blind).parameters.support;
  EXPECT_GT(error(), 0.08);
}

TEST_F(Regression, DoesNotBlendSurfacesThatAreMeasuredBadly) {
  const auto step = [](int x) -> Eigen::Vector3d { return x < 48 ? wall : 3 * wall; };  // 3 px
  measure(step, 0.05, 0.1);
  for (cv::Vec4f& check : fixture_.view(0).checks) check[0] = 1;
  EXPECT_LT(over_pixels(42, 53,
                        [&](ivec2 pixel) {
                          return displacement(pixel, regressed(pixel, 18, 0.015), step(pixel.x));
                        }),
            0.3);
}

TEST_F(Regression, LaterRoundsTellSmoothSurfacesApartThatLieNearEachOther) {
  const auto step = [](int x) -> Eigen::Vector3d { return x < 48 ? wall : 1.3 * wall; };  // 0.45 px
  measure(step, 0.02, 0.1);
  for (cv::Vec4f& check : fixture_.view(0).checks) check[0] = 0.15f * 0.15f;
  const auto error = [&](float tolerance) {
    return over_pixels(42, 53, [&](ivec2 pixel) {
      return displacement(pixel, regressed(pixel, 18, 0.015, 4, 0, tolerance), step(pixel.x));
    });
  };
  EXPECT_LT(error(0.36f), 0.7 * error(1));
}

TEST_F(Regression, LaterRoundsDoNotRoundCreases) {
  // Planes that meet in the column of the axis, where rays have no x, and part by 0.1 px a column.
  const auto crease = [](int x) -> Eigen::Vector3d {
    return x < size / 2 ? wall : wall + Eigen::Vector3d(1, 0, 0);
  };
  measure(crease, 0.02, 0.01);
  for (cv::Vec4f& check : fixture_.view(0).checks) check[0] = 0.1f;
  for (const auto& [first, last] : {std::pair(40, 45), std::pair(50, 55)}) {
    EXPECT_LT(over_pixels(first, last,
                          [&](ivec2 pixel) {
                            const Eigen::Vector3d plane = regressed(pixel, 40, 0.01, 4, 0, 0.6f);
                            return displacement(pixel, plane, crease(pixel.x));
                          }),
              0.06)
        << "columns " << first << " to " << last;
  }
}

TEST_F(Regression, LaterRoundsDoNotLetLargerSurfacesAroundMoveSmallOnes) {
  const auto strip = [](int x) -> Eigen::Vector3d {  // 0.6 px before the wall
    return 46 <= x && x < 50 ? 1.4 * wall : wall;
  };
  measure(strip, 0.02, 0.1);
  for (cv::Vec4f& check : fixture_.view(0).checks) check[0] = 0.2f * 0.2f;
  EXPECT_LT(over_pixels(46, 49,
                        [&](ivec2 pixel) {
                          return displacement(pixel, regressed(pixel, 40, 0.015, 4, 0, 0.36f),
                                              strip(pixel.x));
                        }),
            0.2);
}

TEST_F(Regression, IsTheSameInEveryUnitOfDistance) {
  const ivec2 pixel(48, 48);
  measure([](int) { return wall; }, 0.1, 0.3);
  const Eigen::Vector3d in_metres = regressed(pixel, 18, 0.015, 4, REGRESS_NORMALS);
  ASSERT_NE(in_metres, Eigen::Vector3d::Zero());
  auto& range = fixture_.schedule().parameters.range;
  const auto range_in_metres = range;
  for (const float unit : {0x1p-26F, 0x1p26F}) {  // powers of two lose no bits
    measure([](int) { return wall; }, 0.1, 0.3);
    for (int i = 0; i < size * size; ++i) {
      cv::Vec4f& held = fixture_.view(0).hypotheses(i / size, i % size);
      held = cv::Vec4f(held[0] * unit, held[1] * unit, held[2] * unit, held[3]);
      cv::Vec4f& check = fixture_.view(0).checks(i / size, i % size);
      check = cv::Vec4f(check[0], check[1] / unit, check[2] * unit, check[3]);
    }
    range.x = range_in_metres.x / unit;
    range.y = range_in_metres.y / unit;
    range.z = range_in_metres.z * unit;
    range.w = range_in_metres.w * unit;
    EXPECT_EQ(regressed(pixel, 18, 0.015, 4, REGRESS_NORMALS), unit * in_metres) << unit;
  }
}

TEST_F(Regression, IsTakenOverWithoutACostOnlyWhereASourceSeesThePoint) {
  const ivec2 pixel(48, 48);
  const cv::Vec4f held(0, 0, 0.5f, 0.1f);
  const cv::Vec4f prior(0, 0, 0.6f, 1);
  const auto adopted = [&] {
    fixture_.view(0).hypotheses(pixel.y, pixel.x) = held;
    fixture_.view(0).priors(pixel.y, pixel.x) = prior;
    kernel::cpu::adopt_point_pixel(fixture_.context(), pixel);
    return fixture_.view(0).hypotheses(pixel.y, pixel.x);
  };
  EXPECT_EQ(adopted(), cv::Vec4f(0, 0, 0.6f, 0.1f));
  EXPECT_FLOAT_EQ(fixture_.view(0).checks(pixel.y, pixel.x)[2],
                  static_cast<float>(0.6 * ray(pixel).z()))
      << "the measure follows";
  EXPECT_EQ(fixture_.view(0).priors(pixel.y, pixel.x), cv::Vec4f(0, 0, 0.5f, 0)) << "for the vote";
  fixture_.schedule().parameters.cameras[1].size.x = 1;
  EXPECT_EQ(adopted(), held);
}

TEST_F(Regression, OfNormalsAloneKeepsDistancesAndUsesAllOfAPlane) {
  measure([](int) { return wall; }, 0.05, 0.05);
  const double error = over_pixels(24, 72, [&](ivec2 pixel) {
    const Eigen::Vector3d found = regressed(pixel, 48, 0);
    const cv::Vec4f held = fixture_.view(0).hypotheses(pixel.y, pixel.x);
    EXPECT_NEAR(found.dot(ray(pixel)), Eigen::Vector3d(held[0], held[1], held[2]).dot(ray(pixel)),
                1e-6);
    return degrees_between(found, wall);
  });
  EXPECT_LT(error, 1.5);
}

TEST_F(Regression, OfBothTakesNormalsFromAWiderSurfaceThanDistances) {
  measure([](int) { return wall; }, 0.05, 0.05);
  const auto normal_error = [&](unsigned how) {
    return over_pixels(32, 64, [&](ivec2 pixel) {
      return degrees_between(regressed(pixel, 32, 0.02, 4, how), wall);
    });
  };
  EXPECT_LT(normal_error(REGRESS_NORMALS), 0.5 * normal_error(0));
  for (int x = 32; x <= 64; ++x) {
    const Eigen::Vector3d r = ray({x, 48});
    EXPECT_NEAR(regressed({x, 48}, 32, 0.02, 4, REGRESS_NORMALS).dot(r),
                regressed({x, 48}, 32, 0.02, 4, 0).dot(r), 1e-6);
  }
}

TEST_F(Regression, OfNormalsAloneStopsAtTheEndOfASmallSurface) {
  // A tilted board before the wall, 16 pixels wide: the whole neighbourhood is all but wall.
  const auto board = [](int x) { return Eigen::Vector3d(40 <= x && x < 56 ? 0.3 : 0, 0, 0.5); };
  measure(board, 0.02, 0.02);
  const double error = over_pixels(44, 51, [&](ivec2 pixel) {
    return degrees_between(regressed(pixel, 48, 0), board(pixel.x));
  });
  EXPECT_LT(error, 5);
}

/// Of a plane that moved here from the frame before, what is noise counts little and what is an
/// error all but whole.
TEST_F(Regression, FiltersSmallMoves) {
  const ivec2 pixel(48, 48);
  const Eigen::Vector3d r = ray(pixel);
  measure([](int) { return wall; }, 0.01, 0);
  for (const auto& [pixels, share] :
       {std::pair(0.03, 0.13), std::pair(0.15, 0.55), std::pair(1.0, 0.98)}) {
    const Eigen::Vector3d held = wall + pixels / speed * r;
    cv::Vec4f& hypothesis = fixture_.view(0).hypotheses(pixel.y, pixel.x);
    for (int i = 0; i < 3; ++i) hypothesis[i] = static_cast<float>(held[i]);
    const double whole = (regressed(pixel, 18, 0.015) - held).dot(r);
    const double filtered = (regressed(pixel, 18, 0.015, 4, FILTER_MOVED) - held).dot(r);
    EXPECT_NEAR(-whole * speed, pixels, 0.01);
    EXPECT_NEAR(filtered / whole, share, 0.03);
  }
}

/// Of the nearest pixels only those on a line are measured, and the pixel's own plane is turned
/// about it: they agree with it.
TEST_F(Regression, OfNormalsGoesBeyondWhatLiesOnALine) {
  const Eigen::Vector3d truth(0, 0, 0.5);
  for (const int diagonal : {1, -1}) {
    measure([&truth](int) { return truth; }, 0, 0);
    for (int y = 0; y < size; ++y) {
      for (int x = 0; x < size; ++x) {
        const int dx = x - 48;
        const int dy = diagonal * (y - 48);
        const bool is_near = std::max(std::abs(dx), std::abs(dy)) <= 8;
        fixture_.view(0).checks(y, x)[0] = is_near && dx != dy ? UNMEASURED_VARIANCE : 4e-4f;
      }
    }
    const Eigen::Vector3d turned(0.06, -0.06 * diagonal, 0.5);
    fixture_.view(0).hypotheses(48, 48) =
        cv::Vec4f(0.06f, static_cast<float>(turned.y()), 0.5f, 0.1f);
    ASSERT_GT(degrees_between(turned, truth), 9);
    EXPECT_LT(degrees_between(regressed({48, 48}, 48, 0, 8), truth), 2) << diagonal;
  }
}

TEST(AveragesOverFrames, TakeLessOfSlopesThanOfDistances) {
  const kernel::cpu::LocalPlane held{0.5f, 0, 0};
  const kernel::cpu::LocalPlane regressed{0.51f, 0.2f, -0.3f};
  const kernel::cpu::LocalPlane filtered = kernel::cpu::filtered_plane(held, regressed, 3);
  const float share = (filtered.offset - held.offset) / 0.01f;
  EXPECT_GT(share, 0.1f);
  EXPECT_LT(share, 0.3f);
  const float of_slopes = share * share * share;
  EXPECT_NEAR(filtered.slope_x, 0.2f * of_slopes, 1e-5);
  EXPECT_NEAR(filtered.slope_y, -0.3f * of_slopes, 1e-5);
}

TEST(Adopting, APlaneThatNoSourceSeesLeavesTheHeldOneWithItsCost) {
  KernelFixture fixture(fisheye_rig(size), wide_range("fast"));
  fixture.set_reference(0);
  fixture.pass().candidates = HELD_UNSEEN;
  int found = 0;
  for (int y = 20; y < 76; y += 4) {
    for (int x = 0; x < size; ++x) {
      const kernel::vec3 ray = to_kernel(fixture.view(0).rays(y, x));
      const kernel::vec3 far = 0.05f * ray;
      const kernel::vec3 near = 4.0f * ray;
      const auto cost = [&](const kernel::vec3& m) {
        return kernel::cpu::patch_cost(fixture.context(), {x, y}, m);
      };
      const bool has_ray = fixture.view(0).rays(y, x)[3] != 0;
      if (!has_ray || cost(far) >= INVALID_COST || cost(near) < INVALID_COST) continue;
      ++found;
      fixture.view(0).hypotheses(y, x) = cv::Vec4f(far.x, far.y, far.z, 0.3f);
      fixture.view(0).priors(y, x) = cv::Vec4f(near.x, near.y, near.z, 1);
      kernel::cpu::adopt_pixel(fixture.context(), {x, y});
      EXPECT_EQ(fixture.view(0).hypotheses(y, x), cv::Vec4f(far.x, far.y, far.z, cost(far)));
    }
  }
  EXPECT_GT(found, 10);
}

}  // namespace
}  // namespace widestereo::test
