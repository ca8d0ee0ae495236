// SPDX-License-Identifier: MIT
// A box before a wall, seen by three cameras: what it hides in one source is seen in the other.
#include <gtest/gtest.h>

#include "match_fixture.h"
#include "synthesis/render.h"

namespace widestereo::test {
namespace {

using Pattern = synthesis::Paint::Pattern;

/// The reference between two sources, at these places on its x axis (metres).
Rig rig_between(double first, double second) {
  Camera camera;
  camera.width = 200;
  camera.height = 120;
  camera.fx = camera.fy = 160;
  camera.cx = 99.5;
  camera.cy = 59.5;
  Rig rig;
  for (const double x : {0.0, first, second}) {
    View& view = rig.views.emplace_back();
    view.name = "cam" + std::to_string(rig.views.size() - 1);
    view.camera = camera;
    view.world_from_camera = Eigen::Translation3d(x, 0, 0);
  }
  return rig;
}

RenderedPair render_box(const Rig& rig) {
  synthesis::Scene scene;
  scene.light = {0.5, -2, 0};
  const synthesis::Paint brick{{0.8, 0.8, 0.8}, {0.1, 0.1, 0.1}, Pattern::noise, 0.08, 0.5};
  const synthesis::Paint wood{{0.8, 0.8, 0.8}, {0.1, 0.1, 0.1}, Pattern::noise, 0.03, 0.5};
  scene.surfaces.push_back(make_plane(brick, {0, 0, 1}, 4));
  scene.surfaces.push_back(
      make_box(wood, Eigen::Isometry3d(Eigen::Translation3d(0, 0, 1.51)), {0.56, 0.6, 0.02}));
  return render(scene, rig, 1);
}

/// Whether the first source, which is the farther one and tells more where it sees a point, is to
/// the right of the reference.
class HiddenInOneSource : public ::testing::TestWithParam<bool> {};

INSTANTIATE_TEST_SUITE_P(Sides, HiddenInOneSource, ::testing::Bool());

TEST_P(HiddenInOneSource, IsMatchedInTheOther) {
  const double side = GetParam() ? 1 : -1;
  const RenderedPair scene = render_box(rig_between(0.12 * side, -0.1 * side));
  const ViewResult found = match_on_cpu(scene, Options::preset_named("fast"), 0.5, 20);

  const GroundTruth& truth = scene.views[0].truth;
  int pixels = 0;
  int wrong = 0;
  for (int y = 30; y < 90; ++y) {
    for (int x = 20; x < 180; ++x) {
      const float distance = truth.distance.at<float>(y, x);
      if (truth.occlusion.at<uchar>(y, x) != 0) continue;
      // Pixels beside the box show some of it.
      const float nearest =
          std::min(truth.distance.at<float>(y, x - 1), truth.distance.at<float>(y, x + 1));
      if (nearest < 0.9F * distance) continue;
      ++pixels;
      wrong += std::abs(found.distance.at<float>(y, x) / distance - 1) > 0.1F ? 1 : 0;
    }
  }
  ASSERT_GT(pixels, 100) << "hidden in the first source";
  RecordProperty("wrong", std::to_string(static_cast<double>(wrong) / pixels));
  EXPECT_LT(wrong, 0.02 * pixels) << "of " << pixels;
}

}  // namespace
}  // namespace widestereo::test
