// SPDX-License-Identifier: MIT
#include "widestereo/pictures.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "geometry/distance.h"
#include "geometry/validation.h"
#include "io/bgr8.h"
#include "statistics/percentile.h"
#include "text/formatted.h"
#include "text/number.h"
#include "text/size_text.h"
#include "widestereo/error.h"
#include "widestereo/matcher.h"

namespace widestereo {
namespace {

const cv::Scalar no_value(48, 48, 48);
const cv::Scalar paper_colour(255, 255, 255);
const cv::Scalar ink(30, 30, 30);

/// Colours (BGR) of named_reasons.
const std::array<cv::Vec3b, named_reasons.size()> reason_colours = {{{48, 48, 48},
                                                                     {160, 90, 40},
                                                                     {200, 200, 60},
                                                                     {60, 60, 220},
                                                                     {40, 150, 250},
                                                                     {190, 80, 190},
                                                                     {120, 220, 120},
                                                                     {200, 150, 250},
                                                                     {60, 200, 250},
                                                                     {230, 80, 40},
                                                                     {150, 150, 150},
                                                                     {110, 110, 160}}};

/// `share` in [0, 1] through a colour map; pixels where `valid` is 0 get the colour of no value.
cv::Mat coloured(const cv::Mat& share, const cv::Mat& valid, int map) {
  cv::Mat levels;
  share.convertTo(levels, CV_8U, 255);
  cv::Mat picture;
  cv::applyColorMap(levels, picture, map);
  picture.setTo(no_value, valid == 0);
  return picture;
}

double text_scale(const cv::Mat& picture) { return std::max(0.35, picture.cols / 900.0); }

/// What the ends of a legend need.
constexpr int least_width = 128;

/// The picture above an empty strip for a legend, and beside one if it is too narrow.
cv::Mat with_strip(const cv::Mat& picture, int height) {
  require_type(picture, CV_8UC3, "The picture");
  cv::Mat result;
  cv::copyMakeBorder(picture, result, 0, height, 0, std::max(0, least_width - picture.cols),
                     cv::BORDER_CONSTANT | cv::BORDER_ISOLATED, paper_colour);
  return result;
}

int thickness_of_text(double scale) { return scale > 0.8 ? 2 : 1; }

cv::Size text_size(const std::string& text, double scale) {
  int base = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, scale, thickness_of_text(scale), &base);
}

/// Columns of a text at `x`, within a picture's.
cv::Range extent(const std::string& text, int x, double scale, double align, int columns) {
  const int width = text_size(text, scale).width;
  const int begin =
      std::clamp(x - static_cast<int>(align * width), 2, std::max(2, columns - width - 2));
  return {begin, begin + width};
}

void put_text(cv::Mat& picture, const std::string& text, cv::Point at, double scale,
              double align = 0) {
  const int x = extent(text, at.x, scale, align, picture.cols).start;
  cv::putText(picture, text, {x, at.y}, cv::FONT_HERSHEY_SIMPLEX, scale, ink,
              thickness_of_text(scale), cv::LINE_AA);
}

std::string metres(double value) {
  // Of a model in its own unit, two digits.
  const char* form = value < 0.1 ? "%.2g" : value < 1 ? "%.2f" : value < 10 ? "%.1f" : "%.0f";
  return formatted(form, value);
}

/// A horizontal bar from share 0 to 1 with labels at given shares, from one end to the other one;
/// those between are left out where they would touch others.
cv::Mat with_bar(const cv::Mat& picture, int map,
                 const std::vector<std::pair<double, std::string>>& labels) {
  const double scale = text_scale(picture);
  const int line = static_cast<int>(30 * scale);
  const int margin = line / 2;
  cv::Mat result = with_strip(picture, 3 * line);
  const cv::Rect bar(margin, picture.rows + line / 2, result.cols - 2 * margin, line);
  cv::Mat ramp(1, bar.width, CV_32F);
  for (int x = 0; x < bar.width; ++x) {
    ramp.at<float>(0, x) = static_cast<float>(x) / static_cast<float>(bar.width - 1);
  }
  cv::Mat colours = coloured(ramp, cv::Mat(ramp.size(), CV_8U, 255), map);
  cv::resize(colours, result(bar), bar.size(), 0, 0, cv::INTER_NEAREST);
  cv::rectangle(result, bar, ink, 1);
  const auto place_of = [&](std::size_t label) {
    return bar.x + static_cast<int>(labels[label].first * (bar.width - 1));
  };
  const auto extent_of = [&](std::size_t label) {
    return extent(labels[label].second, place_of(label), scale, 0.5, result.cols);
  };
  const int apart = line / 2;
  const std::size_t last = labels.size() - 1;
  int taken = -apart;
  for (std::size_t i = 0; i <= last; ++i) {
    const cv::Range here = extent_of(i);
    const bool is_end = i == 0 || i == last;
    if (!is_end && (here.start < taken + apart || here.end + apart > extent_of(last).start)) {
      continue;
    }
    taken = here.end;
    const int x = place_of(i);
    cv::line(result, {x, bar.y + bar.height}, {x, bar.y + bar.height + line / 5}, ink, 1);
    put_text(result, labels[i].second, {x, bar.y + bar.height + line}, scale, 0.5);
  }
  return result;
}

void require_ascending(double low, double high, const std::string& what) {
  if (low < high && std::isfinite(high - low)) return;
  throw Error("Colours from " + text_of(low) + " to " + text_of(high) + " show no " + what +
              "; give a lower and a higher one.");
}

void require_range(const ColourRange& range) {
  require_ascending(range.nearest, range.farthest, "distances");
  if (range.nearest > 0) return;
  throw Error("Colours from the distance " + text_of(range.nearest) +
              " on have no inverse distance; give a positive one.");
}

}  // namespace

ColourRange robust_range(const cv::Mat& distance) {
  require_type(distance, CV_32FC1, "The distance map");
  std::vector<float> inverse;
  for (auto it = distance.begin<float>(); it != distance.end<float>(); ++it) {
    if (has_distance(*it)) inverse.push_back(1 / *it);
  }
  if (inverse.empty()) return {1, 10};
  const double low = static_cast<double>(percentile(inverse, 0.02));
  const double high = std::max(static_cast<double>(percentile(inverse, 0.98)), low * 1.01);
  return {1 / high, 1 / low};
}

cv::Mat distance_picture(const cv::Mat& distance, const ColourRange& range) {
  require_type(distance, CV_32FC1, "The distance map");
  require_range(range);
  const double low = 1 / range.farthest;
  const double high = 1 / range.nearest;
  cv::Mat valid(distance.size(), CV_8UC1);
  std::transform(distance.begin<float>(), distance.end<float>(), valid.begin<uchar>(),
                 [](float value) { return has_distance(value) ? uchar{255} : uchar{0}; });
  cv::Mat share;
  cv::divide(1.0, distance, share, CV_32F);
  share = (share - low) / (high - low);
  share.setTo(0, ~valid);
  return coloured(share, valid, cv::COLORMAP_TURBO);
}

cv::Mat normal_picture(const cv::Mat& normals) {
  require_type(normals, CV_32FC3, "The normal map");
  cv::Mat picture(normals.size(), CV_8UC3, no_value);
  const auto level = [](float share) { return cv::saturate_cast<uchar>(255 * share); };
  for (int y = 0; y < normals.rows; ++y) {
    for (int x = 0; x < normals.cols; ++x) {
      const cv::Vec3f& n = normals.at<cv::Vec3f>(y, x);
      const float squared_length = n.dot(n);
      if (!(squared_length >= 0.25f) || std::isinf(squared_length)) continue;  // NaN, too
      picture.at<cv::Vec3b>(y, x) = {level((1 - n[2]) / 2), level((1 - n[1]) / 2),
                                     level((1 + n[0]) / 2)};
    }
  }
  return picture;
}

cv::Mat scalar_picture(const cv::Mat& map, double low, double high) {
  require_type(map, CV_32FC1, "The map to show");
  require_ascending(low, high, "values");
  return coloured((map - low) / (high - low), map == map, cv::COLORMAP_VIRIDIS);  // NaN: no value
}

cv::Mat reason_picture(const cv::Mat& reasons, const cv::Mat& image) {
  require_image(image, "The image");
  require_map(reasons, image.size(), CV_16UC1, "The map of reasons");
  cv::Mat picture = to_bgr8(image);
  // The lowest bit that is set shows, but what was filled shows as that.
  const auto show = [&](std::size_t bit) {
    picture.setTo(reason_colours[bit], (reasons & (1 << bit)) != 0);
  };
  for (std::size_t bit = named_reasons.size(); bit-- > 0;) show(bit);
  show(std::countr_zero(static_cast<unsigned>(reason_filled)));
  return picture;
}

cv::Mat cloud_picture(const PointCloud& cloud, const Eigen::Isometry3d& world_from_viewer,
                      cv::Size size) {
  if (size.width < 1 || size.height < 1) {
    throw Error("A picture of a cloud cannot have " + size_text(size.width, size.height) +
                " pixels; give one or more both ways.");
  }
  cv::Mat picture(size, CV_8UC3, no_value);
  cv::Mat_<float> nearest(size, std::numeric_limits<float>::max());
  const Eigen::Isometry3d viewer = world_from_viewer.inverse();
  const float focal = 0.5f * static_cast<float>(size.width);
  const Eigen::Vector2f centre(0.5f * static_cast<float>(size.width - 1),
                               0.5f * static_cast<float>(size.height - 1));
  for (const CloudPoint& point : cloud) {
    const Eigen::Vector3f p = (viewer * point.position.cast<double>()).cast<float>();
    if (p.z() <= 0) continue;
    const Eigen::Vector2f pixel = centre + focal / p.z() * p.head<2>();
    // Told before the conversion to whole numbers, which may overflow; false for NaN.
    const bool is_inside = pixel.x() >= -1 && pixel.x() <= static_cast<float>(size.width) &&
                           pixel.y() >= -1 && pixel.y() <= static_cast<float>(size.height);
    if (!is_inside) continue;
    const cv::Point at(cvRound(pixel.x()), cvRound(pixel.y()));
    const cv::Rect dot = cv::Rect(at.x - 1, at.y - 1, 3, 3) & cv::Rect({}, size);
    for (int y = dot.y; y < dot.y + dot.height; ++y) {
      for (int x = dot.x; x < dot.x + dot.width; ++x) {
        if (p.z() >= nearest(y, x)) continue;
        nearest(y, x) = p.z();
        picture.at<cv::Vec3b>(y, x) = {point.blue, point.green, point.red};
      }
    }
  }
  return picture;
}

cv::Mat with_distance_legend(const cv::Mat& picture, const ColourRange& range,
                             const std::string& unit) {
  require_range(range);
  std::vector<std::pair<double, std::string>> labels;
  const double low = 1 / range.farthest;
  const double high = 1 / range.nearest;
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    labels.emplace_back(share, metres(1 / (low + share * (high - low))) + unit);
  }
  return with_bar(picture, cv::COLORMAP_TURBO, labels);
}

cv::Mat with_scalar_legend(const cv::Mat& picture, double low, double high) {
  return with_bar(picture, cv::COLORMAP_VIRIDIS,
                  {{0.0, metres(low)}, {0.5, metres((low + high) / 2)}, {1.0, metres(high)}});
}

cv::Mat with_reason_legend(const cv::Mat& picture) {
  const double scale = text_scale(picture);
  const int line = static_cast<int>(30 * scale);
  const double text = scale * 0.7;
  int widest = 0;
  for (const auto& reason : named_reasons) {
    widest = std::max(widest, text_size(reason.name, text).width);
  }
  const int count = static_cast<int>(named_reasons.size());
  const int columns = std::clamp(picture.cols / (line + widest + line / 4), 1, 4);
  const int rows = (count + columns - 1) / columns;
  cv::Mat result = with_strip(picture, (2 + 5 * rows) * line / 4);
  const int column = result.cols / columns;
  for (int i = 0; i < count; ++i) {
    const cv::Point at(line / 2 + i % columns * column,
                       picture.rows + line / 2 + i / columns * line * 5 / 4);
    const cv::Rect box(at.x, at.y, line * 2 / 3, line * 2 / 3);
    cv::rectangle(result, box, cv::Scalar(reason_colours[i]), cv::FILLED);
    put_text(result, named_reasons[i].name, {at.x + line, at.y + line * 2 / 3}, text);
  }
  return result;
}

cv::Mat panel_sheet(const std::vector<Panel>& panels, int columns) {
  if (panels.empty() || columns < 1) {
    throw Error("A sheet of " + std::to_string(panels.size()) + " panels in " +
                std::to_string(columns) + " columns is empty; give one or more of both.");
  }
  const int width = std::max(panels.front().picture.cols, least_width);
  const double scale = std::max(0.45, width / 700.0);
  const int title = static_cast<int>(36 * scale);
  const int gap = title / 3;
  std::vector<cv::Mat> pictures;
  int height = 0;
  int cell = width;  // as wide as the widest title
  for (const Panel& panel : panels) {
    require_image(panel.picture, "The panel " + panel.title);
    cv::Mat picture = with_strip(to_bgr8(panel.picture), 0);
    const double factor = static_cast<double>(width) / picture.cols;
    cv::resize(picture, picture, {width, std::max(1, static_cast<int>(picture.rows * factor))}, 0,
               0, factor < 1 ? cv::INTER_AREA : cv::INTER_NEAREST);
    height = std::max(height, picture.rows);
    cell = std::max(cell, text_size(panel.title, scale).width);
    pictures.push_back(picture);
  }
  columns = std::min(columns, static_cast<int>(panels.size()));
  const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
  cv::Mat sheet(rows * (height + title + gap) + gap, columns * (cell + gap) + gap, CV_8UC3,
                paper_colour);
  for (int i = 0; i < static_cast<int>(panels.size()); ++i) {
    const cv::Point corner(gap + i % columns * (cell + gap),
                           gap + i / columns * (height + title + gap));
    put_text(sheet, panels[i].title, {corner.x + cell / 2, corner.y + title * 3 / 4}, scale, 0.5);
    const cv::Point place = corner + cv::Point((cell - width) / 2, title);
    pictures[i].copyTo(sheet(cv::Rect(place, pictures[i].size())));
  }
  return sheet;
}

}  // namespace widestereo
