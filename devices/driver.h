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

/// Describes one kind of device. Scenes, `tendond devices`, the server and the udev rules use it. Each kind has its own
/// configuration type X and these overloads, which std::visit selects by argument:
///     const Driver& driver(const X&)                        this row
///     SimulatedDevice::Config stand_in(const X&)            simulates it where the cost of a step is measured
///     std::unique_ptr<Device> make(const X&, FromOutside)   the device itself
struct Driver {
  std::string_view kind;      ///< [device] kind in a scene
  std::string_view name;      ///< name of the hardware, for people
  bool exerts_force = true;   ///< false: an input device, whose user does not feel forces
  bool moves_a_hand = false;  ///< a real device with motors: it always requires a limiter and a safety layer
  std::string_view axes{};    ///< "right=x up=y user=z", see core/base/frames.h; empty: unknown
  std::vector<std::string_view> buttons{};  ///< names by bit in PositionSample::buttons; empty: unknown
  std::string_view buttons_in_words{};      ///< "one of a Falcon's, 0 to 3"; empty if the device has no buttons
  Duration watchdog{};                      ///< how long the device holds a force without a command; 0: no watchdog
  std::string_view homing{};                ///< what the operator must do in kUnhomed: "homed: pull the grip …"

  // USB devices, for which X has `std::string port`.
  std::span<const usb::Id> ids{};  ///< empty: not a USB device
  std::uint8_t in = 0x81;          ///< endpoints
  std::uint8_t out = 0x02;
  usb::PipeConfig::Transfers transfers = usb::PipeConfig::Transfers::kBulk;
  std::vector<std::uint8_t> zero_packet{};  ///< ends the force; written by the guardian if the server dies
};

/// Resources that the caller of `make` provides.
struct FromOutside {
  std::unique_ptr<usb::Pipe> pipe;                                       ///< null for a device without USB
  std::function<std::ifstream(const std::filesystem::path&)> open_file;  ///< throws if the file cannot be opened
};

}  // namespace tendon
