// SPDX-License-Identifier: MIT
// The order of kernels, once for all back ends: a list of dispatches without read-back.
#pragma once

#include <vector>

#include "kernel/host.h"
#include "widestereo/options.h"
#include "widestereo/rig.h"

namespace widestereo {

/// Every kernel, as shaders/kernel_list.h describes them; each has one entry point per back end,
/// named as to_string() says.
enum class Kernel {
#define KERNEL(name, view) name,
#include "kernel_list.h"
  iterate_raster,  ///< iterate, sequentially in raster order (CPU back end only)
};
inline constexpr int kernel_count = static_cast<int>(Kernel::iterate_raster) + 1;
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
  int texels_per_pixel = 1;  ///< 2 for cubic interpolation
  bool operator==(const KernelConstants&) const = default;
};
/// Texture units have texels of half precision where they can: what is shorter collides less in
/// their cache.
inline int bytes_of_texel(const KernelConstants& constants) {
  return constants.filter == static_cast<int>(Filter::device) ? 2 : 4;
}

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

/// How many pixels of a row are launched: every other one for one colour of the checkerboard.
inline int columns_of(int width, int colour) { return colour < 0 ? width : (width + 1) / 2; }

struct Schedule {
  KernelConstants constants;
  kernel::MatchParameters parameters{};
  std::vector<Dispatch> dispatches;
  /// The rig's views at full size, then at half of it, and so on: what a back end keeps memory for.
  std::vector<View> views;
};

/// Throws Error when rig or options are invalid, there are fewer than 2 views, more than
/// MAX_IMAGES, or those of all levels together are more than MAX_VIEWS.
Schedule make_schedule(const Rig& rig, const Options& options);

/// The schedule of a frame that starts from the planes which the views hold, those of the previous
/// frame, with the same constants and views; set_motion() completes it. Throws as make_schedule().
Schedule make_warm_schedule(const Rig& rig, const Options& options);

/// Sets how the rig moved since the previous frame, and which frame of its sequence this is; the
/// dispatches stay the same. `now_from_previous`: X now = T X then, in the rig's frame (metres).
/// Throws Error, and changes nothing, where that is no rigid motion.
void set_motion(Schedule& schedule, const Rig& rig, const Eigen::Isometry3d& now_from_previous,
                int frame);

}  // namespace widestereo
