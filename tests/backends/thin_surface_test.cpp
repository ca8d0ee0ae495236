// SPDX-License-Identifier: MIT
// Poles and a ball of a few pixels before a wall: the search must find them, regression, repair and
// vote must leave them, though nearly all that is around lies on the wall.
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "match_fixture.h"
#include "synthesis/render.h"

namespace widestereo::test {
namespace {

using Eigen::Vector3d;
using Pattern = synthesis::Paint::Pattern;

constexpr int size = 192;
constexpr double wall_z = 3;  // metres
constexpr double pole_z = 1.5;

/// A textured wall alone.
synthesis::Scene wall() {
  synthesis::Scene scene;
  scene.light = {0.5, -2, 0};
  const synthesis::Paint brick{{0.7, 0.6, 0.5}, {0.35, 0.3, 0.3}, Pattern::noise, 0.3, 1.2};
  scene.surfaces.push_back(make_plane(brick, {0, 0, 1}, wall_z));
  return scene;
}

/// Poles, about five pixels wide, whose points are displaced by two pixels from those of the wall
/// behind.
RenderedPair render_poles() {
  synthesis::Scene scene = wall();
  const synthesis::Paint wood{{0.75, 0.7, 0.6}, {0.6, 0.55, 0.5}, Pattern::noise, 0.1, 0.6};
  for (const double x : {-0.9, -0.3, 0.3, 0.9}) {
    scene.surfaces.push_back(make_cylinder(wood, {x, 0, pole_z}, 0.065, 6));
  }
  return render(scene, demo_rig(size), 1);
}

/// How bright the source is, the reference being 1.
class ThinSurfaces : public ::testing::TestWithParam<double> {};

INSTANTIATE_TEST_SUITE_P(Exposures, ThinSurfaces, ::testing::Values(1, 0.7));

TEST_P(ThinSurfaces, StayBeforeAWall) {
  RenderedPair pair = render_poles();
  pair.views[1].image.convertTo(pair.views[1].image, -1, GetParam());
  const ViewResult view = match_on_cpu(pair, Options::preset_named("fast"), 0.5, 20);

  const GroundTruth& truth = pair.views[0].truth;
  int pixels = 0;
  int lost = 0;
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const double distance = static_cast<double>(truth.distance.at<float>(y, x));
      Vector3d ray;
      if (truth.occlusion.at<uchar>(y, x) != 255) continue;
      if (!unproject(pair.rig.views[0].camera, {x, y}, ray)) continue;
      // Where poles are thin, and not seen from far below.
      const double z = distance * ray.z();
      if (z > 0.5 * (pole_z + wall_z) || std::abs(distance * ray.y()) > 1.5) continue;
      ++pixels;
      // Half way to the wall, in displacement.
      const double found = static_cast<double>(view.distance.at<float>(y, x)) * ray.z();
      lost += found == 0 || 1 / found < 0.5 * (1 / pole_z + 1 / wall_z) ? 1 : 0;
    }
  }
  ASSERT_GT(pixels, 500);
  RecordProperty("lost", std::to_string(static_cast<double>(lost) / pixels));
  EXPECT_LT(lost, 0.06 * pixels) << "of " << pixels;
}

/// A ball three pixels of the coarsest image wide, which moves by four of them.
TEST(SmallNearSurfaces, AreFoundThoughTheCoarsestImageHidesThem) {
  constexpr int side = 288;
  constexpr double ball_distance = 0.33;
  synthesis::Scene scene = wall();
  const synthesis::Paint cloth{{0.8, 0.3, 0.2}, {0.3, 0.6, 0.8}, Pattern::noise, 0.01, 1.2};
  scene.surfaces.push_back(make_sphere(cloth, {0.05, 0.02, ball_distance}, 0.045));
  const RenderedPair pair = render(scene, demo_rig(side), 1);
  Options options = Options::preset_named("fast");
  options.levels = 4;
  const ViewResult view = match_on_cpu(pair, options, 0.2, 20);
  const GroundTruth& truth = pair.views[0].truth;
  const cv::Mat on_ball = (truth.distance > 0) & (truth.distance < 2 * ball_distance);
  const cv::Mat found = (view.distance > 0) & (view.distance < 2 * ball_distance) & on_ball;
  const int pixels = cv::countNonZero(on_ball);
  ASSERT_GT(pixels, 200);
  RecordProperty("found",
                 std::to_string(cv::countNonZero(found)) + " of " + std::to_string(pixels));
  EXPECT_GT(cv::countNonZero(found), 0.7 * pixels) << "none without candidates of other surfaces";
}

}  // namespace
}  // namespace widestereo::test
