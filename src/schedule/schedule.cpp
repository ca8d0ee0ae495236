// SPDX-License-Identifier: MIT
#include "schedule/schedule.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>

#include "geometry/angle.h"
#include "geometry/camera_parameters.h"
#include "geometry/camera_scale.h"
#include "geometry/validation.h"
#include "kernel/enumerations.h"
#include "text/size_text.h"
#include "widestereo/error.h"
#include "widestereo/matcher.h"

namespace widestereo {
namespace {

constexpr int left_and_up = NEIGHBOUR_LEFT | NEIGHBOUR_UP;
constexpr int right_and_down = NEIGHBOUR_RIGHT | NEIGHBOUR_DOWN;
constexpr int all_neighbours = left_and_up | right_and_down;

// The blocks are uploaded as they are: their layout must be std140 (parameters) and std430 (pass).
static_assert(sizeof(kernel::CameraParameters) == 96);
static_assert(sizeof(kernel::ViewPair) == 48);
static_assert(offsetof(kernel::MatchParameters, cameras) == 128);
static_assert(offsetof(kernel::MatchParameters, pairs) == 128 + 96 * MAX_VIEWS);
static_assert(sizeof(kernel::MatchParameters) <= 16384);  // every device's uniform range
static_assert(sizeof(kernel::PassParameters) == 68);

kernel::ViewPair view_pair(const Eigen::Isometry3d& source_from_reference) {
  const Eigen::Matrix<float, 3, 4> t = source_from_reference.matrix().topRows<3>().cast<float>();
  const auto row = [&t](int i) { return kernel::vec4(t(i, 0), t(i, 1), t(i, 2), t(i, 3)); };
  return {row(0), row(1), row(2)};
}

/// `all`: the rig's views, which are `images`, and then those at coarser levels.
kernel::MatchParameters match_parameters(const std::vector<View>& all, int images,
                                         const Options& options) {
  const auto single = [](double value) { return static_cast<float>(value); };
  kernel::MatchParameters p{};
  p.range = {single(options.min_distance), single(options.max_distance),
             single(1 / options.max_distance), single(1 / options.min_distance)};
  p.patch_limits = {single(std::pow(options.min_texture / 255, 2)), single(options.min_visible),
                    single(std::cos(options.max_tilt * radians_per_degree)), 0};
  const auto limits = [&single](const Options& o) {
    return kernel::vec4(single(o.consistency_relative), single(o.consistency_pixels),
                        single(o.min_parallax), single(o.min_support));
  };
  p.check_limits = limits(options);
  p.acceptance = {single(options.min_confidence), single(options.max_cost), 0, 0};
  p.repair_limits = limits(Options());
  const auto inverse_scale = [](double grey_levels) {
    constexpr double most = 1e6;  // where all but equal intensities weigh nothing; never infinite
    return grey_levels > 0 ? static_cast<float>(std::min(255 / grey_levels, most)) : 0.0f;
  };
  p.support = {inverse_scale(options.weight_scale), inverse_scale(options.regression_scale),
               single(options.ambiguity_margin), single(options.far_preference)};
  p.search = {static_cast<int>(options.sampling), options.refinements, options.best_sources, 0};
  for (std::size_t i = 0; i < all.size(); ++i) p.cameras[i] = kernel_camera(all[i].camera);
  for (int i = 0; i < images; ++i) {
    for (int j = 0; j < images; ++j) {
      p.pairs[i * MAX_IMAGES + j] = view_pair(source_from_reference(all[j], all[i]));
    }
  }
  return p;
}

/// The camera of an image downsampled by averaging 2x2 pixels; an odd side keeps a last, partial
/// pixel, which is masked.
View halved(const View& view) {
  View half = view;
  Camera& camera = half.camera;
  camera.width = (camera.width + 1) / 2;
  camera.height = (camera.height + 1) / 2;
  scale_intrinsics(camera, 0.5, 0.5);
  half.mask = cv::Mat();  // masked pixels arrive with the intensities
  return half;
}

/// The rig's views at `levels` levels, finest first.
std::vector<View> pyramid(const Rig& rig, int levels) {
  std::vector<View> views = rig.views;
  for (int level = 1; level < levels; ++level) {
    for (std::size_t i = 0; i < rig.views.size(); ++i) {
      views.push_back(halved(views[views.size() - rig.views.size()]));
    }
  }
  return views;
}

/// Of the pyramid (Options::levels).
int levels_of(const Rig& rig, const Options& options) {
  if (options.search != SearchMethod::pyramid) return 1;
  if (options.levels > 0) return options.levels;
  constexpr int least_side = 40;
  int side = std::numeric_limits<int>::max();
  for (const View& view : rig.views) {
    side = std::min({side, view.camera.width, view.camera.height});
  }
  const int most = std::min(Options::most_levels, MAX_VIEWS / static_cast<int>(rig.views.size()));
  auto levels =
      static_cast<int>(std::max(options.level_iterations.size(), options.level_regressions.size()));
  while (levels < most && side >> levels >= least_side) ++levels;
  return levels;
}

/// The number that such a list has for a level, 0 being the finest.
int of_level(const std::vector<int>& finest_last, int level) {
  const auto finest = static_cast<int>(finest_last.size()) - 1;
  return finest_last[static_cast<std::size_t>(std::max(finest - level, 0))];
}

// Candidates of shaders/adaptive_search.glsl.
constexpr std::array<unsigned, 2> near_strips = {1u << STRIP_UP | 1u << STRIP_LEFT,
                                                 1u << STRIP_DOWN | 1u << STRIP_RIGHT};
constexpr unsigned near_strips_of_all_sides = near_strips[0] | near_strips[1];
constexpr unsigned strips = (1u << STRIPS) - 1;
constexpr unsigned inverse_distance = 1u << CANDIDATE_INVERSE_DISTANCE;
constexpr unsigned normal = 1u << CANDIDATE_NORMAL;
constexpr unsigned both = 1u << CANDIDATE_BOTH;
constexpr unsigned random_distance = 1u << CANDIDATE_RANDOM_DISTANCE;
constexpr unsigned surroundings = 1u << CANDIDATE_SURROUNDINGS;
constexpr unsigned source_planes = 1u << CANDIDATE_SOURCE_PLANE;
constexpr unsigned other_surfaces = 1u << CANDIDATE_OTHER_SURFACE;

/// Smaller images leave pixels in their middle without planes: patches reach over both borders.
void require_room_for_patches(const View& view, int window_radius) {
  const int least = 2 * window_radius + 2;
  if (std::min(view.camera.width, view.camera.height) >= least) return;
  throw Error("The image of " + view.name + " has " +
              size_text(view.camera.width, view.camera.height) + " pixels; patches of radius " +
              std::to_string(window_radius) + " need " + std::to_string(least) +
              " both ways: choose a smaller window radius.");
}

/// Views that one launch runs over.
struct Views {
  int first = 0;
  int count = 1;
};

/// Appends the dispatches of one schedule. What reads nothing that it writes in other views is
/// launched over all views of a level at once, which fills a GPU that one view of a coarse level
/// leaves idle.
class Builder {
 public:
  Builder(const Rig& rig, const Options& options) : options_(options) {
    levels_ = levels_of(rig, options);
    require_few_enough(rig.views.size());
    views_of_rig_ = static_cast<int>(rig.views.size());
    schedule_.views = pyramid(rig, levels_);
    for (const View& view : rig.views) require_room_for_patches(view, options.window_radius);
    for (const View& view : schedule_.views) {
      if (view.camera.width < 2 || view.camera.height < 2) {
        throw Error(
            "The image of " + view.name + " is too small for " + std::to_string(levels_) +
            " levels: the coarsest would be less than 2 pixels wide or high; choose fewer levels.");
      }
    }
    schedule_.constants = {
        .camera_model = common_model(),
        .window_radius = options.window_radius,
        .warp = static_cast<int>(options.warp),
        .source_count = views_of_rig_ - 1,
        .pattern = static_cast<int>(options.pattern),
        .weighted = options.weight_scale > 0 ? 1 : 0,
        .filter = static_cast<int>(options.filter),
        .texels_per_pixel = options.interpolation == Interpolation::cubic ? 2 : 1};
    schedule_.parameters = match_parameters(schedule_.views, views_of_rig_, options);
  }

  Schedule build_cold() {
    interpolate(0);
    if (options_.search == SearchMethod::pyramid) {
      build_pyramid();
    } else {
      build_random();
    }
    return finished();
  }

  Schedule build_warm() {
    interpolate(0);
    // One by one: they share the transfer buffers.
    for (const Views view : launches(0, one_by_one)) move_on(view);
    if (costs_follow_in_warm_frames()) {
      add(Kernel::renew_point, pass_of(views_of(0)), views_of(0), 0);
    } else {
      add(Kernel::renew, pass_of(views_of(0)), views_of(0), 1);
    }
    if (options_.search == SearchMethod::pyramid) {
      search_warm();
    } else {
      iterate(views_of(0), options_.warm_iterations);
    }
    return finished();
  }

 private:
  /// Kernels number the images, and the views of all levels together.
  void require_few_enough(std::size_t images) const {
    const int most = std::min(MAX_IMAGES, MAX_VIEWS / levels_);
    if (images <= static_cast<std::size_t>(most)) return;
    throw Error("The rig has " + std::to_string(images) + " views, but " + std::to_string(levels_) +
                " pyramid level(s) allow " + std::to_string(most) + "; match fewer images" +
                (images <= MAX_IMAGES
                     ? ", or choose " + std::to_string(MAX_VIEWS / static_cast<int>(images)) +
                           " level(s) with no more level iterations and level regressions."
                     : "."));
  }

  Schedule finished() {
    add(Kernel::structure, pass_of(views_of(0)), views_of(0), 0);
    add(Kernel::check, pass_of(views_of(0)), views_of(0), 0);
    if (options_.ambiguity_margin > 0) find_ambiguity();
    fill(options_.fill_radius, reason_no_ray);
    return std::move(schedule_);
  }

  /// Sources are sampled from texels; the intensities of this level must be there.
  void interpolate(int level) {
    add(Kernel::interpolate, pass_of(views_of(level)), views_of(level), 0);
  }

  void build_random() {
    add(Kernel::initialise, pass_of({0}), {0}, 1);
    iterate({0}, options_.first_iterations);
    for (int view = 1; view < views_of_rig_; ++view) {
      start_from(view, 0);
      iterate({view}, options_.second_iterations);
    }
  }

  void build_pyramid() {
    for (int level = 1; level < levels_; ++level) {
      add_between_levels(Kernel::downsample, level, level - 1, 0);
      interpolate(level);
    }
    for (int level = levels_ - 1; level >= 0; --level) {
      if (level == levels_ - 1) {
        sweep(level);
      } else {
        add_between_levels(Kernel::upsample, level, level + 1, options_.coarse_planes);
      }
      const int iterations = of_level(options_.level_iterations, level);
      for (int i = 0; i < iterations; ++i) {
        const bool last = level == 0 && i + 1 == iterations;
        const unsigned candidates = cold_candidates(level == levels_ - 1, i, last);
        search(level, i, {candidates, candidates});
      }
      const int regressions = of_level(options_.level_regressions, level);
      for (int i = 0; i < regressions; ++i) {
        const Views views = views_of(level);
        measure(views);
        if (i == 0 && options_.subpixel_match) match_subpixel(views);
        const bool last = i + 1 == regressions;
        // Costs are not needed before the last round, those of before lie near enough.
        const Kernel adopt = level == 0 ? until_vote() : last ? Kernel::adopt : Kernel::adopt_point;
        regress(views, level == 0 ? round(i) : coarse_round(i),
                level > 0 && i > 0 ? HELD_UNSEEN : 0, adopt);
        if (level > 0) continue;
        repair_and_vote(last);
      }
    }
    if (options_.level_regressions.back() > 0) find_normals();
  }

  void find_normals() {
    measure(views_of(0));
    const bool vote = options_.normal_vote;
    regress(views_of(0), normals_after(options_.level_regressions.back()), 0,
            vote ? Kernel::adopt_point : Kernel::adopt);
    if (!vote) return;
    add(Kernel::vote_normal, pass_of(views_of(0)), views_of(0), 0);
    adopt_voted();
  }

  Views views_of(int level) const { return {level * views_of_rig_, views_of_rig_}; }

  enum Order { at_once, one_by_one };
  /// Of all views of a level.
  std::vector<Views> launches(int level, Order order) const {
    const Views all = views_of(level);
    if (order == at_once) return {all};
    std::vector<Views> views;
    for (int i = 0; i < all.count; ++i) views.push_back({all.first + i});
    return views;
  }

  int common_model() const {
    const CameraModel model = schedule_.views.front().camera.model;
    for (const View& view : schedule_.views) {
      if (view.camera.model != model) return -1;
    }
    return static_cast<int>(model);
  }

  kernel::PassParameters pass_of(Views views) const {
    kernel::PassParameters pass{};
    pass.reference = views.first;
    pass.first_view = views.first / views_of_rig_ * views_of_rig_;
    pass.other = views.first;
    pass.iteration = 0;
    pass.colour = -1;
    pass.neighbours = all_neighbours;
    pass.seed = options_.seed;
    return pass;
  }

  /// `over`: the views whose pixels the kernel runs over; `patches`: evaluated per pixel in every
  /// source.
  void add(Kernel kernel, const kernel::PassParameters& pass, Views over, int patches) {
    add_with_patches(kernel, pass, over, patches * (views_of_rig_ - 1));
  }

  /// The same, `patches` being those in all sources together.
  void add_with_patches(Kernel kernel, const kernel::PassParameters& pass, Views over,
                        int patches) {
    add_with_samples(kernel, pass, over,
                     patches * kernel::samples_of_patch(schedule_.constants.window_radius,
                                                        schedule_.constants.pattern));
  }

  /// `samples`: per pixel, in all sources together.
  void add_with_samples(Kernel kernel, kernel::PassParameters pass, Views over, long long samples) {
    Dispatch dispatch{.kernel = kernel, .over = over.first, .views = over.count};
    for (int i = 0; i < over.count; ++i) {
      const Camera& camera = schedule_.views[static_cast<std::size_t>(over.first + i)].camera;
      const long long pixels = static_cast<long long>(camera.width) * camera.height;
      dispatch.width = std::max(dispatch.width, camera.width);
      dispatch.height = std::max(dispatch.height, camera.height);
      dispatch.pixels += pixels;
      dispatch.samples += pixels / (pass.colour < 0 ? 1 : 2) * samples;
    }
    pass.first_row = 0;
    pass.last_row = dispatch.height;
    dispatch.pass = pass;
    schedule_.dispatches.push_back(dispatch);
  }

  void start_from(int view, int other) {
    kernel::PassParameters pass = pass_of({view});
    pass.other = other;
    add(Kernel::transfer_clear, pass, {view}, 0);
    add(Kernel::transfer_nearest, pass, {other}, 0);
    add(Kernel::transfer_winner, pass, {other}, 0);
    add(Kernel::transfer_gather, pass, {view}, 1);
  }

  void move_on(Views view) {
    const kernel::PassParameters pass = pass_of(view);
    add(Kernel::transfer_clear, pass, view, 0);
    add(Kernel::transfer_nearest, pass, view, 0);
    add(Kernel::transfer_winner, pass, view, 0);
    add(Kernel::transfer_keep, pass, view, 0);
  }

  /// Little more than what corrects planes that are nearly right: the near strips, half of them for
  /// each colour, carry surfaces into what has come into view; perturbations of distance follow
  /// what moved, and random distances find what has come near, for one colour, from which the other
  /// one takes them. What patches match best is then averaged over neighbours, and with the planes
  /// that moved, and so over frames.
  void search_warm() {
    // Planes that match a little better would put noise in the place of an average.
    constexpr double better_than_moved = 0.8;
    for (int i = 0; i < options_.warm_iterations; ++i) {
      search(0, i, {near_strips[0] | inverse_distance | random_distance, near_strips[1]},
             better_than_moved);
    }
    if (options_.warm_regressions == 0) return;
    // Measured once for all rounds, so that planes need their costs after the last one only.
    measure(views_of(0));
    const bool filters = options_.subpixel_match;
    if (filters) match_subpixel(views_of(0), WHOLE_SHIFT);
    for (int i = 0; i < options_.warm_regressions; ++i) {
      const bool last = i + 1 == options_.warm_regressions;
      const unsigned how =
          (last ? REGRESS_NORMALS : 0) | (i > 0 ? HELD_UNSEEN : 0) | (filters ? FILTER_MOVED : 0);
      // The frame before had the first round.
      regress(views_of(0), round(filters ? i + 1 : i), how,
              last ? until_vote() : Kernel::adopt_point, warm_regression_steps());
    }
    repair_and_vote(true);
  }

  void iterate(Views views, int iterations) {
    kernel::PassParameters pass = pass_of(views);
    for (int iteration = 1; iteration <= iterations; ++iteration) {
      pass.iteration = iteration;
      if (options_.propagation == Propagation::raster) {
        pass.neighbours = iteration % 2 == 1 ? left_and_up : right_and_down;
        add(Kernel::iterate_raster, pass, views, 2 + options_.refinements);
        continue;
      }
      for (int colour = 0; colour < 2; ++colour) {
        pass.colour = colour;
        add(Kernel::iterate, pass, views, 4 + options_.refinements);
      }
    }
  }

  /// `from`: the next coarser or finer level.
  void add_between_levels(Kernel kernel, int level, int from, int patches) {
    kernel::PassParameters pass = pass_of(views_of(level));
    pass.other = views_of(from).first;
    pass.places = patches;
    add(kernel, pass, views_of(level), patches);
  }

  void sweep(int level) {
    kernel::PassParameters pass = pass_of(views_of(level));
    pass.steps = options_.sweep_steps;
    add(Kernel::sweep, pass, views_of(level), options_.sweep_steps);
  }

  /// `iteration`: of the level; `last`: of all.
  unsigned cold_candidates(bool coarsest, int iteration, bool last) const {
    unsigned candidates = strips;
    // Far planes first, which then spread.
    if (options_.alternate_strips && !coarsest) {
      candidates &= iteration % 2 == 0 ? ~near_strips_of_all_sides : near_strips_of_all_sides;
    }
    // Presets of few samples spend those of the last iteration in the vote instead.
    if (!last || options_.pattern == PatchPattern::dense) candidates |= surroundings;
    // The last iteration spreads planes alone: the regression does what perturbations would.
    if (!last || options_.level_regressions.back() == 0) {
      candidates |= inverse_distance;
      // Normals found there are spread, and regressed, at the finer levels.
      if (coarsest) candidates |= both;
      if (coarsest && options_.pattern == PatchPattern::dense) candidates |= normal;
    }
    const bool first_of_all = coarsest && iteration == 0;
    if (first_of_all) candidates |= random_distance;
    // What they find spreads from there on.
    if (iteration == 0 && !coarsest && !last) candidates |= other_surfaces;
    // Earlier, on blank walls and periods, one view's errors would spread to the other and back.
    if (options_.source_planes && last && !first_of_all) candidates |= source_planes;
    return candidates;
  }

  /// As a share of the held plane's cost, what no better one costs: far planes may cost a little
  /// more.
  static constexpr double any_better = 2;

  /// `candidates`: of each colour. `most_cost`: of a plane that is taken, as a share of the held
  /// one's.
  void search(int level, int iteration, const std::array<unsigned, 2>& candidates,
              double most_cost = any_better) {
    // A view's planes may be candidates of the next one's.
    const bool reads_views = ((candidates[0] | candidates[1]) & source_planes) != 0;
    for (const Views views : launches(level, reads_views ? one_by_one : at_once)) {
      search(views, iteration, candidates, most_cost);
    }
  }

  void search(Views views, int iteration, const std::array<unsigned, 2>& candidates,
              double most_cost) {
    kernel::PassParameters pass = pass_of(views);
    pass.iteration = iteration + 1;
    const double share = std::pow(0.5, iteration);
    pass.step_pixels = static_cast<float>(options_.step_pixels * share);
    pass.step_normal = static_cast<float>(options_.step_normal * share);
    pass.tolerance = static_cast<float>(most_cost);
    for (int colour = 0; colour < 2; ++colour) {
      pass.colour = colour;
      pass.candidates = candidates[static_cast<std::size_t>(colour)];
      add(Kernel::search, pass, views, std::popcount(pass.candidates));
    }
  }

  /// What a round of regressions asks of neighbourhoods.
  struct Round {
    double precision;  ///< what they must determine; 0: normals alone
    double tolerance;  ///< of other surfaces, as a share of the first round's
  };

  /// More from round to round, as outliers vanish and neighbours become smooth.
  Round round(int i) const {
    constexpr double share = 0.6;
    constexpr double finest = 1e-6;  // always the whole neighbourhood; 0 would mean normals alone
    const double narrowed = std::pow(share, i);
    return {std::max(options_.regression_precision * narrowed, finest), narrowed};
  }

  /// On coarse levels blank walls are still found from farther edges.
  Round coarse_round(int i) const { return {round(i).precision, 1}; }

  Round normals_after(int rounds) const { return {0, round(rounds - 1).tolerance}; }

  void measure(Views views) { add(Kernel::measure, pass_of(views), views, 0); }

  /// In all sources at most. `how`: see shaders/subpixel.glsl.
  void match_subpixel(Views views, unsigned how = 0) {
    kernel::PassParameters pass = pass_of(views);
    pass.candidates = how;
    add(Kernel::subpixel, pass, views, 1);
  }

  /// Planes that were regressed in the frame before need fewer neighbours.
  int warm_regression_steps() const {
    constexpr int fewest = 2;
    return std::max(std::min(options_.regression_steps, fewest), options_.regression_steps / 2);
  }

  /// The views must have been measured. `how`, and the kernel that adopts the planes: see
  /// shaders/regression.glsl.
  void regress(Views views, Round round, unsigned how, Kernel adopt) {
    regress(views, round, how, adopt, options_.regression_steps);
  }

  /// `steps`: of the grid of neighbours.
  void regress(Views views, Round round, unsigned how, Kernel adopt, int steps) {
    kernel::PassParameters pass = pass_of(views);
    pass.iteration = ++regressions_;
    // Four times as much for normals alone: a slope needs a wider base than a distance.
    pass.radius = (round.precision == 0 ? 4 : 1) * options_.regression_radius;
    pass.steps = steps;
    pass.deviation = static_cast<float>(round.precision);
    pass.tolerance = static_cast<float>(round.tolerance);
    pass.candidates = how;
    add(Kernel::regress, pass, views, 0);
    add(adopt, pass, views, adopt == Kernel::adopt ? 1 : 0);
  }

  /// Regressed planes get their costs when they have been voted on. Until then, pixels keep those
  /// of the planes before, which lie near enough to be checked.
  Kernel until_vote() const {
    return options_.vote_radius > 0 ? Kernel::adopt_point : Kernel::adopt;
  }

  /// A vote ends with costs for all planes.
  bool costs_follow_in_warm_frames() const {
    return options_.search == SearchMethod::pyramid && options_.warm_regressions > 0 &&
           options_.vote_radius > 0;
  }

  /// `costs_follow`: those of the planes that are voted for.
  void vote(bool costs_follow) {
    if (options_.vote_radius == 0) return;
    kernel::PassParameters pass = pass_of(views_of(0));
    pass.iteration = regressions_;
    pass.radius = options_.vote_radius;
    // In the source that tells most.
    add_with_samples(Kernel::vote, pass, views_of(0),
                     VOTE_COMPARED * kernel::samples_of_patch(VOTE_MIDDLE_RADIUS, PATTERN_DENSE));
    if (costs_follow) {
      add(Kernel::adopt_point, pass_of(views_of(0)), views_of(0), 0);
    } else {
      adopt_voted();
    }
  }

  void merge() {
    add(Kernel::merge, pass_of(views_of(0)), views_of(0), 0);
    adopt_voted();
  }

  /// What regressions left without a cost gets one, voted for or not.
  void adopt_voted() {
    kernel::PassParameters pass = pass_of(views_of(0));
    pass.candidates = HELD_UNSEEN;
    add(Kernel::adopt, pass, views_of(0), 1);
  }

  void find_ambiguity() {
    kernel::PassParameters pass = pass_of(views_of(0));
    pass.places = 6;
    add(Kernel::ambiguity, pass, views_of(0), pass.places);
  }

  /// All views must have been checked: filled planes must not count as a source's own. `how`:
  /// reasons not to fill, FILL_WITH_MATCHES.
  void fill(int radius, unsigned how) {
    if (radius == 0) return;
    kernel::PassParameters pass = pass_of(views_of(0));
    pass.radius = radius;
    pass.candidates = how;
    add(Kernel::fill, pass, views_of(0), 0);
    add(Kernel::adopt_fill, pass, views_of(0), 1);
  }

  /// Lets pixels that fail the checks take the planes around them, and then the elected ones.
  /// `last`: after the last regression; then the views are merged, as nothing but the checks
  /// compares planes as they came about any more.
  void repair_and_vote(bool last) {
    const bool merges = last && options_.merge_views;
    if (options_.repair_radius > 0 || options_.vote_radius > 0) {
      // Samples one source once.
      add_with_samples(Kernel::check_for_vote, pass_of(views_of(0)), views_of(0), 1);
      fill(options_.repair_radius, reason_no_ray | reason_no_overlap | FILL_WITH_MATCHES);
      vote(merges);
    }
    if (merges) merge();
  }

  const Options& options_;
  int levels_ = 1;
  int views_of_rig_ = 2;
  int regressions_ = 0;
  Schedule schedule_;
};

void require_usable(const Rig& rig, const Options& options) {
  if (rig.views.size() < 2) {
    throw Error("The rig has " + std::to_string(rig.views.size()) +
                " view(s); stereo needs 2 or more.");
  }
  validate(rig, "The rig");
  validate(options);
}

}  // namespace

const char* to_string(Kernel kernel) {
  static constexpr std::array<const char*, kernel_count> names = {
#define KERNEL(name, view) #name,
#include "kernel_list.h"
      "iterate_raster"};
  return names[static_cast<std::size_t>(kernel)];
}

Schedule make_schedule(const Rig& rig, const Options& options) {
  require_usable(rig, options);
  return Builder(rig, options).build_cold();
}

Schedule make_warm_schedule(const Rig& rig, const Options& options) {
  require_usable(rig, options);
  return Builder(rig, options).build_warm();
}

void set_motion(Schedule& schedule, const Rig& rig, const Eigen::Isometry3d& now_from_previous,
                int frame) {
  require_rigid(now_from_previous, "The motion from the previous frame");
  schedule.parameters.frame.x = frame;
  for (std::size_t i = 0; i < rig.views.size(); ++i) {
    const Eigen::Isometry3d& rig_from_camera = rig.views[i].world_from_camera;
    schedule.parameters.pairs[i * MAX_IMAGES + i] =
        view_pair(rig_from_camera.inverse() * now_from_previous * rig_from_camera);
  }
}

}  // namespace widestereo
