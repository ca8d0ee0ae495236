// SPDX-License-Identifier: MIT
#pragma once

#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "widestereo/epipolar.h"
#include "widestereo/rig.h"

namespace widestereo {

/// One image of a pair shows finer detail than the other, as where lenses are focused differently.
/// Patches that are not alike match with an error; blurring the sharper image mends most of it.
struct SharpnessDifference {
  int sharper = 0;  ///< 0: the first image, 1: the second
  double blur = 0;  ///< standard deviation, pixels, of the Gaussian that makes it like the other
};

/// Compares the share of fine detail around matched features (match_features()) of two calibrated
/// views' images, 8 or 16 bit or as to_intensity() returns them; masked features and those that are
/// not about as large in both images are left out. None where the images differ by less than a
/// blur of 0.7 pixels, as noise in one image alone looks like up to 0.6, or where matches are too
/// few to tell; never more than 3 pixels. Exposure does not count. Throws Error on images of
/// another kind.
std::optional<SharpnessDifference> compare_sharpness(const View& first, const View& second,
                                                     const cv::Mat& first_image,
                                                     const cv::Mat& second_image,
                                                     const std::vector<PixelMatch>& matches);

/// Standard deviation, pixels, of the Gaussian after which a view's image shows about as much
/// detail as another camera with larger pixels does: by the median over the directions (at
/// infinity) that both see. 0 where its pixels are not finer by a fifth, or nothing is seen by
/// both. Throws Error for cameras that validate() refuses.
double blur_of_finer_pixels(const View& view, const View& other);

/// An image of 8 or 16 bits, or of floats, blurred by a Gaussian of that standard deviation
/// (pixels, at most most_blur); as it is for 0. Throws Error for other numbers and empty images.
constexpr double most_blur = 1000;
cv::Mat blurred(const cv::Mat& image, double blur);

}  // namespace widestereo
