// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "devices/usb/usb.h"

namespace tendon {

/// A plugged-in device that Tendon has a driver for, and what keeps it from being used: `tendond devices`.
struct PluggedDevice {
  struct Lack {
    std::string what;
    std::string mend;  ///< what the user can do about it
  };
  std::string name;
  std::string kind;  ///< of a scene: [device] kind
  usb::PluggedIn plugged;
  std::vector<Lack> lacks;
};

/// `firmware_problem`: why the file given as a Falcon's firmware is not one; an empty text when it is; not set when no
/// file was given.
std::vector<PluggedDevice> report_devices(std::span<const usb::PluggedIn> plugged,
                                          const std::optional<std::string>& firmware_problem);

/// The report for people; and one JSON object for each device, a line each.
std::string in_words(std::span<const PluggedDevice> devices);
std::string in_json(std::span<const PluggedDevice> devices);

}  // namespace tendon
