// SPDX-License-Identifier: MIT
#include "schedule/schedule.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "geometry/camera_parameters.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr int all_neighbours = 15;
constexpr int left_and_up = 1 | 4;
constexpr int right_and_down = 2 | 8;

// The blocks are uploaded as they are: their layout must be std140 (parameters) and std430 (pass).
static_assert(sizeof(kernel::CameraParameters) == 80);
static_assert(sizeof(kernel::ViewPair) == 48);
static_assert(offsetof(kernel::MatchParameters, cameras) == 64);
static_assert(offsetof(kernel::MatchParameters, pairs) == 64 + 80 * MAX_VIEWS);
static_assert(sizeof(kernel::PassParameters) == 36);

kernel::ViewPair view_pair(const View& source, const View& reference) {
  const Eigen::Matrix<float, 3, 4> t =
      source_from_reference(source, reference).matrix().topRows<3>().cast<float>();
  const auto row = [&t](int i) { return kernel::vec4(t(i, 0), t(i, 1), t(i, 2), t(i, 3)); };
  return {row(0), row(1), row(2)};
}

kernel::MatchParameters match_parameters(const Rig& rig, const Options& options) {
  constexpr double degree = std::numbers::pi / 180;
  const auto single = [](double value) { return static_cast<float>(value); };
  kernel::MatchParameters p{};
  p.range = {single(options.min_distance), single(options.max_distance),
             single(1 / options.max_distance), single(1 / options.min_distance)};
  p.patch_limits = {single(std::pow(options.min_texture / 255, 2)), single(options.min_visible),
                    single(std::cos(options.max_tilt * degree)), 0};
  p.check_limits = {single(options.consistency_relative), single(options.consistency_pixels),
                    single(options.max_cost), single(options.min_parallax)};
  const int views = static_cast<int>(rig.views.size());
  p.search = {static_cast<int>(options.sampling), options.refinements, options.best_sources, views};
  for (int i = 0; i < views; ++i) {
    p.cameras[i] = kernel_camera(rig.views[i].camera);
    for (int j = 0; j < views; ++j) {
      p.pairs[i * MAX_VIEWS + j] = view_pair(rig.views[j], rig.views[i]);
    }
  }
  return p;
}

/// Appends the dispatches of one schedule.
class Builder {
 public:
  Builder(const Rig& rig, const Options& options) : rig_(rig), options_(options) {
    schedule_.constants = {.source_model = common_model(),
                           .window_radius = options.window_radius,
                           .warp = static_cast<int>(options.warp),
                           .view_count = static_cast<int>(rig.views.size())};
    schedule_.parameters = match_parameters(rig, options);
  }

  Schedule build() {
    const int views = schedule_.constants.view_count;
    start_at_random(0);
    iterate(0, options_.first_iterations);
    for (int view = 1; view < views; ++view) {
      start_from(view, 0);
      iterate(view, options_.second_iterations);
    }
    for (int view = 0; view < views; ++view) add(Kernel::check, pass_of(view), view, 0);
    return std::move(schedule_);
  }

 private:
  int common_model() const {
    const CameraModel model = rig_.views.front().camera.model;
    for (const View& view : rig_.views) {
      if (view.camera.model != model) return -1;
    }
    return static_cast<int>(model);
  }

  kernel::PassParameters pass_of(int view) const {
    const unsigned all_views = (1u << rig_.views.size()) - 1;
    kernel::PassParameters pass{};
    pass.reference = view;
    pass.sources = all_views & ~(1u << view);
    pass.other = view;
    pass.iteration = 0;
    pass.colour = -1;
    pass.neighbours = all_neighbours;
    pass.seed = options_.seed;
    return pass;
  }

  /// `over`: the view whose pixels the kernel runs over; `patches`: evaluated per pixel.
  void add(Kernel kernel, kernel::PassParameters pass, int over, int patches) {
    const Camera& camera = rig_.views[over].camera;
    const long long window = 2 * options_.window_radius + 1;
    const long long sources = static_cast<long long>(rig_.views.size()) - 1;
    const long long pixels = static_cast<long long>(camera.width) * camera.height;
    pass.first_row = 0;
    pass.last_row = camera.height;
    schedule_.dispatches.push_back(
        {kernel, pass, camera.width, camera.height,
         pixels / (pass.colour < 0 ? 1 : 2) * patches * sources * window * window});
  }

  void start_at_random(int view) { add(Kernel::initialise, pass_of(view), view, 1); }

  void start_from(int view, int other) {
    kernel::PassParameters pass = pass_of(view);
    pass.other = other;
    add(Kernel::transfer_clear, pass, view, 0);
    add(Kernel::transfer_nearest, pass, other, 0);
    add(Kernel::transfer_winner, pass, other, 0);
    add(Kernel::transfer_gather, pass, view, 1);
  }

  void iterate(int view, int iterations) {
    kernel::PassParameters pass = pass_of(view);
    for (int iteration = 1; iteration <= iterations; ++iteration) {
      pass.iteration = iteration;
      if (options_.propagation == Propagation::raster) {
        pass.neighbours = iteration % 2 == 1 ? left_and_up : right_and_down;
        add(Kernel::iterate_raster, pass, view, 2 + options_.refinements);
        continue;
      }
      for (int colour = 0; colour < 2; ++colour) {
        pass.colour = colour;
        add(Kernel::iterate, pass, view, 4 + options_.refinements);
      }
    }
  }

  const Rig& rig_;
  const Options& options_;
  Schedule schedule_;
};

}  // namespace

const char* to_string(Kernel kernel) {
  static constexpr std::array<const char*, kernel_count> names = {
      "initialise",       "iterate",         "iterate_raster",  "transfer_clear",
      "transfer_nearest", "transfer_winner", "transfer_gather", "check"};
  return names[static_cast<std::size_t>(kernel)];
}

Schedule make_schedule(const Rig& rig, const Options& options) {
  if (rig.views.size() < 2 || rig.views.size() > MAX_VIEWS) {
    throw Error("The rig has " + std::to_string(rig.views.size()) + " view(s); stereo needs 2 to " +
                std::to_string(MAX_VIEWS) + ".");
  }
  validate(rig, "The rig");
  validate(options);
  return Builder(rig, options).build();
}

}  // namespace widestereo
