// SPDX-License-Identifier: Apache-2.0
#include "server/device_factory.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "devices/driver.h"
#include "devices/usb/usb.h"
#include "protocol/limits.h"
#include "server/machine/log.h"
#include "server/machine/realtime.h"
#include "server/machine/regular_file.h"

namespace tendon {
namespace {

constexpr int kUsbPriority = kHapticPriority + 5;  ///< must be higher, because the haptic thread waits for USB

std::function<void(int)> notify_guardian(Guardian& guardian, const Scene& scene, const Driver& driver) {
  static_assert(limits::kMaxDevices <= Guardian::kDevices);
  const ZeroPacket zero = ZeroPacket::usb(driver.out, std::as_bytes(std::span(driver.zero_packet)));
  return [&guardian, zero, device = scene.loop.device, name = scene.name](int node) {
    const bool heard = node >= 0 ? guardian.guard(device, node, zero) : guardian.forget(device);
    if (!heard)
      log::error(name + ": the guardian process has died: if the server is killed, the device keeps its last force");
  };
}

std::unique_ptr<usb::Pipe> open_pipe(const Scene& scene, const Driver& driver, const std::string& port,
                                     Guardian* guardian) {
  usb::PipeConfig pipe{.ids = {driver.ids.begin(), driver.ids.end()},
                       .port = port,
                       .in = driver.in,
                       .out = driver.out,
                       .transfers = driver.transfers};
  pipe.on_start = [device = scene.loop.device] {
    name_thread("usb-" + std::to_string(device));
    enter_realtime(kUsbPriority);  // the haptic thread reports if this is refused
  };
  pipe.tell = [name = scene.name](const std::string& why) { log::warn(name + ": " + why); };
  if (driver.moves_a_hand) pipe.opened = notify_guardian(*guardian, scene, driver);
  return usb::open_pipe(pipe);
}

}  // namespace

std::unique_ptr<Guardian> make_guardian(const std::vector<Scene>& scenes) {
  const auto on_start = [] {
    name_thread("guardian-parent");
    enter_realtime(kHapticPriority);
  };
  const bool any = std::ranges::any_of(scenes, [](const Scene& scene) { return scene.driver().moves_a_hand; });
  return any ? std::make_unique<Guardian>(on_start) : nullptr;
}

std::unique_ptr<Device> make_device(const Scene& scene, Guardian* guardian) {
  return std::visit(
      [&](const auto& config) {
        FromOutside outside{.pipe = nullptr,
                            .open_file = [](const std::filesystem::path& file) { return open_regular_file(file); }};
        if constexpr (requires { config.port; }) {
          outside.pipe = open_pipe(scene, scene.driver(), config.port, guardian);
        }
        return make(config, std::move(outside));
      },
      scene.device);
}

}  // namespace tendon
