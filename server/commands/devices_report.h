// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "devices/usb/usb.h"

namespace tendon {

/// A connected device that is supported by Tendon, and the problems that prevent its use.
struct PluggedDevice {
  struct Lack {
    std::string what;
    std::string mend;
  };
  std::string name;
  std::string kind;  ///< [device] kind in a scene
  usb::PluggedIn plugged;
  std::vector<Lack> lacks;
};

/// `firmware_problem` describes the firmware file for a Falcon: empty if it is valid, not set if there is no file.
std::vector<PluggedDevice> report_devices(std::span<const usb::PluggedIn> plugged,
                                          const std::optional<std::string>& firmware_problem);

std::string in_words(std::span<const PluggedDevice> devices);
std::string in_json(std::span<const PluggedDevice> devices);

}  // namespace tendon
