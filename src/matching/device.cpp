// SPDX-License-Identifier: MIT
#include "widestereo/device.h"

#include <algorithm>
#include <charconv>
#include <utility>

#include "cpu/cpu_device.h"
#include "matching/backend.h"
#include "vulkan/vulkan_device.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

constexpr const char* vulkan_prefix = "vulkan:";

/// Lower is better: GPUs before software devices.
int rank(const DeviceInfo& info) {
  if (!info.unusable.empty()) return 9;
  if (info.type == "discrete gpu") return 0;
  if (info.type == "integrated gpu") return 1;
  if (info.type == "virtual gpu") return 2;
  return info.kind == DeviceKind::vulkan ? 3 : 4;
}

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string names_of(const std::vector<DeviceInfo>& devices) {
  std::string names;
  for (const DeviceInfo& device : devices) {
    names += (names.empty() ? "" : ", ") + device.id + " (" + device.name + ")";
  }
  return names;
}

bool matches(const DeviceInfo& device, const std::string& wanted) {
  std::string uuid = lower_case(wanted);
  std::erase(uuid, '-');
  return wanted.empty() || device.id == vulkan_prefix + wanted || device.uuid == uuid ||
         lower_case(device.name).find(lower_case(wanted)) != std::string::npos;
}

int index_of(const DeviceInfo& device) {
  return std::stoi(device.id.substr(std::string(vulkan_prefix).size()));
}

std::unique_ptr<Device::Implementation> open_matching(const std::string& wanted,
                                                      const DeviceRequest& request) {
  std::string why_none;
  std::vector<DeviceInfo> devices = list_vulkan_devices(&why_none);
  if (devices.empty()) {
    throw Error("No Vulkan device: " + why_none + " Or choose the device \"cpu\".");
  }
  std::stable_sort(devices.begin(), devices.end(),
                   [](const auto& a, const auto& b) { return rank(a) < rank(b); });
  for (const DeviceInfo& device : devices) {
    if (!matches(device, wanted)) continue;
    if (!device.unusable.empty()) {
      throw Error("The Vulkan device " + device.name + " cannot be used: " + device.unusable);
    }
    return open_vulkan_device(index_of(device), request);
  }
  throw Error("No Vulkan device is called \"" + wanted + "\"; there are: " + names_of(devices) +
              ".");
}

std::unique_ptr<Device::Implementation> open_best(const DeviceRequest& request) {
  std::string passed_over;
  for (const DeviceInfo& device : Device::list()) {
    if (device.kind == DeviceKind::cpu) continue;
    if (!device.unusable.empty()) {
      passed_over += device.name + ": " + device.unusable + " ";
      continue;
    }
    try {
      auto implementation = open_vulkan_device(index_of(device), request);
      implementation->note = passed_over;
      return implementation;
    } catch (const Error& error) {
      passed_over += device.name + ": " + error.what() + " ";
    }
  }
  if (passed_over.empty()) {
    list_vulkan_devices(&passed_over);
    passed_over = "No Vulkan device: " + passed_over + " ";
  }
  auto implementation = open_cpu_device();
  implementation->note = passed_over + "Using the CPU.";
  return implementation;
}

}  // namespace

Device::Device(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
Device::~Device() = default;
Device::Device(Device&&) noexcept = default;
Device& Device::operator=(Device&&) noexcept = default;

const DeviceInfo& Device::info() const { return implementation_->info; }
const std::string& Device::note() const { return implementation_->note; }
std::vector<std::string> Device::validation_messages() const {
  return implementation_->validation_messages();
}

Device Device::open(const DeviceRequest& request) {
  const std::string& name = request.device;
  if (name == "auto") return Device(open_best(request));
  if (name == "cpu") return Device(open_cpu_device());
  if (name == "vulkan") return Device(open_matching("", request));
  if (name.starts_with(vulkan_prefix)) {
    return Device(open_matching(name.substr(std::string(vulkan_prefix).size()), request));
  }
  throw Error("There is no device \"" + name +
              "\"; choose auto, cpu, vulkan, vulkan:INDEX, vulkan:NAME or vulkan:UUID "
              "(`widestereo devices` lists them).");
}

Device Device::open(const std::string& device) {
  DeviceRequest request;
  request.device = device;
  return open(request);
}

std::vector<DeviceInfo> Device::list() {
  std::vector<DeviceInfo> devices = list_vulkan_devices(nullptr);
  devices.push_back(cpu_device_info());
  std::stable_sort(devices.begin(), devices.end(),
                   [](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return devices;
}

}  // namespace widestereo
