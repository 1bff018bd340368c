// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "devices/woodenhaptics/kinematics.h"

/// The messages between the firmware and the host: HID reports of 14 bytes without a report number, seven int16 each,
/// least byte first. Source: haptikfabrikenapi, firmware/main.cpp. The only checksum is that of USB.
///
///     to the device   currents a b c (mA), command, attributes 0 1 2
///         command 0   sets the currents. The firmware treats every command other than 1 as 0
///         command 1   sets counters a b c to attributes 0 1 2, counters d e f to the three fields of the currents,
///                     and the currents to 0; ends the request to calibrate
///     to the host     counters a b c d e f, info
///         info        1 from when the calibrate button is pressed until command 1; else 0
///
/// The firmware ignores reports of another length.
namespace tendon::woodenhaptics {

inline constexpr std::size_t kReportBytes = 14;
using ReportBytes = std::array<std::uint8_t, kReportBytes>;

/// Command 0.
ReportBytes encode(const Currents& currents) noexcept;

/// Command 1: sets the counters of the three motors to `counters`, and those of the gimbal to 0.
ReportBytes encode_calibration(const Currents& counters) noexcept;

/// Device to host.
struct Report {
  std::array<std::int16_t, 6> counters{};  ///< a b c of the motors, which wrap; d e f of the gimbal, 0 without one
  bool calibrate = false;                  ///< the button was pressed
};

/// The report in these bytes. Empty when their length differs, or `info` is neither 0 nor 1. Thread-safe,
/// realtime-safe.
std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept;

/// Whether the switch at the tip is closed; some arms have one. The host library takes counter d above 5000 for a
/// closed switch. The published firmware never sets it.
inline bool switch_is_closed(const Report& report) noexcept { return report.counters[3] > 5000; }

}  // namespace tendon::woodenhaptics
