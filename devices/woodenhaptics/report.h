// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "devices/woodenhaptics/kinematics.h"

/// The messages between firmware and host: HID reports of 14 bytes without a report id, containing seven little-endian
/// int16. Source: haptikfabrikenapi, firmware/main.cpp. The only checksum is that of USB.
///
///     to the device   currents a b c (mA), command, attributes 0 1 2
///         command 0   sets the currents. The firmware treats every command other than 1 as 0
///         command 1   sets counters a b c to attributes 0 1 2, counters d e f to the three fields of the currents,
///                     and the currents to 0; ends the request to calibrate
///     to the host     counters a b c d e f, info
///         info        1 from when the calibrate button is pressed until command 1; otherwise 0
///
/// Reports with a different length are ignored by the firmware.
namespace tendon::woodenhaptics {

inline constexpr std::size_t kReportBytes = 14;
using ReportBytes = std::array<std::uint8_t, kReportBytes>;

ReportBytes encode(const Currents& currents) noexcept;

/// Command 1. The counters of the gimbal are set to 0.
ReportBytes encode_calibration(const Currents& counters) noexcept;

struct Report {
  std::array<std::int16_t, 6> counters{};  ///< a b c of the motors; d e f of the gimbal, or 0
  bool calibrate = false;
};

/// Returns nullopt if the length or `info` is invalid. Thread-safe, realtime-safe.
std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept;

/// The switch at the tip of some arms. The host library compares counter d with 5000, but the firmware never sets it.
inline bool switch_is_closed(const Report& report) noexcept { return report.counters[3] > 5000; }

}  // namespace tendon::woodenhaptics
