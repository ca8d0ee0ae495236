// SPDX-License-Identifier: MIT
#include "white_level.h"

#include <opencv2/core.hpp>

#include "frame_settings.h"
#include "say.h"
#include "widestereo/image_io.h"

namespace ws = widestereo;

void WhiteLevel::add_to(CLI::App& command) {
  command
      .add_option("--white-level", value_,
                  "Largest value of the camera where 16-bit images hold fewer bits: 4095 for 12")
      ->check(CLI::Range(lowest, highest));
}

cv::Mat WhiteLevel::read(const std::filesystem::path& file, int otherwise) const {
  constexpr int of_10_bits = 1023, of_12_bits = 4095;
  const cv::Mat image = ws::read_image(file);
  if (value_ > 0) return ws::stretched(image, value_, file.string());
  if (otherwise > 0 && image.depth() == CV_16U) {
    return ws::stretched(image, otherwise, file.string());
  }
  if (told_ || image.depth() != CV_16U) return image;
  const double brightest = ws::largest_value(image);
  if (brightest > of_12_bits) return image;
  told_ = true;
  const bool may_be_10_bits = brightest <= of_10_bits;
  say(file.string() + " has 16 bits, but no value above " + std::to_string(cvRound(brightest)) +
      ", and is taken for a dark image; where the camera has " + (may_be_10_bits ? "10" : "12") +
      " bits, give --white-level " + std::to_string(may_be_10_bits ? of_10_bits : of_12_bits) +
      ".");
  return image;
}

cv::Mat WhiteLevel::read_of_many(const std::filesystem::path& file) const {
  return ::read_of_many([&] { return read(file); });
}
