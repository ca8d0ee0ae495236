// SPDX-License-Identifier: MIT
// What averaging over the views is worth where the truth is known.
#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "match_fixture.h"

namespace widestereo::test {
namespace {

TEST(MergedViews, AreMoreAccurateThanEachAlone) {
  RenderedPair pair = render_demo(128);
  cv::RNG random(1);
  for (RenderedView& view : pair.views) {
    cv::Mat noise(view.image.size(), CV_16SC3);
    random.fill(noise, cv::RNG::NORMAL, 0, 4);
    cv::add(view.image, noise, view.image, cv::noArray(), CV_8U);
  }
  const auto [nearest, farthest] = demo_distance_range();
  const auto match = [&, nearest = nearest, farthest = farthest](bool merge) {
    Options options = Options::preset_named("fast");
    options.merge_views = merge;
    return match_on_cpu(pair, options, nearest, farthest);
  };
  const auto scores_of = [&](const ViewResult& view) {
    return non_occluded(
        evaluate(view.distance, {}, pair.views[0].truth, pair.rig.views[0], pair.rig.views[1]));
  };
  const ViewResult of_one = match(false);
  const ViewResult of_both = match(true);
  const RegionScores alone = scores_of(of_one);
  const RegionScores merged = scores_of(of_both);
  RecordProperty("median_alone", std::to_string(alone.median_pixels));
  RecordProperty("median_merged", std::to_string(merged.median_pixels));
  EXPECT_LT(merged.median_pixels, alone.median_pixels);
  EXPECT_LT(merged.bad_relative.at(0.02), 0.99 * alone.bad_relative.at(0.02));
  EXPECT_LT(merged.bad_pixels.at(1), alone.bad_pixels.at(1) + 0.002) << "surfaces stay apart";
  const auto disagreeing = [](const ViewResult& view) {
    return cv::countNonZero((view.reasons & static_cast<int>(reason_inconsistent)) != 0);
  };
  EXPECT_LT(disagreeing(of_both), disagreeing(of_one));
}

}  // namespace
}  // namespace widestereo::test
