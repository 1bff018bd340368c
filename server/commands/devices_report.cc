// SPDX-License-Identifier: Apache-2.0
#include "server/commands/devices_report.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

#include "devices/falcon/falcon_device.h"
#include "server/scene/scene.h"

namespace tendon {
namespace {

std::string id_of(const usb::PluggedIn& plugged) {
  std::ostringstream text;
  text << std::hex << std::setfill('0') << std::setw(4) << plugged.id.vendor << ':' << std::setw(4)
       << plugged.id.product;
  return text.str();
}

const Driver* driver_for(const usb::Id& id) {
  const auto found = std::ranges::find_if(
      drivers(), [&id](const Driver* driver) { return std::ranges::find(driver->ids, id) != driver->ids.end(); });
  return found == drivers().end() ? nullptr : *found;
}

}  // namespace

std::vector<PluggedDevice> report_devices(std::span<const usb::PluggedIn> plugged,
                                          const std::optional<std::string>& firmware_problem) {
  std::vector<PluggedDevice> reports;
  for (const usb::PluggedIn& one : plugged) {
    const Driver* driver = driver_for(one.id);
    if (driver == nullptr) continue;
    const bool falcon = one.id == FalconDevice::kId;
    PluggedDevice report{
        .name = std::string(driver->name), .kind = std::string(driver->kind), .plugged = one, .lacks = {}};
    if (!one.has_node) {
      report.lacks.push_back(
          {"there is no " + one.node + ", although the kernel has found the device",
           "pass it to this container: docker run -v /dev/bus/usb:/dev/bus/usb --device-cgroup-rule 'c 189:* rmw'"});
    } else if (!one.may_open) {
      report.lacks.push_back(
          {"this user has no permission to open " + one.node,
           "copy deploy/udev/60-tendon.rules to /etc/udev/rules.d, run `udevadm control --reload`, then unplug the "
           "device and plug it in again; users who are not logged in locally must be in the group plugdev"});
    }
    if (falcon && !firmware_problem) {
      report.lacks.push_back(
          {"no firmware file, which the device requires each time it is powered on",
           "use the file of your own Novint software with --falcon-firmware FILE, or with `firmware` in [device] of "
           "the scene; Tendon cannot include it (devices/falcon/README.md)"});
    } else if (falcon && !firmware_problem->empty()) {
      report.lacks.push_back({*firmware_problem, "use the file of your own Novint software"});
    }
    reports.push_back(std::move(report));
  }
  return reports;
}

std::string in_words(std::span<const PluggedDevice> devices) {
  if (devices.empty()) {
    return "no device with a Tendon driver is connected; a Falcon also requires its own power supply\n";
  }
  std::ostringstream text;
  for (const PluggedDevice& device : devices) {
    text << device.name << "  " << id_of(device.plugged) << "  port " << device.plugged.port << "  "
         << device.plugged.node << "\n  scene: [device] kind = \"" << device.kind << "\"\n";
    for (const auto& [what, mend] : device.lacks) text << "  missing: " << what << "\n    " << mend << '\n';
    if (device.lacks.empty()) text << "  nothing is missing\n";
  }
  return text.str();
}

std::string in_json(std::span<const PluggedDevice> devices) {
  using Json = nlohmann::ordered_json;
  std::string text;
  for (const PluggedDevice& device : devices) {
    Json out = {{"name", device.name},         {"kind", device.kind},         {"id", id_of(device.plugged)},
                {"port", device.plugged.port}, {"node", device.plugged.node}, {"may_open", device.plugged.may_open},
                {"missing", Json::array()}};
    for (const auto& [what, mend] : device.lacks) out["missing"].push_back({{"what", what}, {"mend", mend}});
    text += out.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
  }
  return text;
}

}  // namespace tendon
