// SPDX-License-Identifier: MIT
#include "vulkan/atlas.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <random>

namespace widestereo {
namespace {

/// Sizes of `count` views at so many levels, as a schedule halves them.
std::vector<cv::Size> pyramid_of(cv::Size finest, int count, int levels) {
  std::vector<cv::Size> sizes;
  for (int level = 0; level < levels; ++level) {
    sizes.insert(sizes.end(), static_cast<std::size_t>(count), finest);
    finest = {(finest.width + 1) / 2, (finest.height + 1) / 2};
  }
  return sizes;
}

/// Each view lies inside its layer, apart from all others.
void expect_apart(const std::vector<cv::Size>& sizes) {
  const Atlas atlas = pack_views(sizes);
  ASSERT_EQ(atlas.places.size(), sizes.size());
  std::vector<cv::Mat_<int>> taken;
  for (int i = 0; i < atlas.layers; ++i) taken.emplace_back(atlas.size, 0);
  for (std::size_t view = 0; view < sizes.size(); ++view) {
    const Atlas::Place& place = atlas.places[view];
    const cv::Rect area(place.origin, sizes[view]);
    ASSERT_EQ(area & cv::Rect({0, 0}, atlas.size), area) << view;
    cv::Mat part = taken.at(static_cast<std::size_t>(place.layer))(area);
    EXPECT_EQ(cv::countNonZero(part), 0) << view;
    part.setTo(1);
  }
}

TEST(Atlas, CoarseLevelsShareLayers) {
  const auto layers = [](int views, int levels) {
    return pack_views(pyramid_of({512, 512}, views, levels)).layers;
  };
  EXPECT_EQ(layers(2, 1), 2);
  EXPECT_EQ(layers(2, 3), 2 + 1);
  EXPECT_EQ(layers(3, 3), 3 + 1);
  EXPECT_EQ(layers(5, 3), 5 + 2);
  EXPECT_EQ(layers(4, 4), 4 + 2);
}

TEST(Atlas, OddSidesFitAsWell) {
  for (const cv::Size size : {cv::Size(512, 512), cv::Size(641, 477), cv::Size(33, 1025)}) {
    EXPECT_EQ(pack_views(pyramid_of(size, 2, 3)).layers, 3) << size;
  }
}

TEST(Atlas, LayersAreNoLargerThanNeeded) {
  EXPECT_EQ(pack_views(pyramid_of({641, 477}, 2, 1)).size, cv::Size(641, 477));
  EXPECT_EQ(pack_views(pyramid_of({512, 512}, 2, 3)).size, cv::Size(512, 512));
}

TEST(Atlas, ViewsOfAnySizesLieApart) {
  std::mt19937 random(1);
  std::uniform_int_distribution<int> side(2, 300);
  std::uniform_int_distribution<int> count(1, 16);
  for (int i = 0; i < 50; ++i) {
    std::vector<cv::Size> sizes(static_cast<std::size_t>(count(random)));
    for (cv::Size& size : sizes) size = {side(random), side(random)};
    expect_apart(sizes);
  }
  expect_apart(pyramid_of({641, 477}, 5, 3));
}

}  // namespace
}  // namespace widestereo
