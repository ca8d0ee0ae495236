// SPDX-License-Identifier: MIT
#include "widestereo/rig_refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "data_folder.h"
#include "error_of.h"
#include "geometry/angle.h"
#include "widestereo/calibration.h"
#include "widestereo/error.h"
#include "widestereo/image_io.h"

namespace widestereo {
namespace {

Eigen::AngleAxisd turned(double degrees, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(degrees * radians_per_degree, axis.normalized());
}

/// Three views of two models, somewhere in the common frame.
Rig true_rig() {
  Camera fisheye;
  fisheye.model = CameraModel::double_sphere;
  fisheye.width = fisheye.height = 512;
  fisheye.fx = fisheye.fy = 158;
  fisheye.cx = 255;
  fisheye.cy = 257;
  fisheye.xi = -0.17;
  fisheye.alpha = 0.59;
  Camera equidistant = fisheye;
  equidistant.model = CameraModel::kannala_brandt;
  equidistant.max_theta = 95 * radians_per_degree;
  equidistant.k1 = 0.01;
  equidistant.k2 = -0.002;
  const Eigen::Isometry3d base = Eigen::Translation3d(3, -2, 1) * turned(70, {1, 2, 3});
  Rig rig;
  rig.views = {{"cam0", fisheye, base, {}},
               {"cam1", equidistant, base * Eigen::Translation3d(0.1, 0.004, -0.01), {}},
               {"cam2", fisheye, base * Eigen::Translation3d(-0.03, 0.2, 0.02), {}}};
  rig.views[1].world_from_camera.rotate(turned(4, {1, -1, 2}));
  rig.views[2].world_from_camera.rotate(turned(9, {-1, 3, 1}));
  return rig;
}

/// `rig` with views 1 and 2 turned by `degrees` and seen by view 0 that far away from where they
/// are.
Rig displaced(Rig rig, double degrees) {
  const Eigen::Vector3d origin = rig.views[0].world_from_camera.translation();
  for (const std::size_t i : {1, 2}) {
    Eigen::Isometry3d& pose = rig.views[i].world_from_camera;
    const Eigen::Vector3d arm = pose.translation() - origin;
    pose.linear() = turned(degrees, {2, i == 1 ? 1.0 : -1.0, 1}) * pose.linear();
    pose.translation() = origin + turned(degrees, arm.unitOrthogonal()) * arm;
  }
  return rig;
}

struct Scene {
  double nearest = 0.4, farthest = 6;  ///< metres
  double noise = 0;                    ///< pixels, standard deviation
  double false_matches = 0;            ///< share
  unsigned seed = 1;
};

std::vector<ViewMatches> matches_of(const Rig& rig, const Scene& scene, int count = 400) {
  std::mt19937 random(scene.seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  std::normal_distribution<double> noise(0, 1);
  std::uniform_real_distribution<double> inverse(1 / scene.farthest, 1 / scene.nearest);
  std::vector<ViewMatches> pairs = {{0, 1, {}}, {0, 2, {}}, {2, 1, {}}};
  for (ViewMatches& pair : pairs) {
    const View& first = rig.views[pair.first];
    const View& second = rig.views[pair.second];
    while (static_cast<int>(pair.matches.size()) < count) {
      const Eigen::Vector3d ray =
          Eigen::Vector3d(unit(random), unit(random), unit(random) + 0.7).normalized();
      const Eigen::Vector3d point = ray / inverse(random);
      const Eigen::Vector3d seen = source_from_reference(second, first) * point;
      PixelMatch match;
      if (!project(first.camera, point, match.first) || !project(second.camera, seen, match.second))
        continue;
      for (double* at : {&match.first.x(), &match.first.y(), &match.second.x(), &match.second.y()})
        *at += scene.noise * noise(random);
      if (unit(random) < 2 * scene.false_matches - 1)
        match.second += Eigen::Vector2d(60 * unit(random), 60 * unit(random));
      pair.matches.push_back(match);
    }
  }
  return pairs;
}

double rotation_error(const Rig& a, const Rig& b, std::size_t view) {
  return Eigen::AngleAxisd(a.views[view].world_from_camera.linear() *
                           b.views[view].world_from_camera.linear().transpose())
             .angle() /
         radians_per_degree;
}

Eigen::Vector3d arm(const Rig& rig, std::size_t view) {
  return rig.views[view].world_from_camera.translation() -
         rig.views[0].world_from_camera.translation();
}

TEST(RigRefinement, FindsTheTruePosesFromExactMatches) {
  const Rig truth = true_rig();
  const Rig calibrated = displaced(truth, 0.4);
  const RigRefinement refined = refine_rig(calibrated, matches_of(truth, {}));
  for (const std::size_t view : {1, 2}) {
    // Nearly: the calibration counts a little, too.
    EXPECT_LT(rotation_error(refined.rig, truth, view), 2e-4);
    EXPECT_LT(degrees_between(arm(refined.rig, view), arm(truth, view)), 2e-3);
    EXPECT_NEAR(arm(refined.rig, view).norm(), arm(truth, view).norm(), 1e-12);
    EXPECT_NEAR(refined.views[view].rotation.change, 0.4, 1e-3);
    EXPECT_NEAR(refined.views[view].direction.change, 0.4, 1e-2);
    EXPECT_EQ(refined.rig.views[view].camera.fx, calibrated.views[view].camera.fx);
    EXPECT_EQ(refined.views[view].focal_length.change, 0);
    EXPECT_EQ(refined.views[view].focal_length.deviation, 0);
  }
  EXPECT_TRUE(refined.rig.views[0].world_from_camera.isApprox(truth.views[0].world_from_camera));
  EXPECT_EQ(refined.views[0].rotation.deviation, 0);
  ASSERT_EQ(refined.after.size(), 3u);
  for (std::size_t pair = 0; pair < 3; ++pair) {
    EXPECT_GT(refined.before[pair].median_pixels, 0.3);
    EXPECT_LT(refined.after[pair].median_pixels, 2e-3);
  }
}

TEST(RigRefinement, FindsIntrinsicsWhereAsked) {
  const Rig truth = true_rig();
  Rig calibrated = displaced(truth, 0.2);
  for (View& view : calibrated.views) {
    view.camera.fx *= 1.005;
    view.camera.fy *= 1.005;
    view.camera.cx += 1.2;
    view.camera.cy -= 0.8;
  }
  const std::vector<ViewMatches> matches = matches_of(truth, {}, 1000);
  const RigRefinement refined = refine_rig(calibrated, matches, true);
  for (std::size_t view = 0; view < 3; ++view) {
    const Camera& camera = refined.rig.views[view].camera;
    EXPECT_NEAR(camera.fx / truth.views[view].camera.fx, 1, 2e-4);
    EXPECT_NEAR(camera.fy / truth.views[view].camera.fy, 1, 2e-4);
    EXPECT_NEAR(camera.cx, truth.views[view].camera.cx, 0.05);
    EXPECT_NEAR(camera.cy, truth.views[view].camera.cy, 0.05);
    EXPECT_NEAR(refined.views[view].focal_length.change, 0.5, 0.02);
    EXPECT_NEAR(refined.views[view].principal_point.change, std::hypot(1.2, 0.8), 0.1);
    EXPECT_LT(rotation_error(refined.rig, truth, view), 0.02);
  }
  EXPECT_LT(refined.after[0].median_pixels,
            0.25 * refine_rig(calibrated, matches).after[0].median_pixels);
}

TEST(RigRefinement, DeviationsSayHowFarFromTheTruthItIs) {
  const Rig truth = true_rig();
  const Rig calibrated = displaced(truth, 0.2);
  constexpr int seeds = 40;
  double rotation = 0;
  double direction = 0;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    const RigRefinement refined =
        refine_rig(calibrated, matches_of(truth, {.noise = 0.3, .seed = seed}, 200));
    const ViewRefinement& view = refined.views[1];
    rotation += std::pow(rotation_error(refined.rig, truth, 1) / view.rotation.deviation, 2);
    direction +=
        std::pow(degrees_between(arm(refined.rig, 1), arm(truth, 1)) / view.direction.deviation, 2);
  }
  // Of the least certain direction; the others add to the error.
  EXPECT_GT(std::sqrt(rotation / seeds), 0.7);
  EXPECT_LT(std::sqrt(rotation / seeds), 1.7);
  EXPECT_GT(std::sqrt(direction / seeds), 0.7);
  EXPECT_LT(std::sqrt(direction / seeds), 1.5);
}

TEST(RigRefinement, FalseMatchesDoNoHarm) {
  const Rig truth = true_rig();
  const RigRefinement refined =
      refine_rig(displaced(truth, 0.4), matches_of(truth, {.noise = 0.2, .false_matches = 0.25}));
  for (const std::size_t view : {1, 2}) {
    EXPECT_LT(rotation_error(refined.rig, truth, view), 0.02);
    EXPECT_LT(degrees_between(arm(refined.rig, view), arm(truth, view)), 0.2);
  }
}

/// Parallax is no larger than noise there, and that of false matches a hundred times as large.
TEST(RigRefinement, FarScenesTellDirectionsAsWellAsDeviationsSay) {
  const Rig truth = true_rig();
  const Rig calibrated = displaced(truth, 0.1);
  for (const double false_matches : {0.0, 0.1}) {
    double squares = 0;
    constexpr int seeds = 6;
    for (unsigned seed = 0; seed < seeds; ++seed) {
      const RigRefinement refined =
          refine_rig(calibrated, matches_of(truth,
                                            {.nearest = 20,
                                             .farthest = 100,
                                             .noise = 0.3,
                                             .false_matches = false_matches,
                                             .seed = seed},
                                            1500));
      for (const std::size_t view : {1, 2}) {
        EXPECT_LT(rotation_error(refined.rig, truth, view), 0.05);
        squares += std::pow(degrees_between(arm(refined.rig, view), arm(truth, view)) /
                                refined.views[view].direction.deviation,
                            2);
      }
    }
    EXPECT_LT(std::sqrt(squares / (2 * seeds)), 2.5) << false_matches;
  }
}

TEST(RigRefinement, WhatMatchesDoNotTellStaysNearTheCalibration) {
  // Points at infinity tell rotations alone; their noise is taken for a little parallax.
  const Rig truth = true_rig();
  const Rig calibrated = displaced(truth, 0.4);
  const RigRefinement refined =
      refine_rig(calibrated, matches_of(truth, {.nearest = 1e6, .farthest = 1e8, .noise = 0.1}));
  for (const std::size_t view : {1, 2}) {
    EXPECT_LT(rotation_error(refined.rig, truth, view), 0.02);
    EXPECT_LT(degrees_between(arm(refined.rig, view), arm(calibrated, view)), 2);
    EXPECT_GT(refined.views[view].direction.deviation, 1);
  }
}

TEST(RigRefinement, LeavesOutWhatIsMasked) {
  const Rig truth = true_rig();
  for (const int begin : {200, 310}) {  // of what is seen: most of the image, and less than half
    Rig calibrated = displaced(truth, 0.4);
    cv::Mat mask(512, 512, CV_8UC1, cv::Scalar(255));
    mask.colRange(0, begin).setTo(0);
    calibrated.views[1].mask = mask;
    std::vector<ViewMatches> matches = matches_of(truth, {});
    int masked = 0;
    for (ViewMatches& pair : matches) {
      for (PixelMatch& match : pair.matches) {
        if (pair.second != 1 || match.second.x() >= begin - 1) continue;
        match.first.y() += 3;
        masked += pair.first == 0;
      }
    }
    EXPECT_EQ(masked > 200, begin > 300) << "half of the first pair's";
    const RigRefinement refined = refine_rig(calibrated, matches);
    EXPECT_LT(rotation_error(refined.rig, truth, 1), 2e-4) << begin;
  }
}

TEST(RigRefinement, BadInputHasOneSentence) {
  const Rig rig = true_rig();
  std::vector<ViewMatches> matches = matches_of(rig, {});
  matches[1].second = 3;
  EXPECT_NE(test::error_of([&] { refine_rig(rig, matches); }).find("views 0 and 3"),
            std::string::npos);
  matches[1].second = 0;
  EXPECT_NE(test::error_of([&] { refine_rig(rig, matches); }).find("views 0 and 0"),
            std::string::npos);
  matches.resize(1);
  matches[0].matches.resize(7);
  EXPECT_NE(test::error_of([&] { refine_rig(rig, matches); }).find("Only 7 features"),
            std::string::npos);
  EXPECT_THROW(refine_rig(rig, {}), Error);
  Rig of_one_centre = rig;
  of_one_centre.views[2].world_from_camera.translation() =
      rig.views[0].world_from_camera.translation();
  EXPECT_NE(test::error_of([&] {
              refine_rig(of_one_centre, matches_of(rig, {}));
            }).find("cam0 and cam2 have the same centre"),
            std::string::npos);
  Rig without_focal_length = rig;
  without_focal_length.views[1].camera.fx = 0;
  EXPECT_NE(test::error_of([&] {
              refine_rig(without_focal_length, matches_of(rig, {}));
            }).find("cam1: fx is 0"),
            std::string::npos);
  // Images that do not belong together.
  const std::vector<ViewMatches> unrelated = matches_of(rig, {.false_matches = 0.95});
  EXPECT_NE(test::error_of([&] { refine_rig(rig, unrelated); }).find("contradict"),
            std::string::npos);
}

/// Views that the calibration is not of: few unknowns can be made to fit them all the same.
TEST(RigRefinement, MatchesOfOtherViewsAreRefused) {
  const Rig truth = true_rig();
  const auto error = [](const Rig& rig, const std::vector<ViewMatches>& matches) {
    return test::error_of([&] { refine_rig(rig, matches); });
  };
  for (const double believed : {1.0, 2.0}) {
    EXPECT_EQ(error(displaced(truth, believed), matches_of(truth, {.noise = 0.2})), "");
  }
  EXPECT_NE(error(displaced(truth, 4), matches_of(truth, {.noise = 0.2}))
                .find("turn cam1 by 4.0 degrees, more than the 2.5 that are believed"),
            std::string::npos);
  // Seen in another direction, but turned as calibrated.
  const auto moved = [&](double degrees) {
    Rig rig = truth;
    const Eigen::Vector3d to_cam1 = arm(rig, 1);
    rig.views[1].world_from_camera.translation() +=
        turned(degrees, to_cam1.unitOrthogonal()) * to_cam1 - to_cam1;
    return error(rig, matches_of(truth, {.noise = 0.2}));
  };
  EXPECT_EQ(moved(6), "");
  const std::string far_off = moved(14);
  EXPECT_NE(far_off.find("turn the direction to cam1 by 1"), std::string::npos) << far_off;
  EXPECT_NE(far_off.find("more than the 10.0 that are believed"), std::string::npos) << far_off;
  // The cameras stand the other way around, as if images had been swapped.
  Rig opposite = truth;
  for (View& view : opposite.views) {
    Eigen::Vector3d centre = view.world_from_camera.translation();
    centre = 2 * truth.views[0].world_from_camera.translation() - centre;
    view.world_from_camera.translation() = centre;
  }
  EXPECT_NE(error(opposite, matches_of(truth, {.noise = 0.2}))
                .find("cam0 and cam1 lie behind the cameras"),
            std::string::npos);
}

/// Views 0 and 1 side by side, 2 and 3 as well, back to back with them, 200 degrees each.
Rig surround_rig() {
  Rig rig = true_rig();
  rig.views.resize(2);
  for (View& view : rig.views) {
    view.camera = rig.views[1].camera;
    view.camera.max_theta = 100 * radians_per_degree;
  }
  const Eigen::Isometry3d& base = rig.views[0].world_from_camera;
  for (int i : {0, 1}) {
    View view = rig.views[static_cast<std::size_t>(i)];
    view.name = "cam" + std::to_string(2 + i);
    view.world_from_camera = base * Eigen::Translation3d(0.1 * i, 0.02, -0.15) *
                             turned(180 + i, Eigen::Vector3d::UnitY());
    rig.views.push_back(view);
  }
  return rig;
}

/// As `count` features found in a repetitive scene.
std::vector<PixelMatch> false_matches(int count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(130, 380);
  std::vector<PixelMatch> matches;
  for (int i = 0; i < count; ++i) {
    matches.push_back({{at(random), at(random)}, {at(random), at(random)}});
  }
  return matches;
}

TEST(RigRefinement, PairsThatSeeNothingInCommonAreLeftOut) {
  const Rig truth = true_rig();
  const Rig calibrated = displaced(truth, 0.4);
  const std::vector<ViewMatches> all = matches_of(truth, {.noise = 0.1});
  for (const int count : {0, 5, 300, 3000}) {
    std::vector<ViewMatches> matches = all;
    matches[1].matches = false_matches(count);  // view 2 is seen by view 1 alone
    const RigRefinement refined = refine_rig(calibrated, matches);
    EXPECT_EQ(refined.left_out[0], "");
    EXPECT_NE(refined.left_out[1].find(count < 8 ? "Only" : "contradict"), std::string::npos)
        << refined.left_out[1];
    EXPECT_NE(refined.left_out[1].find("cam0 and cam2"), std::string::npos);
    EXPECT_EQ(refined.left_out[2], "");
    ASSERT_EQ(refined.after.size(), 3U);
    EXPECT_EQ(refined.after[1].matches, 0);
    EXPECT_EQ(refined.after[2].matches, 400);
    for (const std::size_t view : {1, 2}) {
      EXPECT_LT(rotation_error(refined.rig, truth, view), 0.02) << count;
    }
  }
}

TEST(RigRefinement, ViewsMayBeConnectedByOthersInAnyOrder) {
  const Rig truth = true_rig();
  std::vector<ViewMatches> matches = matches_of(truth, {});
  matches.erase(matches.begin() + 1);  // view 2 is seen by view 1 alone
  std::swap(matches[0], matches[1]);
  const RigRefinement refined = refine_rig(displaced(truth, 0.4), matches);
  EXPECT_LT(rotation_error(refined.rig, truth, 2), 1e-3);
}

TEST(RigRefinement, ViewsThatNothingConnectsAreNamed) {
  const Rig rig = true_rig();
  std::vector<ViewMatches> matches = matches_of(rig, {});
  matches.resize(1);
  const std::string unmatched = test::error_of([&] { refine_rig(rig, matches); });
  EXPECT_NE(unmatched.find("No matches connect cam2 with cam0"), std::string::npos) << unmatched;
  matches = matches_of(rig, {});
  matches[0].matches = false_matches(300);
  matches[2].matches = false_matches(3);
  const std::string unrelated = test::error_of([&] { refine_rig(rig, matches); });
  EXPECT_NE(unrelated.find("No matches connect cam1 with cam0"), std::string::npos) << unrelated;
  EXPECT_NE(unrelated.find("cam0 and cam1 contradict"), std::string::npos) << unrelated;
}

TEST(RigRefinement, FieldsOfViewTellWhichPairsToMatch) {
  Rig rig = surround_rig();
  EXPECT_TRUE(share_field_of_view(rig.views[0], rig.views[1]));
  EXPECT_TRUE(share_field_of_view(rig.views[2], rig.views[3]));
  EXPECT_TRUE(share_field_of_view(rig.views[0], rig.views[2])) << "at their rims";
  for (View& view : rig.views) view.camera.max_theta = 85 * radians_per_degree;
  EXPECT_TRUE(share_field_of_view(rig.views[0], rig.views[1]));
  EXPECT_FALSE(share_field_of_view(rig.views[0], rig.views[2]));
  EXPECT_FALSE(share_field_of_view(rig.views[3], rig.views[1]));
}

TEST(RigRefinement, ARealRigGetsBetter) {
  SKIP_WITHOUT_STEREO_SETS();
  const auto set = test::data_folder() / "real/vfs_t265_fs";
  const Rig rig = read_calibration(set / "calib.yaml").rig;
  const RigRefinement refined = refine_rig(
      rig, {{0, 1, match_features(read_image(set / "cam0.png"), read_image(set / "cam1.png"))}});
  EXPECT_LT(refined.after[0].median_pixels, 0.8 * refined.before[0].median_pixels);
  EXPECT_LT(refined.views[1].rotation.change, 0.2);
}

}  // namespace
}  // namespace widestereo
