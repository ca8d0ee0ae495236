// SPDX-License-Identifier: MIT
// What the adaptive search tries, one kind of candidate at a time, and what it prefers.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>
#include <vector>

#include "kernel_fixture.h"
#include "same_bits.h"
#include "synthesis/render.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;
using kernel::vec3;

constexpr int size = 96;
constexpr int middle = size / 2;

class Candidates : public ::testing::Test {
 protected:
  Candidates() : fixture_(fisheye_rig(size), wide_range("fast")) { fixture_.set_reference(0); }

  vec3 ray(ivec2 pixel) {
    const cv::Vec4f r = fixture_.view(0).rays(pixel.y, pixel.x);
    return {r[0], r[1], r[2]};
  }
  void hold(int view, const vec3& m) {
    fixture_.view(view).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, 0.1));
  }
  /// From the plane that the pixel holds; `speed`: source pixels per unit of inverse distance.
  vec3 candidate(ivec2 pixel, const vec3& held, int kind, float speed = 3) {
    return kernel::cpu::adaptive_candidate(fixture_.context(), pixel, ray(pixel), held, speed, 1,
                                           kind);
  }

  KernelFixture fixture_;
  const vec3 wall_{0.05f, 0.1f, 0.5f};
};

TEST_F(Candidates, OfStripsLieOnFourSidesOfThePixel) {
  constexpr int reach = 30;
  std::array<std::set<std::pair<int, int>>, STRIPS> found;
  for (int dy = -reach; dy <= reach; ++dy) {
    for (int dx = -reach; dx <= reach; ++dx) {
      fixture_.view(0).hypotheses.setTo(cv::Scalar(0, 0, 0, INVALID_COST));
      fixture_.view(0).hypotheses(middle + dy, middle + dx) = cv::Vec4f(0, 0, 1, 0.1f);
      for (int strip = 0; strip < STRIPS; ++strip) {
        if (candidate({middle, middle}, wall_, strip).z == 0) continue;
        // As if the strip led to the right.
        const bool upright = strip % 4 == STRIP_UP || strip % 4 == STRIP_DOWN;
        const bool outwards = strip % 4 == STRIP_DOWN || strip % 4 == STRIP_RIGHT;
        const int along = (outwards ? 1 : -1) * (upright ? dy : dx);
        found.at(static_cast<std::size_t>(strip)).insert({along, upright ? dx : dy});
      }
    }
  }
  const std::set<std::pair<int, int>> v = {{1, 0}, {2, -1}, {2, 1}, {3, -2},
                                           {3, 2}, {4, -3}, {4, 3}};
  std::set<std::pair<int, int>> line;
  for (int along = 3; along <= 23; along += 2) line.insert({along, 0});
  for (std::size_t strip = 0; strip < STRIPS; ++strip) {
    EXPECT_EQ(found.at(strip), strip < NEAR_STRIPS ? v : line) << strip;
  }
}

TEST_F(Candidates, OfSurroundingsAreParallelToThePointsAround) {
  hold(0, wall_);
  const ivec2 pixel(60, 40);
  const vec3 held = (dot(wall_, ray(pixel))) * ray(pixel);
  const Eigen::Vector3d found = to_eigen(candidate(pixel, held, CANDIDATE_SURROUNDINGS));
  EXPECT_LT((found - to_eigen(wall_)).norm(), 1e-4);
}

TEST_F(Candidates, OfTheSourceAreItsPlanesInTheReferencesFrame) {
  hold(1, kernel::cpu::plane_in_source(fixture_.schedule().parameters.pairs[1], wall_));
  const Eigen::Vector3d found = to_eigen(candidate({60, 40}, 1.1f * wall_, CANDIDATE_SOURCE_PLANE));
  EXPECT_LT((found - to_eigen(wall_)).norm(), 1e-5);
}

TEST(TellingSource, IsTheFastestOfThoseThatSeeThePoint) {
  Rig rig = fisheye_rig(size);
  rig.views.push_back(rig.views[1]);
  rig.views[2].name = "cam2";
  rig.views[1].world_from_camera.translation() *= 0.5;
  KernelFixture fixture(rig, wide_range("fast"));
  fixture.set_reference(0);
  const cv::Vec4f r = fixture.view(0).rays(middle, middle);
  const auto found = [&] {
    kernel::vec2 velocity;
    return kernel::cpu::telling_source(fixture.context(), {r[0], r[1], r[2]}, 0.5f, velocity);
  };
  EXPECT_EQ(found(), 2);
  kernel::CameraParameters& fastest = fixture.schedule().parameters.cameras[2];
  fastest.size.x = 1;
  EXPECT_EQ(found(), 1) << "the other one does not see it";
  fixture.schedule().parameters.cameras[1].size.x = 1;
  EXPECT_EQ(found(), 2) << "nor does this one";
}

/// Lowest, mean and highest value over many pixels.
struct Spread {
  double low = 1e9, mean = 0, high = -1e9;
  int count = 0;
  void add(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
    mean += (value - mean) / ++count;
  }
};

TEST_F(Candidates, AreDrawnFromAroundWhatIsHeldToEitherSide) {
  constexpr double speed = 3;
  constexpr double pixels = 0.5;
  constexpr double turn = 0.25;
  fixture_.pass().step_pixels = pixels;
  fixture_.pass().step_normal = turn;
  const kernel::vec4 range = fixture_.schedule().parameters.range;
  const double least = static_cast<double>(range.z);
  const double most = static_cast<double>(range.w);
  Spread moved;
  Spread anywhere;
  std::array<Spread, 3> turned;
  for (int y = 24; y < 72; ++y) {
    for (int x = 24; x < 72; ++x) {
      const Eigen::Vector3d r = to_eigen(ray({x, y}));
      const Eigen::Vector3d held = to_eigen(wall_);
      const auto drawn = [&](int kind) {
        return to_eigen(candidate({x, y}, wall_, kind, static_cast<float>(speed)));
      };
      const Eigen::Vector3d distance = drawn(CANDIDATE_INVERSE_DISTANCE);
      moved.add((distance - held).dot(r) * speed);
      EXPECT_LT(distance.normalized().cross(held.normalized()).norm(), 1e-5);
      for (const int kind : {CANDIDATE_RANDOM_DISTANCE, CANDIDATE_OTHER_SURFACE}) {
        const Eigen::Vector3d random = drawn(kind);
        anywhere.add((random.dot(r) - least) / (most - least));
        EXPECT_LT(random.normalized().cross(held.normalized()).norm(), 1e-5);
      }
      const Eigen::Vector3d normal = drawn(CANDIDATE_NORMAL);
      EXPECT_NEAR(normal.dot(r), held.dot(r), 1e-5);
      // Scaled so that what was added to the unit normal shows, but for its part along the normal.
      const Eigen::Vector3d n = held.normalized();
      const Eigen::Vector3d across = normal / normal.dot(n) - n;
      for (int i = 0; i < 3; ++i) turned.at(static_cast<std::size_t>(i)).add(across[i]);
    }
  }
  EXPECT_NEAR(moved.low, -pixels, 0.01);
  EXPECT_NEAR(moved.mean, 0, 0.03);
  EXPECT_NEAR(moved.high, pixels, 0.01);
  EXPECT_NEAR(anywhere.low, 0, 0.01);
  EXPECT_NEAR(anywhere.mean, 0.5, 0.03);
  EXPECT_NEAR(anywhere.high, 1, 0.01);
  // Scaling lengthens what is added to a normal that gets shorter.
  for (const Spread& axis : {turned[0], turned[1]}) {
    EXPECT_GT(-axis.low, 0.9 * turn);
    EXPECT_LT(-axis.low, 1.6 * turn);
    EXPECT_NEAR(axis.mean, 0, 0.1 * turn);
    EXPECT_GT(axis.high, 0.9 * turn);
    EXPECT_LT(axis.high, 1.6 * turn);
  }
}

/// Costs of the planes that pixels before a wall take from such candidates; all held another one.
std::vector<float> taken_costs(int kind, float held_cost, float most_cost = 2) {
  const Rig rig = fisheye_rig(size);
  synthesis::Scene scene;
  const synthesis::Paint paint{
      {0.8, 0.8, 0.8}, {0.2, 0.2, 0.2}, synthesis::Paint::Pattern::noise, 0.15, 1.2};
  scene.surfaces.push_back(make_plane(paint, {0, 0, 1}, 1));
  KernelFixture fixture(rig, wide_range("fast"));
  fixture.show(render(scene, rig, 4));
  fixture.set_reference(0);
  fixture.pass().candidates = 1u << kind;
  fixture.pass().tolerance = most_cost;
  std::vector<float> costs;
  for (int y = 30; y < 66; ++y) {
    for (int x = 30; x < 66; ++x) {
      const vec3 held = to_kernel(0.2 * fixture.ray(0, {x, y}));
      fixture.view(0).hypotheses(y, x) = cv::Vec4f(held.x, held.y, held.z, held_cost);
      kernel::cpu::search_pixel(fixture.context(), {x, y});
      const cv::Vec4f taken = fixture.view(0).hypotheses(y, x);
      if (taken[0] != held.x || taken[1] != held.y || taken[2] != held.z) costs.push_back(taken[3]);
    }
  }
  return costs;
}

TEST(OtherSurfaces, ReplaceWhatHardlyMatchesByWhatMatchesMuchBetter) {
  for (const float held : {0.3f, 0.6f}) {
    const std::vector<float> costs = taken_costs(CANDIDATE_OTHER_SURFACE, held);
    const std::vector<float> better = taken_costs(CANDIDATE_RANDOM_DISTANCE, held);
    EXPECT_GT(costs.size(), 20u) << held;
    EXPECT_LT(costs.size(), better.size()) << held;
    for (const float cost : costs) EXPECT_LE(cost, 0.4f * held);
    EXPECT_GT(std::ranges::max(better), 0.4f * held);
  }
  EXPECT_EQ(taken_costs(CANDIDATE_OTHER_SURFACE, 0.24f), std::vector<float>());
  // As of planes that moved, in a sequence.
  for (const float cost : taken_costs(CANDIDATE_RANDOM_DISTANCE, 0.6f, 0.8f)) {
    EXPECT_LE(cost, 0.8f * 0.6f);
  }
  EXPECT_NE(taken_costs(CANDIDATE_RANDOM_DISTANCE, 0.24f), std::vector<float>());
}

Options small_patches() {
  Options options = wide_range("paper");
  options.window_radius = 2;
  return options;
}

/// The planes of `iterations` of the paper's search, all of which start with such checks.
cv::Mat planes_after(int iterations, std::optional<float> checks,
                     const Options& options = small_patches()) {
  KernelFixture fixture(fisheye_rig(48), options);
  fixture.set_reference(0);
  const auto over_pixels = [&](int colour, const auto& function) {
    fixture.pass().colour = colour;
    for (int y = 0; y < 48; ++y) {
      for (int x = colour < 0 ? 0 : (y + colour) % 2; x < 48; x += colour < 0 ? 1 : 2) {
        function(fixture.context(), ivec2{x, y});
      }
    }
  };
  over_pixels(-1, kernel::cpu::initialise_pixel);
  fixture.pass().neighbours = NEIGHBOUR_LEFT | NEIGHBOUR_RIGHT | NEIGHBOUR_UP | NEIGHBOUR_DOWN;
  for (int iteration = 1; iteration <= iterations; ++iteration) {
    fixture.pass().iteration = iteration;
    for (int colour = 0; colour < 2; ++colour) {
      if (checks) fixture.view(0).checks.setTo(cv::Scalar::all(*checks));
      over_pixels(colour, kernel::cpu::iterate_pixel);
    }
  }
  return fixture.view(0).hypotheses.clone();
}

/// As the paper says: distances from all of a quarter of the range around the held one, normals
/// from 180 and 90 degrees around it, halved from candidate to candidate.
TEST(Refinement, HalvesTheRangesEachTime) {
  Options options = wide_range("paper");
  options.min_distance = 1;
  options.max_distance = 41;
  KernelFixture fixture(fisheye_rig(size), options);
  fixture.set_reference(0);
  constexpr double quarter = 10, held_distance = 21;
  constexpr int neighbours = 4, refinements = 4;
  for (int i = 0; i < refinements; ++i) {
    const double share = std::pow(0.5, i);
    Spread distance;
    Spread turned;  // radians, about the ray; both of its angles together turn it at most so far
    for (int y = 24; y < 72; ++y) {
      for (int x = 24; x < 72; ++x) {
        const Eigen::Vector3d r = fixture.ray(0, {x, y});
        const vec3 held = to_kernel(r / held_distance);
        const Eigen::Vector3d m = to_eigen(kernel::cpu::candidate_plane(
            fixture.context(), {x, y}, to_kernel(r), kernel::vec4(held, 0.1f), neighbours + i));
        distance.add((1 / m.dot(r) - held_distance) / (quarter * share));
        turned.add(std::acos(std::min(std::abs(m.normalized().dot(r)), 1.0)) /
                   (std::numbers::pi * share));
      }
    }
    EXPECT_NEAR(distance.low, -1, 0.01) << i;
    EXPECT_NEAR(distance.mean, 0, 0.05) << i;
    EXPECT_NEAR(distance.high, 1, 0.01) << i;
    EXPECT_LT(turned.high, 1.5) << i;
    // Before, that is as far as an axis turns.
    if (i > 1) {
      EXPECT_GT(turned.high, 0.5) << i;
    }
  }
}

TEST(Refinement, TriesAsManyPlanesAsAsked) {
  std::vector<double> mean_costs;
  for (const int refinements : {0, 1, 4}) {
    Options options = small_patches();
    options.refinements = refinements;
    mean_costs.push_back(cv::mean(planes_after(1, std::nullopt, options))[3]);
  }
  EXPECT_LT(mean_costs[1], 0.98 * mean_costs[0]);
  EXPECT_LT(mean_costs[2], 0.98 * mean_costs[1]);
}

TEST(Propagation, TriesPlanesOnceWithTheBitsOfTryingThemAgain) {
  constexpr float always_new = 1e9f;
  constexpr float never_new = -1;
  const cv::Mat planes = planes_after(5, std::nullopt);
  EXPECT_TRUE(same_bits(planes, planes_after(5, always_new)));
  // And without their neighbours' planes pixels find worse ones.
  EXPECT_GT(cv::mean(planes_after(5, never_new))[3], 1.05 * cv::mean(planes)[3]);
}

TEST(Propagation, BeginsAnewWithEveryMatch) {
  // As another match left them.
  const cv::Mat planes = planes_after(1, std::nullopt);
  EXPECT_TRUE(same_bits(planes, planes_after(1, -1.0f)));
}

TEST(FarPreference, DecidesWithoutTextureAndYieldsToIt) {
  Options options = wide_range();
  options.far_preference = 0.08;
  KernelFixture fixture(fisheye_rig(96), options);
  const ivec2 pixel(48, 48);
  const cv::Vec4f r = fixture.view(0).rays(48, 48);
  const vec3 ray(r[0], r[1], r[2]);
  // `small`: difference of inverse distance up to which planes are as far as each other.
  const auto chosen_distance = [&](double held_distance, double held_cost, double distance,
                                   float small = 0) {
    const float w = static_cast<float>(1 / held_distance);
    const kernel::vec4 held(w * ray, static_cast<float>(held_cost));
    const kernel::vec4 better = kernel::cpu::better_of(
        fixture.context(), pixel, ray, held, static_cast<float>(1 / distance) * ray, small);
    return static_cast<double>(1 / (better.x * ray.x + better.y * ray.y + better.z * ray.z));
  };
  for (int view = 0; view < 2; ++view) fixture.view(view).image().setTo(0.5);
  fixture.interpolate();
  EXPECT_NEAR(chosen_distance(2, NO_INFORMATION_COST, 90), 90, 0.01) << "nothing to see: far";
  EXPECT_NEAR(chosen_distance(90, NO_INFORMATION_COST, 2), 90, 0.01);
  EXPECT_NEAR(chosen_distance(2, 0.9, 90), 2, 1e-4) << "a difference in cost outweighs it";
  EXPECT_NEAR(chosen_distance(30, NO_INFORMATION_COST, 40), 40, 0.01);
  EXPECT_NEAR(chosen_distance(30, NO_INFORMATION_COST, 40, 0.01f), 30, 0.01) << "as good as there";

  // On a gradient of brightness every plane matches well.
  for (int view = 0; view < 2; ++view) {
    cv::Mat image = fixture.view(view).image();
    gradient(image.size(), 0.005, 0, 0, 1).copyTo(image);
    image += 0.02 * smooth_noise(image.size(), view + 1);
  }
  fixture.interpolate();
  const double of_far = kernel::cpu::patch_cost(fixture.context(), pixel, (1.0f / 90) * ray);
  ASSERT_LT(of_far, 0.1);
  EXPECT_NEAR(chosen_distance(2, of_far / 1.03, 90), 90, 0.01) << "nearly as good";
  EXPECT_NEAR(chosen_distance(2, of_far / 1.12, 90), 2, 1e-4) << "a tenth worse";
}

TEST_F(Candidates, AreTriedByPixelsThatLostTheirPlane) {
  fixture_.hold_in_all_views(wall_);
  fixture_.view(0).hypotheses(middle, middle) = cv::Vec4f(0, 0, 0, INVALID_COST);
  fixture_.pass().candidates = 1u << STRIP_LEFT;
  fixture_.pass().tolerance = 2;
  kernel::cpu::search_pixel(fixture_.context(), {middle, middle});
  EXPECT_EQ(fixture_.view(0).hypotheses(middle, middle)[2], wall_.z);
}

TEST(FarPreference, TriesPlanesAgainWhoseTurnDependsOnWhatIsHeld) {
  for (const double preference : {0.0, 0.08}) {
    Options options = wide_range("paper");
    options.far_preference = preference;
    KernelFixture fixture(fisheye_rig(48), options);
    fixture.set_reference(0);
    fixture.pass().iteration = 5;
    fixture.pass().colour = 0;
    EXPECT_EQ(kernel::cpu::is_new_plane(fixture.context(), {24, 24}), preference > 0);
  }
}

}  // namespace
}  // namespace widestereo::test
