// SPDX-License-Identifier: MIT
// Which device is chosen, and what is said of those that are not.
#include <gmock/gmock.h>

#include "matching/open_first.h"
#include "vulkan_fixture.h"

namespace widestereo::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

DeviceInfo vulkan_device(const std::string& id, const std::string& type,
                         const std::string& unusable = {}) {
  DeviceInfo info;
  info.kind = DeviceKind::vulkan;
  info.id = id;
  info.name = type + " " + id;
  info.type = type;
  info.unusable = unusable;
  return info;
}

std::unique_ptr<Device::Implementation> first_of(const std::vector<DeviceInfo>& devices) {
  std::string passed_over = "No CUDA device. ";
  return open_first(devices, {}, passed_over);
}

TEST(DeviceChoice, NotesBetterDevicesThatCannotBeUsedOrDoNotOpen) {
  DeviceInfo cpu;
  cpu.id = "cpu";
  const auto device = first_of({cpu, vulkan_device("vulkan:1000", "integrated gpu"),
                                vulkan_device("vulkan:1", "discrete gpu", "It is too old.")});
  ASSERT_NE(device, nullptr);
  EXPECT_EQ(device->info.kind, DeviceKind::cpu);
  EXPECT_THAT(device->note, ::testing::StartsWith("No CUDA device. discrete gpu vulkan:1: It is "
                                                  "too old. integrated gpu vulkan:1000: "));
  EXPECT_EQ(first_of({vulkan_device("vulkan:1", "discrete gpu", "It is too old.")}), nullptr);
}

TEST(DeviceChoice, NotesUnusableGpusNoWorseThanTheOneThatOpens) {
  REQUIRE_VULKAN_OR_SKIP();
  // The first device, as a GPU.
  const auto device = first_of({vulkan_device("vulkan:0", "discrete gpu"),
                                vulkan_device("vulkan:1", "discrete gpu", "It is too old."),
                                vulkan_device("vulkan:2", "integrated gpu", "It is too small.")});
  ASSERT_NE(device, nullptr);
  EXPECT_EQ(device->info.kind, DeviceKind::vulkan);
  EXPECT_THAT(device->note, HasSubstr("discrete gpu vulkan:1: It is too old."));
  EXPECT_THAT(device->note, Not(HasSubstr("vulkan:2"))) << "nothing was lost by it";
}

}  // namespace
}  // namespace widestereo::test
