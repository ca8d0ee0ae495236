// SPDX-License-Identifier: MIT
#include "benchmark_plot.h"

#include <algorithm>
#include <cmath>

#include "text/formatted.h"

namespace ws = widestereo;

namespace {

constexpr double left = 290;   // of the axis; labels are left of it
constexpr double right = 760;  // values are right of it
constexpr double width = 1000;
constexpr double top = 76;
constexpr double row_height = 34;
constexpr const char* wall_colour = "#c6dbef";
constexpr const char* device_colour = "#3b7fbd";
constexpr const char* roofline_colour = "#d1495b";

std::string escaped(const std::string& plain) {
  std::string result;
  for (const char c : plain) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else {
      result += c;
    }
  }
  return result;
}

std::string label(double x, double y, const char* anchor, const std::string& content) {
  return ws::formatted("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\">", x, y, anchor) +
         escaped(content) + "</text>\n";
}

std::string rectangle(double x0, double x1, double y, double height, const char* colour) {
  return ws::formatted("<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"/>\n",
                       x0, y, std::max(x1 - x0, 0.5), height, colour);
}

std::string line(double x0, double y0, double x1, double y1, const char* colour, double thickness) {
  return ws::formatted(
      "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"%s\" "
      "stroke-width=\"%.1f\"/>\n",
      x0, y0, x1, y1, colour, thickness);
}

/// Three significant digits, no exponent.
std::string number(double value) {
  const int digits = static_cast<int>(std::floor(std::log10(std::max(value, 1e-6))));
  return ws::formatted("%.*f", std::clamp(2 - digits, 0, 6), value);
}

/// Places of times on the picture, and the times marked below it.
class Axis {
 public:
  explicit Axis(const std::vector<PlotBar>& bars) {
    double smallest = 1e30;
    for (const PlotBar& bar : bars) {
      largest_ = std::max({largest_, bar.wall_max, bar.device, bar.roofline.milliseconds, 1e-6});
      for (const double time : {bar.wall_min, bar.device, bar.roofline.milliseconds}) {
        if (time > 0) smallest = std::min(smallest, time);
      }
    }
    logarithmic_ = largest_ > 30 * smallest;
    if (logarithmic_) {
      first_ = std::pow(10, std::floor(std::log10(smallest)));
      for (double mark = first_; mark <= largest_; mark *= 10) marks_.push_back(mark);
    } else {
      const double decade = std::pow(10, std::floor(std::log10(largest_)));
      const double step = largest_ < 2 * decade   ? decade / 4
                          : largest_ < 5 * decade ? decade / 2
                                                  : decade;
      for (double mark = 0; mark <= largest_; mark += step) marks_.push_back(mark);
    }
  }
  double at(double milliseconds) const {
    const double share = logarithmic_ ? std::log(std::max(milliseconds, first_) / first_) /
                                            std::log(largest_ / first_)
                                      : milliseconds / largest_;
    return left + share * (right - left);
  }
  const std::vector<double>& marks() const { return marks_; }
  bool logarithmic() const { return logarithmic_; }

 private:
  std::vector<double> marks_;
  double largest_ = 0;
  double first_ = 0;
  bool logarithmic_ = false;
};

std::string legend(const Axis& axis) {
  const std::string scale = axis.logarithmic() ? ", logarithmic" : "";
  std::string svg =
      "<text x=\"16\" y=\"26\" font-size=\"17\">Milliseconds per depth map" + scale + "</text>\n";
  svg += rectangle(16, 40, 42, 12, wall_colour) +
         label(46, 53, "start", "wall time, median; line: fastest to slowest");
  svg += rectangle(332, 356, 42, 12, device_colour) + label(362, 53, "start", "on the device");
  svg += line(478, 40, 478, 56, roofline_colour, 3) +
         label(486, 53, "start", "roofline: the device's peak allows no less");
  return svg;
}

std::string row(const PlotBar& bar, const Axis& axis, double y) {
  std::string svg = label(left - 10, y + 18, "end", bar.label);
  svg += rectangle(left, axis.at(bar.wall), y + 4, 20, wall_colour);
  svg += rectangle(left, axis.at(bar.device), y + 9, 10, device_colour);
  svg += line(axis.at(bar.wall_min), y + 14, axis.at(bar.wall_max), y + 14, "#222", 1.2);
  for (const double end : {bar.wall_min, bar.wall_max}) {
    svg += line(axis.at(end), y + 9, axis.at(end), y + 19, "#222", 1.2);
  }
  std::string value = number(bar.wall) + " (" + number(bar.device) + ")";
  const double least = bar.roofline.milliseconds;
  if (least > 0) svg += line(axis.at(least), y + 2, axis.at(least), y + 26, roofline_colour, 3);
  if (const auto share = bar.roofline.share_of(bar.device)) {
    value += ws::formatted(", %.0f %% of ", 100 * *share) + bar.roofline.bound;
  }
  return svg + label(right + 10, y + 18, "start", value);
}

}  // namespace

std::string benchmark_plot(const std::vector<PlotBar>& bars) {
  const Axis axis(bars);
  const double bottom = top + row_height * static_cast<double>(bars.size());
  std::string svg = ws::formatted(
                        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" "
                        "font-family=\"sans-serif\" font-size=\"13\">\n",
                        width, bottom + 34) +
                    "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n" + legend(axis);
  for (const double mark : axis.marks()) {
    svg += line(axis.at(mark), top - 4, axis.at(mark), bottom + 4, "#ddd", 1);
    svg += label(axis.at(mark), bottom + 20, "middle", ws::formatted("%g", mark));
  }
  double y = top;
  for (const PlotBar& bar : bars) {
    svg += row(bar, axis, y);
    y += row_height;
  }
  return svg + "</svg>\n";
}
