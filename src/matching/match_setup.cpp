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
  }
}

std::vector<cv::Mat> MatchSetup::set_rays(Backend& backend) const {
  const auto views_of_rig = static_cast<std::size_t>(schedule.constants.source_count) + 1;
  std::vector<cv::Mat> of_rig;
  for (std::size_t i = 0; i < schedule.views.size(); ++i) {
    const View& view = schedule.views[i];
    const cv::Mat rays = ray_image(view.camera, view.mask);
    backend.set_rays(static_cast<int>(i), rays);
    if (i < views_of_rig) of_rig.push_back(rays);
  }
  return of_rig;
}

void require_planes(bool there_are, const std::string& remedy) {
  if (there_are) return;
  throw Error("There are no planes of a previous frame to start from; " + remedy);
}

}  // namespace widestereo
