// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include "command_line/command_fixture.h"
#include "non_occluded.h"
#include "widestereo/calibration.h"
#include "widestereo/evaluation.h"
#include "widestereo/image_io.h"
#include "widestereo/synthesis.h"

namespace widestereo::test {
namespace {

TEST(OpenCvBaseline, IsRightAtMostPixelsOfTheDemoScene) {
  const RenderedPair pair = render_demo(256);
  const TemporaryFolder folder;
  const auto file = [&](const char* name) { return (folder / name).string(); };
  write_kalibr(file("calib.yaml"), pair.rig);
  write_image(file("left.png"), pair.views[0].image);
  write_image(file("right.png"), pair.views[1].image);
  const auto [nearest, farthest] = demo_distance_range();
  const Outcome outcome =
      run(file("left.png") + " " + file("right.png") + " -c " + file("calib.yaml") + " -o " +
          file("out") + " --min-distance " + std::to_string(nearest) + " --max-distance " +
          std::to_string(farthest));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const cv::Mat distance = read_map(file("out") + "/distance0.tiff");
  const std::vector<RegionScores> scores =
      evaluate(distance, {}, pair.views[0].truth, pair.rig.views[0], pair.rig.views[1]);
  EXPECT_LT(non_occluded(scores).bad_relative.at(0.05), 0.3) << to_table(scores);
  EXPECT_LT(non_occluded(scores).bad_pixels.at(1), 0.1) << to_table(scores);
  EXPECT_GT(non_occluded(scores).completeness, 0.9) << to_table(scores);

  const Outcome missing = run(file("left.png") + " " + file("none.png") + " -c " +
                              file("calib.yaml") + " -o " + file("out"));
  EXPECT_EQ(missing.exit_code, 1);
  EXPECT_NE(missing.output.find("none.png"), std::string::npos) << missing.output;
}

}  // namespace
}  // namespace widestereo::test
