// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "devices/woodenhaptics/kinematics.h"

/// What the firmware and the host say to each other: HID reports of 14 bytes without a number, seven int16 each, least
/// byte first. Source: haptikfabrikenapi, firmware/main.cpp. There is no checksum but USB's own.
///
///     to the device   currents a b c (mA), command, attributes 0 1 2
///         command 0   the currents are written. Other commands than 1 are taken for 0
///         command 1   counters a b c become attributes 0 1 2, counters d e f the three fields of the currents; the
///                     currents become 0, the request to calibrate is over
///     to the host     counters a b c d e f, info
///         info        1 from when the calibrate button is pressed until command 1; else 0
///
/// Reports of another length are left out by the firmware.
namespace tendon::woodenhaptics {

inline constexpr std::size_t kReportBytes = 14;
using ReportBytes = std::array<std::uint8_t, kReportBytes>;

/// Command 0.
ReportBytes encode(const Currents& currents) noexcept;

/// Command 1: what the counters of the three motors are from now on. Those of the gimbal become 0.
ReportBytes encode_calibration(const Currents& counters) noexcept;

/// Device to host.
struct Report {
  std::array<std::int16_t, 6> counters{};  ///< those of the motors wrap; those of the gimbal are 0 without one
  bool calibrate = false;                  ///< the button was pressed
};

/// The report in these bytes. Empty for another length, and for an `info` that is neither 0 nor 1. Thread-safe,
/// realtime-safe.
std::optional<Report> parse(std::span<const std::uint8_t> bytes) noexcept;

/// The switch at the tip of some arms: the host library finds it in counter d, beyond 5000. The published firmware
/// never sets it.
inline bool switch_is_closed(const Report& report) noexcept { return report.counters[3] > 5000; }

}  // namespace tendon::woodenhaptics
