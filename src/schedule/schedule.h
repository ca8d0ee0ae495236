// SPDX-License-Identifier: MIT
// The order of kernels, once for all back ends: a list of dispatches without read-back.
#pragma once

#include <vector>

#include "kernel/host.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"

namespace widestereo {

/// Every kernel; each has one entry point per back end, named as to_string() says
/// (shaders/NAME.comp).
enum class Kernel {
  initialise,        ///< random planes of a view and their cost
  iterate,           ///< one colour: candidates of the neighbours, then random refinements
  iterate_raster,    ///< the same, sequentially in raster order (CPU back end only)
  transfer_clear,    ///< empties the transfer buffers of a view
  transfer_nearest,  ///< forward-warps another view's planes: nearest inverse distance per pixel
  transfer_winner,   ///< ... smallest pixel index among the nearest ones
  transfer_gather,   ///< ... takes over the winner's plane, or a random one where there is none
  check,             ///< consistency, reasons and confidence of a view
  downsample,        ///< intensities of a view from those one level finer
  sweep,             ///< fronto-spherical planes over the whole range of inverse distances
  upsample,          ///< planes of a view from those one level coarser
  search,            ///< one colour: candidates of eight strips, then refinement in source pixels
  measure,           ///< how precisely each pixel is matched (kept where the checks go)
  regress,           ///< precision-weighted plane of each pixel's neighbourhood
  adopt,             ///< takes those planes over
  fill,              ///< planes of accepted pixels for the rejected ones around them
  adopt_fill,        ///< takes those planes over and marks the pixels
  vote,              ///< planes which most of the planes around agree with
  transfer_keep,     ///< keeps a view's own planes, moved on from the previous frame
  renew,             ///< starts a view from those
  interpolate,       ///< intensities of a view at half pixels
  subpixel,          ///< moves what was measured to where each patch matches best
  ambiguity,         ///< adds to the checks where another place matches better
  adopt_point,       ///< takes regressed planes over whose costs follow later
};
inline constexpr int kernel_count = 24;
const char* to_string(Kernel kernel);

/// Constants compiled into a back end's kernels (specialisation constants, template arguments).
struct KernelConstants {
  int camera_model = -1;  ///< of all views when they agree, else -1
  int window_radius = 5;
  int warp = 0;
  int source_count = 1;
  int pattern = 0;
  int weighted = 0;
  int filter = 0;
  bool operator==(const KernelConstants&) const = default;
};

/// One launch over all pixels of a view, or of several, none of which reads what another one's
/// threads write. Writes of one dispatch are visible to the next.
struct Dispatch {
  Kernel kernel = Kernel::initialise;
  kernel::PassParameters pass{};
  int over = 0;   ///< the view, or the first of them; `pass.reference` or `pass.other`
  int views = 1;  ///< how many there are: they follow each other
  int width = 0;  ///< pixels, of the largest of them
  int height = 0;
  long long pixels = 0;   ///< of all of them, both colours
  long long samples = 0;  ///< patch samples at full windows, for splitting and progress
};

struct Schedule {
  KernelConstants constants;
  kernel::MatchParameters parameters{};
  std::vector<Dispatch> dispatches;
  /// The rig's views at full size, then at half of it, and so on: what a back end keeps memory for.
  std::vector<View> views;
};

/// Samples of a patch at its full window.
long long samples_of_patch(int window_radius, int pattern);

/// Throws Error when rig or options are invalid, there are fewer than 2 views, more than
/// MAX_IMAGES, or those of all levels together are more than MAX_VIEWS.
Schedule make_schedule(const Rig& rig, const Options& options);

/// The schedule of a frame that starts from the planes which the views hold, those of the previous
/// frame, with the same constants and views; set_motion() completes it. Throws as make_schedule().
Schedule make_warm_schedule(const Rig& rig, const Options& options);

/// Sets how the rig moved since the previous frame, and which frame this is since a cold one; the
/// dispatches stay the same. `now_from_previous`: X now = T X then, in the rig's frame (metres).
void set_motion(Schedule& schedule, const Rig& rig, const Eigen::Isometry3d& now_from_previous,
                int frame);

}  // namespace widestereo
