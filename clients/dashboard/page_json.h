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

// The messages for the page, one JSON object per WebSocket message. Units are in the names, as on the wire; an absent
// number is null. README.md of this folder lists the fields.

namespace tendon::dash {

/// The sentence that a tendon-dash without permission to arm shows: what it lacks.
inline constexpr std::string_view kArmingNeeds =
    "This page only looks on. To arm and disarm from here start tendon-dash with --key FILE, a controller's key, and "
    "--arm CHANNEL.";

/// The settings of tendon-dash that the page has to know.
struct Abilities {
  std::string server;       ///< HOST:PORT of tendond
  bool recordings = false;  ///< there is a folder
  bool arms = false;        ///< arming and disarming are allowed
  /// Why a device cannot be armed and disarmed from the page now, in a sentence; empty: it can.
  std::function<std::string(std::uint32_t device)> arming_objection = [](std::uint32_t) {
    return std::string(kArmingNeeds);
  };
};

/// {"type":"server",…}: the contact, the devices and their descriptions. Sent when it changes.
std::string server_json(const Board& board, const Abilities& abilities);

/// {"type":"states",…}: all states received of one device, in columns and in order. Missing ticks were lost on the way,
/// or the page did not keep up.
std::string states_json(std::uint32_t device, std::span<const DeviceState> states);

/// {"type":"ports",…}: both ends of a device's coupling, one row for each time, in order.
std::string ports_json(std::uint32_t device, std::span<const Board::Ports> ports);

/// {"type":"reports",…}: the state of a device's loop and of its engines. Sent once a second.
std::string reports_json(std::uint32_t device, const Board& board);

/// [{"name":…,"size_bytes":…,"modified_unix_s":…}, …]
std::string recordings_json(std::span<const Recordings::Entry> entries);

/// "active", "holding" …: as the page and /metrics name it.
std::string_view name(Mode mode) noexcept;
/// "armed", "fault" …
std::string_view name(Safety safety) noexcept;
std::string_view name(Contact contact) noexcept;
/// "engaged", "clutched" …
std::string_view name(PortPhase phase) noexcept;
std::string_view name(Order order) noexcept;
/// "energy", "max_force" … of bit `bit` of core/base/reason.h; "bit_20" of one that has no name yet.
std::string reason_name(std::size_t bit);

}  // namespace tendon::dash
