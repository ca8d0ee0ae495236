// SPDX-License-Identifier: MIT
// Planes warped into the other view, or the next frame.
#include <gtest/gtest.h>

#include "kernel_fixture.h"

namespace widestereo::test {
namespace {

using kernel::ivec2;
using kernel::vec3;

template <typename Function>
void run_over(KernelFixture& fixture, int view, Function function) {
  const auto context = fixture.context();
  const cv::Size size = fixture.view(view).rays.size();
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) function(context, ivec2(x, y));
  }
}

/// Warps planes from one view to another, or the same, whose pixels fetch theirs by `gather`.
template <typename Gather>
void transfer(KernelFixture& fixture, int from, int to, Gather gather) {
  fixture.set_reference(to);
  fixture.pass().other = from;
  run_over(fixture, to, kernel::cpu::transfer_clear_pixel);
  run_over(fixture, from, kernel::cpu::transfer_nearest_pixel);
  run_over(fixture, from, kernel::cpu::transfer_winner_pixel);
  run_over(fixture, to, gather);
}

/// The pixels that share_that_holds() looks at.
cv::Rect middle_of(cv::Size size) {
  return {size.width / 5, size.height / 5, size.width - 2 * (size.width / 5),
          size.height - 2 * (size.height / 5)};
}

/// Share of the pixels in the middle that hold the plane m.
double share_that_holds(const cv::Mat_<cv::Vec4f>& map, const vec3& m) {
  const cv::Rect middle = middle_of(map.size());
  int holding = 0;
  for (const cv::Vec4f& h : cv::Mat_<cv::Vec4f>(map(middle))) {
    holding += cv::norm(cv::Vec3f(h[0], h[1], h[2]) - cv::Vec3f(m.x, m.y, m.z)) < 1e-5;
  }
  return static_cast<double>(holding) / middle.area();
}

/// The plane m of view 0 in view 1's frame.
vec3 in_view_1(KernelFixture& fixture, const vec3& m) {
  return kernel::cpu::plane_in_source(fixture.schedule().parameters.pairs[1], m);
}

TEST(Transfer, CarriesAPlaneIntoTheOtherView) {
  KernelFixture fixture(fisheye_rig(96), wide_range());
  // One slanted plane in front of the rig, held by all pixels of view 0 that see it.
  const Eigen::Vector3d m(0.05, 0.1, 0.5);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      const cv::Vec4f ray = fixture.view(0).rays(y, x);
      const double w = m.dot(Eigen::Vector3f(ray[0], ray[1], ray[2]).cast<double>());
      const vec3 mk = to_kernel(m);
      fixture.view(0).hypotheses(y, x) =
          w > 0.02 ? cv::Vec4f(mk.x, mk.y, mk.z, 0.1f) : cv::Vec4f(0, 0, 0, 2);
    }
  }
  transfer(fixture, 0, 1, kernel::cpu::transfer_gather_pixel);
  EXPECT_GT(share_that_holds(fixture.view(1).hypotheses, in_view_1(fixture, to_kernel(m))), 0.99);
}

TEST(Transfer, MovesAViewsOwnPlanesWithTheRig) {
  const Rig rig = fisheye_rig(96);
  KernelFixture fixture(rig, wide_range("fast"));
  const Eigen::Isometry3d now_from_previous =
      Eigen::Translation3d(0.05, -0.02, 0.1) *
      Eigen::AngleAxisd(0.06, Eigen::Vector3d(0.3, 1, 0.2).normalized());
  set_motion(fixture.schedule(), rig, now_from_previous, 7);
  // The plane {X : n . X = d} of the rig's frame, seen by camera 1, whose frame is another one.
  const Eigen::Vector3d n = Eigen::Vector3d(0.1, 0.15, 1).normalized();
  const auto in_camera = [&](const Eigen::Isometry3d& previous_from_camera) {
    const double d = 1.7 - n.dot(previous_from_camera.translation());
    return Eigen::Vector3d(previous_from_camera.linear().transpose() * n / d);
  };
  const Eigen::Isometry3d& rig_from_camera = rig.views[1].world_from_camera;
  const Eigen::Vector3d held = in_camera(rig_from_camera);
  const vec3 expected = to_kernel(in_camera(now_from_previous.inverse() * rig_from_camera));
  const vec3 mk = to_kernel(held);
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      const cv::Vec4f ray = fixture.view(1).rays(y, x);
      const double w = held.dot(Eigen::Vector3f(ray[0], ray[1], ray[2]).cast<double>());
      const bool seen = w > 0.02 && !(x >= 40 && x < 52 && y >= 40 && y < 52);
      fixture.view(1).hypotheses(y, x) =
          seen ? cv::Vec4f(mk.x, mk.y, mk.z, 0.1f) : cv::Vec4f(0, 0, 0, 2);
    }
  }
  transfer(fixture, 1, 1, kernel::cpu::transfer_keep_pixel);
  EXPECT_EQ(fixture.view(1).hypotheses(30, 30)[0], mk.x) << "still read by other pixels";
  const double hole = 12.0 * 12 / middle_of({96, 96}).area();
  EXPECT_GT(share_that_holds(fixture.view(1).priors, expected), 0.97 - hole);
  EXPECT_LT(share_that_holds(fixture.view(1).priors, expected), 1 - 0.5 * hole)
      << "what had no plane has none now";
  for (const auto renew : {kernel::cpu::renew_pixel, kernel::cpu::renew_point_pixel}) {
    fixture.view(1).hypotheses.setTo(cv::Scalar::all(0));
    run_over(fixture, 1, renew);
    EXPECT_GT(share_that_holds(fixture.view(1).hypotheses, expected), 0.99)
        << "surfaces continue into holes";
  }
}

/// Until a plane has a cost of its own, others must cost less than one and a half times as much as
/// it did, or less than 0.2.
TEST(Transfer, CostsThatFollowLaterComeFromTheFrameBefore) {
  const Rig rig = fisheye_rig(96);
  for (const auto& [before, expected] :
       {std::pair(0.01f, 0.2f), {0.4f, 0.6f}, {0.9f, 1.0f}, {1.9f, 1.0f}}) {
    KernelFixture fixture(rig, wide_range("fast"));
    set_motion(fixture.schedule(), rig, Eigen::Isometry3d::Identity(), 1);
    const vec3 m(0.05f, 0.1f, 0.5f);
    fixture.view(0).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, before));
    transfer(fixture, 0, 0, kernel::cpu::transfer_keep_pixel);
    run_over(fixture, 0, kernel::cpu::renew_point_pixel);
    EXPECT_FLOAT_EQ(fixture.view(0).hypotheses(48, 48)[3], expected);
    // At the left border the other view, which is on the right, does not see what is near.
    int unseen = 0;
    for (int y = 0; y < 96; ++y) {
      for (int x = 0; x < 96; ++x) unseen += fixture.view(0).hypotheses(y, x)[3] == INVALID_COST;
    }
    EXPECT_GT(unseen, 0);
    fixture.view(0).priors.setTo(cv::Scalar::all(0));
    run_over(fixture, 0, kernel::cpu::renew_point_pixel);
    EXPECT_EQ(fixture.view(0).hypotheses(48, 48)[3], 1) << "nothing moved there";
  }
}

TEST(Transfer, LeavesNoHolesInAViewThatSeesEverythingLarger) {
  Rig rig = fisheye_rig(96);
  rig.views[1].camera = fisheye_camera(160);
  KernelFixture fixture(rig, wide_range());
  const vec3 m(0.05f, 0.1f, 0.5f);
  fixture.view(0).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, 0.1));
  transfer(fixture, 0, 1, kernel::cpu::transfer_gather_pixel);
  EXPECT_GT(share_that_holds(fixture.view(1).hypotheses, in_view_1(fixture, m)), 0.99);
}

TEST(Transfer, OfSeveralPlanesTheNearestWins) {
  KernelFixture fixture(fisheye_rig(96), wide_range());
  const vec3 far(0.05f, 0.1f, 0.5f);
  const vec3 near = 1.5f * far;
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      const vec3& m = (x + y) % 2 == 0 ? near : far;
      fixture.view(0).hypotheses(y, x) = cv::Vec4f(m.x, m.y, m.z, 0.1f);
    }
  }
  transfer(fixture, 0, 1, kernel::cpu::transfer_gather_pixel);
  EXPECT_GT(share_that_holds(fixture.view(1).hypotheses, in_view_1(fixture, near)), 0.95);
}

TEST(Transfer, LeavesWhatIsSeenFromBehindOrOutOfRange) {
  KernelFixture fixture(fisheye_rig(96), wide_range());
  const auto share = [&](const vec3& m) {
    fixture.view(0).hypotheses.setTo(cv::Scalar(m.x, m.y, m.z, 0.1));
    transfer(fixture, 0, 1, kernel::cpu::transfer_gather_pixel);
    return share_that_holds(fixture.view(1).hypotheses, in_view_1(fixture, m));
  };
  EXPECT_GT(share({0, 0, 0.5f}), 0.99);
  fixture.schedule().parameters.range.w = 0.1f;  // 10 m at least
  EXPECT_EQ(share({0, 0, 0.5f}), 0);
  fixture.schedule().parameters.range.w = 100;
  const Eigen::Vector3d centre = fixture.rig().views[1].world_from_camera.translation();
  const vec3 between = to_kernel(centre.normalized() / (0.5 * centre.norm()));
  fixture.schedule().parameters.patch_limits.z = 0;  // however oblique
  EXPECT_EQ(share(between), 0);
}

TEST(Transfer, WithoutMotionEveryPixelKeepsItsPlane) {
  const Rig rig = fisheye_rig(96);
  KernelFixture fixture(rig, wide_range("fast"));
  set_motion(fixture.schedule(), rig, Eigen::Isometry3d::Identity(), 1);
  cv::Mat_<cv::Vec4f>& planes = fixture.view(0).hypotheses;
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      const cv::Vec4f r = fixture.view(0).rays(y, x);
      const float w = 0.3f + 0.001f * static_cast<float>((7 * x + 13 * y) % 50);
      planes(y, x) = cv::Vec4f(w * r[0], w * r[1], w * r[2], 0.1f);
    }
  }
  transfer(fixture, 0, 0, kernel::cpu::transfer_keep_pixel);
  int lost = 0;
  for (int y = 0; y < 96; ++y) {
    for (int x = 0; x < 96; ++x) {
      if (fixture.view(0).rays(y, x)[3] == 0) continue;
      const cv::Vec4f& moved = fixture.view(0).priors(y, x);
      const cv::Vec4f difference = moved - planes(y, x);
      lost += cv::norm(cv::Vec3f(difference[0], difference[1], difference[2])) > 1e-6;
    }
  }
  EXPECT_EQ(lost, 0);
}

TEST(Transfer, SurfacesContinueIntoHolesFromEveryDirection) {
  KernelFixture fixture(fisheye_rig(96), wide_range("fast"));
  fixture.set_reference(0);
  const vec3 m(0.05f, 0.1f, 0.5f);
  for (int i = 0; i < 9; ++i) {
    if (i == 4) continue;
    fixture.view(0).priors.setTo(cv::Scalar::all(0));
    const int x = 48 + 8 * (i % 3 - 1);
    const int y = 48 + 8 * (i / 3 - 1);
    fixture.view(0).priors(y, x) = cv::Vec4f(m.x, m.y, m.z, 1);
    for (const auto renew : {kernel::cpu::renew_pixel, kernel::cpu::renew_point_pixel}) {
      fixture.view(0).hypotheses(48, 48) = {};
      renew(fixture.context(), {48, 48});
      EXPECT_EQ(fixture.view(0).hypotheses(48, 48)[2], m.z) << "from " << x << ", " << y;
    }
  }
}

TEST(MovingOn, KeepsThePlanesOfImagesThatAreNotSquare) {
  const vec3 wall(0.05f, 0.1f, 0.5f);
  for (const cv::Size image : {cv::Size(96, 64), cv::Size(64, 96)}) {
    const Rig rig = fisheye_rig(image);
    KernelFixture fixture(rig, wide_range("fast"));
    set_motion(fixture.schedule(), rig, Eigen::Isometry3d::Identity(), 1);
    fixture.view(0).hypotheses.setTo(cv::Scalar(wall.x, wall.y, wall.z, 0.1));
    transfer(fixture, 0, 0, kernel::cpu::transfer_keep_pixel);
    int seen = 0;
    int lost = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        const cv::Vec4f ray = fixture.view(0).rays(y, x);
        const float slant = dot(to_kernel(ray), wall) / std::sqrt(dot(wall, wall));
        if (ray[3] == 0 || slant < 0.2f) continue;
        ++seen;
        lost += fixture.view(0).priors(y, x)[2] != wall.z;
      }
    }
    EXPECT_GT(seen, 1000);
    EXPECT_EQ(lost, 0) << image;
  }
}

/// Of a view of another size; every pixel of the first view holds another distance.
TEST(Transfer, TakesPlanesFromThePixelsThatSeeThePoint) {
  Rig rig = fisheye_rig(96);
  rig.views[0].camera = fisheye_camera(120);
  const auto inverse_distance = [](double x, double y) { return 0.4 + 0.0005 * x + 0.0007 * y; };
  KernelFixture fixture(rig, wide_range());
  for (int y = 0; y < 120; ++y) {
    for (int x = 0; x < 120; ++x) {
      const vec3 m = to_kernel(inverse_distance(x, y) * fixture.ray(0, {x, y}));
      fixture.view(0).hypotheses(y, x) = cv::Vec4f(m.x, m.y, m.z, 0.1f);
    }
  }
  transfer(fixture, 0, 1, kernel::cpu::transfer_gather_pixel);
  const Eigen::Isometry3d back = source_from_reference(rig.views[0], rig.views[1]);
  int wrong = 0;
  for (int y = 30; y < 66; ++y) {
    for (int x = 30; x < 66; ++x) {
      const Eigen::Vector3d m = to_eigen(to_kernel(fixture.view(1).hypotheses(y, x)));
      const Eigen::Vector3d ray = fixture.ray(1, {x, y});
      const Eigen::Vector3d point = back * (ray / m.dot(ray));
      Eigen::Vector2d pixel;
      const bool is_seen = project(rig.views[0].camera, point, pixel);
      const double error = 1 / point.norm() / inverse_distance(pixel.x(), pixel.y()) - 1;
      wrong += !is_seen || std::abs(error) > 0.01;
    }
  }
  EXPECT_LT(wrong, 0.02 * 36 * 36);
}

TEST(Transfer, ComparesDistancesFromTheViewThatPlanesGoTo) {
  const Rig rig = fisheye_rig(96);
  KernelFixture fixture(rig, wide_range());
  fixture.set_reference(1);
  fixture.pass().other = 0;
  fixture.view(0).hypotheses.setTo(cv::Scalar(0, 0, 3, 0.1));  // as near as the baseline is long
  for (const ivec2 pixel : {ivec2(48, 48), ivec2(66, 48), ivec2(30, 40)}) {
    ivec2 corner(0, 0);
    float w = 0;
    ASSERT_TRUE(kernel::cpu::forward_warp(fixture.context(), pixel, corner, w));
    const Eigen::Vector3d ray = fixture.ray(0, pixel);
    const Eigen::Vector3d point =
        source_from_reference(rig.views[1], rig.views[0]) * (ray / (3 * ray.z()));
    EXPECT_NEAR(static_cast<double>(w) * point.norm(), 1, 1e-4);
  }
}

}  // namespace
}  // namespace widestereo::test
