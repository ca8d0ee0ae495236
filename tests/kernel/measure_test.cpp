// SPDX-License-Identifier: MIT
// Measures of planes held nearly right, on rendered images of a slanted plane.
#include <gtest/gtest.h>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

constexpr int size = 128;
constexpr int step = 3;

class Measure : public ::testing::Test {
 protected:
  explicit Measure(const Rig& rig = fisheye_rig(size)) : fixture_(rig, wide_range("fast")) {
    const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, 1).normalized();
    const double offset = 2;
    wall_ = normal / offset;
    fixture_.show(render_plane(fixture_.rig(), normal, offset));
    for (int i = 0; i < 2; ++i) {
      fixture_.view(i).hypotheses.setTo(cv::Scalar(0, 0, 0, INVALID_COST));
    }
    fixture_.set_reference(0);
  }

  /// `roll`: of the source about its axis, radians; `factor`: of its image's size.
  static Rig changed_rig(double roll, double factor = 1) {
    Rig rig = fisheye_rig(size);
    View& source = rig.views[1];
    source.world_from_camera.rotate(Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()));
    source.camera = scaled(source.camera, factor);
    return rig;
  }

  /// Replaces the source's intensities b by gain b + offset.
  void change_exposure(double gain, double offset) {
    cv::Mat image = fixture_.view(1).image();
    const cv::Mat masked = image < 0;
    image.convertTo(image, -1, gain, offset);
    image.setTo(MASKED_INTENSITY, masked);
    fixture_.interpolate();
  }

  /// A gradient of brightness and noise (of full scale), instead of the wall.
  void show_gradients(double noise) {
    for (int i = 0; i < 2; ++i) {
      cv::Mat image = fixture_.view(i).image();
      const cv::Mat masked = image < 0;
      gradient(image.size(), 0.003, 0.003, noise, i + 1).copyTo(image);
      image.setTo(MASKED_INTENSITY, masked);
    }
    fixture_.interpolate();
  }

  /// Pixels in the source between where the wall is and where the measure puts it, of a plane held
  /// `held` pixels off, over the middle of the image; `matched`: after a sub-pixel match, too.
  std::vector<double> measured(double held, bool matched) {
    std::vector<double> all;
    deviations_.clear();
    for (int y = 24; y < size - 24; y += step) {
      for (int x = 24; x < size - 24; x += step) {
        const cv::Vec4f r = fixture_.view(0).rays(y, x);
        const Eigen::Vector3d ray(r[0], r[1], r[2]);
        const auto measure = [&](const Eigen::Vector3d& m) {
          const Eigen::Vector3f single = m.cast<float>();
          fixture_.view(0).hypotheses(y, x) = cv::Vec4f(single.x(), single.y(), single.z(), 0.1f);
          kernel::cpu::measure_pixel(fixture_.context(), {x, y});
          return fixture_.view(0).checks(y, x);
        };
        const double speed = measure(wall_)[1];
        if (speed <= 0) continue;
        deviations_.push_back(
            std::sqrt(static_cast<double>(measure(wall_ + held / speed * ray)[0])));
        if (matched) kernel::cpu::subpixel_pixel(fixture_.context(), {x, y});
        const cv::Vec4f check = fixture_.view(0).checks(y, x);
        all.push_back((static_cast<double>(check[2]) - wall_.dot(ray)) * speed);
      }
    }
    return all;
  }

  /// Standard deviations that the measure tells of the same planes (px).
  std::vector<double> deviations(double held) {
    measured(held, false);
    return deviations_;
  }

  /// Median of the variances of planes held on the wall (px^2), over the middle of the image,
  /// without what the source adds, which holds no planes to agree with.
  double median_variance() {
    std::vector<float> all;
    for (int y = 24; y < size - 24; y += step) {
      for (int x = 24; x < size - 24; x += step) {
        const cv::Vec3f m(wall_.cast<float>().eval().data());
        fixture_.view(0).hypotheses(y, x) = cv::Vec4f(m[0], m[1], m[2], 0.1f);
        kernel::cpu::measure_pixel(fixture_.context(), {x, y});
        all.push_back(fixture_.view(0).checks(y, x)[0]);
      }
    }
    std::nth_element(all.begin(), all.begin() + all.size() / 2, all.end());
    constexpr double unchecked = static_cast<double>(UNCHECKED_DISPLACEMENT);
    return static_cast<double>(all[all.size() / 2]) - 0.25 * unchecked * unchecked;
  }

  static double root_mean_square(const std::vector<double>& all) {
    double sum = 0;
    for (const double displacement : all) sum += displacement * displacement;
    return std::sqrt(sum / static_cast<double>(all.size()));
  }

  KernelFixture fixture_;
  std::vector<double> deviations_;
  Eigen::Vector3d wall_;  ///< m of the plane that is seen
};

class MeasureOfRolledCameras : public Measure, public ::testing::WithParamInterface<double> {
 protected:
  MeasureOfRolledCameras() : Measure(changed_rig(GetParam())) {}
};

INSTANTIATE_TEST_SUITE_P(Radians, MeasureOfRolledCameras, ::testing::Values(0, 1, -2));

TEST_P(MeasureOfRolledCameras, SubpixelMatchFindsWherePatchesMatch) {
  change_exposure(0.6, 0.1);
  for (const double held : {-0.3, 0.15, 0.3}) {
    const auto as_held = measured(held, false);
    const auto matched = measured(held, true);
    ASSERT_GT(matched.size(), 500u);
    EXPECT_NEAR(root_mean_square(as_held), std::abs(held), 0.01);
    EXPECT_LT(root_mean_square(matched), 0.08) << "held " << held << " px off";
  }
}

TEST_F(Measure, SubpixelMatchNeedsEvidence) {
  change_exposure(-0.6, 0.9);
  EXPECT_NEAR(root_mean_square(measured(0.3, true)), 0.3, 0.01) << "a negative";
  for (int i = 0; i < 2; ++i) {
    cv::Mat image = fixture_.view(i).image();
    image.setTo(0.5, image >= 0);
  }
  fixture_.interpolate();
  EXPECT_NEAR(root_mean_square(measured(0.3, true)), 0.3, 0.01) << "no texture";
}

TEST_F(Measure, GradientsOfBrightnessAndNoiseDetermineNoDistance) {
  EXPECT_LT(median_variance(), 0.04) << "texture does";
  // Gain and offset explain what a displacement does to a gradient.
  for (const auto& [noise, least] : {std::pair(0.0, 0.2), std::pair(0.004, 0.05)}) {
    show_gradients(noise);
    EXPECT_GT(median_variance(), least) << "noise " << noise;
  }
}

/// The reference tells as much whatever the source's pixels are, in which the variance is counted.
TEST(MeasureOfCoarserOrFinerSources, IsThatOfTheReferenceInTheirPixels) {
  struct OfSource : Measure {
    OfSource(double roll, double factor) : Measure(changed_rig(roll, factor)) {}
    void TestBody() override {}
    double variance() {
      constexpr double noise = 0.004;
      show_gradients(noise);
      return median_variance() - static_cast<double>(SMALLEST_VARIANCE);
    }
  };
  for (const double roll : {0.0, 1.0}) {
    const double of_equal = OfSource(roll, 1).variance();
    for (const double factor : {0.15, 0.5, 2.0}) {
      EXPECT_NEAR(OfSource(roll, factor).variance() / (factor * factor), of_equal, 0.1 * of_equal)
          << factor << " times the size, rolled by " << roll;
    }
  }
}

TEST_F(Measure, HalfOfTheDisplacementFromTheSourcesPlaneCountsUpToFivePixels) {
  const kernel::vec3 m(static_cast<float>(wall_.x()), static_cast<float>(wall_.y()),
                       static_cast<float>(wall_.z()));
  const kernel::vec3 of_source =
      kernel::cpu::plane_in_source(fixture_.schedule().parameters.pairs[1], m);
  fixture_.view(1).hypotheses.setTo(cv::Scalar(of_source.x, of_source.y, of_source.z, 0.1));
  for (const double held : {2.0, 4.0, 7.0}) {
    double mean = 0;
    const auto all = deviations(held);
    for (const double deviation : all) mean += deviation / static_cast<double>(all.size());
    EXPECT_NEAR(mean, 0.5 * std::min(held, 5.0), 0.15) << held;
  }
}

TEST_F(Measure, SubpixelMatchMovesNoFurtherThanAPatchCanTell) {
  const std::vector<double> displacements = measured(3, true);
  ASSERT_GT(displacements.size(), 500u);
  for (const double displacement : displacements) {
    EXPECT_NEAR(displacement, 3, static_cast<double>(LARGEST_SHIFT) + 0.1);
  }
}

TEST(AgreeingSource, IsTheFastestOfThoseThatAgreeAndTellDistances) {
  const auto chosen = [](const std::vector<double>& baselines) {
    const kernel::vec3 wall(0.05f, 0.1f, 0.5f);
    KernelFixture fixture(rig_of_baselines(96, baselines), wide_range());
    fixture.set_reference(0);
    fixture.hold_in_all_views(wall);
    fixture.view(1).hypotheses *= 3;  // disagrees
    kernel::vec2 velocity;
    return kernel::cpu::agreeing_source(fixture.context(), {48, 48},
                                        to_kernel(fixture.view(0).rays(48, 48)), wall, velocity);
  };
  EXPECT_EQ(chosen({1, 0.8, 0.6}), 2);
  EXPECT_EQ(chosen({1, 0.6, 0.8}), 3);
  EXPECT_EQ(chosen({1, 0.01}), 1) << "the other one would agree with any plane";
}

/// The noise of each is its own.
TEST(SeveralSources, TellMoreThanOneWhereTheyAgree) {
  Rig rig = fisheye_rig(size);
  View& third = rig.views.emplace_back(rig.views[1]);
  third.name = "cam2";
  third.world_from_camera.translation() *= -1;
  KernelFixture fixture(rig, wide_range("fast"));
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, 1).normalized();
  const Eigen::Vector3d wall = normal / 2;
  fixture.show(render_plane(rig, normal, 2));
  for (int i = 0; i < 3; ++i) {
    cv::Mat image = fixture.view(i).image();
    cv::Mat noise(image.size(), CV_32FC1);
    cv::RNG(static_cast<std::uint64_t>(i + 1)).fill(noise, cv::RNG::NORMAL, 0, 6.0 / 255);
    cv::add(image, noise, image, image >= 0);
    image = cv::max(image, MASKED_INTENSITY);
  }
  fixture.interpolate();
  fixture.set_reference(0);
  fixture.pass().candidates = WHOLE_SHIFT;
  struct Found {
    double error = 0, variance = 0;  // px, px^2
  };
  const auto found = [&] {
    Found sums;
    int count = 0;
    for (int y = 24; y < size - 24; y += step) {
      for (int x = 24; x < size - 24; x += step, ++count) {
        kernel::cpu::measure_pixel(fixture.context(), {x, y});
        const cv::Vec4f measure = fixture.view(0).checks(y, x);
        kernel::cpu::subpixel_pixel(fixture.context(), {x, y});
        const double w = static_cast<double>(fixture.view(0).checks(y, x)[2]);
        sums.error +=
            std::pow((w - wall.dot(fixture.ray(0, {x, y}))) * static_cast<double>(measure[1]), 2);
        sums.variance += static_cast<double>(measure[0]);
      }
    }
    return Found{std::sqrt(sums.error / count), sums.variance / count};
  };
  fixture.hold_in_all_views(to_kernel(wall));
  const Found of_both = found();
  for (const int wrong : {1, 2}) {
    fixture.hold_in_all_views(to_kernel(wall));
    fixture.view(wrong).hypotheses *= 3;
    const Found of_one = found();
    EXPECT_LT(of_both.error, 0.9 * of_one.error) << wrong;
    EXPECT_GT(of_both.variance, 0.65 * of_one.variance) << wrong;
    EXPECT_LT(of_both.variance, 0.85 * of_one.variance) << wrong;
  }
}

/// Of planes that are 0.3 px off and matches that are not precise.
TEST(SubpixelMatch, TakesAllOfTheShiftOrTheShareThatThePrecisionIsWorth) {
  KernelFixture fixture(fisheye_rig(128), wide_range("fast"));
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, 1).normalized();
  fixture.show(render_plane(fixture.rig(), normal, 2));
  fixture.set_reference(0);
  const auto error_left = [&](unsigned how) {
    fixture.pass().candidates = how;
    double sum = 0;
    int count = 0;
    for (int y = 34; y < 94; y += 5) {
      for (int x = 34; x < 94; x += 5, ++count) {
        const Eigen::Vector3d ray = fixture.ray(0, {x, y});
        const double truth = normal.dot(ray) / 2;
        kernel::vec2 velocity;
        kernel::cpu::telling_source(fixture.context(), to_kernel(ray), static_cast<float>(truth),
                                    velocity);
        const double speed = std::hypot(velocity.x, velocity.y);
        const kernel::vec3 m = to_kernel(normal / 2 + 0.3 / speed * ray);
        fixture.view(0).hypotheses(y, x) = cv::Vec4f(m.x, m.y, m.z, 0.1f);
        fixture.view(0).checks(y, x) =
            cv::Vec4f(1e-3f, static_cast<float>(speed), dot(m, to_kernel(ray)), 0.5f);
        kernel::cpu::subpixel_pixel(fixture.context(), {x, y});
        sum += std::pow((static_cast<double>(fixture.view(0).checks(y, x)[2]) - truth) * speed, 2);
      }
    }
    return std::sqrt(sum / count);
  };
  EXPECT_GT(error_left(0), 0.24);
  EXPECT_LT(error_left(WHOLE_SHIFT), 0.1);
}

}  // namespace
}  // namespace widestereo::test
