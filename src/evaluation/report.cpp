// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>

#include "evaluation/ground_truth.h"
#include "geometry/distance.h"
#include "text/formatted.h"
#include "widestereo/evaluation.h"

namespace widestereo {
namespace {

/// A number of a table, "-" where there is none.
std::string cell(const char* format, double value) {
  const std::string text = formatted(format, value);
  return std::isnan(value) ? std::string(text.size() - 1, ' ') + "-" : text;
}

nlohmann::ordered_json shares(const std::map<double, double>& bad) {
  nlohmann::ordered_json json;
  for (const auto& [threshold, share] : bad) json[nlohmann::json(threshold).dump()] = share;
  return json;
}

}  // namespace

std::string to_table(const std::vector<RegionScores>& scores) {
  std::string table =
      formatted("%-17s %8s %6s | %26s | %19s | %7s %7s %7s %7s | %s\n", "region", "pixels", "compl",
                "bad 0.5   1   2   5 % of d", "bad 0.5   1   2 px", "med px", "med %", "MAE m",
                "RMSE m", "normals med, mean deg");
  for (const RegionScores& s : scores) {
    if (s.pixels == 0) continue;
    table += formatted("%-17s %8ld %5.1f%% |", s.region.c_str(), s.pixels, 100 * s.completeness);
    for (const auto& [threshold, share] : s.bad_relative) table += cell(" %5.1f%%", 100 * share);
    table += " |";
    for (const auto& [threshold, share] : s.bad_pixels) table += cell(" %5.1f%%", 100 * share);
    table += " |" + cell(" %7.3f", s.median_pixels) + cell(" %7.3f", 100 * s.median_relative) +
             cell(" %7.4f", s.mean_absolute) + cell(" %7.4f", s.root_mean_square) + " |";
    if (!std::isnan(s.mean_normal_angle)) {
      table += formatted(" %5.1f %5.1f", s.median_normal_angle, s.mean_normal_angle);
    }
    table += "\n";
  }
  return table;
}

std::string to_json(const std::vector<RegionScores>& scores) {
  nlohmann::ordered_json json = nlohmann::json::array();
  for (const RegionScores& s : scores) {
    json.push_back({{"region", s.region},
                    {"pixels", s.pixels},
                    {"completeness", s.completeness},
                    {"bad_relative", shares(s.bad_relative)},
                    {"bad_relative_predicted", shares(s.bad_relative_predicted)},
                    {"bad_pixels", shares(s.bad_pixels)},
                    {"bad_pixels_predicted", shares(s.bad_pixels_predicted)},
                    {"median_pixels", s.median_pixels},
                    {"median_relative", s.median_relative},
                    {"median_absolute", s.median_absolute},
                    {"mean_absolute", s.mean_absolute},
                    {"root_mean_square", s.root_mean_square},
                    {"mean_normal_angle", s.mean_normal_angle},
                    {"median_normal_angle", s.median_normal_angle}});
  }
  return json.dump(2);
}

std::string to_table(const FarScores& scores) {
  const std::string right = scores.pixels == 0 ? "-" : formatted("%.1f%%", 100 * scores.right);
  return formatted("without ground truth: %ld pixels, %s within 2 px of %g m\n", scores.pixels,
                   right.c_str(), scores.distance);
}

std::string to_json(const FarScores& scores) {
  const nlohmann::ordered_json json = {
      {"distance", scores.distance}, {"pixels", scores.pixels}, {"right", scores.right}};
  return json.dump(2);
}

std::string to_table(const std::vector<SparsificationPoint>& curve) {
  if (curve.empty()) return "";
  std::string table = formatted("%-13s %10s %12s\n", "kept", "confidence", "bad 2 px");
  for (const SparsificationPoint& point : curve) {
    table += formatted("%12.0f%% %10.3f %11.2f%%\n", 100 * point.kept, point.confidence,
                       100 * point.bad_pixels);
  }
  return table;
}

std::string to_json(const std::vector<SparsificationPoint>& curve) {
  nlohmann::ordered_json json = nlohmann::json::array();
  for (const SparsificationPoint& point : curve) {
    json.push_back(
        {{"kept", point.kept}, {"confidence", point.confidence}, {"bad_pixels", point.bad_pixels}});
  }
  return json.dump(2);
}

std::string to_table(const std::vector<ReliabilityBin>& bins) {
  double total = 0;
  for (const ReliabilityBin& bin : bins) total += static_cast<double>(bin.pixels);
  std::vector<std::string> lines;
  double above = 0;
  double right_above = 0;
  for (auto bin = bins.rbegin(); bin != bins.rend(); ++bin) {
    if (bin->pixels == 0) continue;
    const auto pixels = static_cast<double>(bin->pixels);
    above += pixels;
    right_above += bin->right * pixels;
    lines.push_back(formatted("%4.2f to %4.2f %9.1f%% %10.3f %8.1f%% | %8.1f%% %8.1f%%\n", bin->low,
                              bin->high, 100 * pixels / total, bin->mean_confidence,
                              100 * bin->right, 100 * above / total, 100 * right_above / above));
  }
  if (lines.empty()) return "";
  std::string table = formatted("%-12s %10s %10s %9s | %9s %9s\n", "confidence", "pixels", "mean",
                                "right", "and above", "right");
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) table += *line;
  return table;
}

std::string to_json(const std::vector<ReliabilityBin>& bins) {
  nlohmann::ordered_json json = nlohmann::json::array();
  for (const ReliabilityBin& bin : bins) {
    json.push_back({{"low", bin.low},
                    {"high", bin.high},
                    {"pixels", bin.pixels},
                    {"mean_confidence", bin.mean_confidence},
                    {"right", bin.right}});
  }
  return json.dump(2);
}

cv::Mat error_picture(const cv::Mat& distance, const GroundTruth& truth) {
  require_truth(distance, truth);
  cv::Mat picture = cv::Mat::zeros(distance.size(), CV_8UC3);
  for (int y = 0; y < distance.rows; ++y) {
    for (int x = 0; x < distance.cols; ++x) {
      const float gt = truth.distance.at<float>(y, x);
      const bool scored =
          has_distance(gt) && (truth.valid.empty() || truth.valid.at<uchar>(y, x) != 0);
      if (!scored) continue;
      const float d = distance.at<float>(y, x);
      cv::Vec3d colour(200, 60, 30);
      if (has_distance(d)) {
        // Logarithmic from 0.5 % (green) over 1.6 % (yellow) to 5 % (red).
        const double relative = std::abs(static_cast<double>(d) / static_cast<double>(gt) - 1);
        const double t = std::clamp(std::log10(std::max(relative, 1e-6) / 0.005), 0.0, 1.0);
        colour = {0, 200 * std::min(1.0, 2 - 2 * t), 255 * std::min(1.0, 2 * t)};
      }
      if (!truth.occlusion.empty() && truth.occlusion.at<uchar>(y, x) != visible_label)
        colour *= 0.45;
      picture.at<cv::Vec3b>(y, x) = colour;
    }
  }
  return picture;
}

}  // namespace widestereo
