// SPDX-License-Identifier: MIT
#include "widestereo/device.h"

#include <algorithm>
#include <array>
#include <utility>

#include "cpu/cpu_device.h"
#include "cuda/cuda_device.h"
#include "matching/backend.h"
#include "text/lower_case.h"
#include "vulkan/vulkan_device.h"
#include "widestereo/error.h"

namespace widestereo {
namespace {

/// One kind of GPU interface: "cuda", "vulkan".
struct Api {
  DeviceKind kind;
  const char* id;
  const char* name;
  std::vector<DeviceInfo> (*list)(std::string* why_none);
  std::unique_ptr<Device::Implementation> (*open)(int index, const DeviceRequest& request);
};
constexpr std::array<Api, 2> apis = {
    {{DeviceKind::cuda, "cuda", "CUDA", list_cuda_devices, open_cuda_device},
     {DeviceKind::vulkan, "vulkan", "Vulkan", list_vulkan_devices, open_vulkan_device}}};

/// Lower is better: GPUs before software devices, CUDA before Vulkan.
int rank(const DeviceInfo& info) {
  if (!info.unusable.empty()) return 9;
  const int not_cuda = info.kind == DeviceKind::cuda ? 0 : 3;
  if (info.type == "discrete gpu") return not_cuda;
  if (info.type == "integrated gpu") return not_cuda + 1;
  if (info.type == "virtual gpu") return not_cuda + 2;
  return info.kind == DeviceKind::cpu ? 7 : 6;
}

std::string names_of(const std::vector<DeviceInfo>& devices) {
  std::string names;
  for (const DeviceInfo& device : devices) {
    names += (names.empty() ? "" : ", ") + device.id + " (" + device.name + ")";
  }
  return names;
}

/// The first device that is `wanted` (what follows "API:", empty for any), null if none is. An
/// index or UUID counts before parts of names, which may hold digits; a number is always an index.
const DeviceInfo* find(const std::vector<DeviceInfo>& devices, const Api& api,
                       const std::string& wanted) {
  const std::string name_part = lower_case(wanted);
  std::string uuid = name_part;
  std::erase(uuid, '-');
  if (uuid.starts_with("gpu") || uuid.starts_with("mig")) uuid.erase(0, 3);  // as nvidia-smi has it
  const auto first = [&devices](auto is_wanted) {
    const auto found = std::find_if(devices.begin(), devices.end(), is_wanted);
    return found == devices.end() ? nullptr : &*found;
  };
  const DeviceInfo* exact = first([&](const DeviceInfo& device) {
    return device.id == std::string(api.id) + ":" + wanted ||
           (!uuid.empty() && device.uuid == uuid);
  });
  const bool is_number =
      !wanted.empty() && wanted.find_first_not_of("0123456789") == std::string::npos;
  if (exact != nullptr || is_number) return exact;
  return first([&](const DeviceInfo& device) {
    return lower_case(device.name).find(name_part) != std::string::npos;
  });
}

std::unique_ptr<Device::Implementation> open_listed(const DeviceInfo& device,
                                                    const DeviceRequest& request) {
  for (const Api& api : apis) {
    if (api.kind != device.kind) continue;
    return api.open(std::stoi(device.id.substr(std::string(api.id).size() + 1)), request);
  }
  return open_cpu_device();
}

/// The first usable one that opens, as another process may have taken it; null where none does.
/// `passed_over`: sentences about those before it, a space after each, which it is noted with.
std::unique_ptr<Device::Implementation> open_first(const std::vector<DeviceInfo>& devices,
                                                   const DeviceRequest& request,
                                                   std::string& passed_over) {
  for (const DeviceInfo& device : devices) {
    if (!device.unusable.empty()) continue;
    try {
      auto implementation = open_listed(device, request);
      implementation->note = passed_over;
      return implementation;
    } catch (const Error& error) {
      passed_over += device.name + ": " + error.what() + " ";
    }
  }
  return nullptr;
}

std::unique_ptr<Device::Implementation> open_matching(const Api& api, const std::string& wanted,
                                                      const DeviceRequest& request) {
  const std::string name = api.name;
  std::string why_none;
  std::vector<DeviceInfo> devices = api.list(&why_none);
  if (devices.empty()) {
    throw Error("No " + name + " device: " + why_none + " Or choose the device \"cpu\".");
  }
  std::stable_sort(devices.begin(), devices.end(),
                   [](const auto& a, const auto& b) { return rank(a) < rank(b); });
  if (wanted.empty() && devices.front().unusable.empty()) {
    std::string passed_over;
    auto implementation = open_first(devices, request, passed_over);
    if (implementation != nullptr) return implementation;
    throw Error(passed_over + "Or choose the device \"cpu\".");
  }
  const DeviceInfo* device = find(devices, api, wanted);
  if (device == nullptr) {
    throw Error("No " + name + " device is called \"" + wanted +
                "\"; there are: " + names_of(devices) + ".");
  }
  if (!device->unusable.empty()) {
    throw Error("The " + name + " device " + device->name + " cannot be used: " + device->unusable);
  }
  return open_listed(*device, request);
}

/// Which CUDA devices cannot be used and why. Someone without an NVIDIA driver need not read of
/// CUDA.
std::string unusable_cuda_devices() {
  if (!cuda_driver_found()) return "";
  std::string why;
  const std::vector<DeviceInfo> devices = list_cuda_devices(&why);
  if (devices.empty()) return "No CUDA device: " + why + " ";
  std::string unusable;
  for (const DeviceInfo& device : devices) {
    if (!device.unusable.empty()) unusable += device.name + ": " + device.unusable + " ";
  }
  return unusable;
}

std::unique_ptr<Device::Implementation> open_best(const DeviceRequest& request) {
  std::string passed_over = unusable_cuda_devices();
  std::vector<DeviceInfo> devices = Device::list();
  std::erase_if(devices, [](const DeviceInfo& device) { return device.kind == DeviceKind::cpu; });
  auto implementation = open_first(devices, request, passed_over);
  if (implementation != nullptr) return implementation;
  bool any_vulkan = false;
  for (const DeviceInfo& device : devices) {
    if (device.kind != DeviceKind::vulkan) continue;
    any_vulkan = true;
    if (!device.unusable.empty()) passed_over += device.name + ": " + device.unusable + " ";
  }
  if (!any_vulkan) {
    passed_over += "No Vulkan device: " + Device::why_none(DeviceKind::vulkan) + " ";
  }
  implementation = open_cpu_device();
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
  for (const Api& api : apis) {
    const std::string prefix = std::string(api.id) + ":";
    if (name == api.id) return Device(open_matching(api, "", request));
    if (name.starts_with(prefix)) {
      return Device(open_matching(api, name.substr(prefix.size()), request));
    }
  }
  throw Error(
      "There is no device \"" + name +
      "\"; choose auto, cpu, cuda or vulkan, either of these two also with :INDEX, :NAME or "
      ":UUID (`widestereo devices` lists them).");
}

std::vector<DeviceInfo> Device::list() {
  std::vector<DeviceInfo> devices;
  for (const Api& api : apis) {
    for (DeviceInfo& device : api.list(nullptr)) devices.push_back(std::move(device));
  }
  devices.push_back(cpu_device_info());
  std::stable_sort(devices.begin(), devices.end(),
                   [](const auto& a, const auto& b) { return rank(a) < rank(b); });
  return devices;
}

std::string Device::why_none(DeviceKind kind) {
  std::string why;
  for (const Api& api : apis) {
    if (api.kind == kind) api.list(&why);
  }
  return why;
}

}  // namespace widestereo
