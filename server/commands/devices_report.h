// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "devices/usb/usb.h"

namespace tendon {

/// Describes a connected device that is supported by Tendon, and the problems that prevent its use. This is used by
/// `tendond devices`.
struct PluggedDevice {
  struct Lack {
    std::string what;
    std::string mend;  ///< instructions for the user
  };
  std::string name;
  std::string kind;  ///< [device] kind in a scene
  usb::PluggedIn plugged;
  std::vector<Lack> lacks;
};

/// `firmware_problem` describes what is wrong with the given firmware file for a Falcon. It is an empty string if the
/// file is valid. It is not set if there is no file.
std::vector<PluggedDevice> report_devices(std::span<const usb::PluggedIn> plugged,
                                          const std::optional<std::string>& firmware_problem);

/// The report as text, or as one line with a JSON object for each device.
std::string in_words(std::span<const PluggedDevice> devices);
std::string in_json(std::span<const PluggedDevice> devices);

}  // namespace tendon
