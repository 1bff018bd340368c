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

/// Describes one kind of device. Used by scenes, `tendond devices`, the server and the udev rules. Each kind has its
/// own configuration X, and these overloads are selected by std::visit:
///
///     const Driver& driver(const X&)                        the description of this kind
///     SimulatedDevice::Config stand_in(const X&)            a simulation, used to measure the cost of a step
///     std::unique_ptr<Device> make(const X&, FromOutside)   the device itself
struct Driver {
  std::string_view kind;                    ///< [device] kind in a scene
  std::string_view name;                    ///< for people
  bool exerts_force = true;                 ///< false for pure input devices
  bool moves_a_hand = false;                ///< requires a limiter and a safety layer
  std::string_view axes{};                  ///< like "right=x up=y user=z" (core/base/frames.h)
  std::vector<std::string_view> buttons{};  ///< names by bit in PositionSample::buttons
  std::string_view buttons_in_words{};      ///< like "one of a Falcon's, 0 to 3"
  Duration watchdog{};                      ///< see DeviceInfo
  std::string_view homing{};                ///< instructions for kUnhomed: "homed: pull the grip …"

  // Only for USB devices, for which X has `std::string port`.
  std::span<const usb::Id> ids{};
  std::uint8_t in = 0x81;
  std::uint8_t out = 0x02;
  usb::PipeConfig::Transfers transfers = usb::PipeConfig::Transfers::kBulk;
  std::vector<std::uint8_t> zero_packet{};  ///< written by the guardian if the server dies
};

struct FromOutside {
  std::unique_ptr<usb::Pipe> pipe;                                       ///< null if not a USB device
  std::function<std::ifstream(const std::filesystem::path&)> open_file;  ///< throws on failure
};

}  // namespace tendon
