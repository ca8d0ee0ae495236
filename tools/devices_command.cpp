// SPDX-License-Identifier: MIT
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "commands.h"
#include "roofline.h"
#include "text/json_text.h"
#include "widestereo/device.h"

namespace {

void print_devices(bool as_json) {
  nlohmann::ordered_json list = nlohmann::json::array();
  for (const widestereo::DeviceInfo& device : widestereo::Device::list()) {
    if (as_json) {
      list.push_back({{"id", device.id},
                      {"name", device.name},
                      {"type", device.type},
                      {"driver", device.driver},
                      {"uuid", device.uuid},
                      {"unusable", device.unusable},
                      {"peaks", to_json(device.peaks)}});
      continue;
    }
    std::cout << std::left << std::setw(10) << device.id << device.name << "  [" << device.type
              << (device.driver.empty() ? "" : ", " + device.driver) << "]";
    if (!device.uuid.empty()) std::cout << "  " << device.uuid;
    if (!device.unusable.empty()) std::cout << "  NOT USABLE: " << device.unusable;
    std::cout << "\n";
  }
  if (as_json) {
    std::cout << widestereo::to_text(list) << "\n";
    return;
  }
  for (const auto& [kind, name] : {std::pair(widestereo::DeviceKind::cuda, "CUDA"),
                                   std::pair(widestereo::DeviceKind::vulkan, "Vulkan")}) {
    const std::string why = widestereo::Device::why_none(kind);
    if (!why.empty()) std::cout << "No " << name << " device: " << why << "\n";
  }
}

}  // namespace

void add_devices_command(CLI::App& app) {
  CLI::App* command = app.add_subcommand("devices", "List the devices that can match, best first");
  auto as_json = std::make_shared<bool>(false);
  command->add_flag("--json", *as_json, "Print JSON");
  command->callback([as_json] { print_devices(*as_json); });
}
