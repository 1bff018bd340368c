// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "clients/dashboard/board.h"
#include "clients/dashboard/recordings.h"

// Messages for the page: one JSON object each, units in names, null for unknown numbers. README.md lists the fields.

namespace tendon::dash {

/// Shown by a page that may not arm.
inline constexpr std::string_view kArmingNeeds =
    "This page is read-only. To arm and disarm from here, start tendon-dash with --key FILE (a controller's key) and "
    "--arm CHANNEL.";

struct Abilities {
  std::string server;       ///< HOST:PORT of tendond
  bool recordings = false;  ///< a folder of recordings is set
  bool arms = false;        ///< arming is allowed
  /// Returns why a device cannot be armed from the page now. Empty if it can.
  std::function<std::string(std::uint32_t device)> arming_objection = [](std::uint32_t) {
    return std::string(kArmingNeeds);
  };
};

/// {"type":"server",…}: the connection, the devices and their descriptions. Sent after each change.
std::string server_json(const Board& board, const Abilities& abilities);

/// {"type":"states",…}: states of one device in columns. Ticks are missing after packet loss or if the page is slow.
std::string states_json(std::uint32_t device, std::span<const DeviceState> states);

/// {"type":"ports",…}: both ends of the coupling of a device, one row for each time.
std::string ports_json(std::uint32_t device, std::span<const Board::Ports> ports);

/// {"type":"reports",…}: the loop of a device and its engines. Sent once per second.
std::string reports_json(std::uint32_t device, const Board& board);

/// [{"name":…,"size_bytes":…,"modified_unix_s":…}, …]
std::string recordings_json(std::span<const Recordings::Entry> entries);

std::string name(Mode mode);      ///< names used by the page and /metrics: "active", "holding" …
std::string name(Safety safety);  ///< "armed", "fault" …
std::string name(Contact contact);
std::string name(PortPhase phase);  ///< "engaged", "clutched" …
std::string name(Order order);
std::string reason_name(std::size_t bit);  ///< "energy", "max_force" …; "bit_20" for bits without a name

}  // namespace tendon::dash
