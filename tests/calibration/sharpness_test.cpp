// SPDX-License-Identifier: MIT
#include "widestereo/sharpness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "data_folder.h"
#include "error_of.h"
#include "same_bits.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

constexpr int size = 256;
constexpr int shift = 7;  // pixels that the second image is displaced by

/// Blocks of random intensities, as a lens of little blur shows them; float, grey levels.
cv::Mat scene() {
  cv::RNG random(5);
  cv::Mat blocks(size / 4, size / 4, CV_32FC1);
  random.fill(blocks, cv::RNG::UNIFORM, 60, 190);
  cv::resize(blocks, blocks, {size, size}, 0, 0, cv::INTER_NEAREST);
  return blurred(blocks, 0.6);
}

cv::Mat displaced(const cv::Mat& image) {
  cv::Mat result;
  cv::copyMakeBorder(image, result, 0, 0, shift, 0, cv::BORDER_REFLECT);
  return result.colRange(0, size);
}

cv::Mat grey_levels(const cv::Mat& image, double noise = 0) {
  cv::Mat grains(image.size(), CV_32FC1);
  cv::RNG(9).fill(grains, cv::RNG::NORMAL, 0, noise);
  cv::Mat result;
  cv::Mat(image + grains).convertTo(result, CV_8U);
  return result;
}

View view(double x = 0, double focal_length = 180) {
  View view;
  view.camera.model = CameraModel::pinhole_radtan;
  view.camera.width = view.camera.height = size;
  view.camera.fx = view.camera.fy = focal_length;
  view.camera.cx = view.camera.cy = size / 2.;
  view.world_from_camera = Eigen::Translation3d(x, 0, 0);
  return view;
}

std::vector<PixelMatch> grid(int step = 11) {
  std::vector<PixelMatch> matches;
  for (int y = 4; y < size; y += step) {
    for (int x = 4; x + shift < size; x += step) matches.push_back({{x, y}, {x + shift, y}});
  }
  return matches;
}

/// Of images side by side, the second one displaced.
std::optional<SharpnessDifference> compare(const cv::Mat& first, const cv::Mat& second,
                                           const std::vector<PixelMatch>& matches) {
  return compare_sharpness(view(), view(-0.1), first, second, matches);
}

TEST(Sharpness, BlursThatAreNoneAreRefused) {
  for (const double blur : {-1.0, 1e9, static_cast<double>(NAN)}) {
    EXPECT_EQ(test::error_of([&] { blurred(scene(), blur); }).find("A blur of"), 0u) << blur;
  }
  EXPECT_EQ(test::error_of([] { blurred({}, 1); }).find("The image to blur is empty"), 0u);
  EXPECT_EQ(test::error_of([] { blurred(cv::Mat(9, 9, CV_32SC1), 1); }).find("The image to blur"),
            0u);
}

TEST(Sharpness, DifferenceIsTheBlurThatWasAdded) {
  for (const double blur : {0.9, 1.2, 2.0}) {
    const cv::Mat sharp = grey_levels(scene());
    const cv::Mat blunt = grey_levels(displaced(blurred(scene(), blur)));
    const auto first = compare(sharp, blunt, grid());
    ASSERT_TRUE(first);
    EXPECT_EQ(first->sharper, 0);
    EXPECT_NEAR(first->blur, blur, 0.05 * blur);
    std::vector<PixelMatch> swapped = grid();
    for (PixelMatch& match : swapped) std::swap(match.first, match.second);
    const auto second = compare(blunt, sharp, swapped);
    ASSERT_TRUE(second);
    EXPECT_EQ(second->sharper, 1);
    EXPECT_EQ(second->blur, first->blur);
  }
}

TEST(Sharpness, ExposureDoesNotCount) {
  const cv::Mat sharp = grey_levels(scene());
  const cv::Mat dark = 0.3 * displaced(scene()) + 30;
  EXPECT_FALSE(compare(sharp, grey_levels(dark), grid()));
  cv::Mat deep;
  cv::Mat(0.3 * displaced(blurred(scene(), 1.5)) + 30).convertTo(deep, CV_16U, 257);
  const auto found = compare(sharp, deep, grid());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sharper, 0);
  EXPECT_NEAR(found->blur, 1.5, 0.1);
}

TEST(Sharpness, OfCamerasWithFewerBitsThanTheirFilesIsFound) {
  cv::Mat sharp;
  cv::Mat blunt;
  scene().convertTo(sharp, CV_16U, 4);
  displaced(blurred(scene(), 1.5)).convertTo(blunt, CV_16U, 4);
  const auto found = compare(sharp, blunt, grid());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sharper, 0);
  EXPECT_NEAR(found->blur, 1.5, 0.1);
}

TEST(Sharpness, NoiseOfOneImageIsNone) {
  const cv::Mat image = grey_levels(scene());
  const cv::Mat noisy = grey_levels(displaced(scene()), 6);
  EXPECT_FALSE(compare(image, noisy, grid()));
  EXPECT_FALSE(compare(noisy, image, grid()));
}

TEST(Sharpness, NoisyImagesDifferToo) {
  const auto found =
      compare(grey_levels(scene(), 3), grey_levels(displaced(blurred(scene(), 1.5))), grid());
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sharper, 0);
  EXPECT_NEAR(found->blur, 1.5, 0.15);
}

TEST(Sharpness, FewFalseMatchesAreHarmless) {
  std::vector<PixelMatch> matches = grid();
  for (std::size_t i = 0; i < matches.size(); i += 4) matches[i].second = {size - 0.4, 0};
  const auto found =
      compare(grey_levels(scene()), grey_levels(displaced(blurred(scene(), 1.5))), matches);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->blur, 1.5, 0.2);
}

TEST(Sharpness, DetailOfAnotherSizeIsNone) {
  // A camera of twice the focal length sees the middle of the scene at twice the size.
  cv::Mat large;
  cv::resize(grey_levels(scene()), large, {2 * size, 2 * size}, 0, 0, cv::INTER_LANCZOS4);
  large = large(cv::Rect(size / 2, size / 2, size, size));
  std::vector<PixelMatch> matches;
  for (const PixelMatch& match : grid(7)) {
    const Eigen::Vector2d there = 2 * match.first - Eigen::Vector2d::Constant(size / 2.);
    if (there.minCoeff() >= 0 && there.maxCoeff() < size) matches.push_back({match.first, there});
  }
  ASSERT_GT(matches.size(), 200u);
  const cv::Mat image = grey_levels(scene());
  EXPECT_FALSE(compare_sharpness(view(), view(0, 360), image, large, matches));
  EXPECT_TRUE(compare_sharpness(view(), view(), image, large, matches))
      << "what a wrong calibration says: the test would see a difference";
  for (PixelMatch& match : matches) std::swap(match.first, match.second);
  EXPECT_FALSE(compare_sharpness(view(0, 360), view(), large, image, matches));
}

/// A camera of twice the focal length sees a wall from twice as far away as large.
TEST(Sharpness, DetailOfOneSizeCountsFromAnyDistance) {
  std::vector<PixelMatch> matches = grid();
  for (PixelMatch& match : matches) match.second = match.first;
  View far = view(0, 360);
  far.world_from_camera.translation().z() = -1;
  const auto found = compare_sharpness(view(), far, grey_levels(scene()),
                                       grey_levels(blurred(scene(), 1.5)), matches);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sharper, 0);
  EXPECT_NEAR(found->blur, 1.5, 0.1);
}

TEST(FinerPixels, AreBlurredToTheOthers) {
  const View coarse = view();
  View fine = view(-0.1, 360);
  EXPECT_EQ(blur_of_finer_pixels(coarse, view(-0.1)), 0);
  EXPECT_EQ(blur_of_finer_pixels(coarse, fine), 0);
  EXPECT_NEAR(blur_of_finer_pixels(fine, coarse), 0.5 * std::sqrt(2 * 2 - 1), 0.05);
  EXPECT_EQ(blur_of_finer_pixels(view(-0.1, 200), coarse), 0) << "hardly finer";
  // Of a wide image only what the other camera sees counts.
  View wide = coarse;
  wide.camera.model = CameraModel::kannala_brandt;
  wide.camera.fx = wide.camera.fy = 80;
  EXPECT_GT(blur_of_finer_pixels(coarse, wide), 0.5 * std::sqrt(2.25 * 2.25 - 1));
  EXPECT_EQ(blur_of_finer_pixels(wide, coarse), 0);
  fine.world_from_camera.rotate(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(blur_of_finer_pixels(fine, coarse), 0) << "they see nothing in common";
}

TEST(FinerPixels, AreOfValidCameras) {
  const auto error = [](const View& first, const View& second) {
    return test::error_of([&] { blur_of_finer_pixels(first, second); });
  };
  EXPECT_EQ(error(view(), view()), "");
  View wrong = view();
  wrong.camera.fx = std::nan("");
  EXPECT_EQ(error(wrong, view()).find("The view's camera: fx is nan"), 0U);
  wrong = view();
  wrong.camera.height = 0;
  EXPECT_EQ(error(view(), wrong).find("The other view's camera: the image height is 0"), 0U);
}

TEST(Sharpness, MaskedFeaturesDoNotCount) {
  View masked = view();
  masked.mask = cv::Mat(size, size, CV_8UC1, cv::Scalar(255));
  masked.mask.rowRange(0, size - 20) = 0;
  const cv::Mat sharp = grey_levels(scene());
  const cv::Mat blunt = grey_levels(displaced(blurred(scene(), 2)));
  EXPECT_TRUE(compare_sharpness(view(), view(-0.1), sharp, blunt, grid()));
  EXPECT_FALSE(compare_sharpness(masked, view(-0.1), sharp, blunt, grid()));
  EXPECT_FALSE(compare_sharpness(view(), masked, sharp, blunt, grid()));
}

TEST(Sharpness, NothingIsSaidOfTooLittle) {
  const cv::Mat sharp = grey_levels(scene());
  const cv::Mat blunt = grey_levels(displaced(blurred(scene(), 2)));
  EXPECT_FALSE(compare(sharp, blunt, {}));
  EXPECT_FALSE(compare(sharp, blunt, grid(60)));
  const cv::Mat flat(size, size, CV_8UC1, cv::Scalar(90));
  EXPECT_FALSE(compare(sharp, flat, grid()));
  EXPECT_FALSE(compare(flat, flat, grid()));
}

TEST(Sharpness, OtherImagesAreRefused) {
  const cv::Mat sharp = grey_levels(scene());
  EXPECT_NE(test::error_of([&] { compare(sharp, {}, grid()); }).find("second image"),
            std::string::npos);
}

TEST(Sharpness, BlurOfNothingIsTheImage) {
  const cv::Mat image = grey_levels(scene());
  EXPECT_EQ(blurred(image, 0).data, image.data);
  cv::Mat difference;
  cv::absdiff(blurred(image, 1), image, difference);
  EXPECT_GT(cv::mean(difference)[0], 3);
}

TEST(Sharpness, BlurOfAPartOfAnImageKnowsNothingOfTheRest) {
  const cv::Mat half = grey_levels(scene()).colRange(0, 100);
  EXPECT_TRUE(test::same_bits(blurred(half, 1.5), blurred(half.clone(), 1.5)));
}

TEST(Sharpness, OfRenderedPairs) {
  SKIP_WITHOUT_STEREO_SETS();
  for (const char* set : {"desk_tumvi", "warehouse_expo", "street_forward_omni"}) {
    SCOPED_TRACE(set);
    const auto folder = test::data_folder() / "synthetic" / set;
    const cv::Mat left = read_image(folder / "cam0.png");
    cv::Mat right = read_image(folder / "cam1.png");
    const auto views = read_calibration(folder / "calib.yaml", left.size()).rig.views;
    const auto difference = [&] {
      return compare_sharpness(views[0], views[1], left, right, match_features(left, right));
    };
    EXPECT_FALSE(difference());
    right = blurred(right, 1.2);
    const auto found = difference();
    ASSERT_TRUE(found);
    EXPECT_EQ(found->sharper, 0);
    EXPECT_NEAR(found->blur, 1.2, 0.15);
  }
}

}  // namespace
}  // namespace widestereo
