// SPDX-License-Identifier: MIT
#include "vulkan/atlas.h"

#include <algorithm>
#include <numeric>

namespace widestereo {
namespace {

struct FreeArea {
  int layer = 0;
  cv::Rect area;
};

bool fits(cv::Size size, const FreeArea& place) {
  return size.width <= place.area.width && size.height <= place.area.height;
}

/// Of a new layer: halves and quarters of odd sides fit beside each other.
cv::Size layer_limits(const std::vector<cv::Size>& sizes) {
  constexpr int multiple = 8;
  int width = 0;
  int height = 0;
  for (const cv::Size& size : sizes) {
    width = std::max(width, size.width);
    height = std::max(height, size.height);
  }
  const auto limit = [](int side) { return (side + multiple - 1) / multiple * multiple; };
  return {limit(width), limit(height)};
}

}  // namespace

Atlas pack_views(const std::vector<cv::Size>& sizes) {
  std::vector<std::size_t> order(sizes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](auto a, auto b) { return sizes[a].area() > sizes[b].area(); });

  const cv::Size limits = layer_limits(sizes);
  Atlas atlas;
  atlas.places.resize(sizes.size());
  std::vector<FreeArea> free;
  for (const std::size_t view : order) {
    const cv::Size taken = sizes[view];
    // The smallest area that holds it; what it leaves is cut in two, beside and below.
    const auto smaller = [&](const FreeArea& a, const FreeArea& b) {
      return std::pair(!fits(taken, a), a.area.area()) < std::pair(!fits(taken, b), b.area.area());
    };
    auto place = std::min_element(free.begin(), free.end(), smaller);
    if (place == free.end() || !fits(taken, *place)) {
      place = free.insert(free.end(), {atlas.layers++, cv::Rect({0, 0}, limits)});
    }
    const auto [layer, area] = *place;
    *place = {layer, {area.x + taken.width, area.y, area.width - taken.width, taken.height}};
    free.push_back(
        {layer, {area.x, area.y + taken.height, area.width, area.height - taken.height}});
    atlas.places[view] = {area.tl(), layer};
    atlas.size = {std::max(atlas.size.width, area.x + taken.width),
                  std::max(atlas.size.height, area.y + taken.height)};
  }
  return atlas;
}

}  // namespace widestereo
