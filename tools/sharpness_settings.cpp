// SPDX-License-Identifier: MIT
#include "sharpness_settings.h"

#include "say.h"
#include "text/formatted.h"
#include "widestereo/error.h"
#include "widestereo/sharpness.h"

namespace ws = widestereo;

namespace {

void say_of(const ws::Rig& rig, std::size_t blurred, const char* why, double blur) {
  say(rig.views[blurred].name + " " + why + " than " + rig.views[1 - blurred].name +
      ws::formatted(" and is blurred by %.2f pixels before it is matched ", blur) +
      "(--blur 0 matches it as it is).");
}

}  // namespace

void SharpnessSettings::add_to(CLI::App& command) {
  command
      .add_option(
          "--blur", given_,
          "Blur images before they are matched: standard deviation, pixels, one for all "
          "views or one for each (by comma), 0 = do not; by default the sharper image of a pair, "
          "or that of finer pixels, where the two differ")
      ->delimiter(',')
      ->check(CLI::Range(0.0, 10.0));
}

std::vector<double> SharpnessSettings::blurs(const ws::Rig& rig, const std::vector<cv::Mat>& images,
                                             const std::vector<MatchedViews>& pairs) const {
  const std::size_t count = rig.views.size();
  if (given_.size() > 1 && given_.size() != count) {
    throw ws::Error("--blur was given " + std::to_string(given_.size()) + " values for " +
                    std::to_string(count) + " views; give one for all or one for each.");
  }
  if (given_.size() == count) return given_;
  std::vector<double> blurs(count, given_.empty() ? 0 : given_.front());
  // Of more views each has sources that are as sharp as itself, or sharper ones that it needs.
  if (!given_.empty() || count != 2) return blurs;
  for (std::size_t i = 0; i < 2; ++i) {
    blurs[i] = ws::blur_of_finer_pixels(rig.views[i], rig.views[1 - i]);
    if (blurs[i] > 0) {
      say_of(rig, i, "has finer pixels", blurs[i]);
      return blurs;
    }
  }
  const auto difference = ws::compare_sharpness(rig.views[0], rig.views[1], images[0], images[1],
                                                pairs.front().matches);
  if (!difference) return blurs;
  const auto sharper = static_cast<std::size_t>(difference->sharper);
  blurs[sharper] = difference->blur;
  say_of(rig, sharper, "is sharper", difference->blur);
  return blurs;
}

std::vector<cv::Mat> blurred(const std::vector<cv::Mat>& images, const std::vector<double>& blurs) {
  std::vector<cv::Mat> results;
  for (std::size_t i = 0; i < images.size(); ++i) {
    results.push_back(ws::blurred(images[i], blurs[i]));
  }
  return results;
}
