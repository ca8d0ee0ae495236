// SPDX-License-Identifier: MIT
#include "matching/device_rows.h"

#include "widestereo/error.h"

namespace widestereo {

std::size_t bytes_of(PixelType pixel) {
  switch (pixel) {
    case PixelType::grey8:
      return 1;
    case PixelType::grey16:
      return 2;
    case PixelType::intensity:
      return 4;
  }
  throw Error("There is no pixel type " + std::to_string(static_cast<int>(pixel)) +
              "; use one of PixelType.");
}

void require_one_for_each_view(std::size_t views, std::size_t images, std::size_t maps) {
  if (images == views && maps == views) return;
  throw Error("The rig has " + std::to_string(views) + " views, but " + std::to_string(images) +
              " image(s) and maps for " + std::to_string(maps) +
              " view(s) were given; give one of each for every view.");
}

void require_rows(const DeviceRows& rows, const std::string& what) {
  if (rows.pitch >= rows.row && rows.pitch % rows.element == 0 && rows.place % rows.element == 0) {
    return;
  }
  throw Error(what + " has a pitch of " + std::to_string(rows.pitch) + " bytes; its " +
              rows.place_is + " and pitch must be multiples of " + std::to_string(rows.element) +
              " and rows have " + std::to_string(rows.row) + " bytes.");
}

}  // namespace widestereo
