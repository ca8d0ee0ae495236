// SPDX-License-Identifier: MIT
#include "matching/match_setup.h"

#include "widestereo/error.h"

namespace widestereo {
namespace {

Options suited(Options options, const DeviceInfo& device) {
  if (!device.filters_intensities) options.filter = Filter::exact;
  return options;
}

}  // namespace

MatchSetup::MatchSetup(const Rig& rig, const Options& options, const DeviceInfo& device)
    : schedule(make_schedule(rig, suited(options, device))),
      warm_schedule(make_warm_schedule(rig, suited(options, device))) {
  if (options.propagation == Propagation::raster && device.kind != DeviceKind::cpu) {
    throw Error(
        "Raster-order propagation is sequential and runs on the CPU only; choose the "
        "device \"cpu\" or checkerboard propagation.");
  }
  for (const View& view : schedule.views) {
    sizes.emplace_back(view.camera.width, view.camera.height);
    rays.push_back(ray_image(view.camera, view.mask));
  }
}

void MatchSetup::set_rays(Backend& backend) const {
  for (std::size_t i = 0; i < rays.size(); ++i) backend.set_rays(static_cast<int>(i), rays[i]);
}

}  // namespace widestereo
