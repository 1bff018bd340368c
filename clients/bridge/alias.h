// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace tendon::bridge {

/// The name under which the programs of a bridge know a device.
struct Alias {
  std::string name;
  std::size_t index;  ///< index of the device at the BridgeHost
};

/// Reads the options --name: "Phantom0=right", or "Phantom0" for the first device. Adds the devices to `devices`
/// (BridgeConfig). Without options, each device has its own name, and `fallback` is the name of the server's first
/// device if none is given. Names must be unique, and must not be longer than `longest` or
/// contain any of @, :, / and spaces. Throws std::runtime_error with the option and the expected form.
std::vector<Alias> read_aliases(std::span<const std::string> names, std::vector<std::string>& devices,
                                std::size_t longest, const std::string& fallback);

}  // namespace tendon::bridge
