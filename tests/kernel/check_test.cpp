// SPDX-License-Identifier: MIT
// Checks, ambiguity and the filling of what they reject.
#include <gtest/gtest.h>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;
using kernel::vec3;

/// Checks a pixel, whose surroundings come first.
void run_check(KernelFixture& fixture, ivec2 pixel) {
  constexpr int radius = 24;
  const cv::Size size = fixture.view(0).rays.size();
  for (int y = std::max(pixel.y - radius, 0); y < std::min(pixel.y + radius, size.height); ++y) {
    for (int x = std::max(pixel.x - radius, 0); x < std::min(pixel.x + radius, size.width); ++x) {
      kernel::cpu::structure_pixel(fixture.context(), {x, y});
    }
  }
  kernel::cpu::check_pixel(fixture.context(), pixel);
}

TEST(Checks, ConsistentPlanesPassAndWrongOnesFail) {
  KernelFixture fixture(fisheye_rig(96), wide_range());
  const Eigen::Vector3d m(0.05, 0.1, 0.5);
  const Eigen::Vector3d moved =
      to_eigen(kernel::cpu::plane_in_source(fixture.schedule().parameters.pairs[1], to_kernel(m)));
  const auto fill = [&](int view, const Eigen::Vector3d& plane) {
    const vec3 mk = to_kernel(plane);
    fixture.view(view).hypotheses.setTo(cv::Scalar(mk.x, mk.y, mk.z, 0.1));
  };
  fill(0, m);
  fill(1, moved);
  run_check(fixture, {48, 48});
  cv::Vec4f check = fixture.view(0).checks(48, 48);
  EXPECT_LT(check[0], 1e-4);
  EXPECT_LT(check[1], 1e-2);
  const float consistent = check[2];
  EXPECT_GT(consistent, 0.9f);
  EXPECT_EQ(check[3], 0);

  fill(1, 1.05 * moved);  // 5 % nearer
  run_check(fixture, {48, 48});
  check = fixture.view(0).checks(48, 48);
  EXPECT_NEAR(check[0], 0.05, 0.003);
  EXPECT_EQ(static_cast<int>(check[3]), REASON_INCONSISTENT);
  fill(1, 3 * moved);
  run_check(fixture, {48, 48});
  check = fixture.view(0).checks(48, 48);
  EXPECT_GT(check[1], 2);
  const auto odds = [](float confidence) { return confidence / (1 - confidence); };
  EXPECT_LT(odds(check[2]), 0.5f * odds(consistent)) << "pixels off";

  fixture.view(0).hypotheses.setTo(cv::Scalar(0, 0, 0, 2));
  run_check(fixture, {48, 48});
  EXPECT_EQ(static_cast<int>(fixture.view(0).checks(48, 48)[3]), REASON_NO_OVERLAP);
  run_check(fixture, {0, 0});
  EXPECT_EQ(static_cast<int>(fixture.view(0).checks(0, 0)[3]), REASON_NO_RAY);
}

/// Views, two unless a rig is given, that agree on one plane everywhere.
class AgreeingViews {
 public:
  explicit AgreeingViews(const Options& options,
                         const Eigen::Vector3d& plane_of_first = {0.05, 0.1, 0.5},
                         const Rig& rig = fisheye_rig(96))
      : fixture(rig, options), first_(to_kernel(plane_of_first)) {
    fixture.hold_in_all_views(first_);
  }

  /// The plane m . X = 1 of view 0 in the frame of `view`.
  vec3 plane(int view) { return fixture.plane_in(view, first_); }

  int reasons(ivec2 pixel) {
    run_check(fixture, pixel);
    return static_cast<int>(fixture.view(0).checks(pixel.y, pixel.x)[3]);
  }

  /// Scales the planes of both views in a square around the pixel, so that they still agree.
  void scale_square(ivec2 pixel, int radius, float factor) {
    for (int view = 0; view < 2; ++view) {
      cv::Mat square = fixture.view(view).hypotheses(
          cv::Rect(pixel.x - radius, pixel.y - radius, 2 * radius + 1, 2 * radius + 1));
      const vec3 m = factor * plane(view);
      square.setTo(cv::Scalar(m.x, m.y, m.z, 0.1));
    }
  }

  KernelFixture fixture;

 private:
  vec3 first_;
};

TEST(Checks, RejectFromEachOptionsLimitOn) {
  const Eigen::Vector3d m(0.05, 0.1, 0.5);
  const cv::Point pixel(28, 66);  // off both axes
  const Options generous = [] {
    Options options = wide_range();
    options.min_texture = options.min_parallax = options.min_support = 0;
    options.max_cost = 2;
    options.max_tilt = 90;
    options.consistency_relative = options.consistency_pixels = 999;
    return options;
  }();
  const Rig rig = fisheye_rig(96);
  constexpr double nearer = 1.05;  // what the source holds
  const auto reasons = [&](double Options::*limit, double value, bool source_has_planes = true) {
    Options options = generous;
    options.*limit = value;
    AgreeingViews views(options, m);
    const vec3 held = static_cast<float>(nearer) * views.plane(1);
    views.fixture.view(1).hypotheses.setTo(
        cv::Scalar(held.x, held.y, held.z, source_has_planes ? 0.1f : INVALID_COST));
    return views.reasons({pixel.x, pixel.y});
  };
  Eigen::Vector3d ray;
  ASSERT_TRUE(unproject(rig.views[0].camera, {pixel.x, pixel.y}, ray));
  const double w = m.dot(ray);

  AgreeingViews views(generous, m);
  constexpr int radius = 5;  // of the patch
  cv::Scalar mean;
  cv::Scalar texture;
  cv::meanStdDev(views.fixture.view(0).image()(
                     cv::Rect(pixel.x - radius, pixel.y - radius, 2 * radius + 1, 2 * radius + 1)),
                 mean, texture);
  const double parallax = pixels_per_inverse_distance(rig.views[1], rig.views[0], ray, w) *
                          (1 / generous.min_distance - 1 / generous.max_distance);
  const double tilt = std::acos(w / m.norm()) * 180 / CV_PI;
  // Where the source's plane puts the point that both see in the same direction of the source.
  const Eigen::Isometry3d motion = source_from_reference(rig.views[1], rig.views[0]);
  const Eigen::Vector3d of_source = motion * (ray / w) / nearer;
  Eigen::Vector2d back;
  ASSERT_TRUE(project(rig.views[0].camera, motion.inverse() * of_source, back));
  const double displacement = (back - Eigen::Vector2d(pixel.x, pixel.y)).norm();

  struct Limit {
    double Options::*option;
    double truth;
    bool is_least;
    int reason;
    double tolerance;
  };
  for (const auto& [option, truth, is_least, reason, tolerance] :
       {Limit{&Options::min_texture, 255 * texture[0], true, REASON_NO_TEXTURE, 0.01},
        {&Options::max_cost, 0.1, false, REASON_HIGH_COST, 0.01},
        {&Options::min_parallax, parallax, true, REASON_LOW_PARALLAX, 0.1},
        {&Options::max_tilt, tilt, false, REASON_TILT, 0.01},
        {&Options::consistency_relative, 1 - 1 / nearer, false, REASON_INCONSISTENT, 0.01},
        {&Options::consistency_pixels, displacement, false, REASON_INCONSISTENT, 0.01}}) {
    EXPECT_EQ(reasons(option, truth * (1 - tolerance)), is_least ? 0 : reason) << reason;
    EXPECT_EQ(reasons(option, truth * (1 + tolerance)), is_least ? reason : 0) << reason;
  }
  EXPECT_EQ(reasons(&Options::consistency_pixels, 0, false), REASON_UNCHECKED);
}

TEST(Checks, DisplacementsAreKnownAtAndBeyondTheEndOfTheFieldOfView) {
  const Rig rig = fisheye_rig(96);
  KernelFixture fixture(rig, wide_range());
  fixture.set_reference(0);
  const ivec2 pixel(28, 66);
  const double w = 0.5;
  Eigen::Vector3d ray;
  ASSERT_TRUE(unproject(rig.views[0].camera, {pixel.x, pixel.y}, ray));
  const auto speed = [&] {
    return static_cast<double>(kernel::cpu::speed_in_sources(
        fixture.context(), pixel, to_kernel(ray), static_cast<float>(w)));
  };
  const double truth = pixels_per_inverse_distance(rig.views[1], rig.views[0], ray, w);
  EXPECT_NEAR(speed(), truth, 0.01 * truth);

  const Eigen::Isometry3d motion = source_from_reference(rig.views[1], rig.views[0]);
  const auto cosine = [&](double at) { return (motion * (ray / at)).normalized().z(); };
  for (const double end : {cosine(w), 1.0}) {
    fixture.schedule().parameters.cameras[1].domain.x = static_cast<float>(end);
    EXPECT_NEAR(speed(), truth, 0.2 * truth) << "pixels of the reference";
  }
  fixture.view(0).rays(pixel.y, pixel.x + 1)[3] = 0;
  EXPECT_EQ(speed(), 0) << "no ray beside tells how large a pixel is";
}

TEST(Checks, TheBestOfSeveralSourcesCounts) {
  Rig rig = fisheye_rig(96);
  rig.views.push_back(rig.views[1]);
  rig.views[2].name = "cam2";
  rig.views[1].world_from_camera.translation() *= 0.1;
  const Eigen::Vector3d m(0.05, 0.1, 0.5);
  Eigen::Vector3d ray;
  ASSERT_TRUE(unproject(rig.views[0].camera, {48, 48}, ray));
  Options options = wide_range();
  options.min_parallax = 0.5 *
                         pixels_per_inverse_distance(rig.views[2], rig.views[0], ray, m.dot(ray)) *
                         (1 / options.min_distance - 1 / options.max_distance);
  for (const char* far : {"last", "first"}) {
    SCOPED_TRACE(far);
    AgreeingViews views(options, m, rig);
    EXPECT_EQ(views.reasons({48, 48}), 0) << "parallax";
    for (const int wrong : {1, 2}) {
      cv::Mat planes = views.fixture.view(wrong).hypotheses;
      const cv::Mat right = planes.clone();
      planes *= 1.2;
      EXPECT_EQ(views.reasons({48, 48}), 0) << "cam" << wrong << " disagrees";
      right.copyTo(planes);
    }
    for (const int view : {1, 2}) views.fixture.view(view).hypotheses *= 1.2;
    EXPECT_EQ(views.reasons({48, 48}), REASON_INCONSISTENT);
    std::swap(rig.views[1], rig.views[2]);
  }
}

/// Far beyond its image a pinhole's model moves points as fast as anything.
TEST(Checks, SourcesInWhichThePointDoesNotLandTellNoSpeed) {
  Rig rig = fisheye_rig(96);
  for (View& view : rig.views) {
    view.camera.model = CameraModel::pinhole;
    view.camera.fx = view.camera.fy = 48;
  }
  const auto speed_at = [&](ivec2 pixel) {
    KernelFixture fixture(rig, wide_range());
    fixture.set_reference(0);
    return kernel::cpu::speed_in_sources(fixture.context(), pixel,
                                         to_kernel(fixture.view(0).rays(pixel.y, pixel.x)), 0.5f);
  };
  const ivec2 seen_by_both(80, 48), seen_by_one(20, 48);
  const float of_pair = speed_at(seen_by_one);
  EXPECT_GT(of_pair, 1);
  rig.views.push_back(rig.views[1]);
  rig.views[2].name = "cam2";
  rig.views[2].world_from_camera.translation().y() += 0.01;
  rig.views[2].world_from_camera.rotate(
      Eigen::AngleAxisd(50 * radians_per_degree, Eigen::Vector3d::UnitY()));
  EXPECT_EQ(speed_at(seen_by_one), of_pair);
  std::swap(rig.views[1], rig.views[2]);
  EXPECT_EQ(speed_at(seen_by_one), of_pair);
  const float of_all = speed_at(seen_by_both);
  rig.views.pop_back();
  EXPECT_GE(of_all, speed_at(seen_by_both));
  EXPECT_GT(speed_at(seen_by_one), 3 * of_pair) << "where no other sees the point";
}

TEST(Checks, ForAVoteTellWhatTheSourceShowsOfThePoint) {
  const Eigen::Vector3d normal = Eigen::Vector3d(0.1, 0.2, 1).normalized();
  AgreeingViews views(wide_range(), normal / 2);
  KernelFixture& fixture = views.fixture;
  fixture.show(render_plane(fixture.rig(), normal, 2), 0.5);
  fixture.set_reference(0);
  for (int x = 30; x < 66; x += 5) {
    ASSERT_EQ(views.reasons({x, 48}), 0);
    const float displacement = fixture.view(0).checks(48, x)[1];
    kernel::cpu::check_for_vote_pixel(fixture.context(), ivec2(x, 48));
    const cv::Vec4f check = fixture.view(0).checks(48, x);
    EXPECT_EQ(check[3], 0);
    EXPECT_EQ(check[0], 1) << "the source";
    EXPECT_EQ(check[1], displacement);
    EXPECT_NEAR(check[2], 0.5f * fixture.view(0).image().at<float>(48, x), 0.02);
  }
}

TEST(Checks, ForAVoteRepairWhatTheImagesContradict) {
  const auto reasons_at_cost = [](float cost) {
    AgreeingViews views(wide_range());
    views.fixture.view(0).hypotheses(48, 48)[3] = cost;
    kernel::cpu::check_for_vote_pixel(views.fixture.context(), ivec2(48, 48));
    return static_cast<int>(views.fixture.view(0).checks(48, 48)[3]);
  };
  EXPECT_EQ(reasons_at_cost(0.99f), 0);
  EXPECT_EQ(reasons_at_cost(1.01f), REASON_HIGH_COST);
}

/// Who asks for fewer and better points gets these, not other planes.
TEST(Checks, ForAVoteAreThoseOfAnyLimitsOfAcceptance) {
  Options strict = wide_range();
  strict.max_cost = 0.01;
  strict.min_parallax = 1e4;
  strict.consistency_relative = 1e-3;
  strict.consistency_pixels = 1e-3;
  strict.min_support = 1;
  AgreeingViews views(strict);
  KernelFixture& fixture = views.fixture;
  fixture.view(0).hypotheses(44, 44) *= 3;
  fixture.view(0).hypotheses(48, 48)[3] = 0.2f;
  fixture.view(1).hypotheses *= 1.005;
  for (cv::Vec4f& plane : fixture.view(1).hypotheses) plane[3] = 0;
  EXPECT_EQ(views.reasons({48, 48}) &
                (REASON_HIGH_COST | REASON_LOW_PARALLAX | REASON_INCONSISTENT | REASON_SPECKLE),
            REASON_HIGH_COST | REASON_LOW_PARALLAX | REASON_INCONSISTENT | REASON_SPECKLE);
  kernel::cpu::check_for_vote_pixel(fixture.context(), ivec2(48, 48));
  EXPECT_EQ(fixture.view(0).checks(48, 48)[3], 0);
}

TEST(Checks, ASmallIslandIsASpeckleAndALargeOneIsNot) {
  AgreeingViews views(wide_range());
  EXPECT_EQ(views.reasons({48, 48}) & REASON_SPECKLE, 0);
  const float alone = [&] {
    views.scale_square({48, 48}, 2, 3);
    EXPECT_NE(views.reasons({48, 48}) & REASON_SPECKLE, 0);
    return views.fixture.view(0).checks(48, 48)[2];
  }();
  views.scale_square({48, 48}, 14, 3);
  EXPECT_EQ(views.reasons({48, 48}) & REASON_SPECKLE, 0);
  EXPECT_LT(alone, views.fixture.view(0).checks(48, 48)[2]) << "confidence falls with support";
}

TEST(Checks, SpecklesHaveLessSupportThanTheOptionAsksFor) {
  Options options = wide_range();
  const auto is_speckle = [&](double min_support) {
    options.min_support = min_support;
    AgreeingViews views(options);
    // Half of the planes around: those of the other columns are farther or nearer.
    views.fixture.view(0).hypotheses.colRange(49, 96) *= 3;
    return (views.reasons({48, 48}) & REASON_SPECKLE) != 0;
  };
  EXPECT_FALSE(is_speckle(0.4));
  EXPECT_TRUE(is_speckle(0.6));
}

TEST(Checks, AgreementWithoutEvidenceIsNotConfident) {
  AgreeingViews views(wide_range());
  KernelFixture& fixture = views.fixture;
  const auto confidence_at_cost = [&](double cost_around) {
    const vec3 m = views.plane(0);
    fixture.view(0).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, cost_around));
    fixture.view(0).hypotheses(48, 48)[3] = 0.5f;
    views.reasons({48, 48});
    return fixture.view(0).checks(48, 48)[2];
  };
  EXPECT_GT(confidence_at_cost(0.1), 0.95);
  EXPECT_GT(confidence_at_cost(0.5), 0.6) << "enough to go by";
  EXPECT_LT(confidence_at_cost(0.5), 0.9) << "less than where all matches";
  EXPECT_LT(confidence_at_cost(0.9), 0.25);
  EXPECT_EQ(confidence_at_cost(1.0), 0);
  EXPECT_EQ(confidence_at_cost(1.3), 0) << "nor do contrary patches speak for a plane";
}

TEST(Checks, RejectWhatIsMoreLikelyWrongThanRight) {
  Options options = wide_range();
  const auto reasons_beside = [&](double least) {
    options.min_confidence = least;
    AgreeingViews views(options);
    for (int view = 0; view < 2; ++view) {
      const vec3 m = views.plane(view);
      views.fixture.view(view).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, 0.9));
    }
    views.fixture.view(0).hypotheses(48, 48)[3] = 0.4f;
    const int reasons = views.reasons({48, 48});
    return std::pair(reasons, views.fixture.view(0).checks(48, 48)[2]);
  };
  const float confidence = reasons_beside(0).second;
  EXPECT_EQ(Options().min_confidence, 0.5);
  EXPECT_LT(confidence, 0.5f);
  EXPECT_EQ(reasons_beside(0.5).first, REASON_LOW_CONFIDENCE) << "and no other";
  const auto limit = static_cast<double>(confidence);
  EXPECT_EQ(reasons_beside(limit).first, 0);
  EXPECT_EQ(reasons_beside(1.01 * limit).first, REASON_LOW_CONFIDENCE);
  EXPECT_EQ(reasons_beside(0).first, 0);
}

TEST(Checks, AgreementOnGradientsOfBrightnessIsNotCertain) {
  AgreeingViews views(wide_range());
  cv::Mat image = views.fixture.view(0).image();
  const auto mean_confidence = [&views] {
    views.fixture.interpolate();
    constexpr int step = 4;
    double sum = 0;
    int count = 0;
    for (int y = 32; y < 64; y += step) {
      for (int x = 32; x < 64; x += step, ++count) {
        views.reasons({x, y});
        sum += static_cast<double>(views.fixture.view(0).checks(y, x)[2]);
      }
    }
    return sum / count;
  };
  const double textured = mean_confidence();
  for (const double noise : {0.0, 0.004}) {
    gradient(image.size(), 0.003, 0, noise, 1).copyTo(image);
    const double blank = mean_confidence();
    image += 0.06 * smooth_noise(image.size(), 1);
    const double weak_texture = mean_confidence();
    EXPECT_GT(1 - blank, 8 * (1 - weak_texture)) << "noise " << noise;
    EXPECT_GT(weak_texture, textured) << "of strong texture that cost leaves more unexplained";
  }
  cv::RNG(1).fill(image, cv::RNG::NORMAL, 0.5, 0.06);
  EXPECT_GT(mean_confidence(), 0.95 * textured) << "texture as fine as noise";
  for (const int slope : {-1, 1}) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        image.at<float>(y, x) = static_cast<float>(0.5 + 0.1 * std::sin(0.4 * (x + slope * y)));
      }
    }
    EXPECT_GT(mean_confidence(), 0.95 * textured) << "stripes along either diagonal";
  }
}

TEST(Checks, TextureAlongEpipolarCurvesTellsNothing) {
  const Rig rig = fisheye_rig(192);
  AgreeingViews views(wide_range("fast"), {0.05, 0.1, 0.5}, rig);
  KernelFixture& fixture = views.fixture;
  fixture.set_reference(0);
  const Eigen::Vector3d baseline = rig.views[1].world_from_camera.translation().normalized();
  const Eigen::Vector3d beside = baseline.unitOrthogonal();
  cv::Mat image = fixture.view(0).image();
  /// Of waves, `turn` radians from those that lie along the epipolar curves.
  const auto confidence = [&](double turn) {
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols; ++x) {
        const Eigen::Vector3d ray = fixture.ray(0, {x, y});
        const double across = std::atan2(ray.dot(baseline.cross(beside)), ray.dot(beside));
        const double along = std::log(std::tan(std::acos(ray.dot(baseline)) / 2));
        const double phase = 40 * (std::cos(turn) * across + std::sin(turn) * along);
        image.at<float>(y, x) = static_cast<float>(0.5 + 0.2 * std::sin(phase));
      }
    }
    fixture.interpolate();
    double sum = 0;
    for (const ivec2 pixel : {ivec2(96, 96), ivec2(60, 110), ivec2(120, 70)}) {
      views.reasons(pixel);
      sum += static_cast<double>(fixture.view(0).checks(pixel.y, pixel.x)[2]);
    }
    return sum / 3;
  };
  for (const double turn : {0.0, 0.15}) EXPECT_LT(confidence(turn), 0.5) << turn;
  EXPECT_LT(confidence(0.15), confidence(0.35));
  for (const double turn : {0.8, -0.8, CV_PI / 2}) EXPECT_GT(confidence(turn), 0.95) << turn;
}

TEST(Checks, AgreementTellsLessWhereTheMatchLeavesMoreThanNoiseUnexplained) {
  AgreeingViews views(wide_range());
  cv::Mat image = views.fixture.view(0).image();
  const auto confidence = [&](double contrast, double noise) {
    cv::Mat grains(image.size(), CV_32FC1);
    cv::RNG(1).fill(grains, cv::RNG::NORMAL, 0, noise);
    cv::Mat(contrast * smooth_noise(image.size(), 1) + grains + 0.2).copyTo(image);
    views.fixture.interpolate();
    views.fixture.view(0).hypotheses(48, 48)[3] = 0.4f;
    views.reasons({48, 48});
    return views.fixture.view(0).checks(48, 48)[2];
  };
  const float explained = confidence(0.1, 0.008);
  EXPECT_GT(explained, 0.97f);
  EXPECT_LT(confidence(0.5, 0.008), explained);
  EXPECT_GT(1 - confidence(0.5, 0), 2 * (1 - explained)) << "without noise";
}

TEST(Checks, PlanesHeldAtAnEndOfTheRangeOfDistancesAreSuspect) {
  const Eigen::Vector3d plane(0.1, 0.2, 1);
  AgreeingViews views(wide_range(), plane, fisheye_rig(192));
  KernelFixture& fixture = views.fixture;
  const ivec2 pixel(96, 96);
  const double w = plane.dot(fixture.ray(0, pixel));
  const double speed = pixels_per_inverse_distance(fixture.rig().views[1], fixture.rig().views[0],
                                                   fixture.ray(0, pixel), w);
  auto& range = fixture.schedule().parameters.range;
  /// Of a match of that cost, so many pixels from the farthest and the nearest distance.
  const auto confidence = [&](float cost, double to_far, double to_near) {
    range.z = static_cast<float>(w - to_far / speed);
    range.w = static_cast<float>(w + to_near / speed);
    fixture.view(0).hypotheses(pixel.y, pixel.x)[3] = cost;
    views.reasons(pixel);
    return fixture.view(0).checks(pixel.y, pixel.x)[2];
  };
  ASSERT_GT(speed * w, 6) << "there is room beyond the farthest distance";
  const double everywhere = speed * w;
  const float amid = confidence(0.5f, everywhere, 100);
  EXPECT_GT(amid, 0.95f);
  for (const bool far : {true, false}) {
    const auto from_end = [&](float cost, double pixels) {
      return far ? confidence(cost, pixels, 100) : confidence(cost, everywhere, pixels);
    };
    EXPECT_LT(from_end(0.5f, 0), 0.6f) << far;
    EXPECT_LT(from_end(0.5f, 0), from_end(0.5f, 2)) << far;
    EXPECT_LT(from_end(0.5f, 2), from_end(0.5f, 4)) << far;
    EXPECT_GT(from_end(0.02f, 0), 0.9f) << "it matches there; " << far;
  }
  // Far away: the same at 1 / 100 of the inverse distance.
  fixture.view(0).hypotheses(pixel.y, pixel.x) = [&] {
    const vec3 m = 0.01f * views.plane(0);
    return cv::Vec4f(m.x, m.y, m.z, 0.5f);
  }();
  const auto at_infinity = [&](double farthest_w) {
    range.z = static_cast<float>(farthest_w);
    range.w = 10;
    views.reasons(pixel);
    return fixture.view(0).checks(pixel.y, pixel.x)[2];
  };
  EXPECT_GT(at_infinity(0.01 * w), 0.94f * at_infinity(0)) << "nothing lies beyond";
}

TEST(Checks, APlaneBesideAFartherSurfaceThatLooksLikeItIsDoubted) {
  const ivec2 pixel(48, 48);
  /// Of being right, with planes scaled from that column on, and the pixels there, 3 px off, that
  /// much brighter.
  const auto odds = [&](float factor, int first_column, float brighter) {
    AgreeingViews views(wide_range());
    KernelFixture& fixture = views.fixture;
    const vec3 m = factor * views.plane(0);
    fixture.view(0)
        .hypotheses.colRange(first_column, fixture.view(0).hypotheses.cols)
        .setTo(cv::Scalar(m.x, m.y, m.z, 0.1));
    cv::Mat image = fixture.view(0).image();
    for (int y = pixel.y - 3; y <= pixel.y + 3; y += 3) {
      image.at<float>(y, pixel.x + 3) = image.at<float>(pixel.y, pixel.x) + brighter;
    }
    fixture.interpolate();
    views.reasons(pixel);
    const float confidence = fixture.view(0).checks(pixel.y, pixel.x)[2];
    return confidence / (1 - confidence);
  };
  constexpr float farther = 0.8f;
  constexpr float nearer = 1.25f;
  const float doubted = odds(farther, pixel.x + 3, 0);
  EXPECT_GT(odds(nearer, pixel.x + 3, 0), 3.5f * doubted) << "a nearer one beside";
  EXPECT_GT(odds(farther, pixel.x + 3, 0.2f), 2.5f * doubted) << "another surface";
  EXPECT_GT(odds(farther, pixel.x + 4, 0), 3.5f * doubted) << "out of reach";
  EXPECT_GT(odds(0.99f, pixel.x + 3, 0), 1.5f * doubted) << "by less than a pixel";
}

TEST(Checks, ABetterMatchElsewhereIsAmbiguous) {
  Options options = wide_range();
  options.ambiguity_margin = 0.2;
  AgreeingViews views(options);
  const auto added_at_cost = [&](double cost, int places) {
    const vec3 m = views.plane(0);
    views.fixture.view(0).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, cost));
    views.fixture.pass().places = places;
    const int before = views.reasons({48, 48});
    kernel::cpu::ambiguity_pixel(views.fixture.context(), {48, 48});
    return static_cast<int>(views.fixture.view(0).checks(48, 48)[3]) - before;
  };
  // Unrelated images: some other place always matches much better than the worst cost.
  EXPECT_EQ(added_at_cost(1.9, 6), REASON_AMBIGUOUS);
  EXPECT_EQ(added_at_cost(0.1, 6), 0);
  EXPECT_EQ(added_at_cost(1.9, 0), 0) << "nowhere else";
  EXPECT_EQ(added_at_cost(2, 6), 0) << "no plane";
}

TEST(Checks, ABetterMatchElsewhereLiesToEitherSideAndMatchesBetterByTheMargin) {
  Options options = wide_range("fast");
  options.ambiguity_margin = 0.2;
  const Eigen::Vector3d normal = Eigen::Vector3d(0.2, 0.1, 1).normalized();
  const Eigen::Vector3d wall = normal / 2;
  KernelFixture fixture(fisheye_rig(128), options);
  fixture.show(render_plane(fixture.rig(), normal, 2));
  fixture.set_reference(0);
  // Share of the pixels that find the wall, held that many source pixels too near.
  const auto share = [&](double pixels, float cost) {
    constexpr int places = 6;
    fixture.pass().places = places;
    int ambiguous = 0;
    int count = 0;
    for (int y = 34; y < 94; y += 5) {
      for (int x = 34; x < 94; x += 5, ++count) {
        Eigen::Vector3d ray;
        EXPECT_TRUE(unproject(fixture.rig().views[0].camera, {x, y}, ray));
        const double w = wall.dot(ray);
        const double speed =
            pixels_per_inverse_distance(fixture.rig().views[1], fixture.rig().views[0], ray, w);
        const vec3 m = to_kernel((1 + pixels / speed / w) * wall);
        fixture.view(0).hypotheses(y, x) = cv::Vec4f(m.x, m.y, m.z, cost);
        fixture.view(0).checks(y, x) = cv::Vec4f(0, 0, 1, 0);
        kernel::cpu::ambiguity_pixel(fixture.context(), {x, y});
        ambiguous += fixture.view(0).checks(y, x)[3] == REASON_AMBIGUOUS;
      }
    }
    return static_cast<double>(ambiguous) / count;
  };
  for (const double pixels : {-8.0, -4.0, -2.0, 2.0, 4.0, 8.0}) {
    // A displacement of eight pixels is so many at the wall itself alone.
    EXPECT_GT(share(pixels, 0.5f), std::abs(pixels) < 8 ? 0.9 : 0.7) << pixels << " px";
    EXPECT_EQ(share(pixels, 0.15f), 0) << pixels << " px, less than the margin better";
  }
}

TEST(Checks, PlanesThatContradictEachOtherByAnyAmountAreInconsistent) {
  Rig rig = fisheye_rig(96);
  for (View& view : rig.views) {
    view.camera.model = CameraModel::pinhole;
    view.camera.fx = view.camera.fy = 900;
    view.world_from_camera.linear().setIdentity();
  }
  AgreeingViews views(wide_range(), {0, 0, 0.2}, rig);
  const ivec2 pixel(48, 48);
  for (const float nearer : {1.0f, 4.0f, 100.0f}) {  // by 54 and 1,800 pixels
    const vec3 held = nearer * views.plane(1);
    views.fixture.view(1).hypotheses.setTo(cv::Scalar(held.x, held.y, held.z, 0.1));
    const int reasons = views.reasons(pixel);
    EXPECT_EQ((reasons & REASON_INCONSISTENT) != 0, nearer > 1) << nearer;
    EXPECT_EQ(reasons & REASON_UNCHECKED, 0) << nearer;
  }
}

TEST(Fill, RejectedPixelsTakeTheFartherSurfaceAndAreMarked) {
  Options options = wide_range();
  options.fill_radius = 10;
  AgreeingViews views(options);
  KernelFixture& fixture = views.fixture;
  fixture.view(0).priors = cv::Mat::zeros(96, 96, CV_32FC4);
  fixture.view(0).image().setTo(0.5);
  const vec3 m = views.plane(0);
  // A nearer object on the left, the surface behind it on the right, and rejected pixels between.
  fixture.view(0).hypotheses.colRange(0, 44).setTo(cv::Scalar(3 * m.x, 3 * m.y, 3 * m.z, 0.1));
  cv::Mat between = fixture.view(0).hypotheses.colRange(44, 50);
  between.setTo(cv::Scalar(2 * m.x, 2 * m.y, 2 * m.z, 0.3));
  fixture.view(0).checks.setTo(cv::Scalar(0, 0, 0.9, 0));
  fixture.view(0).checks.colRange(44, 50).setTo(cv::Scalar(0.5, 9, 0.1, REASON_INCONSISTENT));
  fixture.pass().radius = options.fill_radius;
  fixture.pass().candidates = REASON_NO_RAY;
  const auto fill = [&](ivec2 pixel) {
    kernel::cpu::fill_pixel(fixture.context(), pixel);
    kernel::cpu::adopt_fill_pixel(fixture.context(), pixel);
    return fixture.view(0).checks(pixel.y, pixel.x);
  };

  const cv::Vec4f check = fill({46, 48});
  const cv::Vec4f filled = fixture.view(0).hypotheses(48, 46);
  EXPECT_EQ(static_cast<int>(check[3]), REASON_INCONSISTENT | REASON_FILLED);
  EXPECT_EQ(check[2], 0) << "nothing is known about it";
  EXPECT_EQ(cv::Vec2f(check[0], check[1]), cv::Vec2f(0.5f, 9)) << "those of the rejected plane";
  EXPECT_FLOAT_EQ(filled[2], m.z);
  EXPECT_LE(filled[3], NO_INFORMATION_COST);

  EXPECT_EQ(fill({60, 48})[3], 0) << "accepted pixels stay";
  fixture.view(0).checks(48, 45)[3] = REASON_NO_RAY;
  EXPECT_EQ(static_cast<int>(fill({45, 48})[3]), REASON_NO_RAY) << "left out as asked for";
  fixture.view(0).checks.setTo(cv::Scalar(0, 0, 0, REASON_HIGH_COST));
  fixture.view(0).checks.colRange(70, 96).setTo(cv::Scalar(0, 0, 0.9, 0));
  EXPECT_EQ(static_cast<int>(fill({47, 48})[3]), REASON_HIGH_COST) << "too far away";
}

/// A rejected pixel in the middle of others, and what of its surroundings is accepted.
class FillOfAPixel : public ::testing::Test {
 protected:
  FillOfAPixel() : views_(wide_range()), m_(views_.plane(0)) {
    KernelFixture& fixture = views_.fixture;
    fixture.view(0).image().setTo(0.5);
    fixture.view(0).checks.setTo(cv::Scalar(0, 0, 0, REASON_HIGH_COST));
    fixture.pass().radius = 10;
    fixture.pass().candidates = REASON_NO_RAY;
  }

  /// A pixel, from the rejected one, that holds a multiple of the plane and is accepted.
  void accept(int dx, int dy, float factor, float intensity = 0.5f) {
    ViewMemory& view = views_.fixture.view(0);
    view.hypotheses(y + dy, x + dx) = cv::Vec4f(factor * m_.x, factor * m_.y, factor * m_.z, 0.1f);
    view.checks(y + dy, x + dx) = cv::Vec4f(0, 0, 0.9f, 0);
    view.image()(y + dy, x + dx) = intensity;
  }

  /// The multiple that the pixel would take over; 0 where there is none.
  float filled() {
    kernel::cpu::fill_pixel(views_.fixture.context(), {x, y});
    const ViewMemory& view = views_.fixture.view(0);
    const auto number = static_cast<int>(view.priors(y, x)[3]);
    if (number == 0) return 0;
    const ivec2 place = kernel::cpu::place_of_step(number);
    return view.hypotheses(y + place.y, x + place.x)[2] / m_.z;
  }

  using ViewMemory = kernel::cpu::ViewMemory;
  static constexpr int x = 48;
  static constexpr int y = 48;
  AgreeingViews views_;
  vec3 m_;
};

TEST_F(FillOfAPixel, LooksEquallyFarInEightDirections) {
  for (int i = 0; i < 9; ++i) {
    const int dx = i % 3 - 1;
    const int dy = i / 3 - 1;
    if (dx == 0 && dy == 0) continue;
    const int reach = dx != 0 && dy != 0 ? 7 : 10;  // the same circle
    for (const int far : {reach, reach + 1}) {
      views_.fixture.view(0).checks.setTo(cv::Scalar(0, 0, 0, REASON_HIGH_COST));
      accept(far * dx, far * dy, 2);
      EXPECT_EQ(filled(), far == reach ? 2 : 0) << dx << ", " << dy;
    }
  }
}

TEST_F(FillOfAPixel, TakesTheMedianOfASurface) {
  accept(-3, 0, 1);
  accept(5, 0, 1.01f);
  accept(0, 7, 1.02f);
  EXPECT_FLOAT_EQ(filled(), 1.01f);
}

TEST_F(FillOfAPixel, GoesByIntensity) {
  accept(-3, 0, 1, 0.8f);
  accept(5, 0, 3, 0.5f);
  EXPECT_FLOAT_EQ(filled(), 3) << "the nearer surface, which looks alike";
}

TEST_F(FillOfAPixel, TakesNoPlaneThatIsOutOfRange) {
  accept(-3, 0, 1);
  accept(5, 0, 3);
  views_.fixture.schedule().parameters.range.z = m_.z * 2;
  EXPECT_FLOAT_EQ(filled(), 3);
}

constexpr int to_the_right = 5;  // of the directions, row by row

TEST(Fill, NumbersStepsOfAllDirections) {
  for (int direction = 0; direction < 9; ++direction) {
    for (const int step : {1, 2, 9999, 10000}) {
      const int number = kernel::cpu::numbered_step(direction, step);
      EXPECT_GT(number, 0);
      const ivec2 place = kernel::cpu::place_of_step(static_cast<int>(static_cast<float>(number)));
      EXPECT_EQ(place.x, step * (direction % 3 - 1)) << direction;
      EXPECT_EQ(place.y, step * (direction / 3 - 1)) << direction;
    }
  }
}

/// The plane of the pixel on the right, as fill_pixel() does.
void offer(kernel::cpu::ViewMemory& view, ivec2 pixel, vec3 m) {
  view.hypotheses(pixel.y, pixel.x + 1) = cv::Vec4f(m.x, m.y, m.z, 0.1f);
  const auto number = static_cast<float>(kernel::cpu::numbered_step(to_the_right, 1));
  view.priors(pixel.y, pixel.x) = cv::Vec4f(0, 0, 0, number);
}

TEST(Fill, WithMatchesLeavesPixelsThatAgreeWithTheSourceAndMatchBetter) {
  Options options = wide_range();
  AgreeingViews views(options);
  KernelFixture& fixture = views.fixture;
  const ivec2 pixel(48, 48);
  const vec3 m = views.plane(0);
  const auto is_filled = [&](unsigned how, float cost, float displacement) {
    fixture.view(0).hypotheses(pixel.y, pixel.x) = cv::Vec4f(2 * m.x, 2 * m.y, 2 * m.z, cost);
    offer(fixture.view(0), pixel, m);
    fixture.view(0).checks(pixel.y, pixel.x) =
        cv::Vec4f(0.1f, displacement, 0.5f, REASON_INCONSISTENT);
    fixture.pass().candidates = how;
    kernel::cpu::adopt_fill_pixel(fixture.context(), pixel);
    return fixture.view(0).hypotheses(pixel.y, pixel.x)[2] == m.z;
  };
  const float beyond = static_cast<float>(options.consistency_pixels) + 0.5f;
  // Unrelated images: the plane that is offered matches badly.
  EXPECT_FALSE(is_filled(FILL_WITH_MATCHES, 0.3f, 0.5f));
  EXPECT_EQ(static_cast<int>(fixture.view(0).checks(pixel.y, pixel.x)[3]), REASON_INCONSISTENT);
  EXPECT_TRUE(is_filled(FILL_WITH_MATCHES, 1.9f, 0.5f)) << "as bad a match as any";
  EXPECT_TRUE(is_filled(FILL_WITH_MATCHES, 0.3f, beyond)) << "perhaps occluded";
  EXPECT_TRUE(is_filled(0, 0.3f, 0.5f)) << "rejected for good";
}

TEST(Fill, ReachesTheRightPixelsOfImagesThatAreNotSquare) {
  KernelFixture fixture(fisheye_rig(cv::Size(96, 72)), wide_range());
  fixture.set_reference(0);
  fixture.view(0).image().setTo(0.5);
  fixture.view(0).checks.setTo(cv::Scalar(0, 0, 0, REASON_HIGH_COST));
  fixture.view(0).checks(36, 45) = cv::Vec4f(0, 0, 0.9f, 0);
  fixture.view(0).hypotheses(36, 45) = cv::Vec4f(0.05f, 0.1f, 0.5f, 0.1f);
  fixture.pass().radius = 10;
  fixture.pass().candidates = REASON_NO_RAY;
  kernel::cpu::fill_pixel(fixture.context(), {48, 36});
  EXPECT_EQ(fixture.view(0).priors(36, 48)[3], kernel::cpu::numbered_step(3, 3)) << "to the left";
  kernel::cpu::adopt_fill_pixel(fixture.context(), {48, 36});
  EXPECT_EQ(fixture.view(0).hypotheses(36, 48)[2], 0.5f);
}

TEST(Fill, WithMatchesMayMatchALittleWorse) {
  const vec3 offered(0.05f, 0.1f, 0.5f);
  KernelFixture fixture(fisheye_rig(96), wide_range());
  fixture.set_reference(0);
  fixture.pass().candidates = FILL_WITH_MATCHES;
  const float cost =
      std::min(kernel::cpu::patch_cost(fixture.context(), {48, 48}, offered), NO_INFORMATION_COST);
  for (const auto& [better, is_filled] : {std::pair(0.08f, true), {0.12f, false}}) {
    fixture.view(0).hypotheses(48, 48) =
        cv::Vec4f(2 * offered.x, 2 * offered.y, 2 * offered.z, cost - better);
    offer(fixture.view(0), {48, 48}, offered);
    fixture.view(0).checks(48, 48) = cv::Vec4f(0.1f, 0.5f, 0.5f, REASON_INCONSISTENT);
    kernel::cpu::adopt_fill_pixel(fixture.context(), {48, 48});
    EXPECT_EQ(fixture.view(0).hypotheses(48, 48)[2] == offered.z, is_filled) << better;
  }
}

TEST(Checks, ASourceThatTellsLittleCountsWhereNoOtherHasAPlane) {
  const vec3 wall(0.05f, 0.1f, 0.5f);
  for (const std::vector<double>& baselines : {std::vector<double>{0.01, 1}, {1, 0.01}}) {
    KernelFixture fixture(rig_of_baselines(96, baselines), wide_range());
    fixture.set_reference(0);
    fixture.hold_in_all_views(wall);
    fixture.view(baselines[0] == 1 ? 1 : 2).hypotheses.setTo(cv::Scalar(0, 0, 0, INVALID_COST));
    const kernel::vec2 difference = kernel::cpu::difference_from_nearest(
        fixture.context(), {48, 48}, to_kernel(fixture.view(0).rays(48, 48)), wall);
    EXPECT_LT(difference.y, 0.01f);
  }
}

TEST(Checks, PixelsWithoutPlanesAreNoSurroundings) {
  const vec3 wall(0.05f, 0.1f, 0.5f);
  KernelFixture fixture(fisheye_rig(96), wide_range());
  fixture.set_reference(0);
  fixture.hold_in_all_views(wall);
  fixture.view(0).hypotheses.colRange(50, 96).setTo(cv::Scalar(0, 0, 0, INVALID_COST));
  const vec3 ray = to_kernel(fixture.view(0).rays(48, 48));
  const kernel::vec2 support =
      kernel::cpu::support_of_surroundings(fixture.context(), {48, 48}, ray, dot(wall, ray), 3);
  EXPECT_FLOAT_EQ(support.x, 1);
  EXPECT_NEAR(support.y, 0.81f, 1e-4);  // of cost 0.1
}

TEST(Checks, DirectionsTurnInTheSourceAsTheirDerivativesSay) {
  const Rig rig = fisheye_rig(96);
  KernelFixture fixture(rig, wide_range());
  fixture.set_reference(0);
  const Eigen::Isometry3d motion = source_from_reference(rig.views[1], rig.views[0]);
  for (const ivec2 pixel : {ivec2(48, 48), ivec2(70, 48), ivec2(28, 66), ivec2(85, 45)}) {
    constexpr double w = 0.5, step = 1e-4;
    const Eigen::Vector3d ray = fixture.ray(0, pixel);
    const auto direction = [&](double at) { return (motion * (ray / at)).normalized(); };
    const double truth = direction(w - step).cross(direction(w + step)).norm() / (2 * step);
    const float turn =
        kernel::cpu::turn_in_source(fixture.context(), 1, to_kernel(ray), static_cast<float>(w));
    EXPECT_NEAR(static_cast<double>(turn), truth, 0.02 * truth) << pixel.x;
  }
}

TEST(Checks, PixelsOfPanoramasAreNarrow) {
  Rig rig = fisheye_rig(96);
  for (View& view : rig.views) view.camera = whole_sphere(144, 72);
  KernelFixture fixture(rig, wide_range());
  fixture.set_reference(0);
  for (const int y : {12, 36, 60}) {
    const double latitude = (0.5 - (y + 0.5) / 72) * CV_PI;
    const float squeeze =
        kernel::cpu::squeeze_of(fixture.context(), {40, y}, to_kernel(fixture.view(0).rays(y, 40)));
    EXPECT_NEAR(static_cast<double>(squeeze), std::pow(std::cos(latitude), 2), 0.01) << y;
  }
}

}  // namespace
}  // namespace widestereo::test
