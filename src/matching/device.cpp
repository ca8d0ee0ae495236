// SPDX-License-Identifier: MIT
#include "widestereo/device.h"

#include <algorithm>
#include <array>
#include <utility>

#include "cpu/cpu_device.h"
#include "cuda/cuda_device.h"
#include "matching/open_first.h"
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

/// Lower is better, usable or not: GPUs before software devices, CUDA before Vulkan.
int rank(const DeviceInfo& info) {
  const int not_cuda = info.kind == DeviceKind::cuda ? 0 : 3;
  if (info.type == "integrated gpu") return not_cuda + 1;
  if (info.type == "virtual gpu") return not_cuda + 2;
  // CUDA devices whose properties cannot be read have no type.
  if (info.type == "discrete gpu" || info.kind == DeviceKind::cuda) return not_cuda;
  return info.kind == DeviceKind::cpu ? 7 : 6;
}

template <class Place>
void sort_by(std::vector<DeviceInfo>& devices, Place place) {
  std::stable_sort(devices.begin(), devices.end(),
                   [place](const auto& a, const auto& b) { return place(a) < place(b); });
}

/// Best first, then those that cannot be used.
void sort_usable_first(std::vector<DeviceInfo>& devices) {
  sort_by(devices,
          [](const DeviceInfo& info) { return std::pair(!info.unusable.empty(), rank(info)); });
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

std::unique_ptr<Device::Implementation> open_matching(const Api& api, const std::string& wanted,
                                                      const DeviceRequest& request) {
  const std::string name = api.name;
  std::string why_none;
  std::vector<DeviceInfo> devices = api.list(&why_none);
  if (devices.empty()) {
    throw Error("No " + name + " device: " + why_none + " Or choose the device \"cpu\".");
  }
  sort_usable_first(devices);
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

/// Why there is no device of this kind, a space after it; empty if there is one.
std::string note_of_none(const Api& api) {
  const std::string why = Device::why_none(api.kind);
  return why.empty() ? "" : std::string("No ") + api.name + " device: " + why + " ";
}

std::unique_ptr<Device::Implementation> open_best(const DeviceRequest& request) {
  const auto& [cuda, vulkan] = apis;
  // Someone without an NVIDIA driver need not read of CUDA.
  std::string passed_over = cuda_driver_found() ? note_of_none(cuda) : "";
  std::vector<DeviceInfo> devices = Device::list();
  std::erase_if(devices, [](const DeviceInfo& device) { return device.kind == DeviceKind::cpu; });
  auto implementation = open_first(devices, request, passed_over);
  if (implementation != nullptr) return implementation;
  implementation = open_cpu_device();
  implementation->note = passed_over + note_of_none(vulkan) + "Using the CPU.";
  return implementation;
}

}  // namespace

std::unique_ptr<Device::Implementation> open_first(std::vector<DeviceInfo> devices,
                                                   const DeviceRequest& request,
                                                   std::string& passed_over) {
  sort_by(devices,
          [](const DeviceInfo& info) { return std::pair(rank(info), info.unusable.empty()); });
  for (const DeviceInfo& device : devices) {
    std::string why = device.unusable;
    try {
      if (why.empty()) {
        auto implementation = open_listed(device, request);
        implementation->note = passed_over;
        return implementation;
      }
    } catch (const Error& error) {
      why = error.what();
    }
    passed_over += device.name + ": " + why + " ";
  }
  return nullptr;
}

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
  sort_usable_first(devices);
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
