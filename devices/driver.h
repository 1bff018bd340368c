// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "devices/device.h"
#include "devices/usb/usb.h"

namespace tendon {

/// One row for each kind of device, beside its driver. Scenes, `tendond devices`, the server and the udev rules read
/// it. Each kind has a configuration of its own, X, and these overloads, which std::visit finds by argument:
///
///     const Driver& driver(const X&)                        this row
///     SimulatedDevice::Config stand_in(const X&)            simulates it where the cost of a step is measured
///     std::unique_ptr<Device> make(const X&, FromOutside)   the device itself
struct Driver {
  std::string_view kind;      ///< in a scene: [device] kind
  std::string_view name;      ///< of the hardware, for people
  bool exerts_force = true;   ///< false: an input only; nobody feels the forces of engines
  bool moves_a_hand = false;  ///< a real device with motors: it never runs without limiter and safety layer
  std::string_view axes{};    ///< "right=x up=y user=z", see core/base/frames.h; empty: not known
  std::vector<std::string_view> buttons{};  ///< names, by their bit in PositionSample::buttons; empty: not known
  std::string_view buttons_in_words{};      ///< "one of a Falcon's, 0 to 3"; empty when it has none of its own
  Duration watchdog{};                      ///< how long the force is kept without a command; 0: no watchdog
  std::string_view homing{};                ///< what the operator has to do in kUnhomed: "homed: pull the grip …"

  // With a plug. X then has `std::string port`.
  std::span<const usb::Id> ids{};  ///< empty: it has no plug
  std::uint8_t in = 0x81;          ///< endpoints
  std::uint8_t out = 0x02;
  usb::PipeConfig::Transfers transfers = usb::PipeConfig::Transfers::kBulk;
  std::vector<std::uint8_t> zero_packet{};  ///< ends its force; what the guardian writes when the server dies
};

/// What `make` needs from outside.
struct FromOutside {
  std::unique_ptr<usb::Pipe> pipe;                                       ///< null for a device without a plug
  std::function<std::ifstream(const std::filesystem::path&)> open_file;  ///< throws when it cannot
};

}  // namespace tendon
